"""Bytes to Python values and back: the only file that knows which JSON library does it.

Decoding: pydantic's own parser (jiter), as fast as orjson and stricter with numbers: integers of any size stay
integers, 1e400 and NaN arrive as infinity and NaN and are refused later with a pointer. Floats come out as `float()`
makes them of the same text (tests hold it against many). Nesting ends at 200 levels. Long arrays of numbers in bodies
without a fault go through simdjson instead (json_arrays.py), with the same result.
Encoding: orjson, straight from numpy arrays: 8 times faster than pydantic's encoder on booleans, 2.5 times on floats.
Long lists are encoded in parts, since orjson lets no other thread run meanwhile.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import orjson
from pydantic import BaseModel
from pydantic_core import from_json

from service import json_arrays
from service.errors import ServiceError

PART: Final = 20_000
"""Items encoded at once: half a millisecond."""


def decode_fast(body: json_arrays.Body) -> Any:
    """Return what `decode` returns, with ndarrays in the place of long arrays of numbers; None if there are none, or
    if anything about the body is not as it should be: then `decode` finds out what."""
    if len(body) < json_arrays.LEAST:
        return None
    try:
        return json_arrays.decode(body)
    except json_arrays.Unfit:
        return None


def decode(body: json_arrays.Body) -> Any:
    """Return the value that the JSON text `body` stands for; `not_json` otherwise."""
    text = body if isinstance(body, (bytes, bytearray)) else bytes(memoryview(body))
    try:
        return from_json(text, cache_strings="keys")
    except ValueError as error:
        raise ServiceError("not_json", f"the body is no JSON that is taken here: {error}") from None


def encode(answer: Any) -> bytes:
    """Return an answer model as JSON; arrays may stand wherever the schema has lists."""
    return orjson.dumps(answer, default=_plain, option=orjson.OPT_SERIALIZE_NUMPY)


def octets(array: Any) -> memoryview:
    """Return an array's numbers, little-endian."""
    little = array.astype(array.dtype.newbyteorder("<"), copy=False)
    return np.ascontiguousarray(little).reshape(-1).view(np.uint8).data


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return {name: _in_parts(item) for name, item in vars(value).items() if item is not None}
    if isinstance(value, np.ndarray):
        return np.ascontiguousarray(value) if value.size else value.tolist()
    raise TypeError(f"{type(value).__name__} has no place in an answer")


def _in_parts(value: Any) -> Any:
    if not isinstance(value, (np.ndarray, list)) or len(value) <= PART:
        return value
    parts = [encode(value[start : start + PART])[1:-1] for start in range(0, len(value), PART)]
    return orjson.Fragment(b"[" + b",".join(parts) + b"]")
