"""Decodes long arrays of numbers from JSON text by simdjson, in pieces, so that no other thread waits long.

A large body is a little structure around a few long arrays of numbers. They are cut out, decoded by themselves
(numbers.py) and put back as ndarrays; the rest goes the way of small bodies. Whatever does not fit (an error in the
text, rows of several lengths that are no rings, an integer too large) is `Unfit`: the other decoder (pieces.py) takes
it, or names what is wrong.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Final

from service.decoding import pieces
from service.decoding.numbers import Decoder, Unfit
from service.decoding.pieces import Body

STEP: Final = 2**22
"""Bytes searched per step: 0.3 ms."""
LEAST: Final = 2**12
"""Least number of bytes without a string for which this decoder is tried."""

_VALUE: Final = re.compile(rb"\s*:\s*(?=\[)")
_MARK: Final = -(10**18)
"""Placeholder of the first array in the rest of the text; the next ones count down."""


def decode(
    body: Body, take: Callable[[int], object] = lambda n: None, poll: Callable[[], object] = lambda: None
) -> Any:
    """Return the value of the JSON text `body`, its long arrays of numbers as ndarrays (int64 or float64).

    take: called with the bytes needed beyond those counted for each byte of the body. poll: called now and then.
    What they raise ends the work.
    """
    rest, arrays, end = [], [], 0
    for start, stop in _sections(body, poll):
        with memoryview(body)[start:stop] as part:
            arrays.append(Decoder(take, poll).array(part))
        rest += [body[end:start], str(_MARK - len(arrays)).encode()]
        end = stop
    if not arrays:
        raise Unfit
    text = b"".join([*rest, body[end:]])
    take(pieces.cost_of(text))
    try:
        document = pieces.decode(text, poll)
    except pieces.NotJson:
        raise Unfit from None
    waiting = {_MARK - i_array: array for i_array, array in enumerate(arrays, 1)}
    document = _put(document, waiting)
    if any(array is not None for array in waiting.values()):  # its mark stood in a string
        raise Unfit
    return document


def _sections(body: Body, poll: Callable[[], object]) -> list[tuple[int, int]]:
    """Return start and stop of each likely member value that is a long array of numbers."""
    sections, n_quotes, most = [], 0, 8 * len(body) // LEAST
    quote = _find(body, b'"', 0, len(body))
    while quote >= 0:  # bound: each turn goes on to the next quote
        n_quotes += 1
        if n_quotes % 1000 == 0:
            poll()
        if n_quotes > most:
            return []  # mostly strings
        start, quote = quote + 1, _find(body, b'"', quote + 1, len(body))
        stop = quote if quote >= 0 else len(body)
        if stop - start >= LEAST:
            value = _VALUE.match(body, start, min(stop, start + LEAST))
            brace = _find(body, b"}", start, stop)
            end = brace if brace >= 0 else body.rfind(b",", start, stop)
            if value is not None and end > value.end():
                sections.append((value.end(), end))
    return sections


def _find(body: Body, byte: bytes, start: int, stop: int) -> int:
    """Return the first position of `byte`, -1 if there is none; in steps, so that no other thread waits long."""
    for at in range(start, stop, STEP):
        place: int = body.find(byte, at, min(at + STEP, stop))
        if place >= 0:
            return place
    return -1


def _put(value: Any, waiting: dict[int, Any]) -> Any:
    """Return `value` with arrays for their placeholders; depth: at most the 200 levels that were decoded."""
    if type(value) is dict:
        for name, item in value.items():
            if type(item) in (dict, list, int):
                value[name] = _put(item, waiting)
    elif type(value) is list:
        if value and type(value[0]) in (dict, list):
            value[:] = [_put(item, waiting) for item in value]
    elif type(value) is int and value in waiting:
        array, waiting[value] = waiting[value], None
        if array is None:  # the mark stood in the body itself
            raise Unfit
        return array
    return value
