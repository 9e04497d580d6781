"""One function per invariant; its error names the element that breaks it, with all digits, and the remedy.

`as_*` functions turn what a caller may pass (arrays of floats or integers, nested lists) into C-contiguous float64
arrays and refuse what is no number: bool, str, object, complex, NaN, infinity, ragged lists, and integers that no
float64 equals. `check_*` functions only raise. `where` is the path of the argument, ``("points",)`` for example; an
error's path goes on to the element: ``("points", 3, 1)``.
"""

from __future__ import annotations

import math
import reprlib
from itertools import chain
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from engine.errors import EmptyGeometryError, EngineError, InvalidArrayError, NotFiniteError, WrongDimensionError
from engine.running.budget import UNLIMITED, Budget, poll, polled
from engine.running.parallel import run_chunks
from engine.solids.geometries import lines_in, note_altitude, positions_in
from engine.types import FloatArray, IntArray, read_only

Where = tuple[str | int, ...]

DIMENSIONS: Final = (2, 3)
_FLOAT_INTEGERS: Final = 2**53  # every integer up to this size is a float64
DOUBLE: Final = np.dtype(np.float64)
_LISTED: Final = 1 << 10
"""Number of list items checked at a time: half a millisecond, in which no other thread runs."""
_BLOCK: Final = 1 << 15
"""Number of array elements checked at a time: the flags of a block stay in the L1 cache."""


_FEW: Final = 24
"""Largest number of items that Python sums faster than numpy."""


def spell(where: Where) -> str:
    """Return the path of an argument as Python writes it: ``points[3][1]``, ``operands[0].faces``."""
    text = ""
    for part in where:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text or "the argument"


def digits(point: npt.ArrayLike) -> str:
    """Return the coordinates of a point as text with all their digits: ``[0.1, 2.0, -3.5]``."""
    return repr(np.asarray(point, np.float64).tolist())


