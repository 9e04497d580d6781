"""The point and the parameter at which a segment p q crosses a plane, correctly rounded, from the end points.

With weights w_p = |s_p| and w_q = |s_q| (distances of the ends from the plane, up to a common factor),

    t = w_p / (w_p + w_q),        x = p + t (q - p) = (p w_q + q w_p) / (w_p + w_q).

Only original end points enter, never a point cut before. Three tries, each dearer and surer than the one before:

1. `point_at`: x = p + t (q - p) with t as a double-double;
2. `cut_coordinate`: the weighted form, which finds an exact zero;
3. `nearest_by_signs`: the double whose midpoints with its neighbours enclose x, by exact signs; ties go to even.

The first two say whether the double is surely the nearest; where the third has no range, rational arithmetic settles
the item (exact_segments.py).

Bound of the weighted form. The weights are known to a relative r each. Products add 2 u^2, their sum 4 u^2, the sum of
the weights 4 u^2, the quotient 16 u^2, the test `surely_rounded` 2 u^2: with M = max(|p|, |q|) every coordinate is
within (28 u^2 + 2 r) M of its value; 40 u^2 + 2.5 r covers the terms of higher order for r < 0.01.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.jit import inline
from engine.predicates.double_double import U2, dd_add, dd_div, dd_scale, even_of, surely_rounded
from engine.predicates.error_free import two_diff, two_prod, two_sum
from engine.predicates.expansion import Components, grow_product, sign

CUT_BOUND: Final = 40.0 * U2
WEIGHT_FACTOR: Final = 2.5
LARGEST: Final = 2.0**120
SMALLEST: Final = 2.0**-120
"""Coordinates of kernels that use double-double or expansions are zero or within these: products of degree four
keep all their bits (multiples of 2^-172 after a difference, of 2^-688 after a product of four)."""
POINT_BOUND: Final = 48.0 * U2
"""Of `point_at`, times |p| + |t (q - p)|: t carries 16 u^2 (18 with its weights), the sum of the low parts, none above
u (|p| + 3 |t (q - p)|), four roundings, and the test one more: below 32 u^2."""
TINY: Final = 2.0**-1070
"""Added to bounds for products that underflow: at most four of 2^-1074."""
_SCALE: Final = 2.0**600
_NEXT: Final = 4
"""Neighbours that `nearest_by_signs` goes on to: a guess is off by one or two units."""


@inline
def is_safe(x: float) -> bool:
    """Tell whether x is zero or of a size for which products of degree four are exact as expansions."""
    return x == 0.0 or SMALLEST <= abs(x) <= LARGEST


@inline
def point_at(p: float, q: float, th: float, tl: float, slack: float) -> tuple[float, bool]:
    """Return p + t (q - p) and whether it is surely the nearest double; t is known within 18 u^2 + `slack` of itself.

    Coordinates below 2^1000. A zero is never sure unless p = q.
    """
    if p == q:
        return p, True
    dh, dl = two_diff(q, p)
    mh, ml = two_prod(th, dh)
    sh, sl = two_sum(p, mh)
    low = (sl + ml) + (tl * dh + th * dl)
    bound = POINT_BOUND * (abs(p) + abs(mh)) + slack * abs(mh) + TINY
    return sh + low, sh + (low - bound) == sh + (low + bound)


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


@inline
def side_of(
    p: float, q: float, wp: Components, n_wp: int, wq: Components, n_wq: int, x: float, step: float, e: Components
) -> int:
    """Return the exact sign of (p w_q + q w_p) / (w_p + w_q) - (x + step); `e` has 6 (n_wp + n_wq) places."""
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


@inline
def nearest_by_signs(
    p: float, q: float, wp: Components, n_wp: int, wq: Components, n_wq: int, guess: float, e: Components
) -> tuple[float, bool]:
    """Return the double nearest to (p w_q + q w_p) / (w_p + w_q), and False where it is far from `guess`.

    wp, wq: positive expansions (or zero, not both) of components within 2^-240 .. 2^240. `e`: see `side_of`. Also
    False where p, q are so far apart in size that products underflow. Subnormal results are rounded right too: all is
    done on numbers times 2^600 there.
    """
    scale = 1.0
    if max(abs(p), abs(q)) < 1.0 / LARGEST:
        scale = _SCALE
    p, q = p * scale, q * scale
    if not ((p == 0.0 or abs(p) >= 2.0**-480) and (q == 0.0 or abs(q) >= 2.0**-480) and max(abs(p), abs(q)) < _SCALE):
        return guess, False
    if side_of(p, q, wp, n_wp, wq, n_wq, 0.0, 0.0, e) == 0:
        return 0.0, True
    x = guess
    if scale == 1.0 and abs(x) < 2.0**-500:
        return guess, False
    for _ in range(_NEXT):
        above, below = np.nextafter(x, np.inf), np.nextafter(x, -np.inf)
        side = side_of(p, q, wp, n_wp, wq, n_wq, x * scale, 0.5 * ((above - x) * scale), e)
        if side == 0:
            return even_of(x * scale, above * scale) / scale + 0.0, True
        if side > 0:
            x = above
            continue
        side = side_of(p, q, wp, n_wp, wq, n_wq, x * scale, 0.5 * ((below - x) * scale), e)
        if side == 0:
            return even_of(x * scale, below * scale) / scale + 0.0, True
        if side > 0:
            return x + 0.0, True
        x = below
    return guess, False


@inline
def parameter_and_point(
    segment: Any, wp: Components, n_wp: int, wq: Components, n_wq: int, axis: int, at: float, point: Any, e: Components
) -> tuple[float, bool]:
    """Set `point` to the nearest doubles, by signs, of the point with these weights; return t and whether all is sure.

    axis, at: an axis whose coordinate is known, -1 for none. Places of `e`, sizes of weights: `nearest_by_signs`.
    """
    wp_h = wp[n_wp - 1] if n_wp > 0 else 0.0
    wp_l = wp[n_wp - 2] if n_wp > 1 else 0.0
    wq_h = wq[n_wq - 1] if n_wq > 0 else 0.0
    wq_l = wq[n_wq - 2] if n_wq > 1 else 0.0
    sum_h, sum_l = dd_add(wp_h, wp_l, wq_h, wq_l)
    t, _ = cut_parameter(wp_h, wp_l, wq_h, wq_l, sum_h, sum_l, 0.0)
    t, sure = nearest_by_signs(0.0, 1.0, wp, n_wp, wq, n_wq, t, e)
    for k in range(point.size):
        p, q = segment[0, k], segment[1, k]
        if k == axis:
            point[k] = at
        elif p == q:
            point[k] = p
        else:
            guess, _ = cut_coordinate(p, q, wp_h, wp_l, wq_h, wq_l, sum_h, sum_l, 0.0)
            point[k], is_sure = nearest_by_signs(p, q, wp, n_wp, wq, n_wq, guess, e)
            sure = sure and is_sure
    return t, sure
