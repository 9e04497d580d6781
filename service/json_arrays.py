"""Long arrays of numbers out of JSON text, by simdjson and in pieces, so that no other thread waits long.

A large body is a little structure around a few long arrays of numbers. They are cut out and put back as ndarrays; the
rest goes the way of small bodies. Each array is parsed in pieces of 64 kilobytes: simdjson holds the
interpreter's lock while it parses, and a piece keeps it for less than a millisecond. If ``[A]`` and ``[B]`` are JSON,
so is ``[A,B]``, with their items one after another; hence a cut is right wherever both sides parse.

simdjson's buffer of a nested array is flat and says nothing of the rows. The brackets and commas of the text do: they
are compared with those that the shape of the first rows asks for. Integers that float64 cannot hold would be rounded
there, so pieces with numbers from 2**53 on are looked at one number at a time. Whatever does not fit (an error in the
text, rows of several lengths, an integer too large) is `Unfit`: the other decoder takes it, or names what is wrong.
"""

from __future__ import annotations

import re
from itertools import chain
from math import prod
from typing import Any, Final

import jiter
import numpy as np
import simdjson

from service import json_pieces
from service.json_pieces import Body

PIECE: Final = 2**16
"""Bytes parsed at once: 0.2 ms, and text and result stay in the processor's cache."""
STEP: Final = 2**22
"""Bytes searched at once: 0.3 ms."""
LEAST: Final = 2**12
"""Bytes without a string in them that are worth looking at."""
EXACT_INTEGERS: Final = 2**53

_OPENING: Final = re.compile(rb"(?:\s*\[){1,4}")
_VALUE: Final = re.compile(rb"\s*:\s*(?=\[)")
_CUTS: Final = {depth: re.compile(rb"\]\s*" * (depth - 1) + rb",") for depth in (1, 2, 3, 4)}
_NO_TOKENS: Final = bytes(set(range(256)) - set(b"[],"))
_MARK: Final = -(10**18)
"""Stands for the first array in the rest of the text; the others follow downwards."""


class Unfit(Exception):
    """The text, or an array in it, is none that is taken here."""


def decode(body: Body) -> Any:
    """Return the value of the JSON text `body`, its long arrays of numbers as ndarrays (int64 or float64)."""
    rest, arrays, end = [], [], 0
    for start, stop in _sections(body):
        with memoryview(body)[start:stop] as text:
            arrays.append(_Decoder().array(text))
        rest += [body[end:start], str(_MARK - len(arrays)).encode()]
        end = stop
    if not arrays:
        raise Unfit
    try:
        document = json_pieces.decode(b"".join([*rest, body[end:]]))
    except json_pieces.NotJson:
        raise Unfit from None
    waiting = {_MARK - i_array: array for i_array, array in enumerate(arrays, 1)}
    document = _put(document, waiting)
    if any(array is not None for array in waiting.values()):  # its mark stood in a string
        raise Unfit
    return document


def _sections(body: Body) -> list[tuple[int, int]]:
    """Return start and stop of what is likely to be the value of a member and a long array of numbers."""
    found, n_quotes, most = [], 0, 8 * len(body) // LEAST
    quote = _find(body, b'"', 0, len(body))
    while quote >= 0:  # bound: each turn goes on to the next quote
        n_quotes += 1
        if n_quotes > most:
            return []  # mostly strings
        start, quote = quote + 1, _find(body, b'"', quote + 1, len(body))
        stop = quote if quote >= 0 else len(body)
        if stop - start >= LEAST:
            value = _VALUE.match(body, start, min(stop, start + LEAST))
            brace = _find(body, b"}", start, stop)
            end = brace if brace >= 0 else body.rfind(b",", start, stop)
            if value is not None and end > value.end():
                found.append((value.end(), end))
    return found


def _find(body: Body, byte: bytes, start: int, stop: int) -> int:
    """Return where `byte` first stands, -1 if nowhere; in steps, so that no other thread waits long."""
    for at in range(start, stop, STEP):
        found: int = body.find(byte, at, min(at + STEP, stop))
        if found >= 0:
            return found
    return -1


def _put(value: Any, waiting: dict[int, Any]) -> Any:
    """Return `value` with arrays in the place of their marks; depth: at most the 200 levels that were decoded."""
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


