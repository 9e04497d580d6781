"""Answers to hashes: numbers by their bits in one fixed layout, whatever type or machine they come from."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterable
from enum import Enum
from fractions import Fraction
from typing import Any

import numpy as np

_LAYOUTS = {"b": "<u1", "i": "<i8", "u": "<i8", "f": "<f8"}


def digest(value: Any) -> str:
    """Return 16 hexadecimal digits that stand for `value`."""
    found = hashlib.sha256()
    _feed(found, value)
    return found.hexdigest()[:16]


def joined(digests: Iterable[str]) -> str:
    """Return the SHA-256 over digests in their order."""
    return hashlib.sha256("".join(digests).encode()).hexdigest()


def _feed(found: Any, value: Any) -> None:
    match value:
        case Enum():
            _feed(found, value.value)
        case np.ndarray():
            _feed_array(found, value)
        case None | bool() | np.bool_():
            found.update(b"-" if value is None else b"T" if value else b"F")
        case int() | np.integer() | Fraction():
            found.update(
                f"n{int(value.numerator):x}/{int(value.denominator):x};".encode()
            )  # decimal digits are limited
        case float():
            found.update(b"f" + struct.pack("<d", value if value == value else float("nan")))
        case str() | bytes():
            text = value.encode() if isinstance(value, str) else value
            found.update(f"{type(value).__name__}{len(text)}:".encode() + text)
        case dict():
            _feed(found, sorted(value.items()))
        case list() | tuple():
            found.update(f"l{len(value)}:".encode())
            for item in value:
                _feed(found, item)
        case _:
            raise TypeError(f"no digest of {type(value).__name__}")


def _feed_array(found: Any, array: np.ndarray) -> None:
    fixed = np.ascontiguousarray(array, _LAYOUTS[array.dtype.kind])
    if array.dtype.kind == "f":
        fixed = np.where(np.isnan(fixed), np.float64("nan"), fixed)
    found.update(f"a{array.dtype.kind}{array.shape}".encode() + fixed.tobytes())
