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

from engine.running.budget import poll, polled

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
        return _text(value)
    except RecursionError:
        raise NotJsonError(ValueError("it is nested too deeply, or within itself"), (), False) from None
    except (ValueError, TypeError) as error:
        raise NotJsonError(error, *_find_invalid(value)) from None


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


def _text(value: Any) -> bytes:
    """Return a value as JSON: that of two halves if it is large. Recursion is as deep as the value, and the logarithms
    of the lengths in it."""
    is_object = isinstance(value, dict)
    is_list = isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)
    n = len(value) if is_object or is_list else 0
    if n == 0 or _count(value, _FEW) <= _FEW:
        return _encoded(value)
    poll()
    if n == 1:
        name, item = next(iter(value.items() if is_object else enumerate(value)))
        return (_encoded({name: None})[:-5] if is_object else b"[") + _text(item) + (b"}" if is_object else b"]")
    items = list(value.items()) if is_object else value
    first, second = (_text(dict(half) if is_object else half) for half in (items[: n // 2], items[n // 2 :]))
    return first[:-1] + b"," + second[1:]


def _encoded(value: Any) -> bytes:
    try:
        return _encode(value).encode()
    except UnicodeEncodeError:  # half a surrogate pair, which only an escape can write
        return _encode_ascii(value).encode()


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
    """Return the path to the first part of a value that cannot become JSON, and whether that part is a float (infinity
    or NaN)."""
    is_list = isinstance(value, (list, tuple, np.ndarray))
    for name, item in polled(value.items() if isinstance(value, dict) else enumerate(value) if is_list else ()):
        try:
            _text({name: item})
        except (ValueError, TypeError, RecursionError):
            path, is_number = _find_invalid(item)
            return (name if isinstance(name, (str, int)) else str(name), *path), is_number
    return (), isinstance(value, (float, np.floating))
