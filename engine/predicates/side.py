"""side_of_plane: the sign of dot(row, (p, 1)), exact for every float64 input; in the plane c and z are 0.

**The filter.** With u = 2^-53, h = 2^-1075 and S the sum of magnitudes: a rounded product is off by u |a x| + h, a sum
by u of its result, so ``error <= 4 (u + 2 u^2) S + 3 h`` for 3 products and an offset. The threshold ``8 u S + 8 h``
also covers its own rounding, and that of correctly rounded coefficients (a posed plane, a wall of a prism: another u
each). An intermediate infinity or NaN makes both comparisons false.

**The second stage** computes the value in double-double.

**The exact stage** adds the products to an expansion. Where a product is too large or too small for that, each factor
is split into significand and exponent and the terms are brought to a common exponent. Terms more than 2^1968 below the
largest are left out; if the rest then is not clearly larger than they are, the answer is UNDECIDED (exact fallback:
`rational.py`).
"""

from __future__ import annotations

from math import frexp, ldexp

from engine.compiling.jit import called, inline
from engine.predicates.error_free import U2, two_prod, two_sum, workspace
from engine.predicates.expansion import Components, grow, grow_product, sign
from engine.types import UNDECIDED, HalfSpace3, Point3

BOUND_PLANE = 2.0**-50  # 8u
GUARD = 2.0**-1072  # 8h
DD_VALUE_BOUND = 32.0 * U2
VALUE_TINY = 2.0**-1070

SMALLEST_PRODUCT = 2.0**-967  # error_free.py: two_prod is exact from here
LARGEST_PRODUCT = 2.0**1000  # a few of them add up below the overflow
COMMON_TOP = 1000  # exponent given to the largest term when terms are brought to a common exponent
LOWEST_SHIFT = -968  # a product of significands has its lowest bit at 2^-106; -106 - 968 = -1074
CLEAR = 2.0**-960  # more than three left-out terms, each below 2^LOWEST_SHIFT, add up to
NO_TERM = -(1 << 20)  # exponent of a zero term


@inline
def side_of_plane_filter(h: HalfSpace3, p: Point3) -> int:
    """Return the sign of a x + b y + c z + d, the plane function of half-space h at p, if rounding cannot have changed
    it, else UNDECIDED."""
    ax, by, cz = h.a * p.x, h.b * p.y, h.c * p.z
    value = ax + by + cz + h.d
    threshold = BOUND_PLANE * (abs(ax) + abs(by) + abs(cz) + abs(h.d)) + GUARD
    return 1 if value > threshold else (-1 if -value > threshold else UNDECIDED)


@inline
def side_of_plane(h: HalfSpace3, p: Point3) -> int:
    """Return 1 if p is inside the half-space h, 0 on its plane, -1 outside, or UNDECIDED."""
    value, _, bound = dd_value(h.a, h.b, h.c, h.d, p)
    if value > bound:
        return 1
    return -1 if -value > bound else _side_exact(h, p)


@inline
def dd_value(a: float, b: float, c: float, d: float, point: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return (h, l, bound): a x + b y + c z + d as a double-double h + l, and a bound on its error. Products are exact,
    or lose 2^-1074 by underflow; their tails and those of sums, together below 4 u S, are added with six roundings. An
    intermediate infinity gives NaN."""
    x, y, z = point
    ah, al = two_prod(a, x)
    bh, bl = two_prod(b, y)
    ch, cl = two_prod(c, z)
    h, first = two_sum(ah, bh)
    h, second = two_sum(h, ch)
    h, third = two_sum(h, d)
    bound = DD_VALUE_BOUND * (abs(ah) + abs(bh) + abs(ch) + abs(d)) + VALUE_TINY
    h, low = two_sum(h, (al + bl) + (cl + first) + (second + third))
    return h, low, bound


@called
def _side_exact(h: HalfSpace3, p: Point3) -> int:
    """Return 1 if p is inside the half-space h, 0 on its plane, -1 outside, or UNDECIDED, by an expansion."""
    e = workspace(8)
    if (
        is_exact_product(h.a, p.x)
        and is_exact_product(h.b, p.y)
        and is_exact_product(h.c, p.z)
        and is_exact_product(h.d, 1.0)
    ):
        n = grow_product(e, grow_product(e, 0, h.a, p.x), h.b, p.y)
        return sign(e, grow(e, grow_product(e, n, h.c, p.z), h.d))
    ax, by = product_exponent(h.a, p.x), product_exponent(h.b, p.y)
    cz, d = product_exponent(h.c, p.z), product_exponent(h.d, 1.0)
    shift = COMMON_TOP - max(ax, by, cz, d)
    n = grow_shifted_product(e, 0, h.a, p.x, ax + shift)
    n = grow_shifted_product(e, n, h.b, p.y, by + shift)
    n = grow_shifted_product(e, n, h.c, p.z, cz + shift)
    n = grow_shifted_product(e, n, h.d, 1.0, d + shift)
    is_incomplete = is_left_out(ax, shift) or is_left_out(by, shift) or is_left_out(cz, shift) or is_left_out(d, shift)
    return clear_sign(e, n, is_incomplete)


@inline
def is_exact_product(a: float, b: float) -> bool:
    """Return whether `two_prod` of a and b is exact, and a sum of a few such products cannot overflow."""
    magnitude = abs(a * b)
    return SMALLEST_PRODUCT <= magnitude <= LARGEST_PRODUCT or a == 0.0 or b == 0.0


@inline
def product_exponent(a: float, b: float) -> int:
    """Return k with |a b| < 2^k; NO_TERM for a zero product."""
    if a == 0.0 or b == 0.0:
        return NO_TERM
    return frexp(a)[1] + frexp(b)[1]


@inline
def is_left_out(exponent: int, shift: int) -> bool:
    """Return whether a product below 2^exponent (NO_TERM for zero), times 2^shift, would lose bits below the smallest
    subnormal, so that `grow_shifted_product` omits it."""
    return exponent != NO_TERM and exponent + shift < LOWEST_SHIFT


@inline
def clear_sign(e: Components, n: int, is_incomplete: bool) -> int:
    """Return the sign of expansion e of n components, or UNDECIDED if omitted terms (is_incomplete) could change it."""
    if is_incomplete and (n == 0 or abs(e[n - 1]) < CLEAR):
        return UNDECIDED
    return sign(e, n)


@inline
def grow_shifted_product(e: Components, n: int, a: float, b: float, exponent: int) -> int:
    """Add the product of the significands of a and b, times 2^exponent, to expansion e of n components; nothing if it
    is zero or would lose bits. Returns the new length, at most n + 2."""
    if a == 0.0 or b == 0.0 or exponent < LOWEST_SHIFT:
        return n
    p, tail = two_prod(frexp(a)[0], frexp(b)[0])
    if tail != 0.0:
        n = grow(e, n, ldexp(tail, exponent))
    return grow(e, n, ldexp(p, exponent))
