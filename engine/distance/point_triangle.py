"""A point and one triangle: bounds on their distance, the nearest feature, and whether the point lies on the triangle.

`point_search.py` says what these are for. Coordinates are relative to the point.

Source: C. Ericson, Real-Time Collision Detection, 2005, 5.1.5 (the closest point of a triangle).
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from engine.collision.meshes.mesh_arrays import MeshArrays, triangle_of
from engine.collision.meshes.near_triangles import FACE
from engine.collision.meshes.triangle_triangle import Facet, corner, projected
from engine.compiling.jit import called, inline
from engine.distance.closed_forms import Wide, Wide3, over, root
from engine.distance.exact_within import between
from engine.distance.refined import View, corners_of
from engine.predicates.error_free import fma, two_diff, two_prod, two_sum
from engine.predicates.orientation import orient2d, orient3d
from engine.predicates.vectors import cross, dot, largest_of, minus
from engine.types import UNDECIDED, Point3

_ROUNDING: Final = 2.0**-47
"""Bound on the rounding of `_measure`, of coordinates below 1: one rounding of each, 12 of a combination of corners,
its length and products with corners, each less than 16 u in all."""
_TINY: Final = 2.0**-1000


class Closest(NamedTuple):
    """The point of a triangle that is nearest to the origin, as floats have it: a combination of the corners with
    weights from 0 to 1, up to rounding. code: of the feature it lies on; inside: how far the weights that are not 0 are
    from 0 and 1, times the denominator of the weights, of a vertex infinite."""

    p: Point3
    code: int
    inside: float


@inline
def _closest(t: Facet) -> Closest:
    u, v, best, least = minus(t.q, t.p), minus(t.r, t.p), Closest(t.p, 0, np.inf), np.inf
    n = cross(u, v)
    nn, a, size = dot(n, n), t.p, max(largest_of(u), largest_of(v))
    if nn > 0.0:
        top, other = dot(cross(v, a), n), dot(cross(a, u), n)
        x, y = top / nn, other / nn
        p = Point3(a.x + x * u.x + y * v.x, a.y + x * u.y + y * v.y, a.z + x * u.z + y * v.z)
        if x >= 0.0 and y >= 0.0 and x + y <= 1.0:
            best, least = Closest(p, FACE, min(top, other, nn - top - other)), dot(p, p)
            if best.inside > 2.0**-44 * size * size:
                return best
    for k in range(3):
        a, b = corner(t, k), corner(t, k + 1)
        u = minus(b, a)
        uu, along = dot(u, u), -dot(a, u)
        x = min(max(along / uu, 0.0), 1.0) if uu > 0.0 else 0.0
        p = b if x == 1.0 else Point3(a.x + x * u.x, a.y + x * u.y, a.z + x * u.z)
        square = dot(p, p)
        if square < least or (k == 0 and best.code != FACE):
            is_end, end = x <= 0.0 or x >= 1.0, k if x <= 0.0 else (k + 1) % 3
            best = Closest(p, end if is_end else 3 + k, np.inf if is_end else min(along, uu - along))
            least = square
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
def _reach(u: Wide3) -> float:
    return max(abs(u.x.h), abs(u.y.h), abs(u.z.h))


@inline
def _product(a: Wide, b: Wide) -> tuple[float, float]:
    """Return a b as its rounded leading part and the rest."""
    p, low = two_prod(a.h, b.h)
    return p, fma(a.h, b.low, fma(a.low, b.h, low))


@inline
def _dot(u: Wide3, v: Wide3) -> Wide:
    """Return u . v within 2^-101 of the sum of the magnitudes S of its products: the rest of one is below 3 u of it,
    and off by 8 u^2; what five terms of 5 u S in all lose in four sums is below 20 u^2 S."""
    (p, p_low), (q, q_low), (r, r_low) = _product(u.x, v.x), _product(u.y, v.y), _product(u.z, v.z)
    p, e = two_sum(p, q)
    p, f = two_sum(p, r)
    return Wide(*two_sum(p, (e + f) + ((p_low + q_low) + r_low)))


@inline
def _turned(a: Wide, b: Wide, c: Wide, d: Wide) -> Wide:
    """Return a b - c d, as precise as `_dot`."""
    (p, p_low), (q, q_low) = _product(a, b), _product(c, d)
    p, e = two_diff(p, q)
    return Wide(*two_sum(p, e + (p_low - q_low)))


@inline
def _cross(u: Wide3, v: Wide3) -> Wide3:
    return Wide3(
        _turned(u.y, v.z, u.z, v.y), _turned(u.z, v.x, u.x, v.z), _turned(u.x, v.y, u.y, v.x)
    )  # fmt: skip


class Levels(NamedTuple):
    """A sum of three numbers: products and their sums rounded, what these leave out, and what that leaves out."""

    first: float
    second: float
    third: float


@inline
def _minor(a: Wide, b: Wide, c: Wide, d: Wide) -> Levels:
    """Return a b - c d."""
    p, p_low = two_prod(a.h, b.h)
    q, q_low = two_prod(c.h, d.h)
    x, x_low = two_prod(a.h, b.low)
    y, y_low = two_prod(a.low, b.h)
    z, z_low = two_prod(c.h, d.low)
    w, w_low = two_prod(c.low, d.h)
    first, e = two_diff(p, q)
    f, f_low = two_diff(p_low, q_low)
    x, e_low = two_sum(x, y)
    z, g_low = two_sum(z, w)
    f, h_low = two_sum(f, e)
    x, k_low = two_diff(x, z)
    second, m_low = two_sum(f, x)
    third = (f_low + e_low - g_low) + (h_low + k_low + m_low) + (x_low + y_low - z_low - w_low)
    return Levels(first, second, third + (a.low * b.low - c.low * d.low))


@inline
def _scaled(z: Wide, m: Levels) -> tuple[float, float, Levels]:
    """Return z m as two numbers more, of the size of the second of its levels."""
    first, first_low = two_prod(m.first, z.h)
    x, x_low = two_prod(m.second, z.h)
    y, y_low = two_prod(m.first, z.low)
    return first_low, y, Levels(first, x, (x_low + y_low) + (m.third * z.h + m.second * z.low))


@called
def _determinant(t: Facet) -> tuple[Wide, float]:
    """Return the determinant of the corners of a triangle, below 2, and a bound on its error. With M the sum of the
    magnitudes of its six products: second levels sum up to 10 u M, third ones, and what sums of second ones leave out,
    to 150 u^2 M, which some 30 roundings move by less than 2^13 u^3 M; `_TINY` is far above what underflows."""
    a, b, c = t.p, t.q, t.r
    bc, ca, ab = _minor(b.x, c.y, b.y, c.x), _minor(c.x, a.y, c.y, a.x), _minor(a.x, b.y, a.y, b.x)
    terms = abs(a.z.h) * (abs(b.x.h * c.y.h) + abs(b.y.h * c.x.h)) + abs(b.z.h) * (
        abs(c.x.h * a.y.h) + abs(c.y.h * a.x.h)
    )
    terms += abs(c.z.h) * (abs(a.x.h * b.y.h) + abs(a.y.h * b.x.h))
    (i, j, p), (k, m, q), (n, o, r) = _scaled(a.z, bc), _scaled(b.z, ca), _scaled(c.z, ab)
    first, e = two_sum(p.first, q.first)
    first, f = two_sum(first, r.first)
    i, i_low = two_sum(i, j)
    k, k_low = two_sum(k, m)
    n, n_low = two_sum(n, o)
    e, e_low = two_sum(e, f)
    x, x_low = two_sum(p.second, q.second)
    i, j_low = two_sum(i, k)
    n, m_low = two_sum(n, r.second)
    x, y_low = two_sum(x, e)
    i, o_low = two_sum(i, n)
    second, z_low = two_sum(i, x)
    third = (i_low + k_low + n_low + e_low) + (x_low + j_low + m_low) + (y_low + o_low + z_low)
    third += p.third + q.third + r.third
    h, low = two_sum(first, second)
    h, low = two_sum(h, low + third)
    return Wide(h, low), 2.0**-145 * terms + 2.0**-104 * abs(h) + _TINY


@called
def distance_to(t: Facet, q: Point3, code: int) -> tuple[Wide, float]:
    """Return the distance of the vertex, or of the line or plane of an edge or a face, of a triangle from a point, and
    a bound on its error: |a|, |a x e| / |e|, |a . n| / |n|, a being exact from the point to a corner.

    With A, U, V the longest coordinates of a and of the edges: a component of a product of two vectors is off by less
    than 2^-100 of the product of these, a . n by 2^-97 A U V; a length of 3 such components by 2^-98 U V, and with
    its rounding, root and quotient by 2^-99 of itself more. Where that would decide too little, below a millionth of
    A U V, a . n is the determinant in three levels."""
    corner_, other = corner(t, code % 3), corner(t, code % 3 + 1)
    a = between(q, corner_)
    if code < 3:
        size = root(_dot(a, a))
        return size, 2.0**-99 * size.h
    u, reach = between(corner_, other), _reach(a)
    if code < FACE:
        normal, size = _cross(a, u), root(_dot(u, u))
        distance = over(root(_dot(normal, normal)), size)
        return distance, 2.0**-97 * reach * _reach(u) / size.h + 2.0**-97 * distance.h
    v = between(t.p, t.r)
    normal, lengths = _cross(u, v), _reach(u) * _reach(v)
    size = root(_dot(normal, normal))
    rough = a.x.h * normal.x.h + a.y.h * normal.y.h + a.z.h * normal.z.h
    if abs(rough) < 2.0**-20 * reach * lengths:
        height, error = _determinant(Facet(a, between(q, t.q), between(q, t.r)))
    else:
        height, error = _dot(a, normal), 2.0**-97 * reach * lengths
    distance = over(height, size)
    distance = distance if distance.h >= 0.0 else Wide(-distance.h, -distance.low)
    return distance, 1.01 * error / size.h + distance.h * 2.0**-97 * (lengths / size.h + 1.0)
