"""Arrays of pieces, as kernels write them, and the ends of segments, as they read them; in 2D z is 0."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from engine.compiling.jit import inline, merged
from engine.predicates.cut_point import T_BOUND, point_at
from engine.running.budget import UNLIMITED, Budget
from engine.running.joining import join_columns
from engine.types import FloatArray, IntArray

Triple = tuple[float, float, float]
End = tuple[float, float, float, int]
"""End of a piece: parameter, its low part, its relative error, and the face; face -1: the segment's own end."""
OWN_START, OWN_END = (-1.0, 0.0, 0.0, -1), (2.0, 0.0, 0.0, -1)
"""The ends of a segment itself, as ends of a piece."""
REJECTED: Final = 0
ACCEPTED: Final = 1
"""States of a segment, besides OPEN."""
LARGE: Final = 2.0**1000
"""Bound on the sum of |coordinates| of a segment: a larger sum (or NaN) leaves it OPEN."""
BLOCK: Final = 64
"""Segments of a block, so that fifteen numbers of each fit the L1 cache."""


class Piece(NamedTuple):
    """One piece of one segment: parameters and points of its two ends, correctly rounded, and the faces crossed there
    (-1: the segment's own end)."""

    t: tuple[float, float]
    start: list[float]
    end: list[float]
    faces: tuple[int, int]


Pieces = namedtuple("Pieces", "source ends t faces")
"""Columns of `SegmentPieces`: source (m,), ends (2, m, dim), t and faces (m, 2)."""


def allocate_pieces(m: int, dimension: int) -> Pieces:
    """Allocate arrays for m pieces, uninitialised."""
    return Pieces(np.empty(m, np.int64), np.empty((2, m, dimension)), np.empty((m, 2)), np.empty((m, 2), np.int64))


def joined(parts: Sequence[Pieces], budget: Budget = UNLIMITED, workers: int | None = 1) -> Pieces:
    """Return several sets of pieces, at least one, concatenated."""
    return Pieces(*join_columns(parts, budget, workers, (0, 1, 0, 0)))


def first_of(pieces: Pieces, m: int) -> Pieces:
    """Return the first m pieces, as views."""
    return Pieces(pieces.source[:m], pieces.ends[:, :m], pieces.t[:m], pieces.faces[:m])


def take_rows(pieces: Pieces, rows: IntArray) -> Pieces:
    """Return the pieces with indices ``rows``."""
    return Pieces(pieces.source[rows], pieces.ends[:, rows], pieces.t[rows], pieces.faces[rows])


def as_pieces(sources: Sequence[int], pieces: Sequence[Piece], dimension: int) -> Pieces:
    """Return pieces of the exact fallback as arrays, -0.0 replaced by 0.0. sources: the segment of each."""
    ends = np.array([(piece.start, piece.end) for piece in pieces], np.float64).reshape(-1, 2, dimension) + 0.0
    return Pieces(
        np.array(sources, np.int64),
        np.ascontiguousarray(ends.swapaxes(0, 1)),
        np.array([piece.t for piece in pieces], np.float64).reshape(-1, 2) + 0.0,
        np.array([piece.faces for piece in pieces], np.int64).reshape(-1, 2),
    )


def in_order_of_source(parts: Sequence[Pieces]) -> Pieces:
    """Merge several sets of pieces by source; the pieces of one source must be in one set, in order."""
    pieces = joined(parts)
    return take_rows(pieces, np.argsort(pieces.source, kind="stable"))


@merged
def is_plain(p: Triple, q: Triple) -> bool:
    """Return whether the coordinates of a segment are finite, and their magnitudes add up to less than `LARGE`."""
    return abs(p[0]) + abs(p[1]) + abs(p[2]) + abs(q[0]) + abs(q[1]) + abs(q[2]) < LARGE


@merged
def point_of(segments: FloatArray, item: int, end: int, is_flat: bool) -> Triple:
    """Return end 0 or 1 of segment ``item``, with z = 0 if is_flat."""
    return segments[item, end, 0], segments[item, end, 1], (0.0 if is_flat else segments[item, end, 2])


@merged
def put_end(pieces: Pieces, row: int, end: int, point: Triple, is_flat: bool) -> None:
    """Write ``point`` as end 0 or 1 of the piece in a row, -0.0 replaced by 0.0. is_flat: 2D."""
    pieces.ends[end, row, 0], pieces.ends[end, row, 1] = point[0] + 0.0, point[1] + 0.0
    if not is_flat:
        pieces.ends[end, row, 2] = point[2] + 0.0


@merged
def put_own_end(pieces: Pieces, row: int, end: int, segments: FloatArray, item: int, is_flat: bool) -> None:
    """Write end 0 or 1 of segment ``item`` as that end of the piece in a row: t 0 or 1, face -1. is_flat: 2D."""
    pieces.t[row, end], pieces.faces[row, end] = end, -1
    put_end(pieces, row, end, point_of(segments, item, end, is_flat), is_flat)


@inline
def slack_of(s: float, s_bound: float, d: float, d_bound: float) -> float:
    """Return a bound on the relative error of s / d, each known to within its bound; infinite if s or d is out of
    range."""
    if not (2.0**-400 <= abs(d) <= 2.0**400 and abs(s) >= 2.0**-500):
        return np.inf
    return 1.01 * (s_bound / abs(s) + d_bound / abs(d))


@inline
def put_point(point: FloatArray, segments: FloatArray, item: int, t: float, low: float, slack: float) -> bool:
    """Write the point of segment ``item`` at parameter t + low to ``point``; slack: relative error of the parameter.
    Return whether the parameter t + low and all coordinates are proven nearest doubles."""
    bound = (T_BOUND + slack) * abs(t)
    sure = (slack < 0.001) & (t + (low - bound) == t + (low + bound))
    for k in range(segments.shape[2]):
        x, is_x = point_at(segments[item, 0, k], segments[item, 1, k], t, low, slack)
        point[k] = x + 0.0
        sure &= is_x
    return sure


@inline
def put_piece(out: Pieces, row: int, source: int, segments: FloatArray, item: int, first: End, last: End) -> bool:
    """Write the piece of segment ``item`` between two ends, each (t, t_low, slack, face), to row `row` of `out`; return
    whether all numbers are proven nearest doubles. face: -1 for the segment's own end."""
    sure = True
    out.source[row] = source
    for end in range(2):
        t, low, slack, face = first if end == 0 else last
        if face < 0:
            put_own_end(out, row, end, segments, item, segments.shape[2] == 2)
        else:
            sure &= put_point(out.ends[end, row], segments, item, t, low, slack)
            out.t[row, end], out.faces[row, end] = t + low, face
    return sure
