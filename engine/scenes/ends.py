"""Pieces of segments within the bodies of a scene, in the exact order of their ends along each segment.

Parameters are rounded to the nearest doubles, which keeps their order; where two ends of a segment round alike, exact
arithmetic finds which comes first, or that they are one (parameters.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cmp_to_key
from typing import Any, NamedTuple

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.direct import entry_of
from engine.jit import bare_kernel, inline
from engine.segment_clipping.parameters import ONE, ZERO, Parameter, compare


@dataclass(frozen=True, slots=True, eq=False)
class ScenePieces:
    """The pieces of segments within bodies, by source, then by where they start, then by body.

    source, body: (m,) int64, the segment each piece is a part of, and the body it lies in.
    start, end: (m, dim) float64, each coordinate the double nearest to the exact one.
    t: (m, 2) float64, the parameters of both ends, each the nearest double; equal for a single point.
    faces: (m, 2) int64, the plane or face crossed at either end, -1 where the end is the segment's own.
    ranks: (m, 2) int64, of all ends of the pieces of a segment, in exact order, which each is: equal ranks are one
        point, so that two pieces overlap, touch or leave a gap exactly as their ranks do.
    """

    source: IntArray
    body: IntArray
    start: FloatArray
    end: FloatArray
    t: FloatArray
    faces: IntArray
    ranks: IntArray

    def __len__(self) -> int:
        return len(self.source)


class Found(NamedTuple):
    """Pieces, those of one segment in one body in order: source, body (m,), ends (2, m, dim), t and faces (m, 2)."""

    source: Any
    body: Any
    ends: Any
    t: Any
    faces: Any


_BY_PARAMETER: Any = cmp_to_key(lambda a, b: compare(a[0], b[0]))
Exact = Callable[[int, int, int], tuple[Parameter, Parameter]]
"""Tells the exact parameters of a piece: its source, its body, and which of their pieces it is."""


def joined(parts: list[Found], dimension: int) -> Found:
    """Return all pieces, in no order."""
    if len(parts) == 1:
        return parts[0]
    none = np.empty(0, np.int64)
    nothing = Found(none, none, np.empty((2, 0, dimension)), np.empty((0, 2)), np.empty((0, 2), np.int64))
    if not parts:
        return nothing
    each = list(zip(nothing, *parts))
    return Found(*(np.concatenate(each[k], axis=int(k == 2)) for k in range(5)))


def taken(found: Found, rows: Any) -> Found:
    """Return some pieces."""
    return Found(found.source[rows], found.body[rows], found.ends[:, rows], found.t[rows], found.faces[rows])


def in_order(found: Found, n_sources: int, exact: Exact) -> ScenePieces:
    """Return pieces, those of one source and body in order, in the exact order of their starts."""
    m = len(found.source)
    numbers, ends = np.empty((2, m), np.int64), np.empty((2, m, found.ends.shape[2]))
    out = *numbers, *ends, np.empty((m, 2)), *np.empty((2, m, 2), np.int64)
    order, ranks, offsets = np.empty(4 * m, np.int64), np.empty((m, 2), np.int64), np.zeros(n_sources + 2, np.int64)
    given = found.source, found.body, found.ends[0], found.ends[1], found.t, found.faces
    if entry_of(put_in_order)(tuple(map(np.ascontiguousarray, given)), offsets, order, ranks, out):
        return ScenePieces(*out)
    found = taken(found, np.lexsort((found.body, found.source)))
    number, is_new = np.arange(m), np.append(True, found.source[1:] != found.source[:-1])
    is_new[1:] |= found.body[1:] != found.body[:-1]
    number -= np.maximum.accumulate(np.where(is_new, number, 0))  # of a piece among those of its source and body
    source = np.concatenate([found.source, found.source])
    order = np.lexsort((found.t.T.ravel(), source))  # all starts, then all ends
    of_ends = np.empty(2 * m, np.int64)
    of_ends[order] = _ranks(found, number, order, source[order], exact)
    by_start = np.lexsort((found.body, of_ends[:m], found.source))
    found, ranks = taken(found, by_start), of_ends.reshape(2, m).T[by_start]
    return ScenePieces(found.source, found.body, found.ends[0], found.ends[1], found.t, found.faces, ranks)


@bare_kernel
def put_in_order(given: Any, offsets: Any, order: Any, ranks: Any, out: Any) -> bool:
    """Fill `out`, the arrays of `ScenePieces`, with pieces given by those before the last; tell whether their order is
    exact: of ends that round alike only the segment's own are known to be one.

    Room to work in: offsets (n + 2,) zeros, for n sources; order (4 m,), ranks (m, 2).
    """
    source, body, start, end, t, faces = given
    for piece in range(source.size):
        offsets[source[piece] + 2] += 1
    for item in range(2, offsets.size):
        offsets[item] += offsets[item - 1]
    for piece in range(source.size):
        place = offsets[source[piece] + 1]
        offsets[source[piece] + 1] += 1
        order[2 * place], order[2 * place + 1] = 2 * piece, 2 * piece + 1
    for item in range(offsets.size - 2):
        first, last = 2 * offsets[item], 2 * offsets[item + 1]
        _sort_ends(order, first, last, body, t)
        rank, n_starts = -1, offsets[item]
        for place in range(first, last):
            piece, side = order[place] // 2, order[place] % 2
            before, other = order[max(first, place - 1)] // 2, order[max(first, place - 1)] % 2
            if place == first or t[before, other] != t[piece, side]:
                rank += 1
            elif faces[before, other] >= 0 or faces[piece, side] >= 0:
                return False
            ranks[piece, side] = rank
            if side == 0:
                order[2 * source.size + n_starts] = piece
                n_starts += 1
    for place in range(source.size):
        piece = order[2 * source.size + place]
        out[0][place], out[1][place] = source[piece], body[piece]
        for k in range(start.shape[1]):
            out[2][place, k], out[3][place, k] = start[piece, k], end[piece, k]
        for k in range(2):
            out[4][place, k], out[5][place, k], out[6][place, k] = t[piece, k], faces[piece, k], ranks[piece, k]
    return True


@inline
def _sort_ends(order: Any, first: int, last: int, body: Any, t: Any) -> None:
    """Sort ends, 2 * piece + side, by parameter and body."""
    gap = (last - first) // 2
    while gap > 0:  # bound: gap is halved; Shell's sort, n^1.5 steps
        for i in range(first + gap, last):
            moved, j = order[i], i
            at, name = t[moved // 2, moved % 2], body[moved // 2]
            while j >= first + gap:
                other = order[j - gap]
                value = t[other // 2, other % 2]
                if value < at or (value == at and body[other // 2] <= name):
                    break
                order[j] = other
                j -= gap
            order[j] = moved
        gap //= 2


def _ranks(found: Found, number: IntArray, order: IntArray, source: IntArray, exact: Exact) -> IntArray:
    """Return the rank of each end, given in the order of source and rounded parameter; a piece's two ends are known to
    be one only where that is known of numbers that round alike."""
    m = len(found.source)
    side, row = np.divmod(order, max(1, m))
    t, is_own = found.t[row, side], found.faces[row, side] < 0
    is_first = np.append(True, source[1:] != source[:-1])[: len(order)]
    is_tie = ~is_first
    is_tie[1:] &= t[1:] == t[:-1]
    is_sure = np.append(False, is_own[1:] & is_own[:-1])[: len(order)]
    steps = (~is_tie).astype(np.int64)
    places = np.flatnonzero(is_tie & ~is_sure)
    if len(places):
        _look_closer(found, number, (row, side), order, is_tie, places, steps, exact)
    counts = np.cumsum(steps)
    ranks: IntArray = counts - np.maximum.accumulate(np.where(is_first, counts, 0))
    return ranks


def _look_closer(
    found: Found, number: IntArray, ends: tuple[IntArray, IntArray], order: IntArray, is_tie: Any, places: IntArray,
    steps: IntArray, exact: Exact,
) -> None:  # fmt: skip
    """Put runs of ends that round alike, some of which may differ, in exact order, and note where one begins."""
    row, side = ends
    starts = np.flatnonzero(~is_tie)
    runs = np.unique(np.searchsorted(starts, places, "right") - 1)
    stops = np.append(starts[1:], len(order))
    for begin, stop in zip(starts[runs].tolist(), stops[runs].tolist()):
        known: dict[int, tuple[Parameter, Parameter]] = {}
        keyed: list[tuple[Parameter, int]] = []
        for place in range(begin, stop):
            i, end = int(row[place]), int(side[place])
            if found.faces[i, end] >= 0 and i not in known:
                known[i] = exact(int(found.source[i]), int(found.body[i]), int(number[i]))
            keyed.append((known[i][end] if found.faces[i, end] >= 0 else (ZERO, ONE)[end], int(order[place])))
        keyed.sort(key=_BY_PARAMETER)
        for place, (at, item) in zip(range(begin, stop), keyed):
            order[place] = item
            steps[place] = place == begin or compare(keyed[place - begin - 1][0], at) != 0
