"""Decodes one long array of numbers from its text, in pieces of 64 kilobytes.

simdjson holds the interpreter's lock while it parses, and a piece keeps it for less than a millisecond. If ``[A]`` and
``[B]`` are JSON, so is ``[A,B]``, with their items one after another; hence a cut is right wherever both sides parse.

simdjson's buffer of a nested array is flat and says nothing of the rows. The brackets and commas of the text do: they
are compared with those that the shape of the first rows asks for. Integers that float64 cannot hold would be rounded
there, so pieces with numbers from 2**53 on are looked at one number at a time. Rings of several lengths become an array
each: the brackets and commas alone give their lengths.

A point of two numbers is ``[,]`` there. With a dot for each, rings read ``[[.,.,.],[.,.,.,.]]``, and polygons are lists
of such. Nothing is looked at point by point: two rings of one length have one text.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import chain
from math import prod
from typing import Any, Final

import jiter
import numpy as np
import simdjson

COST: Final = 300
"""Bytes of a ring's array besides its numbers."""


class Unfit(Exception):
    """The text, or an array in it, is not one that this decoder handles."""


def lengths_of(tokens: bytes, depth: int) -> tuple[int, list[list[int]]]:
    """Return the dimension of the points, and the lengths of the rings by polygon.

    tokens: brackets and commas of a list of rings (depth 3: one polygon) or of polygons (depth 4).
    Raises: Unfit for anything else.

    >>> lengths_of(b"[[[,],[,]],[[,],[,],[,]]]", 3)
    (2, [[2, 3]])
    >>> lengths_of(b"[[[[,,]],[[,,]]],[[[,,],[,,]]]]", 4)
    (3, [[1, 1], [2]])
    """
    dimension = tokens.find(b"]") - depth + 1
    if dimension not in (2, 3):
        raise Unfit
    dotted = tokens.replace(b"[%b]" % (b"," * (dimension - 1)), b".")
    level = depth - 1
    if not dotted.startswith(b"[" * level + b".") or not dotted.endswith(b"." + b"]" * level):
        raise Unfit
    polygons = dotted[level:-level].split(b"]],[[") if depth == 4 else [dotted[level:-level]]
    rings = [polygon.split(b"],[") for polygon in polygons]
    if not all(ring == b",".join([b"."] * len(ring[::2])) for ring in set().union(*rings)):
        raise Unfit
    return dimension, [[len(ring[::2]) for ring in polygon] for polygon in rings]


def cut(rows: Any, groups: list[list[int]], depth: int) -> list[Any]:
    """Return the rings, views of `rows`; at depth 4 a list of them for each polygon."""
    polygons, start = [], 0
    for lengths in groups:
        rings = []
        for length in lengths:
            rings.append(rows[start : start + length])
            start += length
        polygons.append(rings)
    return polygons if depth == 4 else [ring for rings in polygons for ring in rings]


PIECE: Final = 2**16
"""Bytes per piece: 0.2 ms, and text and result stay in the processor's cache."""
LONGEST: Final = 2**22
"""Bytes of the longest piece: 10 ms."""
_SEARCHED: Final = 2**19
"""Bytes searched per step: two milliseconds."""
EXACT_INTEGERS: Final = 2**53

_DEEPEST: Final = 4
_OPENING: Final = re.compile(rb"(?:\s{0,64}\[){1,%d}" % (_DEEPEST + 1))
_CUTS: Final = {depth: re.compile(rb"\]\s*" * (depth - 1) + rb",") for depth in range(1, _DEEPEST + 1)}
_NO_TOKENS: Final = bytes(set(range(256)) - set(b"[],"))


