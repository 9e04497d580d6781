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
    """Return all pieces, by source and body."""
    none = np.empty(0, np.int64)
    found = Found(none, none, np.empty((2, 0, dimension)), np.empty((0, 2)), np.empty((0, 2), np.int64))
    if len(parts) == 1:
        found = parts[0]
    elif parts:
        source, body, ends, t, faces = (list(each) for each in zip(*parts))
        whole = (np.concatenate(each) for each in (t, faces))
        found = Found(np.concatenate(source), np.concatenate(body), np.concatenate(ends, axis=1), *whole)
    return taken(found, np.lexsort((found.body, found.source)))


def taken(found: Found, rows: Any) -> Found:
    """Return some pieces."""
    return Found(found.source[rows], found.body[rows], found.ends[:, rows], found.t[rows], found.faces[rows])


def in_order(found: Found, exact: Exact) -> ScenePieces:
    """Return pieces, given by source and body, in the exact order of their starts."""
    m, starts_source = len(found.source), found.source[1:] != found.source[:-1]
    if starts_source.all() and (found.t[:, 0] < found.t[:, 1]).all():
        ranks = np.array([[0, 1]]).repeat(m, axis=0)
        return ScenePieces(found.source, found.body, found.ends[0], found.ends[1], found.t, found.faces, ranks)
    number = np.arange(m)  # of a piece among those of its source and body
    is_new = np.append(True, starts_source | (found.body[1:] != found.body[:-1]))
    number -= np.maximum.accumulate(np.where(is_new, number, 0))
    source = np.concatenate([found.source, found.source])
    order = np.lexsort((found.t.T.ravel(), source))  # all starts, then all ends
    ranks = np.empty(2 * m, np.int64)
    ranks[order] = _ranks(found, number, order, source[order], exact)
    by_start = np.lexsort((found.body, ranks[:m], found.source))
    found = taken(found, by_start)
    ranks = ranks.reshape(2, m).T[by_start]
    return ScenePieces(found.source, found.body, found.ends[0], found.ends[1], found.t, found.faces, ranks)


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
    found: Found,
    number: IntArray,
    ends: tuple[IntArray, IntArray],
    order: IntArray,
    is_tie: Any,
    places: IntArray,
    steps: IntArray,
    exact: Exact,
) -> None:
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
            if found.faces[i, end] < 0:
                at = ONE if end else ZERO
            else:
                if i not in known:
                    known[i] = exact(int(found.source[i]), int(found.body[i]), int(number[i]))
                at = known[i][end]
            keyed.append((at, int(order[place])))
        keyed.sort(key=_BY_PARAMETER)
        for place, (at, item) in zip(range(begin, stop), keyed):
            order[place] = item
            steps[place] = place == begin or compare(keyed[place - begin - 1][0], at) != 0
