"""Crossing of a segment p q and an edge a b of the plane or a triangle a b c of space: t and point, provably rounded.

With s(x) = ((b - a) x (c - a)) . (x - a), in the plane (b - a) x (x - a), the crossing is at

    t = s(p) / d,    d = s(p) - s(q) = ((b - a) x (c - a)) . (p - q),    x = p + t (q - p),

all in double-double with a running bound. What that leaves open is computed from the exact values s(p) and s(q), ties
and zeros too (cut_point.py).

**The bound.** u = 2^-53; differences of coordinates are exact pairs head + tail, |tail| <= u |head|. A component of the
normal n = U V - X Y is stored as h + low, m = |u v| + |x y|:

    step                                              error of n, in u^2 m
    products of two tails, left out                   2
    products with one tail, rounded                   2
    six sums of terms <= u m, 2 u m, 3 u m, 4 u m     12
    together: |error| <= 16 u^2 m, |low| <= 4.1 u m

    step of n w, w = head + tail a difference         error, in u^2 m |w|
    low times the tail of w, left out                 4.1
    the other two products, rounded                   5.1
    their sum; the sum with the tail of h w           5.1 + 6.1
    error of n                                        16.1
    together: |error| <= 37 u^2 m |w|, tail <= 6.2 u m |w|

The sum of three such products, heads exactly, tails in four sums (29 u^2): |error| <= 66 u^2 sum m |w|. `VALUE_BOUND`
also covers the rounding of that sum and terms of third order.
"""

from __future__ import annotations

from typing import Any, Final

from engine.compiling.jit import called, inline, merged
from engine.predicates.cut_point import T_BOUND, nearest, parameter_and_point, point_at
from engine.predicates.error_free import U2, dd_div, two_diff, two_prod, two_sum, workspace
from engine.predicates.expansion import Components, add_scaled, grow, is_safe, magnitude
from engine.predicates.parameters import compare_products
from engine.predicates.parameters import minor as exact_minor
from engine.segment_clipping.on_boundary.contacts import Bit, Place, axis_of, decode_place
from engine.segment_clipping.on_boundary.triangle_contacts import corner, flat_axis, triangle_at
from engine.segment_clipping.pieces import Triple
from engine.types import FloatArray, Point3

VALUE_BOUND: Final = 80.0 * U2
MOST_COMPONENTS: Final = 12
"""Most components of values whose products are compared."""

Line = tuple[int, int, int, int]
"""Corners a and b of an element, and the two axes on which the line a b is seen."""
Normal = tuple[Triple, Triple, Triple]
Vector = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


@merged
def minor(u: float, u_low: float, v: float, v_low: float, x: float, x_low: float, y: float, y_low: float) -> Triple:
    """Return (h, low, m): U V - X Y as a sum of two doubles h + low, and m = |u v| + |x y|. U = u + u_low and so on are
    exact pairs."""
    ph, pl = two_prod(u, v)
    qh, ql = two_prod(x, y)
    h, tail = two_diff(ph, qh)
    low = tail + ((pl - ql) + ((u * v_low + u_low * v) - (x * y_low + x_low * y)))
    return h, low, abs(ph) + abs(qh)


@merged
def product(n: Triple, w: float, w_low: float) -> Triple:
    """Return (h, low, size): the product of n and W = w + w_low as a sum of two doubles, and its size m |w|. n = (h,
    low, m) of `minor`."""
    g, tail = two_prod(n[0], w)
    return g, tail + (n[0] * w_low + n[1] * w), n[2] * abs(w)


@merged
def normal_of(a: Point3, b: Point3, c: Point3) -> Normal:
    """Return the normal (b - a) x (c - a) of a triangle: each component as (h, low, m) of `minor`."""
    ux, uy, uz = two_diff(b.x, a.x), two_diff(b.y, a.y), two_diff(b.z, a.z)
    vx, vy, vz = two_diff(c.x, a.x), two_diff(c.y, a.y), two_diff(c.z, a.z)
    return (
        minor(uy[0], uy[1], vz[0], vz[1], uz[0], uz[1], vy[0], vy[1]),
        minor(uz[0], uz[1], vx[0], vx[1], ux[0], ux[1], vz[0], vz[1]),
        minor(ux[0], ux[1], vy[0], vy[1], uy[0], uy[1], vx[0], vx[1]),
    )


@merged
def dot(n: Normal, w: Vector) -> Triple:
    """Return (h, low, bound): n . w as a double-double, and a bound on its error. n: of `normal_of`; w: three exact
    pairs."""
    x, x_low, x_size = product(n[0], w[0][0], w[0][1])
    y, y_low, y_size = product(n[1], w[1][0], w[1][1])
    z, z_low, z_size = product(n[2], w[2][0], w[2][1])
    h, first = two_sum(x, y)
    h, second = two_sum(h, z)
    h, low = two_sum(h, ((x_low + y_low) + (z_low + first)) + second)
    return h, low, VALUE_BOUND * (x_size + y_size + z_size)


