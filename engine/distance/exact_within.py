"""Whether a triangle is within a distance of a point, exact by expansions: where the distance in double-doubles does
not tell, which is where it is the limit.

With A from the point to a corner, U an edge and N = U x V of the triangle, exact pairs of doubles and expansions,

    a corner                               A . A <= d^2
    an edge, if A . U <= 0 <= B . U        |A x U|^2 <= d^2 U . U
    the plane, if N . (A x B) >= 0         (A . N)^2 <= d^2 N . N
               for all three edges

are signs of polynomials of degree 6 at most. Of coordinates that are zero or within `_LEAST` .. 1 all terms are
multiples of 2^-918, far above what underflows. Numbers of more components than there is room for are UNDECIDED.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.collision.meshes.mesh_arrays import triangle_of
from engine.collision.meshes.near_triangles import FACE
from engine.collision.meshes.triangle_triangle import Facet, corner
from engine.compiling.jit import called, inline
from engine.distance.closed_forms import Wide, Wide3, less
from engine.distance.refined import Candidates, View, scaled
from engine.predicates.error_free import two_diff, workspace
from engine.predicates.expansion import Components, add_product, add_scaled, compress, grow_product, scale, sign
from engine.predicates.parameters import minor
from engine.types import UNDECIDED, Point3

_LEAST: Final = 2.0**-100
_MOST_EXACT: Final = 32
"""Most candidates that are compared with a limit by expansions."""
_MOST: Final = 8
"""Most components of a number that is squared; sizes of workspaces follow."""


@inline
def between(a: Point3, b: Point3) -> Wide3:
    """Return b - a, exact."""
    return Wide3(Wide(*two_diff(b.x, a.x)), Wide(*two_diff(b.y, a.y)), Wide(*two_diff(b.z, a.z)))


@inline
def _is_usable(p: Point3) -> bool:
    is_usable = True
    for x in p:
        is_usable &= x == 0.0 or _LEAST <= abs(x) <= 1.0
    return is_usable


@called
def _set_dot(e: Components, u: Wide3, v: Wide3) -> int:
    """Set e (24 places) to u . v; return its length."""
    n = 0
    for k in range(3):
        for x in u[k]:
            for y in v[k]:
                if x != 0.0 and y != 0.0:
                    n = grow_product(e, n, x, y)
    return compress(e, n)


@inline
def _set_cross(e: Components, u: Wide3, v: Wide3, k: int) -> int:
    """Set e (16 places) to component k of u x v; return its length."""
    a, b, c, d = u[(k + 1) % 3], u[(k + 2) % 3], v[(k + 1) % 3], v[(k + 2) % 3]
    return compress(e, minor(e, a.h, a.low, b.h, b.low, c.h, c.low, d.h, d.low))


@called
def _compared(e: Components, n: int, square: Components, m: int, limit: float) -> int:
    """Return the sign of e - limit^2 square; e: room for 64 more. UNDECIDED if there are too many components."""
    m = compress(square, m)
    if m > 2 * _MOST:
        return UNDECIDED
    scaled = workspace(32)
    return sign(e, add_scaled(e, n, scaled, scale(square, m, limit, scaled), -limit))


@called
def _corner_side(a: Wide3, limit: float) -> int:
    """Return the sign of the distance of a corner less the limit."""
    e, one = workspace(88), workspace(1)
    one[0] = 1.0
    return _compared(e, _set_dot(e, a, a), one, 1, limit)


@called
def _edge_side(a: Wide3, u: Wide3, limit: float) -> int:
    """Return the sign of the distance of an edge's line less the limit; 1 without length."""
    e, m, n = workspace(448), workspace(24), 0
    for k in range(3):
        length = _set_cross(m, a, u, k)
        if length > _MOST:
            return UNDECIDED
        n = add_product(e, n, m, length, m, length)
    length = _set_dot(m, u, u)
    return _compared(e, n, m, length, limit) if length > 0 else 1


