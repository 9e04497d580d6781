"""JSON values that layers copy unchanged: their text, written in short steps, and keys to compare them by.

`json` does not release the interpreter's lock while it writes: a third of a second for 20 MB. Here it writes at most
`_FEW` values in one call, and the deadline is polled in between.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from engine.running.budget import poll

_FEW: Final = 256
"""Number of values written in one call: some 30 us."""
_LETTERS: Final = 1000
"""Number of characters of text that take as long as one value."""
_SCALARS: Final = frozenset({str, int, float, bool, type(None)})
Path = tuple[str | int, ...]


class NotJsonError(ValueError):
    """A value cannot be written as JSON. path: where in the value. is_number: whether the cause is infinity or NaN."""

    def __init__(self, error: Exception, path: Path, is_number: bool) -> None:
        super().__init__(str(error))
        self.path = path
        self.is_number = is_number


def text_of(value: Any) -> bytes:
    """Return a value as JSON, numbers exactly; arrays become lists. Raises: NotJsonError, DeadlineExceededError,
    CancelledError."""
    try:
        if isinstance(value, str) or _count(value, _FEW) <= _FEW:
            return _encoded(value)
        writer = _Writer()
        writer.write(value)
        return bytes(writer.text)
    except RecursionError:
        raise NotJsonError(ValueError("it is nested too deeply, or within itself"), (), False) from None


def key_of(value: Any) -> bytes:
    """Return bytes that are equal exactly for equal JSON values, to compare or hash: numbers by value (1 equals 1.0,
    not true), objects whatever the order of their names. For a list or an object it is a SHA-256, so that keys are
    short. Raises: TypeError where JSON has no such value, DeadlineExceededError, CancelledError."""
    if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and not value.ndim):
        value = value.tolist()
    if value is None or isinstance(value, bool):
        return {None: b"null", True: b"true", False: b"false"}[value]
    if isinstance(value, str):
        return b'"' + value.encode("utf-8", "surrogatepass")
    if isinstance(value, (int, float)):
        return (str(int(value)) if value % 1 == 0 else repr(value)).encode()
    poll()
    digest = hashlib.sha256()

    def add(keys: Iterable[bytes]) -> None:
        for key in keys:
            digest.update(b"%d:%b" % (len(key), key))

    if isinstance(value, (list, tuple, np.ndarray)):
        for start in range(0, len(value), _FEW):
            poll()
            some = value[start : start + _FEW]
            add(map(key_of, some.tolist() if isinstance(some, np.ndarray) and some.ndim == 1 else some))
        return b"[" + digest.digest()
    if not isinstance(value, dict):
        raise TypeError(f"it is of type {type(value).__name__}")
    if not all(isinstance(name, str) for name in value):
        raise TypeError("not all names in it are text")
    for name in sorted(value):
        add((key_of(name), key_of(value[name])))
    return b"{" + digest.digest()


class _Writer:
    """Writes a large value as JSON in `text`, polling the deadline."""

    def __init__(self) -> None:
        self.text = bytearray()
        self._path: list[str | int] = []

    def write(self, value: Any) -> None:
        """Append a list, an array or an object of more than `_FEW` values to the text. Recursion is as deep as the
        value."""
        names = list(value) if isinstance(value, dict) else None
        items = list(value.values()) if isinstance(value, dict) else value
        self.text += b"[" if names is None else b"{"
        start, weight = 0, 0
        if isinstance(items, np.ndarray) and items.ndim == 1:
            for start in range(0, len(items), _FEW):
                self._write_few(names, items, start, start + _FEW)
            items = ()
        for place, item in enumerate(items):
            size = _count(item, _FEW)
            if weight + size > _FEW:
                self._write_few(names, items, start, place)
                start, weight = place, 0
            weight += size
            if size > _FEW and not isinstance(item, str):
                name = place if names is None else names[place]
                self.text += b"" if names is None else _encoded({name: None})[1:-5]
                self._path.append(name)
                self.write(item)
                self._path.pop()
                self.text += b","
                start, weight = place + 1, 0
        if len(items):
            self._write_few(names, items, start, len(items))
        if self.text[-1:] == b",":
            del self.text[-1]
        self.text += b"]" if names is None else b"}"

    def _write_few(self, names: list[Any] | None, items: Any, start: int, stop: int) -> None:
        """Append items[start:stop] and a comma to the text; names: of the items, for an object, None for a list."""
        poll()
        if start == stop:
            return
        some = items[start:stop]
        try:
            self.text += _encoded(some if names is None else dict(zip(names[start:stop], some)))[1:-1] + b","
        except NotJsonError as error:
            first, *rest = error.path
            error.path = (*self._path, start + int(first) if names is None else first, *rest)
            raise


def _encoded(value: Any) -> bytes:
    """Return the JSON of a small value; raise NotJsonError with the path to what cannot be written."""
    try:
        try:
            return _encode(value).encode()
        except UnicodeEncodeError:  # half a surrogate pair, which only an escape can write
            return _encode_ascii(value).encode()
    except (ValueError, TypeError, RecursionError) as error:
        path, is_number = _find_invalid(value)
        raise NotJsonError(error, path, is_number) from None


def _as_list(value: Any) -> Any:
    """Return a numpy array or number as a list or Python number: what the encoder calls for other types; raise
    TypeError."""
    if not isinstance(value, (np.ndarray, np.generic)):
        raise TypeError(f"it is of type {type(value).__name__}")
    return value.tolist()


_encode = json.JSONEncoder(allow_nan=False, ensure_ascii=False, separators=(",", ":"), default=_as_list).encode
_encode_ascii = json.JSONEncoder(allow_nan=False, separators=(",", ":"), default=_as_list).encode


def _count(value: Any, most: int) -> int:
    """Return the number of values in `value`, itself included, 1,000 characters of text counting as one more; some
    number above `most` if there are more. Recursion is `most` levels deep at most."""
    if isinstance(value, str):
        return 1 + len(value) // _LETTERS
    if type(value) in _SCALARS or not isinstance(value, (dict, list, tuple, np.ndarray)):
        return 1
    if isinstance(value, np.ndarray):
        return 1 + value.size if value.ndim else 1
    items: Iterable[Any] = value.values() if isinstance(value, dict) else value
    n = 1 + len(value)
    if n > most:
        return n
    kinds = set(map(type, items))
    if kinds <= _SCALARS:
        n += sum([len(item) for item in items if type(item) is str]) // _LETTERS if str in kinds else 0
    else:
        for item in items:
            n += _count(item, most - n + 1) - 1
            if n > most:
                break
    return n


def _find_invalid(value: Any) -> tuple[Path, bool]:
    """Return the path to the first part of a small value that cannot become JSON, and whether that part is a float
    (infinity or NaN)."""
    items: Iterable[tuple[Any, Any]] = ()
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, (list, tuple, np.ndarray)):
        items = enumerate(value)
    for name, item in items:
        try:
            _encode({name: item})
        except (ValueError, TypeError, RecursionError):
            path, is_number = _find_invalid(item)
            return (name if isinstance(name, (str, int)) else str(name), *path), is_number
    return (), isinstance(value, (float, np.floating))
