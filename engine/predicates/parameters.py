"""Comparison of two segment parameters: which of two planes does a segment p q reach first?

With plane values s_p and s_q of opposite sign (one may be zero), the segment meets the plane at
t = s_p / (s_p - s_q), which grows with |s_p| / |s_q|. So two planes i and j compare as the products

    |s_p(i)| |s_q(j)|   against   |s_p(j)| |s_q(i)|

The core is the sign of a b - c d for four numbers that are known within a bound each (the filter), exactly as
expansions, or as differences of doubles.

Precondition of the exact form: components are zero or so large that products of four components' lowest bits stay
above 2^-1074, and nothing overflows; callers check the range of their input.
"""

from __future__ import annotations

from typing import Final

from engine.compiling.jit import called, inline
from engine.predicates.error_free import two_diff, two_prod
from engine.predicates.expansion import Components, add_scaled, grow_product, sign
from engine.types import UNDECIDED

EXACT_DIFFERENCES: Final = 24.0 * 2.0**-106
"""Relative error bound of `compare_in_pairs`, whose leading products are exact: four products of a tail, below u of a
product each, are rounded once, and six sums of such terms."""

TINY: Final = 2.0**-1000
"""Added to bounds: covers products that underflow, so that the filter is right for every finite input."""


@inline
def compare_ratios_filter(
    a: float, a_bound: float, b: float, b_bound: float, c: float, c_bound: float, d: float, d_bound: float
) -> int:
    """Return the sign of |a b| - |c d| for numbers each known to +- its bound, or UNDECIDED. ``||a b| - |exact|| <= |a|
    b_bound + |b| a_bound + a_bound b_bound``; 2^-50 of each product covers every rounding."""
    a, b, c, d = abs(a), abs(b), abs(c), abs(d)
    left, right = a * b, c * d
    slack = a * b_bound + (b + b_bound) * a_bound + c * d_bound + (d + d_bound) * c_bound
    bound = 1.01 * slack + 2.0**-50 * (left + right) + TINY
    gap = left - right
    return 1 if gap > bound else (-1 if -gap > bound else UNDECIDED)


@inline
def compare_differences(
    a0: float, a1: float, b0: float, b1: float, c0: float, c1: float, d0: float, d1: float, e: Components
) -> int:
    """Return the exact sign of (a0 - a1) (b0 - b1) - (c0 - c1) (d0 - d1); `e` is a workspace of 16 places."""
    ah, al = two_diff(a0, a1)
    bh, bl = two_diff(b0, b1)
    ch, cl = two_diff(c0, c1)
    dh, dl = two_diff(d0, d1)
    if al == 0.0 and bl == 0.0 and cl == 0.0 and dl == 0.0:  # case: lattices and offsets, differences without error
        left, left_tail = two_prod(ah, bh)
        right, right_tail = two_prod(ch, dh)
        if left != right:
            return 1 if left > right else -1
        return 0 if left_tail == right_tail else (1 if left_tail > right_tail else -1)
    side = compare_in_pairs(ah, al, bh, bl, ch, cl, dh, dl)
    return side if side != UNDECIDED else sign(e, minor(e, ah, al, ch, cl, dh, dl, bh, bl))


@inline
def compare_in_pairs(ah: float, al: float, bh: float, bl: float, ch: float, cl: float, dh: float, dl: float) -> int:
    """Return the sign of a b - c d for a = ah + al and so on, exact, if it is proven from the leading parts of the
    products, else UNDECIDED. UNDECIDED for infinities and NaN; underflow is covered."""
    left, left_tail = two_prod(ah, bh)
    right, right_tail = two_prod(ch, dh)
    gap, gap_tail = two_diff(left, right)
    gap += gap_tail + ((left_tail - right_tail) + ((ah * bl + al * bh) - (ch * dl + cl * dh)))
    if abs(gap) > EXACT_DIFFERENCES * (abs(left) + abs(right)) + TINY:
        return 1 if gap > 0.0 else -1
    return UNDECIDED


@called
def minor(
    e: Components,
    ax: float,
    ax_tail: float,
    ay: float,
    ay_tail: float,
    bx: float,
    bx_tail: float,
    by: float,
    by_tail: float,
) -> int:
    """Set expansion e to (ax + ax_tail)(by + by_tail) - (ay + ay_tail)(bx + bx_tail); return its length, at most 16."""
    n = grow_product(e, 0, ax, by)
    n = grow_product(e, n, -ay, bx)
    if ax_tail != 0.0:
        n = grow_product(e, n, ax_tail, by)
        n = grow_product(e, n, ax_tail, by_tail)
    if ay_tail != 0.0:
        n = grow_product(e, n, -ay_tail, bx)
        n = grow_product(e, n, -ay_tail, bx_tail)
    if bx_tail != 0.0:
        n = grow_product(e, n, -ay, bx_tail)
    if by_tail != 0.0:
        n = grow_product(e, n, ax, by_tail)
    return n


@inline
def add_absolute_product(e: Components, n: int, a: Components, na: int, b: Components, nb: int, factor: int) -> int:
    """Add factor |a b| (factor 1 or -1) to expansion e of n components in place, for expansions a of na and b of nb
    components. Returns the new length, at most n + 2 na nb."""
    flip = float(factor * sign(a, na) * sign(b, nb))
    for i in range(na):
        n = add_scaled(e, n, b, nb, flip * a[i])
    return n


@called
def compare_products(
    a: Components, na: int, b: Components, nb: int, c: Components, nc: int, d: Components, nd: int, e: Components
) -> int:
    """Return the exact sign of |a b| - |c d| for expansions of na, nb, nc and nd components; `e` is a workspace of 2
    (na nb + nc nd) places."""
    n = add_absolute_product(e, 0, a, na, b, nb, 1)
    n = add_absolute_product(e, n, c, nc, d, nd, -1)
    return sign(e, n)