@called
def _plane_side(a: Wide3, b: Wide3, c: Wide3, u: Wide3, v: Wide3, limit: float, is_inside: bool) -> int:
    """Return the sign of the distance of a plane less the limit; 1 if the foot is not in the triangle, unless is_inside
    says that it is, or the triangle has no area. a, b, c: its corners, u, v: two edges from the first."""
    x, y, z, height, square = workspace(16), workspace(16), workspace(16), workspace(96), workspace(384)
    i, j, k = _set_cross(x, u, v, 0), _set_cross(y, u, v, 1), _set_cross(z, u, v, 2)
    if max(i, j, k) > _MOST:
        return UNDECIDED
    if max(i, j, k) == 0:
        return 1
    m, around, n = workspace(16), workspace(384), 0
    for side in range(0 if is_inside else 3):
        start, end = (a, b) if side == 0 else (b, c) if side == 1 else (c, a)
        p = _set_cross(m, start, end, 0)
        n = 0 if p > _MOST else add_product(around, 0, m, p, x, i)
        q = _set_cross(m, start, end, 1)
        n = 0 if q > _MOST else add_product(around, n, m, q, y, j)
        r = _set_cross(m, start, end, 2)
        n = 0 if r > _MOST else add_product(around, n, m, r, z, k)
        if max(p, q, r) > _MOST:
            return UNDECIDED
        if sign(around, n) < 0:
            return 1
    n = add_scaled(height, add_scaled(height, 0, x, i, a.x.h), x, i, a.x.low)
    n = add_scaled(height, add_scaled(height, n, y, j, a.y.h), y, j, a.y.low)
    n = compress(height, add_scaled(height, add_scaled(height, n, z, k, a.z.h), z, k, a.z.low))
    if n > _MOST:
        return UNDECIDED
    e = workspace(192)
    n_square = add_product(square, add_product(square, add_product(square, 0, x, i, x, i), y, j, y, j), z, k, z, k)
    return _compared(e, add_product(e, 0, height, n, height, n), square, n_square, limit)


@called
def _side_of_limit(t: Facet, q: Point3, code: int, is_certain: bool, limit: float) -> int:
    """Return 1 if a triangle is farther from a point than the limit, -1 if not, or UNDECIDED. Coordinates are below 1.
    code: the feature that is the nearest, if is_certain; else all are tried."""
    if not (_is_usable(t.p) and _is_usable(t.q) and _is_usable(t.r) and _is_usable(q) and _LEAST <= limit <= 2.0):
        return UNDECIDED
    a, b, c = between(q, t.p), between(q, t.q), between(q, t.r)
    least, is_unsure, m = 1, False, workspace(24)
    for feature in range(FACE + 1):
        if is_certain and feature != code:
            continue
        if feature < 3:
            side = _corner_side(a if feature == 0 else b if feature == 1 else c, limit)
        elif feature < FACE:
            start, end = (a, b) if feature == 3 else (b, c) if feature == 4 else (c, a)
            u, side = between(corner(t, feature - 3), corner(t, feature - 2)), 1
            if is_certain or (sign(m, _set_dot(m, start, u)) <= 0 and sign(m, _set_dot(m, end, u)) >= 0):
                side = _edge_side(start, u, limit)
        else:
            side = _plane_side(a, b, c, between(t.p, t.q), between(t.p, t.r), limit, is_certain)
        is_unsure |= side == UNDECIDED
        least = -1 if side <= 0 else least
    return UNDECIDED if least > 0 and is_unsure else least


@inline
def compare_with_limit(
    view: View, q: Point3, n: int, candidates: Candidates, distance: Wide, bound: float, limit: float, unit: float
) -> float:
    """Return 0.0 if the nearest of the first n candidates is within the limit, else infinity; -1.0 if unproven. What is
    as far as the limit in double-doubles is decided by expansions. distance, bound: of the nearest, in the unit of the
    view; unit: brings all coordinates below 1."""
    gap = less(distance, Wide(limit * view.unit, 0.0)).h
    if abs(gap) > bound + 2.0**-98 * distance.h and 2.0**-500 < distance.h < 2.0**500:
        return 0.0 if gap < 0.0 else np.inf
    is_open = view.place.is_posed or n > _MOST_EXACT
    for k in range(n):
        if is_open:
            break
        item, is_certain = candidates.pairs[k, 0], candidates.pairs[k, 1] == 1
        t = triangle_of(view.mesh, item)
        t = Facet(scaled(t.p, unit), scaled(t.q, unit), scaled(t.r, unit))
        side = _side_of_limit(t, scaled(q, unit), candidates.pairs[k, 2], is_certain, limit * unit)
        if side < 0:
            return 0.0
        is_open = side == UNDECIDED
    return -1.0 if is_open else np.inf
