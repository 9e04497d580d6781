"""Distance of a vertex and an edge of two placed outlines in double-doubles, the position of the foot, and error
bounds.

**Bound.** Given coordinates are doubles, their differences exact double-doubles; placed ones are off by `error`, and a
distance by at most twice that of both bodies. height = cross(u, w) / |u|: the two largest products cancel without loss,
all others are below 2^-50 of those, so the height is off by 2^-98 of itself and 2^-148 of the longest vector. Over an
axis-parallel edge it is an exact difference, and equal ones are a tie. The sign of a scalar product is known if its
products are exact: a sum is off by a part of itself. The foot moves by the errors of the corners times distance of the
vertex / length of the edge.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final, NamedTuple

import numpy as np

from engine.arrangement.simple_rings import fill_tree
from engine.compiling.jit import called, inline
from engine.distance.closed_forms import Wide, less, over, plus, product, root, times
from engine.predicates.vectors import as_point2
from engine.types import FloatArray, IntArray

LARGEST: Final = 2.0**200
"""Largest coordinate for which the bounds are valid."""
_SHORTEST: Final = 2.0**-400
"""Smallest length of an edge, and smallest factor of exact products."""


class Wide2(NamedTuple):
    """A point or vector of the plane in double-doubles."""

    x: Wide
    y: Wide


Placed = namedtuple("Placed", "points following boxes error reach")
"""Outline under a pose.

| field | meaning |
|---|---|
| points | (n, 4) both coordinates rounded, then their low parts |
| following | the vertex at the end of each edge |
| boxes | tree over the edges |
| error | bound on the error of coordinates |
| reach | largest coordinate, infinite out of the range of the bounds |
"""

VertexEdge = namedtuple("VertexEdge", "distance bound is_first first second face their_face")
"""Distance of a vertex of one outline and an edge of another, with its error bound.