def _kind(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"an array of dtype {value.dtype} and shape {value.shape}"
    return f"{shown(value)} ({type(value).__name__})"


_SHORT = reprlib.Repr()
_SHORT.maxlist = _SHORT.maxtuple = _SHORT.maxdict = 12
_SHORT.maxstring = _SHORT.maxlong = _SHORT.maxother = 80


def shown(value: object, limit: int = 60) -> str:
    """Return a text of at most some `limit` characters of a caller's value, for a message; works for any object, of any
    length or depth."""
    try:
        text = _SHORT.repr(value)
    except Exception:  # an integer beyond Python's own limit of digits, a broken __repr__
        text = f"a {type(value).__name__} that cannot be printed"
    return text if len(text) <= limit else text[: limit - 3] + "..."


def as_number(value: object, where: Where) -> float:
    """Return `value`, a finite float or an integer that a float64 equals, as a float."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (float, int, np.floating, np.integer)):
        raise InvalidArrayError(f"{spell(where)} must be a number (float or int), got {_kind(value)}", where)
    if isinstance(value, (int, np.integer)):
        try:
            number = float(int(value))
        except OverflowError:
            number = math.inf
        if math.isinf(number) or int(number) != int(value):
            raise InvalidArrayError(f"{spell(where)} is {_kind(value)}, which no float64 equals; round it", where)
        return number
    number = float(value)
    if not math.isfinite(number):
        raise NotFiniteError(f"{spell(where)} is {number!r}; only finite numbers have a place", where)
    if number != value:
        raise InvalidArrayError(f"{spell(where)} is {_kind(value)}, which no float64 equals; round it", where)
    return number


def as_floats(values: object, depth: int, where: Where, must_be_finite: bool = True) -> FloatArray:
    """Return `values` as a finite float64 array of `depth` axes, C-contiguous and read-only.

    must_be_finite: False where the caller looks for NaN and infinity later, with `check_finite`. The result is a view
    where nothing had to change, and of one type for the compiler, whatever the caller's array is (writable or not,
    aligned or not, a subclass), so that no kernel is compiled a second time.
    """
    result = _as_floats(values, depth, where, must_be_finite).view()
    result.setflags(write=False)
    return result


def is_ready(values: object, *shape: int) -> bool:
    """Return whether `values` is an aligned C-contiguous float64 array (n, *shape); NaN and infinity are not looked
    for."""
    return (
        type(values) is np.ndarray
        and values.dtype is DOUBLE
        and values.shape[1:] == shape
        and values.flags.c_contiguous
        and values.flags.aligned
    )


def _as_floats(values: object, depth: int, where: Where, must_be_finite: bool) -> FloatArray:
    if isinstance(values, np.ma.MaskedArray):
        raise InvalidArrayError(f"{spell(where)} is a masked array; fill or drop the masked items first", where)
    if isinstance(values, (list, tuple)):
        return _from_lists(values, depth, where)
    array = values if isinstance(values, np.ndarray) else np.asarray(values)
    if array.dtype.kind not in "fiu":
        what = _kind(values)
        raise InvalidArrayError(f"{spell(where)} must be an array of floats or integers, got {what}", where)
    if array.ndim == 1 and array.size == 0:
        array = array.reshape((0,) * depth)  # case: np.array([]) stands for no points
    if array.ndim != depth:
        raise InvalidArrayError(
            f"{spell(where)} must have {depth} axes, got {_kind(array)}; a single item still needs its outer axis",
            where,
        )
    if array.dtype == np.float64 and type(array) is np.ndarray and array.flags.c_contiguous and array.flags.aligned:
        result: FloatArray = array
    elif array.dtype.kind == "f" and array.dtype.itemsize <= 8:
        result = np.require(array, np.float64, ["C", "A", "E"])
    else:
        with np.errstate(over="ignore", under="ignore"):  # wider floats: judged by the check
            result = np.require(array, np.float64, ["C", "A", "E"])
        _check_converted(array, result, where)
    if must_be_finite:
        check_finite(result, where)
    return result


def _check_converted(array: npt.NDArray[Any], result: FloatArray, where: Where) -> None:
    """Raise unless every element of `result` equals the integer or wider float in `array` it was converted from."""
    if array.dtype.kind == "f":
        suspects = np.flatnonzero((result != array) & ~np.isnan(array))
    else:
        suspects = np.flatnonzero(np.abs(result) >= _FLOAT_INTEGERS)
    for index in suspects:
        path = np.unravel_index(index, array.shape)
        as_number(array[path], (*where, *map(int, path)))


def plain_floats(values: Any, depth: int) -> FloatArray | None:
    """Return a list of numbers (depth 1), or of lists of numbers (depth 2), as a float64 array; None if it is anything
    else. Numbers: finite floats, and integers of magnitude up to 2^53."""
    try:
        items = values if depth == 1 else list(chain.from_iterable(values))
        is_plain = depth == 1 or (depth == 2 and set(map(type, values)) <= {list, tuple})
        kinds = set(map(type, items))
        if int in kinds:
            is_plain &= kinds <= {float, int} and min(items) >= -_FLOAT_INTEGERS and max(items) <= _FLOAT_INTEGERS
        if is_plain and items and kinds <= {float, int} and math.isfinite(sum(items)):
            return np.array(values, np.float64)
    except (TypeError, ValueError, NotImplementedError):  # no lists, of different lengths, views of several axes
        pass
    return None


def _plain_parts(values: list[Any] | tuple[Any, ...], depth: int) -> FloatArray | None:
    """Return what `plain_floats` does, converting `_LISTED` items at a time and polling the deadline."""
    if len(values) <= _LISTED:
        return plain_floats(values, depth)
    parts: list[FloatArray] = []
    for first in range(0, len(values), _LISTED):
        poll()
        part = plain_floats(values[first : first + _LISTED], depth)
        if part is None or (parts and part.shape[1:] != parts[0].shape[1:]):
            return None
        parts.append(part)
    return np.concatenate(parts)


def _from_lists(values: list[Any] | tuple[Any, ...], depth: int, where: Where) -> FloatArray:
    """Return lists nested to `depth` levels as an array. Raises InvalidArrayError for unequal lengths at a level, or a
    leaf that is no number."""
    if (plain := _plain_parts(values, depth)) is not None:
        return plain
    shape, items = [len(values)], list(values)
    for level in range(1, depth):
        rows = [item.tolist() if isinstance(item, np.ndarray) else item for item in items]
        n_columns = len(rows[0]) if rows and isinstance(rows[0], (list, tuple)) else 0
        for i_row, row in enumerate(polled(rows)):
            if not isinstance(row, (list, tuple)):
                path = _path(i_row, shape, where)
                raise InvalidArrayError(f"{spell(path)} must be a list, got {_kind(row)}", path)
            if len(row) != n_columns:
                path, last = _path(i_row, shape, where), level == depth - 1
                mixed = last and {len(row), n_columns} <= {2, 3}
                kind = WrongDimensionError if mixed else InvalidArrayError
                raise kind(f"{spell(path)} has {len(row)} items where those before it have {n_columns}", path)
        shape.append(n_columns)
        items = [item for row in polled(rows) for item in row]
    for i_item, item in enumerate(polled(items)):
        is_plain = math.isfinite(item) if type(item) is float else type(item) is int and abs(item) <= _FLOAT_INTEGERS
        if not is_plain:  # to name its place takes a thousand times as long
            items[i_item] = as_number(item, _path(i_item, shape, where))
    starts = range(0, max(1, len(items)), _LISTED)
    result = np.concatenate([np.array(items[first : first + _LISTED], np.float64) for first in starts]).reshape(shape)
    check_finite(result, where)
    return result


def _path(index: int, shape: list[int], where: Where) -> Where:
    return (*where, *map(int, np.unravel_index(index, shape)))


def check_finite(array: FloatArray, where: Where, budget: Budget = UNLIMITED, workers: int | None = 1) -> None:
    """Raise for the first NaN or infinity of an array; many are looked for by several threads."""
    flat = array.reshape(-1)
    if len(flat) <= _FEW and math.isfinite(sum(flat.tolist())):
        return
    are_finite = [bool(np.isfinite(flat).all())] if len(flat) <= _BLOCK else []

    def look(first: int, last: int) -> None:
        poll()
        are_finite.append(bool(np.isfinite(flat[first:last]).all()))

    if not are_finite:
        run_chunks(look, len(flat), budget=budget, workers=workers, first_chunk=_BLOCK)
    if not all(are_finite):
        index = int(np.isfinite(flat).argmin())
        path = _path(index, list(array.shape), where)
        raise NotFiniteError(f"{spell(path)} is {float(flat[index])!r}; only finite numbers have a place", path)


def check_dimension(n_columns: int, dimension: int | None, where: Where, what: str = "positions of") -> None:
    """Raise unless `n_columns`, the number of coordinates of a position, is `dimension` (None: 2 or 3). what: begins
    the noun phrase of the message."""
    allowed = DIMENSIONS if dimension is None else (dimension,)
    if n_columns not in allowed:
        wanted = " or ".join(map(str, allowed))
        raise WrongDimensionError(f"{spell(where)} must hold {what} {wanted} numbers each, got {n_columns}", where)


def check_given_dimension(dimension: object) -> None:
    """Raise unless `dimension`, an argument, is the whole number 2 or 3."""
    if isinstance(dimension, bool) or not isinstance(dimension, (int, np.integer)) or dimension not in DIMENSIONS:
        raise WrongDimensionError(f"dimension must be 2 or 3, got {shown(dimension)}", ("dimension",))


def check_not_empty(count: int, what: str, where: Where) -> None:
    """Raise EmptyGeometryError if `count` is 0. what: the things counted, for the message."""
    if count == 0:
        raise EmptyGeometryError(f"{spell(where)} is empty; at least one {what} is needed", where)


def as_points(
    points: object, dimension: int | None, where: Where = ("points",), must_be_finite: bool = True
) -> FloatArray:
    """Return `points` as a finite C-contiguous float64 array ``(n, dimension)``; may be empty.

    points: array of floats or integers, nested lists or GeoJSON points; a view if float64 and contiguous already.
    dimension: 2 or 3, or None for either (no points: 2). must_be_finite: as in `as_floats`. Raises: InvalidArrayError,
    WrongDimensionError, NotFiniteError.
    """
    listed = None
    if not isinstance(points, np.ndarray):
        try:
            listed = positions_in(points)
        except EngineError as error:
            raise error.at(*where) from None
    array = as_floats(points if listed is None else listed, 2, where, must_be_finite)
    if listed and dimension == 2 and array.shape[1] == 3:
        note_altitude(where[0])
        array = read_only(array[:, :2])
    if array.size == 0 and array.shape[0] == 0 and array.shape[1] in (0, dimension or 0):
        return array.reshape((0, dimension or 2))
    check_dimension(array.shape[1], dimension, where)
    return array


def as_point_groups(
    groups: object, size: int | None, dimension: int | None, where: Where, must_be_finite: bool = True
) -> FloatArray:
    """Return segments, triangles or quads as a finite float64 array ``(n, size, dimension)``; may be empty.

    must_be_finite: as in `as_floats`.
    """
    listed = None
    if size == 2 and not isinstance(groups, np.ndarray):
        try:
            listed = lines_in(groups)
        except EngineError as error:
            raise error.at(*where) from None
        for number, line in enumerate(listed or ()):
            if not isinstance(line, (list, tuple, np.ndarray)) or len(line) != 2:
                raise InvalidArrayError(
                    f"{spell((*where, number))} is no line of 2 positions; clip_lines takes longer ones", where
                )
    array = as_floats(groups if listed is None else listed, 3, where, must_be_finite)
    if listed and dimension == 2 and array.shape[2] == 3:
        note_altitude(where[0])
        array = read_only(array[:, :, :2])
    if array.shape[0] == 0 and array.size == 0 and (array.shape[2] == 0 or dimension in (None, array.shape[2])):
        return np.zeros((0, size or 0, dimension or array.shape[2] or 2), np.float64)
    check_dimension(array.shape[2], dimension, where)
    if size is not None and array.shape[1] != size:
        raise InvalidArrayError(f"{spell(where)} must hold {size} points in each item, got {array.shape[1]}", where)
    return array


def as_vector(vector: object, dimension: int | None, where: Where) -> FloatArray:
    """Return one position or direction as a read-only float64 array ``(dimension,)``; -0.0 becomes 0.0."""
    array = as_floats(vector, 1, where)
    check_dimension(array.shape[0], dimension, where)
    return frozen(array)


def frozen(array: FloatArray) -> FloatArray:
    """Return a read-only C-contiguous copy of an array, with -0.0 replaced by 0.0."""
    if len(array) <= _BLOCK:
        copy = np.add(array, 0.0, dtype=np.float64, order="C")  # -0.0 + 0.0 = +0.0
    else:
        copy = np.empty(array.shape)
        for first in range(0, len(array), _BLOCK):
            poll()
            np.add(array[first : first + _BLOCK], 0.0, out=copy[first : first + _BLOCK])
    copy.setflags(write=False)
    return copy


def as_offsets(offsets: object, n_items: int, where: Where) -> IntArray:
    """Return `offsets` as int64. Raises unless they are whole numbers, ascending, within 0 .. `n_items`."""
    try:
        array = np.asarray(offsets)
    except ValueError:  # ragged
        array = np.array(None)
    if array.ndim != 1 or array.dtype.kind not in "iu" or not len(array):
        what = f"an array of dtype {array.dtype} and shape {array.shape}"
        raise InvalidArrayError(
            f"{spell(where)} must be whole numbers in one row, one more than items; got {what}", where
        )
    result = array.astype(np.int64, copy=False)
    falls = np.flatnonzero(np.diff(result) < 0)
    if len(falls):
        place = (*where, int(falls[0]) + 1)
        raise InvalidArrayError(f"{spell(place)} is {result[falls[0] + 1]}, less than the one before it", place)
    if result[0] < 0 or result[-1] > n_items:
        raise InvalidArrayError(
            f"{spell(where)} go from {result[0]} to {result[-1]}, but there are {n_items} items", where
        )
    return result


def as_nested_offsets(n_items: int, **levels: object) -> list[IntArray]:
    """Return read-only offsets of nested levels, in the order of the arguments. The first offsets divide `n_items`
    items into parts, the next ones divide these parts, and so on; each must go from 0 to the number of what it divides.
    """
    checked = []
    for name, offsets in levels.items():
        checked.append(read_only(as_offsets(offsets, n_items, (name,))))
        if checked[-1][0] != 0 or checked[-1][-1] != n_items:
            raise InvalidArrayError(f"{name} must go from 0 to {n_items}, all items that there are", (name,))
        n_items = len(checked[-1]) - 1
    return checked
