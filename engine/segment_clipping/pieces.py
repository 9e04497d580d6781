"""Arrays of pieces, as kernels write them, and the ends of segments, as they read them; in 2D z is 0."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from engine.compiling.jit import inline, merged
from engine.predicates.cut_point import T_BOUND, point_at
from engine.running.budget import concatenated
from engine.types import FloatArray

Triple = tuple[float, float, float]
End = tuple[float, float, float, int]
"""End of a piece: parameter, its low part, its relative error, and the face, -1 for the segment's own end."""
OWN_START, OWN_END = (-1.0, 0.0, 0.0, -1), (2.0, 0.0, 0.0, -1)
"""The ends of a segment as ends of a piece."""
REJECTED: Final = 0
ACCEPTED: Final = 1
"""States of a segment, besides OPEN."""
LARGE: Final = 2.0**1000
"""Bound on the sum of |coordinates| of an item: a larger sum (or NaN) leaves it OPEN."""
BLOCK: Final = 64
"""Segments of a block: fifteen numbers each fit the L1 cache."""


class Piece(NamedTuple):
    """One piece of one segment: parameters and points correctly rounded, faces crossed (-1: own end)."""

    t: tuple[float, float]
    start: list[float]
    end: list[float]
    faces: tuple[int, int]


Pieces = namedtuple("Pieces", "source ends t faces")
"""Columns of `SegmentPieces`: source (m,), ends (2, m, dim), t and faces (m, 2)."""


def allocate_pieces(m: int, dimension: int) -> Pieces:
    """Return uninitialised arrays for m pieces."""
    return Pieces(np.empty(m, np.int64), np.empty((2, m, dimension)), np.empty((m, 2)), np.empty((m, 2), np.int64))


def joined(parts: Sequence[Pieces]) -> Pieces:
    """Return several sets of pieces concatenated."""
    source, ends, t, faces = zip(*parts)
    return Pieces(concatenated(source), concatenated(ends, axis=1), concatenated(t), concatenated(faces))


def first_of(pieces: Pieces, m: int) -> Pieces:
    """Return the first m pieces."""
    return Pieces(pieces.source[:m], pieces.ends[:, :m], pieces.t[:m], pieces.faces[:m])


def as_pieces(sources: Sequence[int], pieces: Sequence[Piece], dimension: int) -> Pieces:
    """Return pieces of the exact fallback as columns, without negative zeros."""
    ends = np.array([(piece.start, piece.end) for piece in pieces], np.float64).reshape(-1, 2, dimension) + 0.0
    return Pieces(
        np.array(sources, np.int64),
        np.ascontiguousarray(ends.swapaxes(0, 1)),
        np.array([piece.t for piece in pieces], np.float64).reshape(-1, 2) + 0.0,
        np.array([piece.faces for piece in pieces], np.int64).reshape(-1, 2),
    )


def in_order_of_source(parts: Sequence[Pieces]) -> Pieces:
    """Return several sets of pieces merged by source; the pieces of one source are in one set."""
    pieces = joined(parts)
    order = np.argsort(pieces.source, kind="stable")
    return Pieces(pieces.source[order], pieces.ends[:, order], pieces.t[order], pieces.faces[order])


@merged
def is_plain(p: Triple, q: Triple) -> bool:
    """Return whether the coordinates of a segment are finite and below `LARGE`."""
    return abs(p[0]) + abs(p[1]) + abs(p[2]) + abs(q[0]) + abs(q[1]) + abs(q[2]) < LARGE


@merged
def point_of(segments: FloatArray, item: int, end: int, is_flat: bool) -> Triple:
    """Return an end of a segment."""
    return segments[item, end, 0], segments[item, end, 1], (0.0 if is_flat else segments[item, end, 2])


@merged
def put_end(pieces: Pieces, row: int, end: int, point: Triple, is_flat: bool) -> None:
    """Write an end of a piece, without negative zeros."""
    pieces.ends[end, row, 0], pieces.ends[end, row, 1] = point[0] + 0.0, point[1] + 0.0
    if not is_flat:
        pieces.ends[end, row, 2] = point[2] + 0.0


@merged
def put_own_end(pieces: Pieces, row: int, end: int, segments: FloatArray, item: int, is_flat: bool) -> None:
    """Write an end of a piece that is the segment's own."""
    pieces.t[row, end], pieces.faces[row, end] = end, -1
    put_end(pieces, row, end, point_of(segments, item, end, is_flat), is_flat)


@inline
def slack_of(s: float, s_bound: float, d: float, d_bound: float) -> float:
    """Return the relative error of s / d from the bounds of s and d; infinite if their sizes are out of its range."""
    if not (2.0**-400 <= abs(d) <= 2.0**400 and abs(s) >= 2.0**-500):
        return np.inf
    return 1.01 * (s_bound / abs(s) + d_bound / abs(d))


@inline
def put_point(point: FloatArray, segments: FloatArray, item: int, t: float, low: float, slack: float) -> bool:
    """Write the point at t, known within slack; return whether it and t are certainly the nearest doubles."""
    bound = (T_BOUND + slack) * abs(t)
    sure = (slack < 0.001) & (t + (low - bound) == t + (low + bound))
    for k in range(segments.shape[2]):
        x, is_x = point_at(segments[item, 0, k], segments[item, 1, k], t, low, slack)
        point[k] = x + 0.0
        sure &= is_x
    return sure


@inline
def put_piece(out: Pieces, row: int, source: int, segments: FloatArray, item: int, first: End, last: End) -> bool:
    """Write a piece between two ends; return whether all numbers are certainly the nearest doubles."""
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
