"""orient2d and orient3d: on which side of a line or plane a point lies, exact for every float64 input.

Four stages. A float filter, whose bound is proven below. Equal points, and all on one axis-parallel line or plane. The
determinant in pairs of doubles, with a bound. Then as an expansion, exact, without allocation, with the coordinates of
an axis scaled by a power of two where that widens the range (the sign does not change). Where even that leaves the
range in which expansions are exact, UNDECIDED: the caller settles the item with `rational.py`. A whole scene at 1e300
or 1e-300 is decided here, and 4.0 beside 5e-324; undecided are only points whose coordinates, from the lowest bit to
the highest, span more than 2^SPREAD on all axes together, and which the filter did not settle either.

**The filter.** Let u = 2^-53, h = 2^-1075 (half the smallest subnormal), and * a rounded product:
|x * y - x y| <= u |x y| + h. Differences of doubles carry a relative error u only. So in 2D, with l and r the products,
|det - exact| <= (3u + 16u^2)(|l| + |r|) + 2h (1 + 4u) (Shewchuk 1997, section 4, for the first part; 2h for the two
products). The threshold used is 4u (|l| + |r|) + 8h: the spare u and 6h pay for rounding the threshold itself. In 3D
likewise (7u + 56u^2) P for the permanent P of the rounded differences, plus 2h |z| for the two products under each of
the three differences z and h for their product with it; the threshold is 8u P + 16h (1 + sum |z|). Infinite
intermediates make the threshold infinite or NaN, and both comparisons false: UNDECIDED.

**In pairs.** Differences of doubles are exact pairs. In 2D see `EXACT_DIFFERENCES`. In 3D, by the bounds of
error_free.py, a minor carries 5 u^2 of each product and 3 u^2 of its value, below 8.1 u^2 of the products' sizes;
the product with z adds 5 u^2, two sums 3 u^2 each: below 19.3 u^2 P in all, for which the threshold has 32 u^2 P, with
room for the low part of the sum. A rounded product that underflows is off by 2h; three in each of the six products
under a z, and three with each z, make less than 32 h (1 + sum |z|).
Where no low part is left anywhere (lattices), and no difference is so small that one could underflow, the value is
exact, zero too.

Source: J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates, 1997.
Changed: the sign of orient3d is opposite, underflow and overflow are covered, the exact stage drops zeros and scales.

Simulation of simplicity: a zero of orient2d is decided as for a point moved by (eps, eps^2).

Seen along a ray, or along the line beside a segment, that line is a point q, and an edge a b of the boundary has it on
its left or right by the sign of orient2d(a, b, q). For every eps > 0 that is small enough, the sign for
q + (eps, eps^2) is

    sign orient2d(a, b, q)   where that is not 0
    sign (a.y - b.y)         else where that is not 0: the derivative of orient2d(a, b, q) by q.x
    sign (b.x - a.x)         else: the derivative by q.y; 0 where a = b alone

So moved, q lies on no vertex and no edge. Two elements at a common edge decide its zero alike, and so do all that count
crossings by this rule, in whichever arithmetic: containment/methods/polyhedron_ray_parity.py and rational_locate.py,
collision/meshes/parity.py and exact_regions.py, segment_clipping/exact_pieces.py and on_boundary/triangle_contacts.py.
tests/unit/predicates/test_ties.py compares them. In the plane a ray to the right is moved up by eps
(polygon_ray_parity.py).

Source: H. Edelsbrunner, E. P. Muecke, Simulation of simplicity, 1990.
"""

from __future__ import annotations

from math import frexp, ldexp
from typing import Any

from engine.compiling.jit import called, inline, kernel, merged
from engine.predicates.error_free import U2, dd_add, dd_mul, dd_sub, two_diff, workspace
from engine.predicates.expansion import Components, add_scaled, sign
from engine.predicates.parameters import compare_differences, compare_in_pairs, minor
from engine.predicates.vectors import as_point3, minus
from engine.types import UNDECIDED, FloatArray, Int8Array, Point2, Point3

BOUND_2D = 2.0**-51  # 4u
BOUND_3D = 2.0**-50  # 8u
GUARD_2D = 2.0**-1072  # 8h
GUARD_3D = 2.0**-1071  # 16h

