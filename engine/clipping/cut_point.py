"""Where a segment p q is cut by a plane: parameter and coordinates in double-double, with a bound, from the end points.

With weights w_p = |s_p| and w_q = |s_q| (distances of the ends from the plane, up to a common factor),

    t = w_p / (w_p + w_q),        x = (p w_q + q w_p) / (w_p + w_q).

Only original end points enter, never a point cut before. Each function returns the double and whether it is surely the
one nearest to the exact value; where not, the item is settled by rational arithmetic (exact_segments.py).

Bound. The weights are known to a relative r each. Products add 2 u^2, their sum 4 u^2, the sum of the weights 4 u^2,
the quotient 16 u^2, the test `surely_rounded` 2 u^2: with M = max(|p|, |q|) every coordinate is within
(28 u^2 + 2 r) M of its value; 40 u^2 + 2.5 r covers the terms of higher order for r < 0.01.
"""

from __future__ import annotations

from typing import Final

from engine.jit import inline
from engine.predicates.double_double import U2, dd_add, dd_div, dd_scale, surely_rounded

CUT_BOUND: Final = 40.0 * U2
WEIGHT_FACTOR: Final = 2.5
LARGEST: Final = 2.0**120
SMALLEST: Final = 2.0**-120
"""Coordinates of kernels that use double-double or expansions are zero or within these: products of degree four
keep all their bits (multiples of 2^-172 after a difference, of 2^-688 after a product of four)."""


@inline
def is_safe(x: float) -> bool:
    """Tell whether x is zero or of a size for which products of degree four are exact as expansions."""
    return x == 0.0 or SMALLEST <= abs(x) <= LARGEST


@inline
def cut_parameter(
    wp_h: float, wp_l: float, wq_h: float, wq_l: float, sum_h: float, sum_l: float, r: float
) -> tuple[float, bool]:
    """Return w_p / (w_p + w_q) and whether it is surely the nearest double; all weights have one sign."""
    if wp_h == 0.0:
        return 0.0, True
    if wq_h == 0.0:
        return 1.0, True
    th, tl = dd_div(wp_h, wp_l, sum_h, sum_l)
    return th + tl, surely_rounded(th, tl, (CUT_BOUND + WEIGHT_FACTOR * r) * abs(th))


@inline
def cut_coordinate(
    p: float, q: float, wp_h: float, wp_l: float, wq_h: float, wq_l: float, sum_h: float, sum_l: float, r: float
) -> tuple[float, bool]:
    """Return (p w_q + q w_p) / (w_p + w_q) and whether it is surely the nearest double; all weights have one sign."""
    if p == q or wp_h == 0.0:
        return p, True
    if wq_h == 0.0:
        return q, True
    ah, al = dd_scale(wq_h, wq_l, p)
    bh, bl = dd_scale(wp_h, wp_l, q)
    nh, nl = dd_add(ah, al, bh, bl)
    if nh == 0.0 and r == 0.0 and wp_l == 0.0 and wq_l == 0.0:
        return 0.0, True  # case: products without error that cancel, a cut exactly at zero (lattices)
    xh, xl = dd_div(nh, nl, sum_h, sum_l)
    bound = (CUT_BOUND + WEIGHT_FACTOR * r) * max(abs(p), abs(q))
    return xh + xl, surely_rounded(xh, xl, bound)