| field | meaning |
|---|---|
| is_first | whether the vertex is the first body's |
| first, second | vertex, or number of vertices + edge, of both bodies |
| face, their_face | the lowest edges that these lie on |
"""


@called
def place(
    vertices: FloatArray, following: IntArray, turn: FloatArray, move: FloatArray, points: FloatArray, boxes: FloatArray
) -> tuple[float, float]:
    """Write the points (n, 4) and the tree over the edges of an outline under a pose; return `error` and `reach`
    of `Placed`. Each sum of three is off by 12 u^2 of its terms. Poses that map axes to axes: exact sums, doubles
    unchanged."""
    reach, is_given = 0.0, True
    for k in range(2):
        reach = max(reach, abs(move[k]))
        is_given = is_given and (turn[k, k] == 0.0 or abs(turn[k, k]) == 1.0) and turn[0, k] * turn[1, k] == 0.0
    is_still = is_given and turn[0, 0] == 1.0 and turn[1, 1] == 1.0 and reach == 0.0
    for vertex in range(len(vertices)):
        p = as_point2(vertices, vertex)
        reach = max(reach, abs(p.x), abs(p.y))
        for k in range(2):
            x = Wide(p.x if k == 0 else p.y, 0.0)
            if not is_still:
                x = plus(plus(product(turn[k, 0], p.x), product(turn[k, 1], p.y)), Wide(move[k], 0.0))
            is_given = is_given and x.low == 0.0
            points[vertex, k], points[vertex, 2 + k] = x.h, x.low
    error = 0.0 if is_given else 2.0**-100 * reach + 2.0**-1000
    return error, _reach(points, following, boxes, reach)


@inline
def _reach(points: FloatArray, following: IntArray, boxes: FloatArray, reach: float) -> float:
    """Write the tree over placed edges; return `reach` of `Placed`, infinite if an edge is too short or a coordinate
    too large for the bounds. reach: bound on the terms of coordinates."""
    fill_tree(points, following, boxes)
    for k in range(4):
        reach = max(reach, abs(boxes[1, k]))
    for edge in range(len(following)):
        p, q = as_point2(points, edge), as_point2(points, following[edge])
        if not max(abs(p.x - q.x), abs(p.y - q.y)) > _SHORTEST:
            size = size2(minus2(point(points, following[edge]), point(points, edge)))
            reach = reach if size == 0.0 or size > _SHORTEST else np.inf
    return reach if reach < LARGEST else np.inf


@inline
def point(points: FloatArray, vertex: int) -> Wide2:
    """Return vertex `vertex` of placed points (n, 4) in double-doubles."""
    return Wide2(Wide(points[vertex, 0], points[vertex, 2]), Wide(points[vertex, 1], points[vertex, 3]))


@inline
def minus2(a: Wide2, b: Wide2) -> Wide2:
    """Return the vector a - b in double-doubles."""
    return Wide2(less(a.x, b.x), less(a.y, b.y))


@inline
def size2(a: Wide2) -> float:
    """Return the larger magnitude of two coordinates."""
    return max(abs(a.x.h), abs(a.y.h))


@inline
def _magnitude(a: Wide) -> Wide:
    """Return the absolute value of a double-double."""
    return a if a.h > 0.0 else Wide(-a.h, -a.low)


@inline
def _is_whole(a: Wide) -> bool:
    """Return whether a double-double is one double, zero or large enough to be a factor of an exact product."""
    return a.low == 0.0 and (a.h == 0.0 or abs(a.h) > _SHORTEST)


@inline
def _cross(u: Wide2, w: Wide2) -> Wide:
    """Return u.x w.y - u.y w.x in double-double. order: the products of the high parts first, which may cancel."""
    total = less(product(u.x.h, w.y.h), product(u.y.h, w.x.h))
    total = plus(total, less(product(u.x.h, w.y.low), product(u.y.h, w.x.low)))
    total = plus(total, less(product(u.x.low, w.y.h), product(u.y.low, w.x.h)))
    return plus(total, Wide(u.x.low * w.y.low - u.y.low * w.x.low, 0.0))


@inline
def _dot(u: Wide2, w: Wide2) -> Wide:
    """Return the scalar product of u and w in double-double."""
    return _cross(u, Wide2(Wide(-w.y.h, -w.y.low), w.x))


@inline
def _along(u: Wide2, w: Wide2, error: float) -> tuple[float, float]:
    """Return dot(u, w) and a bound on its error, 0.0 if its sign is proven. error: bound on coordinates."""
    reach = max(size2(u), size2(w))
    value, slack = u.x.h * w.x.h + u.y.h * w.y.h, 2.0**-48 * size2(u) * size2(w) + 16.0 * error * reach + 2.0**-1000
    if abs(value) > slack:
        return value, 0.0
    value = _dot(u, w).h
    if error == 0.0 and _is_whole(u.x) and _is_whole(u.y) and _is_whole(w.x) and _is_whole(w.y):
        return value, 0.0
    return value, 2.0**-98 * abs(value) + 2.0**-146 * size2(u) * reach + 16.0 * error * reach


@inline
def _along_axis(u: Wide2, w: Wide2) -> float:
    """Return a number with the sign of dot(u, w), for a vector u parallel to an axis."""
    x, way = (w.y.h, u.y.h) if u.x.h == 0.0 else (w.x.h, u.x.h)
    return x if way > 0.0 else -x


@inline
def _is_level(u: Wide2, error: float) -> bool:
    """Return whether u is exact and parallel to an axis."""
    return error == 0.0 and (u.x.h == 0.0 or u.y.h == 0.0)


@called
def measure(p: Wide2, a: Wide2, b: Wide2, error: float) -> tuple[Wide, float, int]:
    """Return (distance, bound, where) of p and the segment ab: the distance as a double-double, its error bound, and
    where p's foot lies: 0 at a, 1 at b, 2 between, -1 unproven. error: bound on coordinates of both bodies together."""
    u, w, v = minus2(b, a), minus2(p, a), minus2(b, p)
    is_level = _is_level(u, error)
    if is_level:
        after, before, slack, their_slack = _along_axis(u, w), _along_axis(u, v), 0.0, 0.0
    else:
        (after, slack), (before, their_slack) = _along(u, w, error), _along(u, v, error)
    if after <= -slack or before <= -their_slack:
        where = 0 if after <= -slack else 1
        gap = minus2(p, b if where else a)
        if _is_level(gap, error):
            return _magnitude(gap.y if gap.x.h == 0.0 else gap.x), 0.0, where
        size = root(_dot(gap, gap))
        return size, 2.0**-98 * size.h + 4.0 * error, where
    if is_level:
        return _magnitude(w.x if u.x.h == 0.0 else w.y), 0.0, 2
    height = over(_magnitude(_cross(u, w)), root(_dot(u, u)))
    bound = 2.0**-98 * height.h + 2.0**-148 * max(size2(u), size2(w)) + 4.0 * error
    if after > slack and before > their_slack:
        return height, bound, 2
    return height, bound + 2.0 * (slack + their_slack) / size2(u), -1  # the foot may lie beyond an end, by this at most


@inline
def foot_of(own: Placed, other: Placed, vertex: int, feature: int) -> tuple[Wide2, float]:
    """Return the point of `other` nearest to vertex `vertex` of `own`, on a feature known to contain it, and the
    point's error bound. feature: a vertex of `other`, or its number of vertices + an edge."""
    n, p, error = len(other.following), point(own.points, vertex), own.error + other.error
    if feature < n:
        return point(other.points, feature), other.error
    a, b = point(other.points, feature - n), point(other.points, other.following[feature - n])
    u, w = minus2(b, a), minus2(p, a)
    if _is_level(u, error):
        return (Wide2(a.x, p.y) if u.x.h == 0.0 else Wide2(p.x, a.y)), 0.0
    reach, share = max(size2(u), size2(w)), over(_dot(u, w), _dot(u, u))
    foot = Wide2(plus(a.x, times(share, u.x)), plus(a.y, times(share, u.y)))
    return foot, 2.0**-98 * (size2(a) + reach) + 16.0 * error * (1.0 + reach / size2(u))
