"""Contact of a segment or ray with a triangle by four determinants, compiled, and unit normals.

Seen from the start p, with A = a - p and so on, and e the vector of the segment or ray,

    ab = e . (A x B)    bc = e . (B x C)    ca = e . (C x A)    v = A . (B x C)    w = ab + bc + ca

the line meets a triangle with w != 0 where no two of ab, bc, ca differ in sign: at t = v / w, with the barycentrics
bc / w, ca / w, ab / w. The determinants are double-doubles with the bounds of crossing_values.py. Where that leaves a
sign or the rounding of a quotient open, the vector products are expansions, and at last the determinant itself. A
vector product from a compressed expansion is within 8 u^2 of itself, which `dot` takes for the 16 u^2 m of `minor`.
What is open still is decided in exact_lines.py, a triangle without area in exact_hits.py.

Under a pose p and e are double-doubles, off by `blur` at most: each of the six products of a determinant, with factors
below M, moves by 3 blur (M + blur)^2, all of them by less than `_BLUR` blur (M + blur)^2. A sign that this leaves open
is open without expansions. Signs that are proven leave t open by as much as v and w are, relative to w: far ends and
earlier hits are compared with that in mind.

Source: T. Moller, B. Trumbore, Fast, minimum storage ray/triangle intersection, 1997. Changed: all is exact.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.compiling.jit import called, kernel, merged
from engine.lanes.faces import longest_axis
from engine.predicates.error_free import (
    U2,
    dd_add,
    dd_div,
    dd_mul,
    fast_two_sum,
    is_correctly_rounded,
    two_diff,
    two_prod,
    workspace,
)
from engine.predicates.expansion import add_scaled, compress
from engine.predicates.parameters import minor as exact_minor
from engine.segment_clipping.on_boundary.contacts import Kind, Place, code_of
from engine.segment_clipping.on_boundary.crossing_values import Normal, Vector, dot, is_item_safe, minor
from engine.segment_clipping.on_boundary.triangle_contacts import _side_when_perturbed, triangle_at
from engine.segment_clipping.pieces import Triple
from engine.types import FlagArray, FloatArray, Point3

Line = namedtuple("Line", "start way blur p q is_ray is_placed turned")
"""start, way: p and e as double-doubles; p, q: points whose line has the same direction, exactly; with is_placed
as they were before the pose, q of a ray its direction. turned: 0, or BACK, ASIDE: a ray from a segment's start."""
BACK, ASIDE = 1, 2
"""Directions of a ray from the start of a segment: away from its end, and any other."""
Hit = namedtuple("Hit", "code t low first second third")
"""A contact: Kind.APART, DEGENERATE (open), IN_PLANE (the line lies in the triangle's plane, see flat_hits.py), or its
code; its parameter t, the nearest double, and what is beyond it (within 2^-67 |t|); its barycentrics."""
IN_PLANE: Final = -3
_NO_HIT, _OPEN_HIT, _FLAT_HIT = (
    Hit(int(kind), 0.0, 0.0, 0.0, 0.0, 0.0) for kind in (Kind.APART, Kind.DEGENERATE, IN_PLANE)
)
_SURE: Final = 2.0**-70
"""Relative error below which quotients are hardly ever left open."""
_BLUR: Final = 20.0
_RELATIVE: Final = 8.0 * U2
_NEAR_ONE: Final = 2.0**-40


@merged
def _away(x: Point3, start: Vector) -> Vector:
    """Return x - start; the tails of `start` enter rounded, which `blur` covers."""
    i, i_low = two_diff(x.x, start[0][0])
    j, j_low = two_diff(x.y, start[1][0])
    k, k_low = two_diff(x.z, start[2][0])
    return (
        fast_two_sum(i, i_low - start[0][1]), fast_two_sum(j, j_low - start[1][1]), fast_two_sum(k, k_low - start[2][1])
    )  # fmt: skip


@merged
def _cross(u: Vector, v: Vector) -> Normal:
    """Return u x v, each component as (h, low, m) of `minor`."""
    return (
        minor(u[1][0], u[1][1], v[2][0], v[2][1], u[2][0], u[2][1], v[1][0], v[1][1]),
        minor(u[2][0], u[2][1], v[0][0], v[0][1], u[0][0], u[0][1], v[2][0], v[2][1]),
        minor(u[0][0], u[0][1], v[1][0], v[1][1], u[1][0], u[1][1], v[0][0], v[0][1]),
    )