# Exact stage, per axis: |v| <= 2^TOP keeps sums of products finite, and nonzero |v| >= 2^BOTTOM makes every v a
# multiple of 2^(BOTTOM - 52), so that a product of 2 (3) of them, and of their differences, is a multiple of 2^-1074.
TOP_2D = 500  # 12 products below 2^1000
BOTTOM_2D = -485  # 2 (-485 - 52) = -1074
TOP_3D = 330  # differences < 2^331, 6 products below 2^993
BOTTOM_3D = -306  # 3 (-306 - 52) = -1074
SMALLEST_EXACT = 2.0**-300  # 3 (-300 - 52) > -1074: of differences whose products keep all their bits
OUT_OF_RANGE = 1 << 20  # no power of two brings this axis into the range
SPREAD = 2000  # bits of a product of coordinates, one an axis, from 2^-1020 to 2^980


@inline
def orient2d_filter(a: Point2, b: Point2, c: Point2) -> int:
    """Return the sign of orient2d(a, b, c) if rounding cannot have changed it, else UNDECIDED."""
    left = (a.x - c.x) * (b.y - c.y)
    right = (a.y - c.y) * (b.x - c.x)
    det = left - right
    threshold = BOUND_2D * (abs(left) + abs(right)) + GUARD_2D
    return 1 if det > threshold else (-1 if -det > threshold else UNDECIDED)


@inline
def orient2d(a: Point2, b: Point2, c: Point2) -> int:
    """Return 1 if a, b, c turn left, -1 if they turn right, 0 if they are collinear, or UNDECIDED (exponents out of
    range)."""
    side = orient2d_filter(a, b, c)
    if side != UNDECIDED:
        return side
    return orient2d_exact(a, b, c)


@merged
def rounded_determinant(u: Point3, v: Point3, w: Point3) -> tuple[float, float]:
    """Return the determinant of three difference vectors in floats, with the sign of orient3d, and its
    permanent: the sum of the magnitudes of its six products."""
    vx_wy, wx_vy = v.x * w.y, w.x * v.y
    wx_uy, ux_wy = w.x * u.y, u.x * w.y
    ux_vy, vx_uy = u.x * v.y, v.x * u.y
    det = u.z * (wx_vy - vx_wy) + v.z * (ux_wy - wx_uy) + w.z * (vx_uy - ux_vy)
    permanent = (
        (abs(vx_wy) + abs(wx_vy)) * abs(u.z)
        + (abs(wx_uy) + abs(ux_wy)) * abs(v.z)
        + (abs(ux_vy) + abs(vx_uy)) * abs(w.z)
    )
    return det, permanent


@inline
def orient3d_filter(a: Point3, b: Point3, c: Point3, d: Point3) -> int:
    """Return the sign of orient3d(a, b, c, d) if rounding cannot have changed it, else UNDECIDED."""
    u, v, w = minus(a, d), minus(b, d), minus(c, d)
    det, permanent = rounded_determinant(u, v, w)
    threshold = BOUND_3D * permanent + GUARD_3D * (1.0 + (abs(u.z) + abs(v.z) + abs(w.z)))
    return 1 if det > threshold else (-1 if -det > threshold else UNDECIDED)


@inline
def orient3d(a: Point3, b: Point3, c: Point3, d: Point3) -> int:
    """Return 1 if d is on the side to which the normal (b - a) x (c - a) points, else -1, 0 coplanar, or UNDECIDED."""
    side = orient3d_filter(a, b, c, d)
    if side != UNDECIDED:
        return side
    return orient3d_exact(a, b, c, d)


@inline
def axis_shift(smallest: float, largest: float, bottom: int, top: int) -> int:
    """Return k such that nonzero magnitudes smallest .. largest, times 2^k, lie in [2^bottom, 2^top]: 0 if they do
    already, OUT_OF_RANGE if no k does. smallest: infinity if all are zero."""
    if largest == 0.0:
        return 0
    high = frexp(largest)[1]
    low = frexp(smallest)[1] - 1
    if high <= top and low >= bottom:
        return 0
    if low + (top - high) >= bottom:
        return top - high
    return OUT_OF_RANGE


@inline
def smaller_nonzero(smallest: float, value: float) -> float:
    """Return the smaller of `smallest` and |value|, ignoring zero."""
    return min(smallest, abs(value)) if value != 0.0 else smallest


@inline
def _span_of(a: float, b: float, c: float, d: float) -> tuple[int, int]:
    """Return (high, low) of four coordinates: magnitudes are below 2^high and multiples of 2^low; (0, 0) of zeros."""
    largest = max(abs(a), abs(b), abs(c), abs(d))
    smallest = smaller_nonzero(smaller_nonzero(smaller_nonzero(smaller_nonzero(largest, a), b), c), d)
    return (frexp(largest)[1], max(frexp(smallest)[1] - 53, -1074)) if largest > 0.0 else (0, 0)