PLANE: Final = (-1, -1, -1, -1)
"""In place of a `Line`: the plane of a triangle."""


@called
def line_of(elements: FloatArray, element: int, code: int) -> Line:
    """Return the line of an edge, or of the side of a coplanar triangle, seen along an axis along which it has an area,
    where it has a contact with the given code; `PLANE` for a triangle that is not coplanar."""
    if elements.shape[1] == 2:
        return 0, 1, 0, 1
    if code & Bit.ALONG == 0:
        return PLANE
    k, _ = flat_axis(*triangle_at(elements, element))
    side = decode_place(code) - 3
    return side, (side + 1) % 3, (k + 1) % 3, (k + 2) % 3


@merged
def line_values(elements: FloatArray, element: int, line: Line, segments: FloatArray, item: int) -> tuple[Any, Any]:
    """Return s(p) and d = s(p) - s(q) of segment ``item``, p q, at a `Line` of element ``element`` of elements (k,
    corners, dim), each as (h, low, error bound)."""
    a, b, i, j = line
    ax, ay = elements[element, a, i], elements[element, a, j]
    px, py = segments[item, 0, i], segments[item, 0, j]
    u, u_low = two_diff(elements[element, b, i], ax)
    v, v_low = two_diff(elements[element, b, j], ay)
    x, x_low = two_diff(px, ax)
    y, y_low = two_diff(py, ay)
    h, low, size = minor(u, u_low, y, y_low, v, v_low, x, x_low)
    h, low = two_sum(h, low)
    x, x_low = two_diff(px, segments[item, 1, i])
    y, y_low = two_diff(py, segments[item, 1, j])
    g, g_low, g_size = minor(u, u_low, y, y_low, v, v_low, x, x_low)
    g, g_low = two_sum(g, g_low)
    return (h, low, VALUE_BOUND * size), (g, g_low, VALUE_BOUND * g_size)


@merged
def plane_values(elements: FloatArray, element: int, segments: FloatArray, item: int) -> tuple[Any, Any]:
    """Return s(p) and d = s(p) - s(q) of segment ``item``, p q, at the plane of triangle ``element`` of elements (k, 3,
    3), each as (h, low, error bound)."""
    a, b, c = triangle_at(elements, element)
    p, q = corner(segments, item, 0), corner(segments, item, 1)
    normal = normal_of(a, b, c)
    at_p = dot(normal, (two_diff(p.x, a.x), two_diff(p.y, a.y), two_diff(p.z, a.z)))
    along = dot(normal, (two_diff(p.x, q.x), two_diff(p.y, q.y), two_diff(p.z, q.z)))
    return at_p, along


@merged
def is_item_safe(items: FloatArray, item: int) -> bool:
    """Return whether all coordinates of ``items[item]`` are zero or in the range in which double-doubles have their
    bounds."""
    safe = True
    for place in range(items.shape[1]):
        for k in range(items.shape[2]):
            safe &= is_safe(items[item, place, k])
    return safe


@merged
def cut_at(
    segments: FloatArray, item: int, elements: FloatArray, element: int, code: int, points: FloatArray, row: int
) -> tuple[float, bool]:
    """Set points[row] to the crossing of segment ``item`` and element ``element``, by double-doubles; return its
    parameter t, and whether t and all coordinates are proven nearest doubles. code: of the contact, in the
    element's inside or side."""
    if segments.shape[2] == 2 or code & Bit.ALONG != 0:
        at_p, along = line_values(elements, element, line_of(elements, element, code), segments, item)
    else:
        at_p, along = plane_values(elements, element, segments, item)
    s, s_low, s_bound = at_p
    d, d_low, d_bound = along
    th, tl = dd_div(s, s_low, d, d_low)
    r = 1.01 * (s_bound / abs(s) + d_bound / abs(d))
    sure = (r < 0.001) & (abs(d) >= 2.0**-400) & (abs(d) <= 2.0**400) & (abs(s) >= 2.0**-500)
    bound = (T_BOUND + r) * th
    sure &= th + (tl - bound) == th + (tl + bound)
    for k in range(points.shape[1]):
        level = elements[element, 0, k]
        is_level = True
        for place in range(1, elements.shape[1]):
            is_level &= elements[element, place, k] == level
        if is_level:  # case: a face or edge across an axis, whose coordinate is the point's
            points[row, k] = level
            continue
        x, is_x = point_at(segments[item, 0, k], segments[item, 1, k], th, tl, r)
        points[row, k] = x + 0.0
        sure &= is_x
    return th + tl, sure