@merged
def _leading(e: Any, n: int) -> Triple:
    """Return (h, low, |h|) for an expansion of n components, h + low within `_RELATIVE` |h| of it."""
    n = compress(e, n)
    if n == 0:
        return 0.0, 0.0, 0.0
    h, low = fast_two_sum(e[n - 1], e[n - 2] if n > 1 else 0.0)
    return h, low, abs(h)


@called
def _component(u: tuple[float, float], v: Any, x: Any, y: Any) -> Triple:
    """Return U V - X Y of exact pairs, as `_leading` does."""
    if u[1] == 0.0 and v[1] == 0.0 and x[1] == 0.0 and y[1] == 0.0:  # case: parallel, of few bits
        h, low = two_prod(u[0], v[0])
        g, tail = two_prod(x[0], y[0])
        if h == g:
            h, low = two_diff(low, tail)
            return h, low, abs(h)
    m = workspace(16)
    return _leading(m, exact_minor(m, u[0], u[1], x[0], x[1], y[0], y[1], v[0], v[1]))


@merged
def _cross_exactly(u: Vector, v: Vector) -> Normal:
    """Return u x v, each component as `_leading` does."""
    return (
        _component(u[1], v[2], u[2], v[1]), _component(u[2], v[0], u[0], v[2]), _component(u[0], v[1], u[1], v[0])
    )  # fmt: skip


@called
def _determinant(u: Vector, v: Vector, w: Vector) -> Triple:
    """Return u . (v x w) of exact pairs as (h, low, error bound), zero only if it is. Caller guarantees safe sizes."""
    e, m, n = workspace(192), workspace(16), 0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        length = exact_minor(m, v[i][0], v[i][1], v[j][0], v[j][1], w[i][0], w[i][1], w[j][0], w[j][1])
        for part in (u[k][1], u[k][0]):
            if part != 0.0:
                n = add_scaled(e, n, m, length, part)
    h, low, size = _leading(e, n)
    return h, low, _RELATIVE * size


@merged
def _sign(value: Triple) -> int:
    """Return the sign of a determinant (h, low, bound); 0 if it is zero or not proven."""
    return 1 if value[0] > value[2] else -1 if -value[0] > value[2] else 0


@merged
def _is_open(value: Triple) -> bool:
    """Return whether the sign of a determinant (h, low, bound) is not proven."""
    return not (abs(value[0]) > value[2] or value[2] == 0.0)


@merged
def _negative(value: Triple) -> Triple:
    return -value[0], -value[1], value[2]


@merged
def _blurred(value: Triple, lost: float) -> Triple:
    return value[0], value[1], 1.5 * value[2] + lost


@called
def _refined(line: Line, a: Vector, b: Vector, c: Vector, values: Any) -> Any:
    """Return the determinants (ab, bc, ca, v), given as `values`, from vector products in expansions, and where
    these do not suffice as expansions. The products with `a` cancel least where bc is the largest, near the corner a.
    """
    ab, bc, ca, v = values
    turn = 0 if abs(bc[0]) >= max(abs(ab[0]), abs(ca[0])) else 1 if abs(ca[0]) >= abs(ab[0]) else 2
    if turn > 0:
        a, b, c = (b, c, a) if turn == 1 else (c, a, b)
    e, (ab, bc, ca) = line.way, (ab, bc, ca) if turn == 0 else (bc, ca, ab) if turn == 1 else (ca, ab, bc)
    if _is_rough(ab) or _is_rough(ca):
        f = _cross_exactly(e, a)
        ab, ca = dot(f, b), _negative(dot(f, c))
    if _is_rough(bc) or _is_rough(v):
        g = _cross_exactly(b, c)
        bc, v = dot(g, e), dot(g, a)
    if _is_rough(ab):
        ab = _determinant(e, a, b)
    if _is_rough(bc):
        bc = _determinant(e, b, c)
    if _is_rough(ca):
        ca = _determinant(e, c, a)
    if _is_rough(v):
        v = _determinant(a, b, c)
    return (ab, bc, ca, v) if turn == 0 else (ca, ab, bc, v) if turn == 1 else (bc, ca, ab, v)


@merged
def _is_rough(value: Triple) -> bool:
    """Return whether a determinant is not known well enough for a quotient."""
    return value[2] > _SURE * abs(value[0])


@merged
def _is_beside(line: Line, a: Point3, b: Point3, c: Point3) -> bool:
    """Return whether the boxes of a line and a triangle are apart; caller guarantees a line without a pose."""
    is_apart = False
    for k in range(3):
        x, way, low, high = line.start[k][0], line.way[k][0], min(a[k], b[k], c[k]), max(a[k], b[k], c[k])
        is_apart |= (way >= 0.0 and high < x) or (way <= 0.0 and low > x)
        is_apart |= not line.is_ray and ((way >= 0.0 and low > line.q[k]) or (way <= 0.0 and high < line.q[k]))
    return is_apart


