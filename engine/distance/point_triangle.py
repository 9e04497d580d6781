"""A point and one triangle: bounds on their distance, the nearest feature, and whether the point lies on the triangle.

`point_search.py` says what these are for. Coordinates are relative to the point.

Source: C. Ericson, Real-Time Collision Detection, 2005, 5.1.5 (the closest point of a triangle).
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from engine.collision.meshes.mesh_arrays import MeshArrays, triangle_of
from engine.collision.meshes.near_triangles import FACE
from engine.collision.meshes.triangle_triangle import Facet, corner, projected
from engine.compiling.jit import called, inline
from engine.distance.closed_forms import Wide, Wide3, dot3, less, less3, over, root, times
from engine.distance.refined import View, corners_of
from engine.predicates.error_free import is_correctly_rounded, two_diff, workspace
from engine.predicates.expansion import add_scaled, compress
from engine.predicates.orientation import orient2d, orient3d
from engine.predicates.parameters import minor
from engine.predicates.vectors import cross, dot, largest_of, minus
from engine.types import UNDECIDED, Point3

_ROUNDING: Final = 2.0**-47
"""Bound on the rounding of `_measure`, of coordinates below 1: one rounding of each, 12 of a combination of corners,
its length and products with corners, each less than 16 u in all."""
_SMALLEST: Final = 2.0**-300
"""Least magnitude whose products of three are exact with tails."""


class Closest(NamedTuple):
    """The point of a triangle that is nearest to the origin, as floats have it: a combination of the corners with
    weights from 0 to 1, up to rounding. code: of the feature it lies on; inside: how far the weights that are not 0 are
    from 0 and 1, times the denominator of the weights, of a vertex infinite."""

    p: Point3
    code: int
    inside: float


@inline
def _closest(t: Facet) -> Closest:
    best, least = Closest(t.p, 0, np.inf), np.inf
    for k in range(3):
        a, b = corner(t, k), corner(t, k + 1)
        u = minus(b, a)
        uu, along = dot(u, u), -dot(a, u)
        x = min(max(along / uu, 0.0), 1.0) if uu > 0.0 else 0.0
        p = b if x == 1.0 else Point3(a.x + x * u.x, a.y + x * u.y, a.z + x * u.z)
        square = dot(p, p)
        if square < least:
            is_end, end = x <= 0.0 or x >= 1.0, k if x <= 0.0 else (k + 1) % 3
            best = Closest(p, end if is_end else 3 + k, np.inf if is_end else min(along, uu - along))
            least = square
    u, v = minus(t.q, t.p), minus(t.r, t.p)
    n = cross(u, v)
    nn, a = dot(n, n), t.p
    if nn > 0.0:
        top, other = dot(cross(v, a), n), dot(cross(a, u), n)
        x, y = top / nn, other / nn
        p = Point3(a.x + x * u.x + y * v.x, a.y + x * u.y + y * v.y, a.z + x * u.z + y * v.z)
        if x >= 0.0 and y >= 0.0 and x + y <= 1.0 and dot(p, p) < least:
            best = Closest(p, FACE, min(top, other, nn - top - other))
    return best


@inline
def _is_certain(t: Facet, closest: Closest) -> bool:
    """Return whether the feature is proven to be that of the exact nearest point. With coordinates below 1, edges E at
    most, and u = 2^-53, an edge is off by 3 u, and

    | quantity | error | allowed |
    |---|---|---|
    | a face's `inside`: three products, of E^2 and E | 160 u E^2 | 2^-44 E^2 |
    | an edge's `inside`: of two vectors, below 1 and E | 20 u | 2^-47 |
    | p . (c - p), p a vertex | 20 u | 2^-47 |
    | the same, p on an edge, off by 20 u / E along it | 80 u / E + 20 u | 2^-44 / E |

    All corners c beyond the plane at p across p, but those of the feature: no point of the triangle is as near."""
    p, code = closest.p, closest.code
    if code == FACE:
        u, v = minus(t.q, t.p), minus(t.r, t.p)
        size = max(largest_of(u), largest_of(v))
        return closest.inside > 2.0**-44 * size * size
    margin = 2.0**-47
    if code >= 3:
        margin = 2.0**-44 / min(largest_of(minus(corner(t, code - 2), corner(t, code - 3))), 1.0)
    is_certain = closest.inside > 2.0**-47
    for k in range(3):
        if k == code % 3 or (code >= 3 and k == (code + 1) % 3):
            continue
        is_certain = is_certain and dot(p, minus(corner(t, k), p)) > margin
    return is_certain


@called
def measure(t: Facet) -> tuple[float, float, int, bool]:
    """Return a lower and an upper bound on the distance of a triangle from the origin, the code of the feature that is
    probably the nearest, and whether it certainly is."""
    largest = max(largest_of(t.p), largest_of(t.q), largest_of(t.r))
    if largest == 0.0:
        return 0.0, 0.0, 0, False
    unit = math.ldexp(1.0, min(-math.frexp(largest)[1], 1000))
    s = Facet(
        Point3(t.p.x * unit, t.p.y * unit, t.p.z * unit),
        Point3(t.q.x * unit, t.q.y * unit, t.q.z * unit),
        Point3(t.r.x * unit, t.r.y * unit, t.r.z * unit),
    )
    closest = _closest(s)
    p = closest.p
    size = np.sqrt(dot(p, p))
    low = min(dot(p, s.p), dot(p, s.q), dot(p, s.r)) / size - _ROUNDING if size > 0.0 else 0.0
    return max(low, 0.0) / unit, (size + _ROUNDING) / unit, closest.code, _is_certain(s, closest)


@inline
def _is_on_edge(a: Point3, b: Point3, q: Point3) -> int:
    """Return 1 if q lies on the closed segment a b, 0 if not, or UNDECIDED."""
    if not (
        min(a.x, b.x) <= q.x <= max(a.x, b.x)
        and min(a.y, b.y) <= q.y <= max(a.y, b.y)
        and min(a.z, b.z) <= q.z <= max(a.z, b.z)
    ):
        return 0
    result = 1
    for axis in range(3):
        side = orient2d(projected(a, axis), projected(b, axis), projected(q, axis))
        if side == UNDECIDED:
            result = UNDECIDED
        elif side != 0:
            return 0
    return result


_NOWHERE: Final = -1
UNSURE: Final = -2


@called
def feature_under(mesh: MeshArrays, item: int, q: Point3) -> int:
    """Return the code of the feature of a triangle that a point lies on, _NOWHERE off it, or UNSURE; exact."""
    t, axis = triangle_of(mesh, item), mesh.axis[item]
    for k in range(3):
        p = corner(t, k)
        if p.x == q.x and p.y == q.y and p.z == q.z:
            return k
    is_unsure = axis < -1  # UNKNOWN_AXIS
    for k in range(3):
        on = _is_on_edge(corner(t, k), corner(t, k + 1), q)
        if on == 1:
            return 3 + k
        is_unsure = is_unsure or on == UNDECIDED
    if axis < 0 or is_unsure:
        return UNSURE if is_unsure else _NOWHERE
    side = orient3d(t.p, t.q, t.r, q)
    if side != 0:
        return UNSURE if side == UNDECIDED else _NOWHERE
    at, turn = projected(q, axis), orient2d(projected(t.p, axis), projected(t.q, axis), projected(t.r, axis))
    for k in range(3):
        side = orient2d(projected(corner(t, k), axis), projected(corner(t, k + 1), axis), at)
        if side == UNDECIDED:
            return UNSURE
        if side != turn:
            return _NOWHERE
    return FACE


@inline
def seen_from(view: View, item: int, q: Point3) -> Facet:
    """Return the corners of a triangle relative to a point, in double-doubles, times the unit of the view."""
    t, unit = triangle_of(view.mesh, item), view.unit
    if view.place.is_posed:
        move = view.place.shift
        shift = Wide3(
            Wide(*two_diff(move.x * unit, q.x * unit)), Wide(*two_diff(move.y * unit, q.y * unit)),
            Wide(*two_diff(move.z * unit, q.z * unit)),
        )  # fmt: skip
        return corners_of(view, item, shift)
    x, y, z = q.x * unit, q.y * unit, q.z * unit
    return Facet(
        Wide3(Wide(*two_diff(t.p.x * unit, x)), Wide(*two_diff(t.p.y * unit, y)), Wide(*two_diff(t.p.z * unit, z))),
        Wide3(Wide(*two_diff(t.q.x * unit, x)), Wide(*two_diff(t.q.y * unit, y)), Wide(*two_diff(t.q.z * unit, z))),
        Wide3(Wide(*two_diff(t.r.x * unit, x)), Wide(*two_diff(t.r.y * unit, y)), Wide(*two_diff(t.r.z * unit, z))),
    )


@inline
def _add_minor(e: Any, n: int, m: Any, z: Wide, a: tuple[Wide, Wide], b: tuple[Wide, Wide]) -> int:
    """Add z times the determinant of two rows to the expansion e of n components; return the new length."""
    size = minor(m, a[0].h, a[0].low, a[1].h, a[1].low, b[0].h, b[0].low, b[1].h, b[1].low)
    return add_scaled(e, add_scaled(e, n, m, size, z.low), m, size, z.h)


@inline
def _reach(u: Wide3) -> float:
    return max(abs(u.x.h), abs(u.y.h), abs(u.z.h))


@inline
def _cross3(u: Wide3, v: Wide3) -> Wide3:
    return Wide3(
        less(times(u.y, v.z), times(u.z, v.y)), less(times(u.z, v.x), times(u.x, v.z)),
        less(times(u.x, v.y), times(u.y, v.x)),
    )  # fmt: skip


@called
def _determinant(t: Facet) -> Wide:
    """Return |det| of the corners of a triangle, computed exactly, then rounded to 2^-104 of itself; 0 if out of
    range."""
    for k in range(3):
        p = corner(t, k)
        for x in (p.x, p.y, p.z):
            if (x.h != 0.0 and abs(x.h) < _SMALLEST) or (x.low != 0.0 and abs(x.low) < _SMALLEST):
                return Wide(0.0, 0.0)
    e, m = workspace(192), workspace(16)
    n = _add_minor(e, 0, m, t.p.z, (t.q.x, t.q.y), (t.r.x, t.r.y))
    n = _add_minor(e, n, m, t.q.z, (t.r.x, t.r.y), (t.p.x, t.p.y))
    n = compress(e, _add_minor(e, n, m, t.r.z, (t.p.x, t.p.y), (t.q.x, t.q.y)))
    det = Wide(e[n - 1] if n > 0 else 0.0, e[n - 2] if n > 1 else 0.0)
    return det if det.h >= 0.0 else Wide(-det.h, -det.low)


@called
def distance_to(t: Facet, code: int) -> tuple[Wide, float]:
    """Return the distance of the vertex, or of the line or plane of an edge or a face, of a triangle from the origin,
    and a bound on its error: |a|, |a x e| / |e|, |a . n| / |n|. With A, U, V the longest coordinates of a and of the
    edges: a component of a product of two vectors is off by less than 2^-101 of the product of these; the length of
    one, root and quotient together by 2^-99 of itself. What 2^-98 A U V / |n| does not decide, the exact determinant
    does."""
    a = corner(t, code % 3)
    if code < 3:
        size = root(dot3(a, a))
        return size, 2.0**-99 * size.h
    u = less3(corner(t, code % 3 + 1), a)
    if code < FACE:
        normal, size = _cross3(a, u), root(dot3(u, u))
        distance = over(root(dot3(normal, normal)), size)
        return distance, 2.0**-98 * _reach(a) * _reach(u) / size.h + 2.0**-98 * distance.h
    v = less3(t.r, a)
    normal, lengths = _cross3(u, v), _reach(u) * _reach(v)
    size = root(dot3(normal, normal))
    distance, share = over(dot3(a, normal), size), 2.0**-98 * (lengths / size.h + 1.0)
    distance = distance if distance.h >= 0.0 else Wide(-distance.h, -distance.low)
    error = _reach(a) * share + distance.h * share
    if not is_correctly_rounded(distance.h, distance.low, error):
        distance = over(_determinant(t), size)
        error = distance.h * share if distance.h > 0.0 else np.inf
    return distance, error
