"""The point and the parameter at which a segment p q crosses a plane, correctly rounded, from the end points.

With weights w_p = |s_p| and w_q = |s_q| (distances of the ends from the plane, up to a common factor),

    t = w_p / (w_p + w_q),        x = p + t (q - p) = (p w_q + q w_p) / (w_p + w_q).

Only original end points enter, never a point cut before. Three stages, each slower and stronger than the one before:

1. `point_at`: x = p + t (q - p) with t as a double-double;
2. `nearest`: first the weighted form as a double-double, which detects an exact zero;
3. then the double whose midpoints with its neighbours enclose x, by exact signs; ties go to even. Mostly the
   double-double leaves one midpoint open, so that one sign decides.

The first two return whether the double is certainly the nearest; where the third is out of range, rational arithmetic
is the exact fallback (profiles.py).

Bound of the weighted form. Weights are exact expansions, compressed: two components are within 8 u^2 of them. Products
add 2 u^2, their sum 4 u^2, the sum of the weights 12 u^2, the quotient 16 u^2, `is_correctly_rounded` 2 u^2: with
M = max(|p|, |q|) ``error <= 44 u^2 M`` for every coordinate. Where the weights are doubles, their products are exact,
and the sum of two double-doubles is within 4 u^2 of itself, however much cancels: then, and where p or q is zero, M is
|x|.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.compiling.jit import called, inline, merged
from engine.predicates.error_free import (
    U2,
    dd_add,
    dd_div,
    dd_scale,
    even_of,
    is_correctly_rounded,
    two_diff,
    two_prod,
    two_sum,
)
from engine.predicates.expansion import LARGEST, Components, grow_product, sign
from engine.types import FloatArray

CUT_BOUND: Final = 64.0 * U2
POINT_BOUND: Final = 48.0 * U2
"""Error bound of `point_at`, times |p| + |t (q - p)|. t has 18 u^2; the low parts, none above u (|p| + 3.1 |t (q -
p)|), lose 17 u^2 in five sums and two products, their product that is left out 3.1 u^2, the test 6 u^2: below 45 u^2.
"""
T_BOUND: Final = 24.0 * U2
"""Relative error bound of t as a double-double: 18 u^2 for a quotient of double-doubles, and the test of its rounding.
"""
TINY: Final = 2.0**-1070
"""Added to bounds for products that underflow: at most four of 2^-1074."""
_SCALE: Final = 2.0**600
_NEXT: Final = 4
"""Neighbouring doubles that `nearest` tries: a guess is off by one or two units."""


@merged
def point_along(p: float, q: float, th: float, tl: float) -> tuple[float, float, float, float]:
    """Return (h, l, m, d): h + l is p + t (q - p) as a double-double, t = th + tl; m and d are t (q - p) and q - p,
    rounded."""
    dh, dl = two_diff(q, p)
    mh, ml = two_prod(th, dh)
    sh, sl = two_sum(p, mh)
    return sh, (sl + ml) + (tl * dh + th * dl), mh, dh


@inline
def point_at(p: float, q: float, th: float, tl: float, slack: float) -> tuple[float, bool]:
    """Return p + t (q - p), t = th + tl, rounded, and whether it is the proven nearest double. slack: relative error of
    t beside that of a quotient of double-doubles, 18 u^2. Coordinates below 2^1000. A zero is never certified unless p
    = q."""
    sh, low, mh, _ = point_along(p, q, th, tl)
    bound = POINT_BOUND * (abs(p) + abs(mh)) + slack * abs(mh) + TINY
    return sh + low, (sh + (low - bound) == sh + (low + bound)) | (p == q)


@called
def side_of(
    p: float, q: float, wp: Components, n_wp: int, wq: Components, n_wq: int, x: float, step: float, e: Components
) -> int:
    """Return the exact sign of (p w_q + q w_p) / (w_p + w_q) - (x + step): on which side of x + step the cut lies. wp,
    wq: the weights, positive, as expansions of n_wp and n_wq components. `e` is a workspace of 6 (n_wp + n_wq) places.
    """
    n = 0
    ah, al = two_diff(p, x)
    bh, bl = two_diff(q, x)
    for i in range(n_wq):
        n = grow_product(e, n, wq[i], al)
        n = grow_product(e, n, wq[i], -step)
        n = grow_product(e, n, wq[i], ah)
    for i in range(n_wp):
        n = grow_product(e, n, wp[i], bl)
        n = grow_product(e, n, wp[i], -step)
        n = grow_product(e, n, wp[i], bh)
    return sign(e, n)


@called
def nearest(
    p: float, q: float, wp: Components, n_wp: int, wq: Components, n_wq: int, sum_h: float, sum_l: float, e: Components
) -> tuple[float, bool]:
    """Return the double nearest to (p w_q + q w_p) / (w_p + w_q), and whether it is certain; False if numbers are out
    of range.

    wp, wq: the weights, positive compressed expansions (or zero, not both) of components within 2^-240 .. 2^240. sum_h,
    sum_l: their sum as a double-double, to 4 u^2. `e`: workspace of 6 (n_wp + n_wq) places. p and q must not be so far
    apart in size that products underflow. Subnormal results are rounded correctly too, on numbers times 2^600."""
    if p == q or n_wp == 0:
        return p + 0.0, True
    if n_wq == 0:
        return q + 0.0, True
    scale = _SCALE if max(abs(p), abs(q)) < 1.0 / LARGEST else 1.0
    p, q = p * scale, q * scale
    if not ((p == 0.0 or abs(p) >= 2.0**-480) and (q == 0.0 or abs(q) >= 2.0**-480) and max(abs(p), abs(q)) < _SCALE):
        return 0.0, False
    wp_l, wq_l = (wp[n_wp - 2] if n_wp > 1 else 0.0), (wq[n_wq - 2] if n_wq > 1 else 0.0)
    ah, al = dd_scale(wq[n_wq - 1], wq_l, p)
    bh, bl = dd_scale(wp[n_wp - 1], wp_l, q)
    h, low = dd_add(ah, al, bh, bl)
    if h == 0.0 and wp_l == 0.0 and wq_l == 0.0:
        return 0.0, True  # case: products without error that cancel, a cut exactly at zero (lattices)
    h, low = dd_div(h, low, sum_h, sum_l)
    is_whole = (n_wp == 1 and n_wq == 1) or p == 0.0 or q == 0.0  # the products are exact, or nothing cancels
    bound = CUT_BOUND * (abs(h) if is_whole else max(abs(p), abs(q)))
    if scale == 1.0 and is_correctly_rounded(h, low, bound):
        return h, True
    is_close = scale == 1.0 and bound <= 2.0**-56 * abs(h)
    if not is_close and side_of(p, q, wp, n_wp, wq, n_wq, 0.0, 0.0, e) == 0:
        return 0.0, True
    x = h / scale
    if scale == 1.0 and abs(x) < 2.0**-500:
        return x, False
    # invariant: the nearest double is x or beyond on the side tested, on both sides until it is bracketed
    is_up, is_bracketed = low > 0.0, is_close
    for _ in range(_NEXT):
        other = np.nextafter(x, np.inf if is_up else -np.inf)
        side = side_of(p, q, wp, n_wp, wq, n_wq, x * scale, 0.5 * ((other - x) * scale), e)
        if side == 0:
            return even_of(x * scale, other * scale) / scale + 0.0, True
        is_beyond = (side > 0) == is_up
        if is_beyond:
            x = other
        elif not is_bracketed:
            is_up = not is_up
        if is_close or (is_bracketed and not is_beyond):
            return x + 0.0, True
        is_bracketed = True
    return x, False


@inline
def parameter_and_point(
    segment: FloatArray, wp: Components, n_wp: int, wq: Components, n_wq: int, axis: int, at: float, point: FloatArray,
    e: Components,
) -> tuple[float, bool]:  # fmt: skip
    """Set `point` (d,) to the nearest doubles of the point that divides the segment (2, d) by the weights wp, wq;
    return its parameter t, 0 at the start, and whether all are certified. axis, at: an axis on which the coordinate is
    known to be at, -1 for none. Weights and workspace `e`: as in `nearest`."""
    sum_h, sum_l = dd_add(
        wp[n_wp - 1] if n_wp > 0 else 0.0,
        wp[n_wp - 2] if n_wp > 1 else 0.0,
        wq[n_wq - 1] if n_wq > 0 else 0.0,
        wq[n_wq - 2] if n_wq > 1 else 0.0,
    )
    t, are_all_nearest = 0.0, True
    for k in range(-1, point.size):  # -1: t itself, from 0 to 1
        x, is_nearest = at, True
        if k != axis or k < 0:
            p, q = (0.0, 1.0) if k < 0 else (segment[0, k], segment[1, k])
            x, is_nearest = nearest(p, q, wp, n_wp, wq, n_wq, sum_h, sum_l, e)
        are_all_nearest = are_all_nearest and is_nearest
        if k < 0:
            t = x
        else:
            point[k] = x
    return t, are_all_nearest
