"""Which vertex and edge of two placed outlines are nearest: doubles leave the pairs that may be, double-doubles rank
them, and where edges are parallel a tie is proven."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.collision.planar.outline_batch import BLOCK
from engine.distance.vertex_edge import Found, Placed, Wide2, measure, minus2, point
from engine.distance.wide import Wide, less
from engine.jit import called, inline
from engine.predicates.error_free import workspace
from engine.predicates.orientation import lower
from engine.predicates.parameters import compare_differences
from engine.predicates.vectors import as_point2
from engine.types import Point2

MOST_NEAR: Final = 64
"""Vertices and edges that may be the nearest; where there are more, their tie is not settled here."""
ROOM: Final = 4 * MOST_NEAR
_LEAST_SQUARE: Final = 2.0**-1000
"""Of lengths; below, an edge is looked at as its start."""
_LEAST_FACTOR: Final = 2.0**-300
"""Of coordinates whose differences are factors of exact products."""


class Look(NamedTuple):
    """The vertices and edges that may be nearest, as doubles tell: rows of `near` that are kept, the least square among
    them, the most that is kept, and by how much distances may be off."""

    n: int
    least: float
    most: float
    slack: float


class Line(NamedTuple):
    """An edge for looks at it: where it starts, where it leads, and the inverse of its squared length, 0.0 for none."""

    a: Point2
    u: Point2
    share: float


@inline
def line_of(other: Placed, edge: int) -> Line:
    a, b = as_point2(other.points, edge), as_point2(other.points, other.following[edge])
    u = Point2(b.x - a.x, b.y - a.y)
    square = u.x * u.x + u.y * u.y
    return Line(a, u, 1.0 / square if square > _LEAST_SQUARE else 0.0)


@inline
def way_to(p: Point2, line: Line) -> Point2:
    """Return about the way to a point from the nearest of an edge.

    Off by less than 2^-47 of all coordinates: the foot is some point of the edge, moved along it by some part of the
    distance that is 2^-50 of all coordinates over the length, or by the length: the less of both moves it away less.
    """
    wx, wy = p.x - line.a.x, p.y - line.a.y
    share = min(max((line.u.x * wx + line.u.y * wy) * line.share, 0.0), 1.0)
    return Point2(wx - share * line.u.x, wy - share * line.u.y)


@inline
def _of_blocks(own: Placed, other: Placed, blocks: tuple[int, int], is_first: bool, near: Any, look: Look) -> Look:
    """Look at the vertices of a block and the edges of another body's; write those that may be nearest to near, four
    numbers a row: about how far, squared, whether the vertex is the first body's, the vertex, the edge."""
    n, least, most, slack = look
    for edge in range(BLOCK * blocks[1], min(BLOCK * (blocks[1] + 1), len(other.following))):
        line = line_of(other, edge)
        for vertex in range(BLOCK * blocks[0], min(BLOCK * (blocks[0] + 1), len(own.following))):
            way = way_to(as_point2(own.points, vertex), line)
            square = way.x * way.x + way.y * way.y
            if square < least:
                least = square
                most = (np.sqrt(square) + slack) ** 2
            if square <= most:
                if n == MOST_NEAR:
                    n = _kept(near, n, most)
                if n < MOST_NEAR:
                    near[4 * n], near[4 * n + 1], near[4 * n + 2], near[4 * n + 3] = square, is_first, vertex, edge
                n += 1
    return Look(n, least, most, slack)


@inline
def row_of(near: Any, row: int) -> tuple[bool, int, int]:
    """Return the last three of a row."""
    return near[4 * row + 1] != 0.0, int(near[4 * row + 2]), int(near[4 * row + 3])


@inline
def _kept(near: Any, n: int, most: float) -> int:
    """Move the rows that may be nearest to the front; return how many these are."""
    kept = 0
    for row in range(n):
        if near[4 * row] <= most:
            for k in range(4):
                near[4 * kept + k] = near[4 * row + k]
            kept += 1
    return kept


@inline
def _gap(boxes: FloatArray, block: int, others: FloatArray, other: int) -> float:
    """Return about how far two boxes are apart, squared."""
    x = max(boxes[block, 0] - others[other, 2], others[other, 0] - boxes[block, 2], 0.0)
    y = max(boxes[block, 1] - others[other, 3], others[other, 1] - boxes[block, 3], 0.0)
    return float(x * x + y * y)


@inline
def look_for(a: Placed, b: Placed, near: Any) -> Look:
    """Return what may be nearest; the blocks that are nearest first. More rows than there is room for: too many."""
    least, first, second = np.inf, 0, 0
    for i in range(len(a.boxes)):
        for j in range(len(b.boxes)):
            gap = _gap(a.boxes, i, b.boxes, j)
            if gap < least:
                least, first, second = gap, i, j
    look = Look(0, np.inf, np.inf, 2.0**-44 * (a.reach + b.reach))
    look = _of_blocks(a, b, (first, second), True, near, look)
    look = _of_blocks(b, a, (second, first), False, near, look)
    for i in range(len(a.boxes)):
        for j in range(len(b.boxes)):
            if _gap(a.boxes, i, b.boxes, j) <= look.most and (i != first or j != second):
                look = _of_blocks(a, b, (i, j), True, near, look)
                look = _of_blocks(b, a, (j, i), False, near, look)
    if look.n <= MOST_NEAR:
        look = Look(_kept(near, look.n, look.most), look.least, look.most, look.slack)
    return look


