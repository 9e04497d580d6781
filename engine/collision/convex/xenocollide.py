"""Do the open interiors of two convex bodies meet, or are they apart? Proposed in float64, believed only when proven.

The bodies have a common point exactly if the set of differences M = {a - b} holds the origin, and common interior
points exactly if the origin is in the open interior of M. From a point of M, a triangle of points of M (the portal)
is moved outward along the half-line to the origin, each corner the farthest of M in some direction.

**Apart** is proven by a direction d in which all of M is below 0: largest d . a < least d . b. The values are those of
all vertices, with d turned into each body's own coordinates: turning d is off by 3u |d|_1 an entry (u = 2^-53, entries
of R at most 1.01), the product with a vertex by 3u more, d . t by 3u |d|_1 |t|, the sums by 3u of the whole: below
16 u |d|_1 (3.1 reach + |t|) for each body, which is less than 1.1 |d|_1 `error`.

**Meeting** is proven by four points of M with the origin strictly inside of their tetrahedron. Each is the difference
of two rounded posed points, of which a coordinate is off by at most `error` = e together, so a determinant |p q r| by
less than e (|p x q|_1 + |p x r|_1 + |q x r|_1) + 18 e^2 m + 6 e^3 where no coordinate exceeds m, and by 2^-50 of six
products at most m^3 for rounding. Bodies with an interior then share an interior point.

What neither proves (contact, or almost) is UNSETTLED and decided elsewhere. Exponents: the caller keeps coordinates
below 2^300 (`pair.py`), so no product of four lengths overflows; a direction or a determinant of at most 2^-900 proves
nothing, so what underflow loses is below the margins.

Source: G. Snethen, XenoCollide: complex collision made simple, Game Programming Gems 7, 2008. Changed: both answers are
certified; a proposal that stalls ends the search.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.collision.codes import UNSETTLED
from engine.collision.convex.body import REACH, ROUND, ConvexArrays, point_of
from engine.collision.meshes.placement import Placement, PoseArrays, as_placement, placed, turned_back
from engine.jit import inline, merged
from engine.predicates.vectors import as_point3, cross, dot, largest_of, length, minus, negative
from engine.types import Point3

APART, MEETING = 0, 1

_FEW = 24
_TURNS = 48
_GUARD = 2.0**-900


class PlacedBody(NamedTuple):
    """One body of a pool and where it stands, and what of the pool concerns it.

    place: its error is twice the bound of `placement.py`, so that it covers the rounding of a difference of two such
    coordinates and of a ball's. round: radius of a ball, 0.0 for others. first, stop: its vertices. outermost: where
    its 8 vertices on the diagonals stand in `graph`.
    """

    place: Placement
    round: float
    first: int
    stop: int
    outermost: int


@merged
def placed_body(pool: ConvexArrays, body: int, poses: PoseArrays, item: int) -> PlacedBody:
    """Return body `body` of the pool under pose `item`."""
    numbers, firsts, shift = pool.numbers, pool.firsts, as_point3(poses.translations, item)
    error = 2.0**-49 * (3.0 * numbers[body, REACH] + largest_of(shift)) + 2.0**-1060
    place = as_placement(poses, item, shift, error)
    return PlacedBody(place, numbers[body, ROUND], firsts[0, body], firsts[0, body + 1], firsts[2, body])


@merged
def farthest(points: Any, graph: Any, f: PlacedBody, local: Point3, hint: int) -> int:
    """Return a vertex about farthest along a local direction: all of few, else uphill from `hint`, -1 for none."""
    if f.stop - f.first <= _FEW:
        best, found = -np.inf, f.first
        for point in range(f.first, f.stop):
            value = dot(point_of(points, point), local)
            if value > best:
                best, found = value, point
        return found
    found = hint
    if found < 0:
        octant = (1 if local.x > 0.0 else 0) + (2 if local.y > 0.0 else 0) + (4 if local.z > 0.0 else 0)
        found = graph[f.outermost + octant]
    best = dot(point_of(points, found), local)
    for _ in range(f.stop - f.first):  # bound: the value grows, so no vertex comes twice
        start = found
        for place in range(graph[start], graph[start + 1]):
            value = dot(point_of(points, graph[place]), local)
            if value > best:
                best, found = value, graph[place]
        if found == start:
            break
    return found


@inline
def largest(points: Any, f: PlacedBody, d: Point3) -> float:
    """Return the largest d . p of all points p of a posed body."""
    local = turned_back(f.place, d)
    best, other = -np.inf, -np.inf
    for point in range(f.first, f.stop - 1, 2):  # two chains: a maximum waits for the one before
        value, second = dot(point_of(points, point), local), dot(point_of(points, point + 1), local)
        best, other = value if value > best else best, second if second > other else other
    best = max(dot(point_of(points, f.stop - 1), local), best, other)
    if f.round > 0.0:
        best += f.round * length(d)
    return best + dot(d, f.place.shift)


@inline
def is_apart_along(points: Any, a: PlacedBody, b: PlacedBody, d: Point3) -> bool:
    """Tell whether all of the first body surely lies below all of the second one along d."""
    size, gap = abs(d.x) + abs(d.y) + abs(d.z), -(largest(points, a, d) + largest(points, b, negative(d)))
    return size > _GUARD and gap > 2.25 * (a.place.error + b.place.error) * size + _GUARD


@inline
def is_around_origin(a: Point3, b: Point3, c: Point3, d: Point3, error: float) -> bool:
    """Tell whether the origin is strictly inside of the tetrahedron of exact points within `error` of these."""
    m = max(largest_of(a), largest_of(b), largest_of(c), largest_of(d))
    bc, ad = cross(b, c), cross(a, d)
    size_ab, size_ac, size_ad = _size(cross(a, b)), _size(cross(a, c)), _size(ad)
    size_bc, size_bd, size_cd = _size(bc), _size(cross(b, d)), _size(cross(c, d))
    e, rest = 1.001 * error, 20.0 * error * error * (m + error) + 2.0**-47 * (m * m * m) + _GUARD
    limit_a, limit_b = e * (size_bc + size_bd + size_cd) + rest, e * (size_ac + size_ad + size_cd) + rest
    limit_c, limit_d = e * (size_ab + size_ad + size_bd) + rest, e * (size_ab + size_ac + size_bc) + rest
    without_a, without_d, without_b, without_c = dot(bc, d), -dot(bc, a), dot(ad, c), -dot(ad, b)
    if without_a > limit_a and without_b > limit_b and without_c > limit_c and without_d > limit_d:
        return True
    return without_a < -limit_a and without_b < -limit_b and without_c < -limit_c and without_d < -limit_d


@merged
def _size(a: Point3) -> float:
    """Return |a|_1."""
    return abs(a.x) + abs(a.y) + abs(a.z)


@inline
def meet_or_apart(points: Any, graph: Any, a: PlacedBody, b: PlacedBody, v0: Point3) -> int:
    """Return APART, MEETING (the open interiors) or UNSETTLED. v0: a point of M, better not one of its symmetry.

    Stages: 0 and 1 find the first two corners, 2 the third, until the half-line from v0 to the origin passes between
    all three; 3 moves the corners outward.
    """
    error, rounding = a.place.error + b.place.error, a.round + b.round
    d, v1, v2, v3 = negative(v0), v0, v0, v0
    i = j = -1
    stage = 0
    for _ in range(_TURNS):
        i = farthest(points, graph, a, turned_back(a.place, d), i)
        j = farthest(points, graph, b, turned_back(b.place, negative(d)), j)
        v = minus(placed(point_of(points, i), a.place), placed(point_of(points, j), b.place))
        if rounding > 0.0:
            scale = rounding / length(d)
            v = Point3(v.x + scale * d.x, v.y + scale * d.y, v.z + scale * d.z)
        height = dot(v, d)
        if not height > 0.0:
            return APART if is_apart_along(points, a, b, d) else UNSETTLED
        if stage == 0:
            v1, d, stage = v, cross(v0, v), 1
            continue
        if stage == 1:
            d, stage = cross(minus(v1, v0), minus(v, v0)), 2
            v2 = v
            if dot(d, v0) > 0.0:
                v1, v2, d = v, v1, negative(d)
            continue
        if stage == 2:
            if dot(cross(v1, v), v0) < 0.0:
                v2 = v
            elif dot(cross(v, v2), v0) < 0.0:
                v1 = v
            else:
                v3, stage = v, 3
            if stage == 2:
                d = cross(minus(v1, v0), minus(v2, v0))
                continue
        else:
            if not height - dot(v1, d) > 4.0 * error * (abs(d.x) + abs(d.y) + abs(d.z)):
                return UNSETTLED  # the portal is on the border of M already, and the origin not beyond it
            side = cross(v, v0)
            if dot(v1, side) > 0.0:
                if dot(v2, side) > 0.0:
                    v1 = v
                else:
                    v3 = v
            elif dot(v3, side) > 0.0:
                v2 = v
            else:
                v1 = v
        d = cross(minus(v2, v1), minus(v3, v1))
        if dot(d, v1) >= 0.0:
            return MEETING if is_around_origin(v0, v1, v2, v3, error) else UNSETTLED
    return UNSETTLED
