"""Two triangles of the plane: the relation of two solids, by orient2d alone.

Two convex polygons without a common point have an edge of one of them with all of the other strictly outside (the
normals of their Minkowski difference are those of their edges). So nine signs for each triangle decide: an edge with
the other strictly outside: disjoint; all nine positive: the other is inside; an edge with the other outside or on it:
the interiors are apart, the triangles touch; else they overlap. A triangle without area is a segment or a point
without interior. Its edges go along its line both ways, so either side of the line may be the outside; two on one line
have a common point if their boxes have.

Source: the textbook's exercise 22.4-5; separating axes after S. Gottschalk et al., OBBTree, 1996, in exact signs.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING, UNSETTLED
from engine.jit import inline, kernel
from engine.predicates.orientation import orient2d
from engine.types import UNDECIDED, Point2


class Triangle2(NamedTuple):
    """Three points of the plane."""

    p: Point2
    q: Point2
    r: Point2


@inline
def as_triangle2(triangles: Any, item: int) -> Triangle2:
    """Load row `item` of (n, 3, 2) triangles."""
    t = triangles[item]
    return Triangle2(Point2(t[0, 0], t[0, 1]), Point2(t[1, 0], t[1, 1]), Point2(t[2, 0], t[2, 1]))


@inline
def are_boxes_apart(t: Triangle2, u: Triangle2) -> bool:
    """Tell whether the bounding boxes have no common point."""
    return (
        max(t.p.x, t.q.x, t.r.x) < min(u.p.x, u.q.x, u.r.x)
        or max(u.p.x, u.q.x, u.r.x) < min(t.p.x, t.q.x, t.r.x)
        or max(t.p.y, t.q.y, t.r.y) < min(u.p.y, u.q.y, u.r.y)
        or max(u.p.y, u.q.y, u.r.y) < min(t.p.y, t.q.y, t.r.y)
    )


@inline
def side_range(a: Point2, b: Point2, u: Triangle2) -> tuple[int, int]:
    """Return the least and the largest side of the line a b that a corner of u lies on; UNDECIDED twice if unsure."""
    p, q, r = orient2d(a, b, u.p), orient2d(a, b, u.q), orient2d(a, b, u.r)
    if p == UNDECIDED or q == UNDECIDED or r == UNDECIDED:
        return UNDECIDED, UNDECIDED
    return min(p, q, r), max(p, q, r)


@inline
def against_edges(t: Triangle2, u: Triangle2) -> int:
    """Return how u lies to the three edges of t, counter-clockwise: DISJOINT, SECOND_INSIDE_FIRST, TOUCHING,
    OVERLAPPING.

    Only DISJOINT and SECOND_INSIDE_FIRST are final; TOUCHING says that the interiors are apart if they exist.
    """
    p, q, r = t
    inside, apart = True, False
    for _ in range(3):
        low, high = side_range(p, q, u)
        if low == UNDECIDED:
            return UNSETTLED
        if high < 0:
            return DISJOINT
        inside, apart = inside and low > 0, apart or high == 0
        p, q, r = q, r, p
    if inside:
        return SECOND_INSIDE_FIRST
    return TOUCHING if apart else OVERLAPPING


@inline
def relation_of_triangles(t: Triangle2, u: Triangle2) -> int:
    """Return the relation of two closed triangles of the plane, degenerate ones included, or UNSETTLED."""
    if are_boxes_apart(t, u):
        return DISJOINT
    t_turn, u_turn = orient2d(t.p, t.q, t.r), orient2d(u.p, u.q, u.r)
    if t_turn == UNDECIDED or u_turn == UNDECIDED:
        return UNSETTLED
    if t_turn < 0:
        t = Triangle2(t.p, t.r, t.q)
    if u_turn < 0:
        u = Triangle2(u.p, u.r, u.q)
    first = against_edges(t, u)
    if first in (UNSETTLED, DISJOINT, SECOND_INSIDE_FIRST):
        return first
    second = against_edges(u, t)
    if second in (UNSETTLED, DISJOINT):
        return second
    if second == SECOND_INSIDE_FIRST:
        return FIRST_INSIDE_SECOND
    have_interiors = t_turn != 0 and u_turn != 0
    return OVERLAPPING if have_interiors and first == OVERLAPPING and second == OVERLAPPING else TOUCHING


@kernel
def relate_triangles_2d(first: Any, second: Any, relations: Any) -> None:
    """Fill relations (n,) int8 for the pairs of rows of two (n, 3, 2) float64 arrays."""
    for item in range(relations.shape[0]):
        relations[item] = relation_of_triangles(as_triangle2(first, item), as_triangle2(second, item))