@inline
def _least_face(following: IntArray, vertex: int) -> int:
    """Return the lesser edge at a vertex."""
    for edge in range(vertex):
        if following[edge] == vertex:
            return edge
    return vertex


@inline
def _found(a: Placed, b: Placed, vertex: int, edge: int, is_first: bool) -> tuple[Found, bool]:
    """Return how far a vertex of `a` is from an edge of `b`, and whether its foot's place is sure; is_first: whether
    `a` is the first body."""
    end = b.following[edge]
    distance, bound, where = measure(
        point(a.points, vertex), point(b.points, edge), point(b.points, end), a.error + b.error
    )
    feature, face = len(b.following) + edge, edge
    if where == 0 or where == 1:
        feature = edge if where == 0 else end
        face = _least_face(b.following, feature)
    own = _least_face(a.following, vertex)
    first, second, face, theirs = (vertex, feature, own, face) if is_first else (feature, vertex, face, own)
    return Found(distance, bound, is_first, first, second, face, theirs), where >= 0


@inline
def _way(a: Placed, b: Placed, found: Found) -> Wide2:
    return minus2(point(a.points, found.first), point(b.points, found.second))


@called
def _are_tied(a: Placed, b: Placed, one: Found, two: Found) -> bool:
    """Tell whether two feet are surely as far from their vertices: all are vertices, as far along each axis; or both
    are feet within one edge, of vertices on a parallel of that; or within two parallel edges that end in the vertices.
    """
    n, m = len(a.following), len(b.following)
    if a.error + b.error > 0.0:
        return False
    if max(one.first, two.first) < n and max(one.second, two.second) < m:
        return _way(a, b, one) == _way(a, b, two)
    if one.is_first == two.is_first:
        own, other, p, q = (a, b, one.first, two.first) if one.is_first else (b, a, one.second, two.second)
        edge, same = (one.second - m, two.second - m) if one.is_first else (one.first - n, two.first - n)
        if edge != same or edge < 0:
            return False
    else:
        own, other, of_first, of_second = a, b, (one if one.is_first else two), (two if one.is_first else one)
        p, edge = of_second.first - n, of_first.second - m
        if p < 0 or edge < 0 or of_second.second not in (edge, b.following[edge]):
            return False
        q = a.following[p]
        if of_first.first != p and of_first.first != q:
            return False
    u, v = as_point2(own.points, p), as_point2(own.points, q)
    c, d = as_point2(other.points, edge), as_point2(other.points, other.following[edge])
    least = lower(lower(lower(lower(np.inf, u.x), u.y), v.x), v.y)
    if lower(lower(lower(lower(least, c.x), c.y), d.x), d.y) < _LEAST_FACTOR:
        return False
    return compare_differences(v.x, u.x, d.y, c.y, v.y, u.y, d.x, c.x, workspace(16)) == 0


@inline
def _rank(found: Found) -> tuple[int, int, int, int]:
    return found.face, found.their_face, found.first, found.second


@inline
def search(a: Placed, b: Placed, near: Any, n: int) -> tuple[Found, float, bool]:
    """Return the nearest of n pairs, of equal ones that of the least faces; by how much another may be nearer; and
    whether this is surely the one."""
    none, is_sure = Wide(np.inf, 0.0), True
    best, rival = Found(none, 0.0, True, -1, -1, 0, 0), none
    for row in range(n):
        is_first, vertex, edge = row_of(near, row)
        other = b if is_first else a
        if point(other.points, edge) == point(other.points, other.following[edge]):
            continue  # case: no length; the edges beside it end there
        found, is_placed = _found(a, b, vertex, edge, True) if is_first else _found(b, a, vertex, edge, False)
        more = less(found.distance, best.distance).h if best.first >= 0 else -np.inf
        bound = 1.001 * (found.bound + best.bound)
        if more > bound or (is_placed and is_sure and found.first == best.first and found.second == best.second):
            continue
        if abs(more) <= bound and (bound == 0.0 or (is_placed and is_sure and _are_tied(a, b, found, best))):
            if _rank(found) < _rank(best):
                best, is_sure = found, is_placed
            continue
        if abs(more) <= bound:
            further = best if more < 0.0 else found
            low = less(further.distance, Wide(further.bound, 0.0))
            rival = low if low.h < rival.h or (low.h == rival.h and low.low < rival.low) else rival
        if more < 0.0:
            best, is_sure = found, is_placed
    if rival.h == np.inf:
        return best, 0.0, is_sure
    behind = less(rival, best.distance).h
    return best, max(-behind, 0.0) + 2.0**-98 * best.distance.h, is_sure and behind > 1.001 * best.bound
