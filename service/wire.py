"""Bytes to Python values and back: the only file that knows which JSON library does it.

Decoding: pydantic's own parser (jiter), as fast as orjson and stricter with numbers: integers of any size stay
integers, 1e400 and NaN arrive as infinity and NaN and are refused later with a pointer. Floats come out as `float()`
makes them of the same text (tests hold it against many). Nesting ends at 200 levels. Long arrays of numbers in bodies
without a fault go through simdjson instead (json_arrays.py), with the same result.
Encoding: orjson, straight from numpy arrays: 8 times faster than pydantic's encoder on booleans, 2.5 times on floats.
Long lists are encoded in parts, since orjson lets no other thread run meanwhile.
"""

from __future__ import annotations

from collections.abc import Iterator
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
    if isinstance(answer, BaseModel) and any(map(_is_long, vars(answer).values())):
        return b"".join(_pieces(answer))
    return _dumps(answer)


def _dumps(value: Any) -> bytes:
    return orjson.dumps(value, default=_plain, option=orjson.OPT_SERIALIZE_NUMPY)


def _is_long(value: Any) -> bool:
    return isinstance(value, (np.ndarray, list)) and len(value) > PART


def _pieces(answer: BaseModel) -> Iterator[bytes | memoryview]:
    """Yield the text of an answer, its long lists in parts: as one text it would be copied once more."""
    lead = b"{"
    for name, item in vars(answer).items():
        if item is not None:
            yield lead + orjson.dumps(name) + b":"
            yield from _parts(item) if _is_long(item) else (_dumps(item),)
            lead = b","
    yield b"}"


def _parts(items: Any) -> Iterator[bytes | memoryview]:
    yield b"["
    for start in range(0, len(items), PART):
        if start:
            yield b","
        yield memoryview(_dumps(items[start : start + PART]))[1:-1]
    yield b"]"


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
    return orjson.Fragment(b"".join(_parts(value))) if _is_long(value) else value
