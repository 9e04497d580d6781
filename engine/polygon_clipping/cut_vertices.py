"""Vertices that planes cut, coordinate by coordinate, as a double, what it leaves over and a bound: arithmetic only.

An original vertex leaves nothing over and has the bound zero, and so has a coordinate that is known to be a double.

Bound of a coordinate of a part of an original edge, x + t (y - x), with u = 2^-53 and t = a / (a - b) from differences
to the plane, which are exact as double-doubles: t loses 1 u^2 of a for each of 2 products and 2 sums, and twice the
square of the first quotient's error (2 u), below 20 u^2 in all; the products and sums of `on_edge` add four roundings
of low parts, none above 3 u |t (y - x)| + u |x|; below 40 u^2 (|x| + |t (y - x)|). Of one between vertices that were
cut: the larger bound of both ends (it lies between them), the roundings of cut_point.py, and r |y - x| for weights
known to a relative r: the parameter moves by at most 2 r t (1 - t) <= r / 2.

Range: coordinates below 2^64. Numbers that t or a quotient divides by are above `WIDEST`, so what underflows, below
2^-1074, comes to less than 2^-870 and is covered by `TINY`.
"""

from __future__ import annotations

from typing import Final

from engine.jit import inline
from engine.predicates.cut_point import CUT_BOUND, POINT_BOUND
from engine.predicates.double_double import U2, dd_add, dd_div, dd_mul
from engine.predicates.error_free import fma, two_diff, two_prod, two_sum

VALUE_BOUND: Final = 16.0 * 2.0**-53
"""Signs in doubles: a term loses the low parts of row and vertex, a product, three sums; its size as much again."""
DD_VALUE_BOUND: Final = 32.0 * U2
"""Values in double-double: rows known to 2 u^2, products 5 u^2, three sums of 4 u^2."""
EDGE_BOUND: Final = 64.0 * U2
TINY: Final = 2.0**-800
WIDEST: Final = 2.0**-200


@inline
def share_of_edge(a: float, b: float, place: float) -> tuple[float, float, bool]:
    """Return t = (a - place) / (a - b) as a double-double for place between a and b; False where it underflows."""
    h, low = two_diff(a, place)
    length, rest = two_diff(a, b)
    inverse = 1.0 / length
    th = h * inverse
    return th, (fma(-th, length, h) + (low - th * rest)) * inverse, abs(length) > WIDEST


@inline
def on_edge(x: float, y: float, th: float, tl: float) -> tuple[float, float, float]:
    """Return x + t (y - x) and its bound, for original x and y."""
    dh, dl = two_diff(y, x)
    mh, ml = two_prod(th, dh)
    sh, sl = two_sum(x, mh)
    h, rest = two_sum(sh, (sl + ml) + (tl * dh + th * dl))
    return h, rest, (EDGE_BOUND * (abs(x) + abs(mh)) + TINY if x != y else 0.0)


@inline
def is_at(x: float, y: float, a: float, b: float, place: float, guess: float) -> bool:
    """Tell whether x + (a - place) / (a - b) (y - x) is surely `guess`: products of differences that are doubles."""
    x_off, x_low = two_diff(x, guess)
    y_off, y_low = two_diff(y, guess)
    a_off, a_low = two_diff(a, place)
    b_off, b_low = two_diff(b, place)
    if x_low != 0.0 or y_low != 0.0 or a_low != 0.0 or b_low != 0.0 or min(abs(a_off), abs(b_off)) < WIDEST:
        return False
    if (x_off != 0.0 and abs(x_off) < WIDEST) or (y_off != 0.0 and abs(y_off) < WIDEST):
        return False
    first, first_low = two_prod(x_off, b_off)
    second, second_low = two_prod(y_off, a_off)
    return first == second and first_low == second_low


@inline
def distance_across(x: float, low: float, bound: float, at: float) -> tuple[float, float, float]:
    """Return x - at as a double-double, and its bound."""
    if low == 0.0:
        h, rest = two_diff(x, at)
        return h, rest, bound
    h, rest = dd_add(x, low, -at, 0.0)
    return h, rest, bound + 4.0 * U2 * abs(h)


@inline
def plus_term(
    h: float, rest: float, size: float, moved: float, a: float, a_low: float, x: float, x_low: float, bound: float
) -> tuple[float, float, float, float]:
    """Return the sum h + rest with a x added to it, and its sums of sizes and of bounds; see `value_bound`."""
    ph, pl = dd_mul(a, a_low, x, x_low)
    h, rest = dd_add(h, rest, ph, pl)
    return h, rest, size + abs(ph), moved + abs(a) * bound


@inline
def value_bound(size: float, moved: float) -> float:
    """Return the bound of a value of a plane at a vertex, from the sums that `plus_term` makes."""
    return DD_VALUE_BOUND * size + 1.01 * moved + TINY


@inline
def between(
    x: float,
    x_low: float,
    x_bound: float,
    y: float,
    y_low: float,
    y_bound: float,
    ph: float,
    pl: float,
    qh: float,
    ql: float,
    sum_h: float,
    sum_l: float,
    th: float,
    tl: float,
    r: float,
) -> tuple[float, float, float]:
    """Return the coordinate (x |q| + y |p|) / (|p| + |q|) = x + t (y - x) and its bound."""
    if x_low != 0.0 or y_low != 0.0 or x_bound != 0.0 or y_bound != 0.0:
        ah, al = dd_mul(x, x_low, qh, ql)
        bh, bl = dd_mul(y, y_low, ph, pl)
        nh, nl = dd_add(ah, al, bh, bl)
        h, rest = dd_div(nh, nl, sum_h, sum_l)
        bound = 1.01 * (max(x_bound, y_bound) + CUT_BOUND * max(abs(x), abs(y)) + r * abs(y - x))
        return h, rest, bound + TINY
    if x == y:
        return x, 0.0, 0.0
    dh, dl = two_diff(y, x)
    mh, ml = two_prod(th, dh)
    sh, sl = two_sum(x, mh)
    h, rest = two_sum(sh, (sl + ml) + (tl * dh + th * dl))
    return h, rest, 1.01 * (POINT_BOUND * (abs(x) + abs(mh)) + r * abs(dh)) + TINY
