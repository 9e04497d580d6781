"""How far apart two small bodies of the plane are, polygons, triangles, boxes and balls: every vertex and every edge.

Outlines that do not cross are nearest at a vertex of one and an edge of the other, or its end. Doubles leave the pairs
that may be it; double-doubles measure those, and say whether the distance is sure, and of one pair (outline_search.py).
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrays import FlagArray, FloatArray, IntArray
from engine.collision.codes import DISJOINT, UNSETTLED
from engine.collision.planar.outline_batch import inside, n_blocks, relate_placed
from engine.distance.closed_forms import UNSURE
from engine.distance.outline_search import MOST_NEAR, ROOM, Look, line_of, look_for, row_of, search, way_to
from engine.distance.vertex_edge import LARGEST, Found, Placed, Wide2, foot_of, minus2, place, point
from engine.distance.wide import Wide, less, over, plus, times
from engine.jit import allocating_kernel, called, inline
from engine.predicates.double_double import U2, surely_rounded
from engine.predicates.error_free import two_sum, workspace
from engine.predicates.vectors import as_point2

_SMALLEST: Final = 2.0**-140
"""Of distances that the bounds hold for."""
_POLL_EVERY: Final = 16


@inline
def _are_parted(own: Placed, other: Placed, vertex: int, edge: int) -> bool:
    """Tell whether bodies surely lie on two sides of a line across the way from an edge to a vertex.

    Of a way n a product n . x is off by less than 8 u |n| of the largest coordinate.
    """
    way, low, high = way_to(as_point2(own.points, vertex), line_of(other, edge)), np.inf, -np.inf
    for vertex in range(len(own.following)):
        low = min(low, way.x * own.points[vertex, 0] + way.y * own.points[vertex, 1])
    for vertex in range(len(other.following)):
        high = max(high, way.x * other.points[vertex, 0] + way.y * other.points[vertex, 1])
    return low - high > 2.0**-50 * (abs(way.x) + abs(way.y)) * (own.reach + other.reach) + 2.0**-1000


@called
def _related(a: Placed, b: Placed, error: float) -> int:
    relation, _, _, _, _ = relate_placed(
        a.points, a.following, a.following[:0], b.points, b.following, b.following[:0], b.boxes, error
    )
    return -1 if relation == UNSETTLED else (1 if relation == DISJOINT else 0)


@inline
def _are_apart(a: Placed, b: Placed, near: Any, look: Look) -> int:
    """Return 1 for bodies without a common point, 0 for others, -1 where this is not sure, or distances may not be."""
    error = 2.0**-51 * max(a.reach if a.error > 0.0 else 0.0, b.reach if b.error > 0.0 else 0.0)
    error += 2.0**-1000 if error > 0.0 else 0.0
    if not (a.reach + b.reach < np.inf and look.least < np.inf):
        return -1
    for row in range(min(look.n, MOST_NEAR)):
        if near[4 * row] == look.least:
            is_first, vertex, edge = row_of(near, row)
            if _are_parted(a, b, vertex, edge) if is_first else _are_parted(b, a, vertex, edge):
                return 1
            break
    if len(a.following) == 1 or len(b.following) == 1:
        ball, other = (a, b) if len(a.following) == 1 else (b, a)
        where = inside(as_point2(ball.points, 0), other.points, other.following, error)
        return 1 - where if where < 2 else -1
    return _related(a, b, error)


@inline
def _write(
    at: Wide2, error: float, errors: float, found: Found, way: Wide2, radius: float, points: FloatArray, end: int
) -> bool:
    """Write the point at a radius from another along a way that is as long as is found; tell whether it is sure.

    error, errors: of that point, and of both ends of the way together.
    """
    is_sure = True
    for k in range(2):
        x, bound = (at.x if k == 0 else at.y), error
        if radius > 0.0:
            x = plus(x, times(over(way.x if k == 0 else way.y, found.distance), Wide(radius, 0.0)))
            bound += radius * (4.0 * errors / found.distance.h + 2.0**-98) + 2.0**-100 * abs(x.h)
        is_sure = is_sure and surely_rounded(x.h, x.low, bound) and (bound == 0.0 or abs(x.h) > 2.0**-800)
        points[end, k] = x.h + 0.0
    return is_sure


@inline
def _nearest(a: Placed, b: Placed, radius: float, their_radius: float, points: FloatArray) -> tuple[float, int, int]:
    """Return the distance of two bodies, 0.0 where they surely meet, or UNSURE; of each body the vertex, or the number
    of vertices + the edge, that the points (2, 2) written lie on; -1 where these are not sure.

    A ball is one vertex and a radius.
    """
    near = workspace(ROOM)
    look = look_for(a, b, near)
    are_apart = _are_apart(a, b, near, look)
    if are_apart != 1 or look.n > MOST_NEAR:
        return 0.0 if are_apart == 0 else UNSURE, -1, -1
    best, nearer, is_sure = search(a, b, near, look.n)
    if not _SMALLEST < best.distance.h < LARGEST:
        return UNSURE, -1, -1
    both = Wide(*two_sum(radius, their_radius))
    distance, bound = less(best.distance, both), best.bound + nearer
    bound += 4.0 * U2 * abs(distance.h) if both.h > 0.0 else 0.0
    if distance.h < -bound:
        return 0.0, -1, -1
    if not (distance.h > bound and surely_rounded(distance.h, distance.low, bound)):
        return UNSURE, -1, -1
    if not is_sure:
        return distance.h, -1, -1
    if best.is_first:
        (p, error), (q, their_error) = (point(a.points, best.first), a.error), foot_of(a, b, best.first, best.second)
    else:
        (p, error), (q, their_error) = foot_of(b, a, best.second, best.first), (point(b.points, best.second), b.error)
    errors = error + their_error
    is_sure = _write(p, error, errors, best, minus2(q, p), radius, points, 0)
    is_sure = _write(q, their_error, errors, best, minus2(p, q), their_radius, points, 1) and is_sure
    return distance.h, best.first if is_sure else -1, best.second


@inline
def _n_rows(following: IntArray) -> int:
    """Return how many rows the points and boxes of an outline take."""
    return len(following) + n_blocks(len(following))


@allocating_kernel
def nearest_under_poses(
    vertices: FloatArray, following: IntArray, radius: float, turns: FloatArray, moves: FloatArray, other: FloatArray,
    their_following: IntArray, their_radius: float, their_turns: FloatArray, their_moves: FloatArray, found: FloatArray,
    points: FloatArray, flag: FlagArray,
) -> tuple[float, int, int]:  # fmt: skip
    """Return what `_nearest` does under the last pose of the second, whose points are written too, and fill found with
    the distance under each, where it is not empty; the first has as many poses, or one.

    Stops early when the flag is raised.
    """
    n, m, k = len(following), len(their_following), _n_rows(following)
    room = np.empty((k + _n_rows(their_following), 4))
    at, boxes, their_at, their_boxes = room[:n], room[n:k], room[k : k + m], room[k + m :]
    error, reach, nearest = 0.0, np.inf, (UNSURE, -1, -1)
    for item in range(len(their_turns)):
        if item % _POLL_EVERY == 0 and flag[0] != 0:
            break
        if item < len(turns):
            error, reach = place(vertices, following, turns[item], moves[item], at, boxes)
        their_error, their_reach = place(
            other, their_following, their_turns[item], their_moves[item], their_at, their_boxes
        )
        a = Placed(at, following, boxes, error, reach)
        b = Placed(their_at, their_following, their_boxes, their_error, their_reach)
        nearest = _nearest(a, b, radius, their_radius, points)
        if len(found) > 0:
            found[item] = nearest[0]
    return nearest
