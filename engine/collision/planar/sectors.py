"""What holds of the interiors of two planar bodies where their boundaries meet in a vertex of one.

About such a point either interior is a sector; three comparisons of sectors say whether the interiors meet there, and
which of them sticks out of the other.
"""

from __future__ import annotations

from engine.arrays import FloatArray, IntArray
from engine.compiling.jit import called, inline
from engine.predicates.orientation import orient2d
from engine.predicates.vectors import as_point2
from engine.types import Point2

IN_BOTH, OUT_OF_SECOND, OUT_OF_FIRST = 1, 2, 4
"""Bits: where the open interiors meet; where that of the first lies outside the second; that of the second outside the
first."""


@inline
def is_in_box(p: Point2, a: Point2, b: Point2) -> bool:
    """Tell whether a point lies in the box of an edge."""
    return min(a.x, b.x) <= p.x <= max(a.x, b.x) and min(a.y, b.y) <= p.y <= max(a.y, b.y)


@inline
def _is_from(p: Point2, s: Point2, e: Point2, x: Point2) -> bool:
    """Tell whether the direction from p to x is that to s, or lies strictly between s and e, counter-clockwise."""
    by_s, by_e, turn = orient2d(p, s, x), orient2d(p, x, e), orient2d(p, s, e)
    if by_s == 0 and (s.x > p.x) == (x.x > p.x) and (s.x < p.x) == (x.x < p.x):
        if (s.y > p.y) == (x.y > p.y) and (s.y < p.y) == (x.y < p.y):
            return True
    if turn == 0:
        return by_s > 0
    return (by_s > 0 and by_e > 0) if turn > 0 else (by_s > 0 or by_e > 0)


@called
def _have_common(p: Point2, s: Point2, e: Point2, t: Point2, f: Point2) -> bool:
    """Tell whether the open sectors about p from s to e, and from t to f, counter-clockwise, have common points."""
    return _is_from(p, s, e, t) or _is_from(p, t, f, s)


@inline
def _of_sectors(
    p: Point2, before: Point2, after: Point2, side: int, their_before: Point2, their_after: Point2, their_side: int
) -> int:
    """Return what holds about a vertex of one boundary on another, as bits."""
    s, e = (after, before) if side > 0 else (before, after)
    t, f = (their_after, their_before) if their_side > 0 else (their_before, their_after)
    found = IN_BOTH if _have_common(p, s, e, t, f) else 0
    found |= OUT_OF_SECOND if _have_common(p, s, e, f, t) else 0
    return found | (OUT_OF_FIRST if _have_common(p, t, f, e, s) else 0)


@called
def at_contact(
    points: FloatArray, following: IntArray, edge: int, side: int, vertices: FloatArray, theirs: IntArray, other: int,
    their_side: int,
) -> int:  # fmt: skip
    """Return what holds where two edges meet, as bits; of the start of an edge the one before it says that."""
    a, b = as_point2(points, edge), as_point2(points, following[edge])
    c, d = as_point2(vertices, other), as_point2(vertices, theirs[other])
    found = 0
    if b != c and is_in_box(b, c, d) and orient2d(c, d, b) == 0:
        after = as_point2(points, following[following[edge]])
        their_after = as_point2(vertices, theirs[theirs[other]]) if b == d else d
        found = _of_sectors(b, a, after, side, c, their_after, their_side)
    if d != a and d != b and is_in_box(d, a, b) and orient2d(a, b, d) == 0:
        found |= _of_sectors(d, a, b, side, c, as_point2(vertices, theirs[theirs[other]]), their_side)
    return found
