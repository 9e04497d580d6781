"""Numeric arrays as one pydantic type: nested JSON lists of one shape in, contiguous ndarray out, with JSON schema.

``Annotated[Array, Numbers(ROWS, DIMENSION)]`` is a field that takes ``[[x, y, z], ...]``. All rows must have the same
length, so a ragged list never passes. Numbers are JSON numbers: ``true``, ``"1.5"`` and ``null`` are refused, as are
those that float64 cannot hold (1e400, NaN, an integer such as 2**53 + 1). A number in JSON becomes exactly what
Python's ``float()`` makes of its text.

The whole list is checked by types and lengths as sets, level by level, at C speed; only a list that failed is walked
again in Python to name the elements at fault.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import chain, islice
from math import isfinite
from typing import Any, Final, NamedTuple, cast

import numpy as np
import numpy.typing as npt
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

Array = npt.NDArray[Any]
Path = tuple[int | str, ...]

MAX_ERRORS: Final = 20
"""Entries of `errors` in one answer: enough to see the pattern."""
EXACT_INTEGERS: Final = 2**53
"""All integers up to this are float64 values; of those beyond only some are."""
STEP: Final = 2**11
"""Items of a list that are looked at at once."""
SHORT: Final = 64
"""Numbers that Python checks sooner than numpy."""
LIMIT: Final = "x-limit"
"""Holds a setting's name in a schema; openapi.py puts `maxItems` with its value in the place."""


class Axis(NamedTuple):
    """Least and largest length along one axis; a name stands for the setting of that name; None for no limit."""

    low: int
    high: int | str | None


DIMENSION: Final = Axis(2, 3)
POINTS: Final = Axis(0, "max_points")
PAIR: Final = Axis(2, 2)

_KINDS: Final[dict[str, tuple[npt.DTypeLike, frozenset[type], dict[str, Any]]]] = {
    "number": (np.float64, frozenset({float, int}), {"type": "number", "format": "double"}),
    "integer": (np.int64, frozenset({int}), {"type": "integer", "format": "int64"}),
    "boolean": (np.bool_, frozenset({bool}), {"type": "boolean"}),
}
_NOT_FINITE: Final = "expected a finite number below 1.8e308 in magnitude, got {!r}; scale the scene, or leave it out"
_WORDS: Final = {"number": "a number", "integer": "an integer", "boolean": "true or false"}


class Fault(NamedTuple):
    """One element that breaks a rule: where it stands within the array, the code, the sentence."""

    path: Path
    code: str
    detail: str