@merged
def _quotient(value: Triple, inverse: Triple) -> tuple[float, float, bool]:
    """Return value / w as a double-double, and whether its leading double is the proven nearest. inverse: 1 / w as a
    double-double, and its relative error. Both products and the test have 12 u^2."""
    h, low = dd_mul(value[0], value[1], inverse[0], inverse[1])
    bound = 1.01 * (abs(h) * (inverse[2] + 12.0 * U2) + value[2] * abs(inverse[0]))
    is_normal = (value[0] == 0.0) | (abs(value[0]) >= 2.0**-500)
    return h + 0.0, low, is_correctly_rounded(h, low, bound) & is_normal


@merged
def triangle_hit(elements: FloatArray, element: int, is_safe: bool, line: Line, most: float, is_any: bool) -> Hit:
    """Return the contact of a line and a triangle. is_safe: sizes of all elements are; most: what begins well beyond it
    is APART; is_any: nothing but the code is wanted."""
    a, b, c = triangle_at(elements, element)
    e, of_a, of_b, of_c = line.way, _away(a, line.start), _away(b, line.start), _away(c, line.start)
    f, g = _cross(e, of_a), _cross(of_b, of_c)
    ab, bc, ca, v = dot(f, of_b), dot(g, e), _negative(dot(f, of_c)), dot(g, of_a)
    if line.is_placed:
        size = line.blur
        for k in range(3):
            size = max(size, abs(e[k][0]), abs(of_a[k][0]), abs(of_b[k][0]), abs(of_c[k][0]))
        lost = _BLUR * line.blur * (size + line.blur) * (size + line.blur)
        ab, bc, ca, v = _blurred(ab, lost), _blurred(bc, lost), _blurred(ca, lost), _blurred(v, lost)
    least, greatest = min(_sign(ab), _sign(bc), _sign(ca)), max(_sign(ab), _sign(bc), _sign(ca))
    if least < 0 and greatest > 0:
        return _NO_HIT
    if not (is_safe or is_item_safe(elements, element)):
        return _OPEN_HIT
    if not line.is_placed and (_is_rough(ab) or _is_rough(bc) or _is_rough(ca) or _is_rough(v)):
        ab, bc, ca, v = _refined(line, of_a, of_b, of_c, (ab, bc, ca, v))
        least, greatest = min(_sign(ab), _sign(bc), _sign(ca)), max(_sign(ab), _sign(bc), _sign(ca))
        if least < 0 and greatest > 0:
            return _NO_HIT
    way = least + greatest
    if way == 0:
        return _OPEN_HIT if line.is_placed else _NO_HIT if _is_beside(line, a, b, c) else _FLAT_HIT
    if _sign(v) * way < 0:
        return _NO_HIT
    is_on = line.is_placed and _sign(ab) * _sign(bc) * _sign(ca) * _sign(v) == 0  # perturbed in the world, if turned
    if is_on or _is_open(ab) or _is_open(bc) or _is_open(ca) or _is_open(v):
        return _OPEN_HIT
    wh, wl = dd_add(ab[0], ab[1], bc[0], bc[1])
    wh, wl = dd_add(wh, wl, ca[0], ca[1])
    w = wh, wl, ab[2] + bc[2] + ca[2] + _RELATIVE * abs(wh)
    t, is_last, least_w = v[0] / wh, False, abs(wh) - w[2]
    off = 1.01 * (v[2] + abs(t) * w[2]) / least_w if least_w > 0.0 else np.inf
    if t - off > most * (1.0 + _NEAR_ONE) or (not line.is_ray and t - off > 1.0 + _NEAR_ONE):
        return _NO_HIT
    if not line.is_ray and t + off > 1.0 - _NEAR_ONE:
        if line.is_placed:
            return _OPEN_HIT
        q = (line.q.x, 0.0), (line.q.y, 0.0), (line.q.z, 0.0)
        beyond = _sign(_determinant(_away(a, q), _away(b, q), _away(c, q))) * way
        if beyond > 0:
            return _NO_HIT
        is_last = beyond == 0
    of_ab, of_bc, of_ca = _sign(ab), _sign(bc), _sign(ca)
    place = 3 if of_ab == 0 else 4 if of_bc == 0 else 5
    if (of_ab == 0) + (of_bc == 0) + (of_ca == 0) == 2:
        place = 0 if of_bc != 0 else 1 if of_ca != 0 else 2
    is_crossed = True
    if of_ab * of_bc * of_ca == 0:
        k = longest_axis((line.q.x - line.p.x, line.q.y - line.p.y, line.q.z - line.p.z))
        turn = 1 if line.q[k] > line.p[k] else -1
        of_ab = turn * of_ab if of_ab != 0 else _side_when_perturbed(a, b, line.p, line.q, k)
        of_bc = turn * of_bc if of_bc != 0 else _side_when_perturbed(b, c, line.p, line.q, k)
        of_ca = turn * of_ca if of_ca != 0 else _side_when_perturbed(c, a, line.p, line.q, k)
        if max(of_ab, of_bc, of_ca) > 1:
            return _OPEN_HIT
        is_crossed = of_ab == of_bc and of_bc == of_ca
    else:
        place = Place.WITHIN
    if _sign(v) == 0 or is_last:
        place = Place.END if is_last else Place.START
    code = code_of(place, is_crossed)
    if is_any:
        return Hit(code, 0.0, 0.0, 0.0, 0.0, 0.0)
    h, low = dd_div(1.0, 0.0, wh, wl)
    inverse = h, low, 1.01 * w[2] * abs(h) + 16.0 * U2
    first, second, third, last = (
        _quotient(bc, inverse),
        _quotient(ca, inverse),
        _quotient(ab, inverse),
        _quotient(v, inverse),
    )
    if is_last:
        last = 1.0, 0.0, True
    is_sure = first[2] & second[2] & third[2] & last[2] & (2.0**-400 <= abs(wh) <= 2.0**400)
    return Hit(code, last[0], last[1], first[0], second[0], third[0]) if is_sure else _OPEN_HIT