class Decoder:
    """Decodes the text of one array into an ndarray, or lists of them."""

    def __init__(self, take: Callable[[int], object], poll: Callable[[], object]) -> None:
        self._take, self._poll = take, poll
        self._parser = simdjson.Parser()
        self._numbers: Any = np.empty(0, np.int64)
        self._n_numbers = 0
        self._ends: list[tuple[int, int]] = []  # of each piece: where its text ends, and how many numbers there were

    def array(self, text: memoryview) -> Any:
        """Return the array of `text`; rings of several lengths as a list of arrays, or a list of such."""
        brackets = _OPENING.match(text)
        inner = bytes(text[-64:]).rstrip()
        if brackets is None or not inner.endswith(b"]"):
            raise Unfit
        depth = brackets[0].count(b"[")
        if depth > _DEEPEST:
            raise Unfit
        stop = len(text) - len(bytes(text[-64:])) + len(inner) - 1
        if depth > 2 and stop > PIECE and _cut(text, depth, 1 + PIECE, stop) == stop:
            with suppress(Unfit):  # one long item
                item = self.array(text[1:stop])
                return [item] if isinstance(item, list) else item[None]
        try:
            return Decoder(self._take, self._poll)._uniform(text, depth, stop)
        except Unfit:
            if depth < 3:
                raise
            return Decoder(self._take, self._poll)._rings(text, depth, stop)

    def _uniform(self, text: memoryview, depth: int, stop: int) -> Any:
        shape: tuple[int, ...] = ()
        for start, end in _pieces(text, depth, stop):
            self._poll()
            length, *rest = self._piece(b"".join((b"[", text[start:end], b"]")), depth, (stop - start) / (end - start))
            if shape and [*shape[1:]] != rest:
                raise Unfit
            shape = (shape[0] + length if shape else length, *rest)
            self._ends.append((end, self._n_numbers))
        if (
            0 in shape or not shape or self._n_numbers != prod(shape)
        ):  # case: brackets and commas of [] are those of [1]
            raise Unfit
        return self._checked(text, depth).reshape(shape)

    def _rings(self, text: memoryview, depth: int, stop: int) -> Any:
        dimensions, groups = set(), []
        for start, end in _pieces(text, depth, stop):
            self._poll()
            piece, n_before = b"".join((b"[", text[start:end], b"]")), self._n_numbers
            dimension, lengths = lengths_of(piece.translate(None, _NO_TOKENS), depth)
            try:
                array: Any = self._parser.parse(piece)
                self._append(array, (stop - start) / (end - start))
                del array  # the parser is used again
            except (ValueError, TypeError, RuntimeError):
                raise Unfit from None
            if self._n_numbers - n_before != dimension * sum(map(sum, lengths)):
                raise Unfit
            dimensions.add(dimension)
            groups += lengths
            self._ends.append((end, self._n_numbers))
        if len(dimensions) != 1 or 0 in dimensions:
            raise Unfit
        rows = self._checked(text, depth).reshape(-1, dimensions.pop())
        self._take(COST * sum(map(len, groups)))
        return cut(rows, groups, depth)

    def _checked(self, text: memoryview, depth: int) -> Any:
        """Return the decoded numbers, unless an integer differs from its text."""
        numbers = self._numbers[: self._n_numbers]
        if numbers.dtype.kind == "f" and not _is_exact(numbers):
            self._check_integers(text, numbers, depth)
        return numbers

    def _piece(self, text: bytes, depth: int, n_pieces: float) -> list[int]:
        """Append the numbers of a piece, and return their shape; n_pieces: estimated number of remaining pieces.

        No other thread runs meanwhile, and nothing here requests it: getting the interpreter back takes as long as a
        piece.
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
        """Append the numbers of `array`; pieces stored separately to the end would block all threads when freed."""
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
        """Raise unless the integers in `text` equal the decoded `numbers`, for pieces with large ones."""
        start, n_before = 1, 0
        for end, n_numbers in self._ends:
            here = numbers[n_before:n_numbers]
            if not _is_exact(here):
                level = jiter.from_json(b"".join((b"[", text[start:end], b"]")))
                for _ in range(depth - 1):
                    level = list(chain.from_iterable(level))
                if any(type(value) is int and int(number) != value for value, number in zip(level, here.tolist())):
                    raise Unfit
            start, n_before = end + 1, n_numbers


def _pieces(text: memoryview, depth: int, stop: int) -> Iterator[tuple[int, int]]:
    """Yield start and stop of the pieces of an array's text, each some whole items of the outermost list."""
    start = 1
    while start < stop:  # bound: each turn takes an item at least
        end = _cut(text, depth, start + PIECE, stop)
        if end - start > LONGEST:
            raise Unfit
        yield start, end
        start = end + 1


def _cut(text: memoryview, depth: int, start: int, stop: int) -> int:
    """Return the end of the next item of the outermost list, `stop` if there is none; in steps.

    An item followed by so many blanks that a step ends within them may be missed.
    """
    for at in range(start, stop, _SEARCHED):
        comma = _CUTS[depth].search(text, at, min(at + _SEARCHED + PIECE, stop))
        if comma is not None:
            return comma.end() - 1
    return stop


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
    """Return whether all are small enough to be exact as int64 and as float64."""
    return not numbers.size or bool(max(numbers.max(), -numbers.min()) < EXACT_INTEGERS)
