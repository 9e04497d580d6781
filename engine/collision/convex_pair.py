"""Narrow phase of convex pairs in batches: bounding balls, then Minkowski portal refinement, then face planes for
inside.

Everything is float64 with a proven margin; pairs that no margin proves, contacts above all, stay UNSETTLED for the
exact path. e = e_a + e_b is the sum of the errors of both bodies (`PlacedBody`), a bound on the error of a coordinate
of a - b.

**Inside.** The first lies in the open interior of the second if every vertex is strictly below each face of the second
(`_classify_in_hull`).

**Meeting or apart** is proposed in float64 and accepted only if proven. The bodies have a common point exactly if the
set of differences M = {a - b} contains the origin, and common interior points exactly if the origin is in the open
interior of M. From a point of M a triangle of points farthest in some direction, the portal, moves outward to the
origin.

**Apart** is proven by a direction d in which all of M is below 0: largest d . a < least d . b (`is_separating_axis`).

**Meeting** is proven by four points of M with the origin strictly inside of their tetrahedron
(`tetrahedron_contains_origin`). Bodies with an interior then share an interior point.

Exponents: caller guarantees coordinates below 2^300 (`LARGEST_ERROR`), so no product of four lengths overflows; a
direction or a determinant of at most 2^-900 proves nothing, so what underflow loses is below the margins.

Source: G. Snethen, XenoCollide: complex collision made simple, Game Programming Gems 7, 2008; both answers certified.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, UNSETTLED
from engine.collision.convex_body import ASIDE, CENTER, RADIUS, REACH, ROUND, ConvexArrays, point_of
from engine.collision.meshes.placement import Placement, PoseArrays, as_placement, placed, rotate, rotate_back
from engine.compiling.jit import inline, merged
from engine.predicates.vectors import as_point3, cross, dot, largest_of, length, minus, negative
from engine.types import UNDECIDED, FloatArray, Point3

_OUT, _WITHIN = 0, 1
LARGEST_ERROR = 2.0**250
"""Bound on the error of placed bodies: reached where coordinates are about 2^299; products of four lengths stay finite.
"""


@inline
def relate_convex(
    pool: ConvexArrays, first: int, second: int, a: PlacedBody, b: PlacedBody, is_boolean: bool, may_be_equal: bool
) -> int:
    """Return the relation code of two placed convex bodies if floats prove it, else UNSETTLED (always for a contact).
    first, second: their indices in the pool; a, b: the same bodies, placed.

    is_boolean: common interior points give OVERLAPPING, even if a body contains the other (but for two balls).
    may_be_equal: equal bodies need not be distinguished from others that overlap, so two overlapping balls of one
    radius are OVERLAPPING, whatever their centres."""
    error = a.place.error + b.place.error
    if not error < LARGEST_ERROR:
        return UNSETTLED
    start = minus(interior_point(pool.numbers, first, a, CENTER), interior_point(pool.numbers, second, b, ASIDE))
    square = dot(start, start)
    first_radius, second_radius = pool.numbers[first, RADIUS], pool.numbers[second, RADIUS]
    if exceeds_distance(square, first_radius + second_radius, error):
        return DISJOINT
    if a.round > 0.0 and b.round > 0.0:
        return _relate_balls(np.sqrt(square), a.round, b.round, error, may_be_equal)
    outcome = refine_portal(a, b, start)
    if outcome == APART:
        return DISJOINT
    if outcome != MEETING:
        return UNSETTLED
    return OVERLAPPING if is_boolean else relation_of_intersecting(pool, first, second, a, b, square)


@inline
def relation_of_intersecting(
    pool: ConvexArrays, first: int, second: int, a: PlacedBody, b: PlacedBody, square: float
) -> int:
    """Return the relation code of two placed bodies whose open interiors intersect: one inside the other, OVERLAPPING,
    or UNSETTLED if unproven. first, second: indices in the pool; square: squared distance between an interior point of
    the first and one of the second."""
    error = a.place.error + b.place.error
    first_lies = second_lies = _OUT
    if not exceeds_distance(square, pool.numbers[second, RADIUS], error):
        first_lies = _classify_in_hull(pool, first, second, a, b, square)
    if first_lies == _WITHIN:
        return FIRST_INSIDE_SECOND
    if not exceeds_distance(square, pool.numbers[first, RADIUS], error):
        second_lies = _classify_in_hull(pool, second, first, b, a, square)
    if second_lies == _WITHIN:
        return SECOND_INSIDE_FIRST
    return OVERLAPPING if first_lies == _OUT and second_lies == _OUT else UNSETTLED


@inline
def _relate_balls(distance: float, first_radius: float, second_radius: float, error: float, may_be_equal: bool) -> int:
    """Return the relation code of two balls from the computed distance of their centres; UNSETTLED if `slack` may
    change it. error: bound e on a coordinate of the difference of the centres; the distance is then off by sqrt(3) e
    and a few u of itself. may_be_equal: balls of one radius that overlap are OVERLAPPING, even if they may be equal.

        slack = 2^-40 (distance + radii) + 8 e + 2^-400
    """
    both = first_radius + second_radius
    slack = 2.0**-40 * (distance + both) + 8.0 * error + 2.0**-400
    if distance > both + slack:
        return DISJOINT
    if distance < second_radius - first_radius - slack:
        return FIRST_INSIDE_SECOND
    if distance < first_radius - second_radius - slack:
        return SECOND_INSIDE_FIRST
    if may_be_equal and first_radius == second_radius and distance < both - slack:
        return OVERLAPPING  # neither lies within the other
    return OVERLAPPING if abs(first_radius - second_radius) + slack < distance < both - slack else UNSETTLED


@merged
def interior_point(numbers: FloatArray, body: int, f: PlacedBody, which: int) -> Point3:
    """Return an interior point of body `body` of the pool under its placement f, rounded. which: CENTER, or ASIDE (off
    the body's symmetries), the first of its three columns in `numbers`."""
    return placed(Point3(numbers[body, which], numbers[body, which + 1], numbers[body, which + 2]), f.place)


@merged
def exceeds_distance(square: float, distance: float, error: float) -> bool:
    """Return whether two placed points p, q are proven to be farther apart than `distance`, a length of a body before
    its pose. square: |p - q|^2 as computed; error: bound on a coordinate of p - q. A pose stretches lengths by up to 1
    + 1.5e-12 < 1 + 2^-30."""
    limit = distance * (1.0 + 2.0**-30) + 8.0 * error
    return square > limit * limit + 2.0**-900


@inline
def _classify_in_hull(pool: ConvexArrays, inner: int, outer: int, a: PlacedBody, b: PlacedBody, square: float) -> int:
    """Return whether body `inner` of the pool, placed by a, lies in the open interior of body `outer`, placed by b:
    _WITHIN, _OUT (some point does not) or UNDECIDED. square: squared distance between an interior point of each.

    For each face of `outer`, with its unit normal n (off by e_n) and a corner p:

        height = max n . a - n . p,    |a - p| <= extent = sqrt(square) + both radii
        |height - exact| <= (e_n + 3e-12) |a - p| + 1.75 (e_a + e_b) + rounding     3e-12: |R - R^-T| <= 3 TOLERANCE
                         <  slack = (e_n + 1e-11) extent + 8 (e_a + e_b)
    """
    error = 8.0 * (a.place.error + b.place.error)
    first, stop = pool.firsts[1, outer], pool.firsts[1, outer + 1]
    if first == stop:
        return _classify_in_ball(a, interior_point(pool.numbers, outer, b, CENTER), b.round, error)
    extent, result = np.sqrt(square) + pool.numbers[inner, RADIUS] + pool.numbers[outer, RADIUS], _WITHIN
    for face in range(first, stop):
        n = rotate(b.place, point_of(pool.normals, face))
        level = dot(n, placed(point_of(pool.points, pool.triangles[face, 0]), b.place))
        height, slack = support_value(a, n) - level, extent * (1e-11 + pool.normals[3, face]) + error
        if height > slack:
            return _OUT
        if not height < -slack:
            result = UNDECIDED
    return result


@inline
def _classify_in_ball(a: PlacedBody, center: Point3, radius: float, error: float) -> int:
    """Return whether placed body `a` lies in an open ball, by its point farthest from the centre: _WITHIN, _OUT or
    UNDECIDED. error: bound on the error of a distance from the centre."""
    most = 0.0
    for point in range(a.first, a.stop):
        v = minus(placed(point_of(a.points, point), a.place), center)
        most = max(most, dot(v, v))
    reach = np.sqrt(most) + a.round
    slack = 2.0**-40 * (reach + radius) + error + 2.0**-400
    return _OUT if reach > radius + slack else (_WITHIN if reach < radius - slack else UNDECIDED)


APART, MEETING = 0, 1

_TURNS = 48
_GUARD = 2.0**-900


class PlacedBody(NamedTuple):
    """A body of the pool under a pose.

    | field | meaning |
    |---|---|
    | points | (3, n): vertices of the pool |
    | place | its `Placement`; `error` is twice the bound of `meshes/placement.py`: for a difference of coordinates |
    | round | radius of a ball, 0.0 for other bodies |
    | first, stop | range of its vertices in the pool |
    """

    points: FloatArray
    place: Placement
    round: float
    first: int
    stop: int


@merged
def placed_body(pool: ConvexArrays, body: int, poses: PoseArrays, item: int) -> PlacedBody:
    """Return body `body` of the pool under pose `item`."""
    numbers, firsts, shift = pool.numbers, pool.firsts, as_point3(poses.translations, item)
    error = 2.0**-49 * (3.0 * numbers[body, REACH] + largest_of(shift)) + 2.0**-1060
    place = as_placement(poses, item, shift, error)
    return PlacedBody(pool.points, place, numbers[body, ROUND], firsts[0, body], firsts[0, body + 1])


@merged
def support_vertex(f: PlacedBody, local: Point3) -> int:
    """Return the index in the pool of a vertex of body f farthest, up to rounding, along `local`, a direction in the
    body's own coordinates (support mapping)."""
    best, support = -np.inf, f.first
    for point in range(f.first, f.stop):
        value = dot(point_of(f.points, point), local)
        if value > best:
            best, support = value, point
    return support


@inline
def support_value(f: PlacedBody, d: Point3) -> float:
    """Return max d . p over all points p of a placed body, its radius included, rounded (support function)."""
    local = rotate_back(f.place, d)
    best, other = -np.inf, -np.inf
    for point in range(f.first, f.stop - 1, 2):  # two chains: a maximum waits for the one before
        value, second = dot(point_of(f.points, point), local), dot(point_of(f.points, point + 1), local)
        best, other = value if value > best else best, second if second > other else other
    best = max(dot(point_of(f.points, f.stop - 1), local), best, other)
    if f.round > 0.0:
        best += f.round * length(d)
    return best + dot(d, f.place.shift)


@inline
def is_separating_axis(a: PlacedBody, b: PlacedBody, d: Point3) -> bool:
    """Return whether largest d . a < least d . b is proven: placed body a lies below b along direction d (separating
    axis).

    u = 2^-53, |.|_1 the sum of |components|, `reach` the largest coordinate and t the translation of one body. Errors
    of its support value, each divided by |d|_1:

        R'd  3 u an entry, entries <= 1.01     9.1 u reach        d . t      3 u |t|
        (R'd) . vertex                         5.3 u reach        last sum   u (1.75 reach + |t|)
        together 16.2 u reach + 4 u |t|  <  1.1 * 16 u (3 reach + |t|) = 1.1 error
        gap > 2.25 (e_a + e_b) |d|_1 proves the sign, with room for its own rounding
    """
    size, gap = abs(d.x) + abs(d.y) + abs(d.z), -(support_value(a, d) + support_value(b, negative(d)))
    return size > _GUARD and gap > 2.25 * (a.place.error + b.place.error) * size + _GUARD


@inline
def tetrahedron_contains_origin(a: Point3, b: Point3, c: Point3, d: Point3, error: float) -> bool:
    """Return whether the origin is proven strictly inside the tetrahedron abcd, whose corners are known to +- e =
    `error` in each coordinate.

    The determinant |p q r| of the corners of each face must exceed its limit; m: the largest coordinate:

        |det - exact| <= e (|p x q|_1 + |p x r|_1 + |q x r|_1) + 18 e^2 m + 6 e^3     corners off by e
                         + 2^-50 * 6 m^3 = 48 u m^3                                   rounding
        limit = 1.001 e (same sum) + 20 e^2 (m + e) + 2^-47 m^3 + 2^-900              2^-47 = 64 u
    """
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
    """Return the 1-norm |a.x| + |a.y| + |a.z|."""
    return abs(a.x) + abs(a.y) + abs(a.z)


@inline
def refine_portal(a: PlacedBody, b: PlacedBody, v0: Point3) -> int:
    """Minkowski portal refinement (XenoCollide): return APART (proven disjoint), MEETING (proven: the open interiors
    intersect) or UNSETTLED, for bodies placed by a and b. v0: a point of the interior of the Minkowski difference {a -
    b}, off its symmetries. The portal is a triangle v1 v2 v3 of points of the difference that the ray from v0 through
    the origin passes: stages 0 and 1 choose two of its corners, 2 a third, 3 moves the portal outward until the origin
    is behind it or provably beyond the difference."""
    error, rounding = a.place.error + b.place.error, a.round + b.round
    d, v1, v2, v3 = negative(v0), v0, v0, v0
    stage = 0
    for _ in range(_TURNS):
        i = support_vertex(a, rotate_back(a.place, d))
        j = support_vertex(b, rotate_back(b.place, negative(d)))
        v = minus(placed(point_of(a.points, i), a.place), placed(point_of(b.points, j), b.place))
        if rounding > 0.0:
            scale = rounding / length(d)
            v = Point3(v.x + scale * d.x, v.y + scale * d.y, v.z + scale * d.z)
        height = dot(v, d)
        if not height > 0.0:
            return APART if is_separating_axis(a, b, d) else UNSETTLED
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
            return MEETING if tetrahedron_contains_origin(v0, v1, v2, v3, error) else UNSETTLED
    return UNSETTLED
