"""Closest points of two triangles in floats: nearly nearest points, and proven bounds on the distance.

The distance of any two points bounds that of the triangles from above. The slab between the triangles across the line
of these points bounds it from below: the triangles are convex, so the bounds meet at the nearest points. Triangles
without area are segments and points.

Source: C. Ericson, Real-Time Collision Detection, 2005, 5.1.9 (segments) and 5.1.10 (triangles); the slab is the
support bound of E. Gilbert, D. Johnson, S. Keerthi, 1988 (`distance/convex_gaps.py`).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.collision.meshes.triangle_triangle import Facet, corner
from engine.compiling.jit import inline, merged
from engine.predicates.vectors import cross, dot, largest_of, minus
from engine.types import Point3

FACE: Final = 6
"""| feature of a triangle | code |
|---|---|
| vertex k | k |
| edge from vertex k to the next | 3 + k |
| face | 6 |
"""
_ROUNDING: Final = 2.0**-47
"""Bound on the rounding of a distance, relative to the largest coordinate seen from a corner: a point on an edge or
face takes 4 roundings a coordinate; three dot products of 3 terms and the differences, less than 30 u in all."""
_TINY: Final = 1e-300
_AS_GOOD: Final = 1.0 - 2.0**-45
"""The lower bound on a distance suffices if it is at least so much of the upper bound."""


class Nearest(NamedTuple):
    """The nearest pair of points so far: p on the first and q on the second triangle; first, second: codes of the
    features that they lie on (above); square: their squared distance."""

    p: Point3
    q: Point3
    first: int
    second: int
    square: float


@merged
def _along(a: Point3, u: Point3, t: float) -> Point3:
    return Point3(a.x + t * u.x, a.y + t * u.y, a.z + t * u.z)


@merged
def _clamped(value: float) -> float:
    return min(max(value, 0.0), 1.0)


@merged
def _end_or_edge(t: float, k: int) -> int:
    """Return the feature code of the point at parameter t (0 .. 1) of edge k of a triangle: a vertex at either end,
    else the edge."""
    return k if t <= 0.0 else ((k + 1) % 3 if t >= 1.0 else 3 + k)


@inline
def _nearest_on_edges(best: Nearest, s: Facet, i: int, t: Facet, j: int) -> Nearest:
    """Return the closest points of edge i of triangle s and edge j of t, or `best` if these are no nearer."""
    a, c = corner(s, i), corner(t, j)
    u, v = minus(corner(s, i + 1), a), minus(corner(t, j + 1), c)
    w = minus(a, c)
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    size = uu * vv - uv * uv
    x = _clamped((uv * vw - vv * uw) / size) if size > 0.0 else 0.0
    y = (uv * x + vw) / vv if vv > 0.0 else 0.0
    if not 0.0 <= y <= 1.0:
        y = _clamped(y)
        x = _clamped((uv * y - uw) / uu) if uu > 0.0 else 0.0
    p, q = _along(a, u, x), _along(c, v, y)
    gap = minus(q, p)
    square = dot(gap, gap)
    return Nearest(p, q, _end_or_edge(x, i), _end_or_edge(y, j), square) if square < best.square else best


@inline
def _project_to_triangle(p: Point3, t: Facet) -> tuple[bool, Point3]:
    """Return whether the foot of p on the plane of t lies in the triangle, and the foot; False and p if t has no area.
    The foot is a convex combination of the corners: a point of the triangle even if the normal of a needle is badly
    rounded."""
    u, v, w = minus(t.q, t.p), minus(t.r, t.p), minus(p, t.p)
    normal = cross(u, v)
    size = dot(normal, normal)
    if not size > 0.0:
        return False, p
    x, y = dot(cross(w, v), normal) / size, dot(cross(u, w), normal) / size
    return x >= 0.0 and y >= 0.0 and x + y <= 1.0, _along(_along(t.p, u, x), v, y)


class SlabBounds(NamedTuple):
    """Bounds on the distance of two triangles, as computed: ``low`` from below, ``size`` from above; is_done: they are
    as close as rounding allows, or low exceeds the limit of the search."""

    low: float
    size: float
    is_done: bool


@inline
def _bound_by_slab(s: Facet, t: Facet, nearest: Nearest, before: SlabBounds, most: float) -> SlabBounds:
    """Return the bounds `before` tightened by new nearest points: from above by their distance, from below by the width
    of the slab between the triangles across the line of the points. most: a lower bound above it ends the search."""
    gap = minus(nearest.q, nearest.p)
    largest = largest_of(gap)
    if not largest > 0.0:
        return SlabBounds(0.0, 0.0, True)
    d = Point3(gap.x / largest, gap.y / largest, gap.z / largest)  # order: squares of small numbers are none
    size, furthest = np.sqrt(dot(d, d)), max(dot(d, s.p), dot(d, s.q), dot(d, s.r))
    low = max(before.low, (min(dot(d, t.p), dot(d, t.q), dot(d, t.r)) - furthest) / size)
    return SlabBounds(low, largest * size, low > most or low >= _AS_GOOD * largest * size)


@inline
def nearest_points(s: Facet, t: Facet, most: float) -> tuple[Nearest, SlabBounds]:
    """Return nearly nearest points of two disjoint triangles, and bounds on the distance, without the rounding of
    `rounding_bound`. The search ends once the triangles are proven farther apart than `most`; the points are then any
    points of the two."""
    best, across = Nearest(s.p, t.p, 0, 0, np.inf), SlabBounds(-np.inf, np.inf, False)
    for i in range(3):
        for j in range(3):
            candidate = _nearest_on_edges(best, s, i, t, j)
            if candidate.square < best.square:
                best, across = candidate, _bound_by_slab(s, t, candidate, across, most)
                if across.is_done:
                    return best, across
    for turn in range(6):
        k, is_first = turn % 3, turn < 3
        end = corner(s if is_first else t, k)
        is_over, foot = _project_to_triangle(end, t if is_first else s)
        gap = minus(foot, end)
        if is_over and dot(gap, gap) < best.square:
            best = Nearest(end, foot, k, FACE, dot(gap, gap)) if is_first else Nearest(
                foot, end, FACE, k, dot(gap, gap))  # fmt: skip
            across = _bound_by_slab(s, t, best, across, most)
            if across.is_done:
                break
    return best, across


@inline
def relative_to(origin: Point3, s: Facet) -> Facet:
    """Return a triangle with its coordinates relative to an origin."""
    return Facet(minus(s.p, origin), minus(s.q, origin), minus(s.r, origin))


@inline
def rounding_bound(s: Facet, t: Facet) -> float:
    """Return a bound on the rounding error of the distances that `nearest_points` computes; s, t: its input, given
    relative to a point near both."""
    largest = max(largest_of(s.p), largest_of(s.q), largest_of(s.r))
    return _ROUNDING * max(largest, largest_of(t.p), largest_of(t.q), largest_of(t.r)) + _TINY