class Numbers:
    """Annotation of a numeric array field: its axes from the outermost in; none for a single number."""

    def __init__(self, *axes: Axis, kind: str = "number", ragged: bool = False, minimum: int | None = None) -> None:
        self.axes = axes
        self.kind = kind
        self.ragged = ragged
        self.minimum = minimum

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.with_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        item: dict[str, Any] = dict(_KINDS[self.kind][2])
        if self.minimum is not None:
            item["minimum"] = self.minimum
        for axis in reversed(self.axes):
            item = {"type": "array", "items": item}
            if axis.low:
                item["minItems"] = axis.low
            if axis.high is not None:
                item[LIMIT if isinstance(axis.high, str) else "maxItems"] = axis.high
        return item

    def _validate(self, value: Any, info: core_schema.ValidationInfo) -> Any:
        call = info.context
        if call is not None:  # a body of many short arrays takes long
            call.remaining()
        array = self._decode(value, call)
        if array is not None:
            return array
        faults = list(islice(self._faults(value, (), {}, call), MAX_ERRORS))
        faults = faults or [Fault((), "invalid_array", self._shape())]
        raise PydanticCustomError("numbers", "{detail}", {"detail": faults[0].detail, "faults": faults})

    def _decode(self, value: Any, call: Any) -> Any:
        """Return `value` as an array, or None if anything about it is wrong; a long list in steps, of which each holds
        up other threads for a millisecond."""
        if type(value) is not list or len(value) <= STEP or not self.axes or isinstance(value[0], np.ndarray):
            return self._decode_few(value, call)
        high = _limit(self.axes[0], call)
        if high is not None and len(value) > high:
            return None
        parts = []
        for start in range(0, len(value), STEP):
            if call is not None:
                call.remaining()
            parts.append(self._decode_few(value[start : start + STEP], call, is_part=True))
            if parts[-1] is None:
                return None
        if all(isinstance(part, np.ndarray) and part.shape[1:] == parts[0].shape[1:] for part in parts):
            return np.concatenate(parts)
        return value if self.ragged else None

    def _decode_few(self, value: Any, call: Any, is_part: bool = False) -> Any:
        """Do so at C speed; is_part: the list is a part of one that is long enough."""
        if not self.axes and type(value) is float and isfinite(value) and self.kind == "number":
            return value
        if isinstance(value, np.ndarray):
            return self._taken(value, self.axes, call)
        if self.ragged and type(value) is list and value and isinstance(value[0], np.ndarray):
            return self._all_taken(value, call)
        dtype, types, _ = _KINDS[self.kind]
        level = [value]
        shape: list[int] = []
        for axis in self.axes:
            # invariant: `level` holds every list of this depth, in order
            if not set(map(type, level)) <= {list}:
                return None
            lengths = set(map(len, level))
            low, high = 0 if is_part and not shape else axis.low, _limit(axis, call)
            if any(length < low or (high is not None and length > high) for length in lengths):
                return None
            is_ragged_axis = self.ragged and len(shape) == 1
            if len(lengths) > 1 and not is_ragged_axis:
                return None
            shape.append(lengths.pop() if len(lengths) == 1 else (-1 if lengths else low))
            level = list(chain.from_iterable(level))
        types_here = set(map(type, level))
        if not types_here <= types:
            return None
        try:
            flat = np.array(level, dtype)
        except OverflowError:
            return None
        if not self._holds_all(flat, level, types_here):
            return None
        if -1 in shape:  # rows of several lengths: the engine takes lists of lists
            return value
        return flat.reshape(shape) if shape else flat.item()

    def _all_taken(self, arrays: list[Array], call: Any) -> list[Array] | None:
        """Return the items of a list of several lengths if this field takes them."""
        low, high = self.axes[0].low, _limit(self.axes[0], call)
        if len(arrays) < low or (high is not None and len(arrays) > high):
            return None
        taken = [self._taken(array, self.axes[1:], call) for array in arrays]
        return taken if all(array is not None for array in taken) else None

    def _taken(self, array: Array, axes: tuple[Axis, ...], call: Any) -> Any:
        """Return `array`, which the fast decoder made of a list without a fault in it, if this field takes it."""
        if array.ndim != len(axes):
            return None
        for axis, length in zip(axes, array.shape):
            high = _limit(axis, call)
            if length < axis.low or (high is not None and length > high):
                return None
        if self.kind == "number":
            if array.dtype.kind == "i" and not -EXACT_INTEGERS <= array.min() <= array.max() <= EXACT_INTEGERS:
                return None
            return array.astype(np.float64, copy=False)
        if self.kind == "integer" and array.dtype.kind == "i":
            return array if self.minimum is None or array.min() >= self.minimum else None
        return None

    def _holds_all(self, flat: Array, level: list[Any], types_here: set[type]) -> bool:
        """Tell whether every number of `level` is finite, large integers unchanged, none below the minimum."""
        if self.kind != "number":
            return self.minimum is None or not level or min(level) >= self.minimum
        if int in types_here:
            large = np.flatnonzero(np.abs(flat) >= EXACT_INTEGERS)
            if not all(int(flat[i]) == level[i] for i in large if type(level[i]) is int):
                return False
        # a finite sum has finite terms; most lists are short, and numpy takes longer to begin than to add
        is_short = len(level) <= SHORT and int not in types_here
        return (is_short and isfinite(sum(level))) or bool(np.isfinite(flat).all())

    def _faults(self, value: Any, path: Path, seen: dict[int, int], call: Any) -> Iterator[Fault]:
        """Walk a list that failed and name each element at fault; `seen`: length of the first list by depth."""
        depth = len(path)
        if depth == len(self.axes):
            yield from self._faults_of_number(value, path)
        elif type(value) is not list:
            yield Fault(path, "invalid_array", f"expected a list, got {_show(value)}; {self._shape()}")
        else:
            if call is not None:
                call.remaining()
            axis, high = self.axes[depth], _limit(self.axes[depth], call)
            if len(value) < axis.low or (high is not None and len(value) > high):
                yield self._fault_of_length(path, axis, high, len(value))
            elif len(value) != seen.setdefault(depth, len(value)) and not (self.ragged and depth == 1):
                detail = f"expected a list of {seen[depth]} as before it, got {len(value)}; {self._shape()}"
                yield Fault(path, "invalid_array", detail)
            else:
                for i_item, item in enumerate(value):
                    yield from self._faults(item, (*path, i_item), seen, call)

    def _fault_of_length(self, path: Path, axis: Axis, high: int | None, length: int) -> Fault:
        if isinstance(axis.high, str) and high is not None and length > high:
            return Fault(path, "limit_exceeded", limit_sentence(axis.high, high, length))
        code = "invalid_array" if length else "empty_geometry"
        return Fault(path, code, f"got a list of {length}; {self._shape()}")

    def _faults_of_number(self, value: Any, path: Path) -> Iterator[Fault]:
        if type(value) not in _KINDS[self.kind][1]:
            yield Fault(path, "invalid_array", f"expected {_WORDS[self.kind]}, got {_show(value)}")
        elif self.kind == "integer":
            if not -(2**63) <= value < 2**63 or (self.minimum is not None and value < self.minimum):
                low = -(2**63) if self.minimum is None else self.minimum
                yield Fault(
                    path, "index_out_of_range", f"expected an integer from {low} to 2**63 - 1, got {_show(value)}"
                )
        elif self.kind == "number" and type(value) is float:
            if value != value or value in (float("inf"), float("-inf")):
                yield Fault(path, "not_finite", _NOT_FINITE.format(value))
        elif self.kind == "number" and not _is_exact(value):
            detail = f"float64 cannot hold {_show(value)}; write the float64 you mean, as 1.5e20"
            yield Fault(path, "invalid_array", detail)

    def _shape(self) -> str:
        counts = [
            f"{axis.low}"
            if axis.low == axis.high
            else f"{axis.low} to {axis.high}"
            if isinstance(axis.high, int)
            else f"{axis.low} or more"
            if axis.low
            else "any number"
            for axis in self.axes
        ]
        noun = _WORDS[self.kind].removeprefix("a ").removeprefix("an ") + "s"
        one_length = "" if self.ragged or len(self.axes) < 2 else ", all rows of one length"
        return f"expected {' lists of '.join(counts)} {noun}{one_length}"


def limit_sentence(name: str, limit: int, length: int) -> str:
    """Return what is said where a list is longer than the setting `name` allows."""
    return f"got {length} items, at most {limit} are taken; send fewer, or raise the setting GEOMETRY_{name.upper()}"


def _limit(axis: Axis, call: Any) -> int | None:
    if isinstance(axis.high, str):
        return None if call is None else cast(int, getattr(call.settings, axis.high))
    return axis.high


def _is_exact(value: int) -> bool:
    try:
        return int(float(value)) == value
    except OverflowError:
        return False


def _show(value: Any) -> str:
    """Return a short JSON-like text of `value`: enough to find it, never the whole body."""
    if isinstance(value, np.generic):  # a number of a long list that was decoded into an array
        value = value.item()
    if isinstance(value, (list, np.ndarray)):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "an object"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, int) and abs(value) >= 10**40:
        return f"an integer of {value.bit_length()} bits"
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."