class _Decoder:
    """Turns the text of one array into an ndarray, or a list of them."""

    def __init__(self) -> None:
        self._parser = simdjson.Parser()
        self._numbers: Any = np.empty(0, np.int64)
        self._n_numbers = 0
        self._ends: list[tuple[int, int]] = []  # of each piece: where its text ends, and how many numbers there were

    def array(self, text: memoryview) -> Any:
        """Return the array that `text` stands for."""
        found = _OPENING.match(text)
        inner = bytes(text[-64:]).rstrip()
        if found is None or not inner.endswith(b"]"):
            raise Unfit
        depth = found[0].count(b"[")
        cut = _CUTS[depth]
        stop = len(text) - len(bytes(text[-64:])) + len(inner) - 1
        shape: tuple[int, ...] = ()
        start = 1
        while start < stop:
            at = cut.search(text, start + PIECE, stop)
            end = at.end() - 1 if at is not None else stop
            if at is None and start == 1 and depth > 2 and stop > PIECE:
                return self.array(text[1:stop])[None]  # one long item
            length, *rest = self._piece(b"".join((b"[", text[start:end], b"]")), depth, (stop - start) / (end - start))
            if shape and [*shape[1:]] != rest:
                raise Unfit
            shape = (shape[0] + length if shape else length, *rest)
            self._ends.append((end, self._n_numbers))
            start = end + 1
        if not shape or self._n_numbers != prod(shape):  # case: brackets and commas of [] are those of [1]
            raise Unfit
        numbers = self._numbers[: self._n_numbers]
        if numbers.dtype.kind == "f" and not _is_exact(numbers):
            self._check_integers(text, numbers, depth)
        return numbers.reshape(shape)

    def _piece(self, text: bytes, depth: int, n_pieces: float) -> list[int]:
        """Put the numbers of a piece after those found, and return their shape; n_pieces: how many are left, roughly.

        Nothing here lets other threads run, or calls for it: to get the interpreter back takes as long as a piece.
        """
        try:
            array: Any = self._parser.parse(text)
            shape, item = [len(array)], array
            for _ in range(depth - 1):
                item = item[0]
                shape.append(len(item))
            del item
            self._append(array, n_pieces)
            del array  # the parser is used again
        except (ValueError, TypeError, IndexError, RuntimeError):
            raise Unfit from None
        if text.translate(None, _NO_TOKENS) != _tokens(shape):
            raise Unfit
        return shape

    def _append(self, array: Any, n_pieces: float) -> None:
        """Put the numbers of `array` after those found: pieces of memory kept to the end would hold up all threads."""
        kind = self._numbers.dtype.kind
        try:
            piece = memoryview(array.as_buffer(of_type="d" if kind == "f" else "i")).cast("B")
        except TypeError:
            if kind == "f":
                raise
            kind, piece = "f", memoryview(array.as_buffer(of_type="d")).cast("B")  # there are fractions among them
        n = len(piece) // 8
        end = self._n_numbers + n
        if end > len(self._numbers) or kind != self._numbers.dtype.kind:
            before = self._numbers[: self._n_numbers]
            if kind != before.dtype.kind and not _is_exact(before):
                raise Unfit
            self._numbers = np.empty(self._n_numbers + int(1.05 * n_pieces * n) + 8, f"{kind}8")
            self._numbers[: len(before)] = before
        memoryview(self._numbers).cast("B")[8 * self._n_numbers : 8 * end] = piece
        self._n_numbers = end

    def _check_integers(self, text: memoryview, numbers: Any, depth: int) -> None:
        """Raise unless integers in `text` are the `numbers` that stand for them, in the pieces that have large ones."""
        start, n_before = 1, 0
        for end, n_numbers in self._ends:
            here = numbers[n_before:n_numbers]
            if not _is_exact(here):
                level = jiter.from_json(b"".join((b"[", text[start:end], b"]")))
                for _ in range(depth - 1):
                    level = list(chain.from_iterable(level))
                if any(type(value) is int and int(held) != value for value, held in zip(level, here.tolist())):
                    raise Unfit
            start, n_before = end + 1, n_numbers


def _tokens(shape: list[int]) -> bytes:
    """Return the brackets and commas of an array of this shape.

    >>> _tokens([2, 3])
    b'[[,,],[,,]]'
    """
    item = b""
    for length in reversed(shape):
        item = b"[" + ((item + b",") * length)[:-1] + b"]"
    return item


def _is_exact(numbers: Any) -> bool:
    """Tell whether all are small enough to be exact as int64 and as float64."""
    return not numbers.size or bool(max(numbers.max(), -numbers.min()) < EXACT_INTEGERS)