@called
def size_at(
    elements: FloatArray, element: int, line: Line, segments: FloatArray, item: int, end: int, e: Components
) -> int:
    """Set expansion e (192 places) to |s(x)|, x end 0 or 1 of segment ``item``; return its number of components.
    Triangle a b c: sum over k of component k of (b - a) x (c - a) times (x - a)_k. A `Line` a b: the one component of
    (b - a) x (x - a) on its axes."""
    m, n, (a, b, i, j), is_flat = workspace(16), 0, line, line[0] >= 0
    for k in range(1 if is_flat else 3):
        if not is_flat:
            a, b, i, j = 0, 1, (k + 1) % 3, (k + 2) % 3
        u, u_tail = two_diff(elements[element, b, i], elements[element, a, i])
        v, v_tail = two_diff(elements[element, b, j], elements[element, a, j])
        x, x_tail = two_diff(segments[item, end, i] if is_flat else elements[element, 2, i], elements[element, a, i])
        y, y_tail = two_diff(segments[item, end, j] if is_flat else elements[element, 2, j], elements[element, a, j])
        length = exact_minor(m, u, u_tail, v, v_tail, x, x_tail, y, y_tail)
        factor, tail = (1.0, 0.0) if is_flat else two_diff(segments[item, end, k], elements[element, 0, k])
        for part in (tail, factor):
            if part != 0.0:
                n = add_scaled(e, n, m, length, part)
    return magnitude(e, n)


@called
def cross_exactly(
    segments: FloatArray, item: int, elements: FloatArray, element: int, code: int, point: FloatArray
) -> tuple[float, bool]:
    """Set `point` to the crossing of segment ``item`` and element ``element`` from exact values; return its parameter
    t, and whether t and all coordinates are proven nearest doubles. code: of the contact. Caller guarantees that the
    ends lie on different sides, or one of them on the element's line or plane, and that coordinates are zero or of
    sizes within 2^-120 .. 2^120, so that differences are multiples of 2^-172 and values of 2^-516, below 2^366."""
    wp, wq, e = workspace(192), workspace(192), workspace(2304)
    n_wp, n_wq = _put_weights(segments, item, elements, element, code, wp, wq)
    return parameter_and_point(segments[item], wp, n_wp, wq, n_wq, -1, 0.0, point, e)


@called
def parameter_exactly(p: float, q: float, x: float) -> tuple[float, bool]:
    """Return (x - p) / (q - p) for x between p and q, and whether it is the proven nearest double."""
    wp, wq, e = workspace(2), workspace(2), workspace(24)
    n_wp, n_wq = _put_distance(wp, x, p), _put_distance(wq, q, x)
    h, low = two_diff(q, p)
    way = 1.0 if h > 0.0 else -1.0
    return nearest(0.0, 1.0, wp, n_wp, wq, n_wq, way * h, way * low, e)


@called
def are_at_one_parameter(
    segments: FloatArray, item: int, elements: FloatArray, first: int, code: int, second: int, other: int
) -> bool:
    """Return whether two contacts of segment ``item``, in no end of it, are proven to have equal parameters. first,
    second: the elements; code, other: the codes of their contacts. Sizes as in `cross_exactly`: products are multiples
    of 2^-1032."""
    wp, wq, vp, vq = workspace(192), workspace(192), workspace(192), workspace(192)
    if max(decode_place(code), decode_place(other)) == Place.END:
        return False
    n_wp, n_wq = _put_weights(segments, item, elements, first, code, wp, wq)
    n_vp, n_vq = _put_weights(segments, item, elements, second, other, vp, vq)
    if max(n_wp, n_wq, n_vp, n_vq) > MOST_COMPONENTS:
        return False
    return compare_products(wp, n_wp, vq, n_vq, vp, n_vp, wq, n_wq, workspace(576)) == 0


@called
def _put_weights(
    segments: FloatArray, item: int, elements: FloatArray, element: int, code: int, wp: Components, wq: Components
) -> tuple[int, int]:
    """Set expansions wp, wq (192 places) to distances of both ends of segment ``item`` from its contact with element
    ``element``, up to a common factor; return their numbers of components. code: of the contact, in no end."""
    place = decode_place(code)
    if place < 3:
        k = axis_of(segments, item)
        x = elements[element, place, k]
        return _put_distance(wp, x, segments[item, 0, k]), _put_distance(wq, segments[item, 1, k], x)
    line = line_of(elements, element, code)
    return (
        size_at(elements, element, line, segments, item, 0, wp),
        size_at(elements, element, line, segments, item, 1, wq),
    )


@inline
def _put_distance(e: Components, x: float, y: float) -> int:
    """Set expansion e to |x - y|; return its number of components, at most 2."""
    h, low = two_diff(x, y)
    return magnitude(e, grow(e, grow(e, 0, low), h))