@kernel
def fill_normals(elements: FloatArray, frame: FloatArray, stop: FlagArray, normals: FloatArray) -> None:
    """Set normals (k, 3) to the unit normals of triangles (k, 3, 3), zero for those without area; NaN where not every
    component is the proven nearest double. frame: of a pose (3, 7), whose first six columns are M = R^-1 in
    double-doubles, so that the normal is M^T N; no rows for none.

    N is within 8 u^2 of itself, a product with an entry of M within 16 u^2 and each of two sums 4 u^2 more; below: the
    errors of the components, and e, the relative one of their length: of the sum of their squares, and 48 u^2 for the
    squares, the sum, the root and the quotients."""
    for i in range(elements.shape[0]):
        if stop[0]:
            return
        a, b, c = triangle_at(elements, i)
        at = (a.x, 0.0), (a.y, 0.0), (a.z, 0.0)
        n, is_sure = _cross_exactly(_away(b, at), _away(c, at)), is_item_safe(elements, i)
        if frame.shape[0] > 0:
            n = _turned_normal(frame, n, 0), _turned_normal(frame, n, 1), _turned_normal(frame, n, 2)
        h, low, lost = 0.0, 0.0, 0.0
        for k in range(3):
            square, tail = dd_mul(n[k][0], n[k][1], n[k][0], n[k][1])
            h, low = dd_add(h, low, square, tail)
            lost += n[k][2] * abs(n[k][0])
        root = np.sqrt(h)
        square, tail = dd_mul(root, 0.0, root, 0.0)
        square, tail = dd_add(h, low, -square, -tail)
        root, rest = fast_two_sum(root, (square + tail) / (2.0 * root) if h > 0.0 else 0.0)
        is_sure &= h == 0.0 or (2.0**-800 < h < 2.0**800 and _RELATIVE * lost < 2.0**-10 * h)
        for k in range(3):
            x, x_low = dd_div(n[k][0], n[k][1], root, rest) if h > 0.0 else (0.0, 0.0)
            e = 1.01 * _RELATIVE * lost / h + 48.0 * U2 if h > 0.0 else 0.0
            bound = 1.01 * (_RELATIVE * n[k][2] / root + abs(x) * e) if h > 0.0 else n[k][2]
            is_sure &= is_correctly_rounded(x, x_low, bound) & (n[k][0] == 0.0 or abs(n[k][0]) > 2.0**-500)
            normals[i, k] = x + x_low
        for k in range(3):
            normals[i, k] = normals[i, k] if is_sure else np.nan


@merged
def _turned_normal(frame: FloatArray, n: Normal, k: int) -> Triple:
    """Return component k of M^T N (`fill_normals`) as (h, low, m), within `_RELATIVE` m of it."""
    h, low, size = 0.0, 0.0, 0.0
    for i in range(3):
        x, tail = dd_mul(frame[i, 2 * k], frame[i, 2 * k + 1], n[i][0], n[i][1])
        h, low = dd_add(h, low, x, tail)
        size += abs(x)
    return h, low, 4.0 * size
