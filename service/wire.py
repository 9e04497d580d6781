"""Encodes and decodes JSON: the only file that knows the JSON libraries.

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

import zlib
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np
import orjson
import zstandard
from pydantic import BaseModel

from service.decoding import arrays, pieces
from service.decoding.numbers import Unfit
from service.errors import ServiceError

PART: Final = 20_000
"""Numbers encoded per step: half a millisecond."""
SENT: Final = 2**17
"""Approximate bytes per send: parts are joined up to that."""
_REMEDIES: Final = {
    "Detected duplicate key": "leave one of the two out",
    "a name, text or number": "shorten it",
    "the name": "shorten it",
    "an object has": "send fewer",
}
Poll = Callable[[], object]
_BOM: Final = b"\xef\xbb\xbf"


def no_poll() -> None:
    """Do nothing: stands for a poll."""


class Series(NamedTuple):
    """A list of an answer whose items are made when they are written.

    make: returns the items from one index up to another. n: their number. weight: approximate numbers in one; if they
    differ, offsets (n + 1,) has the numbers before each. least: least bytes of all together.
    """

    n: int
    make: Callable[[int, int], Any]
    weight: int = 1
    offsets: Any = None
    least: int = 0

    def cuts(self, start: int = 0, stop: int | None = None) -> Iterator[tuple[int, int]]:
        """Yield start and stop of the parts of the items from one up to another."""
        end = self.n if stop is None else min(stop, self.n)
        while start < end:  # bound: each turn takes an item at least
            stop = start + max(1, PART // self.weight)
            if self.offsets is not None:
                most = np.searchsorted(self.offsets, self.offsets[start] + PART, "right") - 1
                stop = min(stop, max(start + 1, int(most)))
            yield start, min(stop, end)
            start = stop

    @property
    def is_long(self) -> bool:
        """Whether it is made in parts."""
        n_numbers = self.n * self.weight if self.offsets is None else self.offsets[-1] - self.offsets[0]
        return bool(max(self.n, n_numbers) > PART)


class Raw(NamedTuple):
    """A part of an answer that is already JSON."""

    text: bytes


def series_of(array: Any) -> Any:
    """Return rows of numbers for an answer: in parts if they are many."""
    return array if array.size <= PART else Series(len(array), lambda start, stop: array[start:stop], len(array[0]))


def decode_fast(body: pieces.Body, take: Callable[[int], object] = lambda n: None, poll: Poll = no_poll) -> Any:
    """Return the result of `decode` with ndarrays for long arrays of numbers; None if there are none, or on any fault.

    take: called with the additional bytes, fewer again if it returns None; poll: called now and then. What they raise
    ends the work.
    """
    if len(body) < arrays.LEAST:
        return None
    taken = 0

    def take_noted(n_bytes: int) -> None:
        nonlocal taken
        take(n_bytes)
        taken += n_bytes

    try:
        return arrays.decode(body, take_noted, poll)
    except Unfit:
        take(-taken)
        return None


def decode(body: pieces.Body, poll: Callable[[], object] = lambda: None) -> Any:
    """Return the value of the JSON text `body`; `not_json` otherwise.

    poll: called now and then; what it raises ends the work.
    """
    try:
        return pieces.decode(body, poll)
    except pieces.NotJson as error:
        raise ServiceError("not_json", _refusal(body, str(error))) from None


def cost_of(body: pieces.Body) -> int:
    """Return an upper bound on the bytes that `decode` needs beyond those counted for each byte; little is ignored."""
    return 0 if len(body) < arrays.LEAST else pieces.cost_of(body)


def _refusal(body: pieces.Body, message: str) -> str:
    text = bytes(memoryview(body)[: pieces.PIECE])
    if len(text) == len(body) and not text.strip():
        return "the body is empty; send a JSON object, /docs has an example for each call"
    if text.startswith(_BOM):
        return "the body begins with a byte order mark; send it as UTF-8 without one"
    if text[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "the body is UTF-16; send it as UTF-8"
    what = next((what for begun, what in _REMEDIES.items() if message.startswith(begun)), "correct it there")
    return f"the body is no JSON that is taken here: {message:.200}; {what}"


def encode(answer: Any, poll: Poll = no_poll) -> bytes:
    """Return an answer model as JSON; arrays may stand wherever the schema has lists."""
    return b"".join(encoded(answer, poll))


def encoded(answer: Any, poll: Poll = no_poll) -> Iterator[bytes]:
    """Yield the JSON of an answer in parts, one if it is short; poll: called between parts, also those of a long
    item."""
    if isinstance(answer, BaseModel) and any(map(_is_long, vars(answer).values())):
        yield from _together(_pieces(answer, poll))
    elif isinstance(answer, Series):
        yield from _together(_parts(answer, poll))
    else:
        yield _dumps(answer, poll)


def least_of(answer: Any) -> int:
    """Return a lower bound on the bytes of an answer, as far as known before it is made."""
    items = vars(answer).values() if isinstance(answer, BaseModel) else ()
    return sum(item.least for item in items if isinstance(item, Series))


def _dumps(value: Any, poll: Poll = no_poll) -> bytes:
    default = _plain if poll is no_poll else partial(_plain, poll=poll)
    return orjson.dumps(value, default=default, option=orjson.OPT_SERIALIZE_NUMPY)


def _is_long(value: Any) -> bool:
    if isinstance(value, Series):
        return value.is_long
    return isinstance(value, (np.ndarray, list)) and len(value) > PART


def _together(pieces: Iterable[bytes | memoryview]) -> Iterator[bytes]:
    """Yield short pieces joined."""
    waiting: list[bytes | memoryview] = []
    size = 0
    for piece in pieces:
        waiting.append(piece)
        size += len(piece)
        if size >= SENT:
            yield b"".join(waiting)
            waiting, size = [], 0
    if waiting:
        yield b"".join(waiting)


def _pieces(answer: BaseModel, poll: Poll) -> Iterator[bytes | memoryview]:
    lead = b"{"
    for name, item in vars(answer).items():
        if item is not None:
            yield lead + orjson.dumps(name) + b":"
            yield from _parts(item, poll) if _is_long(item) else (_dumps(item, poll),)
            lead = b","
    yield b"}"


def _parts(items: Any, poll: Poll) -> Iterator[bytes | memoryview]:
    cuts: Iterable[tuple[int, int]]
    if isinstance(items, Series):
        cuts, make = items.cuts(), items.make
    else:
        cuts = ((start, start + PART) for start in range(0, len(items), PART))
        make = lambda start, stop: items[start:stop]  # noqa: E731
    lead = b"["
    for start, stop in cuts:
        poll()
        yield lead
        yield memoryview(_dumps(make(start, stop), poll))[1:-1]
        lead = b","
    yield b"]" if lead == b"," else b"[]"


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


def _plain(value: Any, poll: Poll = no_poll) -> Any:
    if isinstance(value, BaseModel):
        return {name: _in_parts(item, poll) for name, item in vars(value).items() if item is not None}
    if isinstance(value, Series):
        return _in_parts(value, poll) if value.is_long else value.make(0, value.n)
    if isinstance(value, Raw):
        return orjson.Fragment(value.text)
    if isinstance(value, np.ndarray):
        return np.ascontiguousarray(value) if value.size else value.tolist()
    raise TypeError(f"{type(value).__name__} has no place in an answer")


def _in_parts(value: Any, poll: Poll) -> Any:
    return orjson.Fragment(b"".join(_parts(value, poll))) if _is_long(value) else value