@called
def _shifts_of(
    x: tuple[int, int], y: tuple[int, int], z: tuple[int, int], top: int, bottom: int
) -> tuple[int, int, int]:
    """Return exponents of two by which the axes are scaled so that products of differences, one an axis, are exact, x y
    first: 0 if all spans (`_span_of`) lie between `bottom` and `top`; the first is OUT_OF_RANGE if there are none.

    One axis takes the highest place that its products with the others leave, the rest become integers below 2^1000:
    z if its span is wider than that, so that the spans of x and y together are not; else the wider of x and y. No
    product of x and y, and none with z, exceeds 2^980, or has bits below 2^(980 - SPREAD)."""
    if max(x[0], y[0], z[0]) <= top and min(x[1], y[1], z[1]) >= bottom:
        return 0, 0, 0
    x_span, y_span, z_span = x[0] - x[1], y[0] - y[1], z[0] - z[1]
    if x_span + y_span + z_span > SPREAD:
        return OUT_OF_RANGE, 0, 0
    if z_span > 1000:
        return -x[1], -y[1], 980 - x_span - y_span - z[0]
    if x_span >= y_span:
        return 980 - y_span - z_span - x[0], -y[1], -z[1]
    return -x[1], 980 - x_span - z_span - y[0], -z[1]


@called
def orient2d_exact(a: Point2, b: Point2, c: Point2) -> int:
    """Return the sign of orient2d(a, b, c) by an expansion; UNDECIDED if exponents are out of its range."""
    # case: on one axis-parallel line, or two equal points; whatever the exponents
    if (a.x == c.x and b.x == c.x) or (a.y == c.y and b.y == c.y):
        return 0
    if (a.x == c.x and a.y == c.y) or (b.x == c.x and b.y == c.y) or (a.x == b.x and a.y == b.y):
        return 0
    ax, ax_tail = two_diff(a.x, c.x)
    ay, ay_tail = two_diff(a.y, c.y)
    bx, bx_tail = two_diff(b.x, c.x)
    by, by_tail = two_diff(b.y, c.y)
    side = compare_in_pairs(ax, ax_tail, by, by_tail, ay, ay_tail, bx, bx_tail)
    if side != UNDECIDED:
        return side
    x, y = _span_of(a.x, b.x, c.x, c.x), _span_of(a.y, b.y, c.y, c.y)
    shift_x, shift_y, _ = _shifts_of(x, y, (0, 0), TOP_2D, BOTTOM_2D - 52)
    if shift_x == OUT_OF_RANGE:
        return UNDECIDED
    if shift_x != 0 or shift_y != 0:
        a = Point2(ldexp(a.x, shift_x), ldexp(a.y, shift_y))
        b = Point2(ldexp(b.x, shift_x), ldexp(b.y, shift_y))
        c = Point2(ldexp(c.x, shift_x), ldexp(c.y, shift_y))
    return compare_differences(a.x, c.x, b.y, c.y, a.y, c.y, b.x, c.x, workspace(16))


@called
def orient3d_exact(a: Point3, b: Point3, c: Point3, d: Point3) -> int:
    """Return the sign of orient3d(a, b, c, d) by an expansion; UNDECIDED if exponents are out of its range."""
    # case: all four in one axis-parallel plane (flush boxes, lattices), whatever the exponents
    if (
        (a.x == d.x and b.x == d.x and c.x == d.x)
        or (a.y == d.y and b.y == d.y and c.y == d.y)
        or (a.z == d.z and b.z == d.z and c.z == d.z)
    ):
        return 0
    if _are_equal(a, d) or _are_equal(b, d) or _are_equal(c, d) or _are_equal(a, b) or _are_equal(b, c):
        return 0
    if _are_equal(c, a):
        return 0
    side = _orient3d_in_pairs(a, b, c, d)
    if side != UNDECIDED:
        return side
    x, y, z = _span_of(a.x, b.x, c.x, d.x), _span_of(a.y, b.y, c.y, d.y), _span_of(a.z, b.z, c.z, d.z)
    shift_x, shift_y, shift_z = _shifts_of(x, y, z, TOP_3D, BOTTOM_3D - 52)
    if shift_x == OUT_OF_RANGE:
        return UNDECIDED
    if shift_x != 0 or shift_y != 0 or shift_z != 0:
        a = Point3(ldexp(a.x, shift_x), ldexp(a.y, shift_y), ldexp(a.z, shift_z))
        b = Point3(ldexp(b.x, shift_x), ldexp(b.y, shift_y), ldexp(b.z, shift_z))
        c = Point3(ldexp(c.x, shift_x), ldexp(c.y, shift_y), ldexp(c.z, shift_z))
        d = Point3(ldexp(d.x, shift_x), ldexp(d.y, shift_y), ldexp(d.z, shift_z))
    ax, ax_tail = two_diff(a.x, d.x)
    ay, ay_tail = two_diff(a.y, d.y)
    az, az_tail = two_diff(a.z, d.z)
    bx, bx_tail = two_diff(b.x, d.x)
    by, by_tail = two_diff(b.y, d.y)
    bz, bz_tail = two_diff(b.z, d.z)
    cx, cx_tail = two_diff(c.x, d.x)
    cy, cy_tail = two_diff(c.y, d.y)
    cz, cz_tail = two_diff(c.z, d.z)
    e, m = workspace(192), workspace(16)  # 3 minors of 16 components, times 2, as 2 products each
    n = 0
    if az != 0.0:
        n = _add_scaled_minor(e, n, m, minor(m, cx, cx_tail, cy, cy_tail, bx, bx_tail, by, by_tail), az, az_tail)
    if bz != 0.0:
        n = _add_scaled_minor(e, n, m, minor(m, ax, ax_tail, ay, ay_tail, cx, cx_tail, cy, cy_tail), bz, bz_tail)
    if cz != 0.0:
        n = _add_scaled_minor(e, n, m, minor(m, bx, bx_tail, by, by_tail, ax, ax_tail, ay, ay_tail), cz, cz_tail)
    return sign(e, n)


