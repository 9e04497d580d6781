"""Bytes to Python values and back: the only file that knows which JSON library does it.

Decoding: jiter, pydantic's own parser, as fast as orjson and stricter: integers of any size stay integers, 1e400 and
NaN arrive as infinity and NaN and are refused later with a pointer, a field that stands twice is refused. Floats come
out as `float()` makes them of the same text (tests hold it against many). Nesting ends at 200 levels. Long texts are
parsed in pieces (decoding/pieces.py). Long arrays of numbers in bodies without a fault go through simdjson instead
(decoding/arrays.py), with the same result.
Encoding: orjson, straight from numpy arrays: 8 times faster than pydantic's encoder on booleans, 2.5 times on floats.
Long lists are made and encoded in parts, since orjson lets no other thread run meanwhile, and sent so: none is ever
whole in memory.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np
import orjson
import zstandard
from pydantic import BaseModel

from service.decoding import arrays, pieces, rings
from service.errors import ServiceError

PART: Final = 20_000
"""Numbers encoded at once: half a millisecond."""
SENT: Final = 2**17
"""Bytes sent at once, about: parts are put together up to that."""
_COSTS: Final = {b"{": 1000, b"[": 100, b",": 32}
"""Bytes that Python holds for an object and the model of it, a list, a number."""
_BOM: Final = b"\xef\xbb\xbf"


class Series(NamedTuple):
    """A list of an answer whose items are made when they are written.

    make: returns the items from one index up to another. n: how many there are. weight: numbers in one, about; where
    they differ, offsets (n + 1,) says how many stand before each.
    """

    n: int
    make: Callable[[int, int], list[Any]]
    weight: int = 1
    offsets: Any = None

    def cuts(self) -> Iterator[tuple[int, int]]:
        """Yield where parts begin and end."""
        start = 0
        while start < self.n:  # bound: each turn takes an item at least
            stop = start + max(1, PART // self.weight)
            if self.offsets is not None:
                most = np.searchsorted(self.offsets, self.offsets[start] + PART, "right") - 1
                stop = min(stop, max(start + 1, int(most)))
            yield start, min(stop, self.n)
            start = stop

    @property
    def is_long(self) -> bool:
        """Whether it is made in parts."""
        n_numbers = self.n * self.weight if self.offsets is None else self.offsets[-1]
        return bool(max(self.n, n_numbers) > PART)


def decode_fast(body: pieces.Body, take: Callable[[int], object] = lambda n: None) -> Any:
    """Return what `decode` returns, with ndarrays in the place of long arrays of numbers; None if there are none, or
    if anything about the body is not as it should be: then `decode` finds out what.

    take: told how many bytes more that holds; what it raises ends the work.
    """
    if len(body) < arrays.LEAST:
        return None
    try:
        return arrays.decode(body, take)
    except rings.Unfit:
        return None


def decode(body: pieces.Body, poll: Callable[[], object] = lambda: None) -> Any:
    """Return the value that the JSON text `body` stands for; `not_json` otherwise.

    poll: called now and then; what it raises ends the work.
    """
    try:
        return pieces.decode(body, poll)
    except pieces.NotJson as error:
        raise ServiceError("not_json", _refusal(body, str(error))) from None


def cost_of(body: pieces.Body) -> int:
    """Return how many bytes decoding holds at most beyond what is counted for each byte: short lists and objects take
    far more than their text."""
    if len(body) < arrays.LEAST:
        return 0
    counts = dict.fromkeys(_COSTS, 0)
    for start in range(0, len(body), arrays.STEP):
        part = body[start : start + arrays.STEP]
        for mark in counts:
            counts[mark] += part.count(mark)
    return max(0, sum(cost * counts[mark] for mark, cost in _COSTS.items()) - 2 * len(body))


def _refusal(body: pieces.Body, found: str) -> str:
    text = bytes(memoryview(body)[: pieces.PIECE])
    if len(text) == len(body) and not text.strip():
        return "the body is empty; send a JSON object, /docs has an example for each call"
    if text.startswith(_BOM):
        return "the body begins with a byte order mark; send it as UTF-8 without one"
    if text[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "the body is UTF-16; send it as UTF-8"
    what = "correct it there"
    if found.startswith(("Detected duplicate key", "a name, text or number")):
        what = "leave one of the two out" if found.startswith("D") else "shorten it"
    return f"the body is no JSON that is taken here: {found:.200}; {what}"


def encode(answer: Any) -> bytes:
    """Return an answer model as JSON; arrays may stand wherever the schema has lists."""
    return b"".join(encoded(answer))


def encoded(answer: Any) -> Iterator[bytes]:
    """Yield the JSON of an answer in parts, one where it is short."""
    if isinstance(answer, BaseModel) and any(map(_is_long, vars(answer).values())):
        yield from _together(_pieces(answer))
    else:
        yield _dumps(answer)


def _dumps(value: Any) -> bytes:
    try:
        return orjson.dumps(value, default=_plain, option=orjson.OPT_SERIALIZE_NUMPY)
    except orjson.JSONEncodeError as error:
        if "64-bit" not in str(error):
            raise
        plain = partial(
            json.dumps, default=lambda item: item.tolist() if isinstance(item, np.ndarray) else _plain(item)
        )
        return str(plain(value)).encode()  # case: integers of any size, which layers pass through


def _is_long(value: Any) -> bool:
    if isinstance(value, Series):
        return value.is_long
    return isinstance(value, (np.ndarray, list)) and len(value) > PART


def _together(pieces: Iterable[bytes | memoryview]) -> Iterator[bytes]:
    """Yield short pieces put together."""
    kept: list[bytes | memoryview] = []
    size = 0
    for piece in pieces:
        kept.append(piece)
        size += len(piece)
        if size >= SENT:
            yield b"".join(kept)
            kept, size = [], 0
    if kept:
        yield b"".join(kept)


def _pieces(answer: BaseModel) -> Iterator[bytes | memoryview]:
    lead = b"{"
    for name, item in vars(answer).items():
        if item is not None:
            yield lead + orjson.dumps(name) + b":"
            yield from _parts(item) if _is_long(item) else (_dumps(item),)
            lead = b","
    yield b"}"


def _parts(items: Any) -> Iterator[bytes | memoryview]:
    cuts: Iterable[tuple[int, int]]
    if isinstance(items, Series):
        cuts, make = items.cuts(), items.make
    else:
        cuts = ((start, start + PART) for start in range(0, len(items), PART))
        make = lambda start, stop: items[start:stop]  # noqa: E731
    lead = b"["
    for start, stop in cuts:
        yield lead
        yield memoryview(_dumps(make(start, stop)))[1:-1]
        lead = b","
    yield b"]"


def octets(array: Any) -> memoryview:
    """Return an array's numbers, little-endian."""
    little = array.astype(array.dtype.newbyteorder("<"), copy=False)
    return np.ascontiguousarray(little).reshape(-1).view(np.uint8).data


def cut(text: memoryview) -> Iterator[memoryview]:
    """Yield a long text in parts, one where it is empty."""
    for start in range(0, max(1, len(text)), SENT):
        yield text[start : start + SENT]


def compressed(parts: Iterable[Any], coding: str) -> Iterator[bytes]:
    """Yield the parts of a text compressed, gzip or zstd, at their fastest."""
    if coding == "gzip":
        deflater: Any = zlib.compressobj(1, wbits=16 + zlib.MAX_WBITS)
    else:
        deflater = zstandard.ZstdCompressor(1).compressobj()
    yield from _together(deflater.compress(part) for part in parts)
    yield deflater.flush()


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return {name: _in_parts(item) for name, item in vars(value).items() if item is not None}
    if isinstance(value, Series):
        return value.make(0, value.n)
    if isinstance(value, np.ndarray):
        return np.ascontiguousarray(value) if value.size else value.tolist()
    raise TypeError(f"{type(value).__name__} has no place in an answer")


def _in_parts(value: Any) -> Any:
    if _is_long(value):
        return orjson.Fragment(b"".join(_parts(value)))
    return _plain(value) if isinstance(value, Series) else value