@inline
def _are_equal(p: Point3, q: Point3) -> bool:
    """Return whether two points are equal."""
    return p.x == q.x and p.y == q.y and p.z == q.z


@inline
def _orient3d_in_pairs(a: Point3, b: Point3, c: Point3, d: Point3) -> int:
    """Return the sign of orient3d(a, b, c, d) if double-doubles prove it, else UNDECIDED."""
    total, total_tail, permanent, heights, lows, smallest = 0.0, 0.0, 0.0, 0.0, 0.0, 1.0
    p, q, r = a, b, c
    for _ in range(3):  # z of p, times the minor of r and q; a loop, because three copies compile three times as long
        z, z_tail = two_diff(p.z, d.z)
        qx, qx_tail = two_diff(q.x, d.x)
        qy, qy_tail = two_diff(q.y, d.y)
        rx, rx_tail = two_diff(r.x, d.x)
        ry, ry_tail = two_diff(r.y, d.y)
        left, left_tail = dd_mul(rx, rx_tail, qy, qy_tail)
        right, right_tail = dd_mul(qx, qx_tail, ry, ry_tail)
        minor_, minor_tail = dd_sub(left, left_tail, right, right_tail)
        term, term_tail = dd_mul(minor_, minor_tail, z, z_tail)
        total, total_tail = dd_add(total, total_tail, term, term_tail)
        permanent += (abs(left) + abs(right)) * abs(z)
        heights += abs(z)
        lows += abs(z_tail) + abs(qx_tail) + abs(qy_tail) + abs(left_tail) + abs(right_tail)
        lows += abs(minor_tail) + abs(term_tail) + abs(total_tail)
        smallest = smaller_nonzero(smaller_nonzero(smaller_nonzero(smallest, z), qx), qy)
        p, q, r = q, r, p
    bound = 32.0 * U2 * permanent + 2.0 * GUARD_3D * (1.0 + heights)
    if lows == 0.0 and smallest >= SMALLEST_EXACT:
        bound = 0.0
        if total == 0.0:
            return 0
    return 1 if total > bound else -1 if -total > bound else UNDECIDED


@inline
def _add_scaled_minor(e: Components, n: int, m: Components, length: int, z: float, z_tail: float) -> int:
    """Add (z + z_tail) times the expansion m of `length` components to e of n; return the new length of e."""
    if z_tail != 0.0:
        n = add_scaled(e, n, m, length, z_tail)
    return add_scaled(e, n, m, length, z)


@kernel
def orient3d_batch(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, sides: Int8Array) -> None:
    """Fill sides (n,) int8 with orient3d of row i of a, b, c, d (n, 3) float64."""
    for item in range(sides.shape[0]):
        sides[item] = orient3d(as_point3(a, item), as_point3(b, item), as_point3(c, item), as_point3(d, item))


def tie_sign_exact(ax: Any, ay: Any, bx: Any, by: Any) -> int:
    """Return the sign of orient2d(a, b, q + (eps, eps^2)) for all small eps > 0, given that orient2d(a, b, q) is 0; 0
    if a = b. Any number type."""
    if ay != by:
        return 1 if ay > by else -1
    return 1 if bx > ax else -1 if bx < ax else 0


tie_sign: Any = inline(tie_sign_exact)
"""`tie_sign_exact`, compiled for float64."""
