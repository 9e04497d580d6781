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

from collections import namedtuple
from typing import Final, NamedTuple

from engine.compiling.jit import inline, merged
from engine.polygon_clipping.rings import Plane
from engine.predicates.cut_point import CUT_BOUND, POINT_BOUND, point_along
from engine.predicates.error_free import U2, dd_add, dd_div, dd_mul, fma, surely_rounded, two_diff, two_prod, two_sum

VALUE_BOUND: Final = 16.0 * 2.0**-53
"""Signs in doubles: a term loses the low parts of row and vertex, a product, three sums; its size as much again."""
DD_VALUE_BOUND: Final = 32.0 * U2
"""Values in double-double: rows known to 2 u^2, products 5 u^2, three sums of 4 u^2."""
EDGE_BOUND: Final = 64.0 * U2
TINY: Final = 2.0**-800
WIDEST: Final = 2.0**-200
Triple = tuple[float, float, float]


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
    h, low, mh, _ = point_along(x, y, th, tl)
    h, rest = two_sum(h, low)
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


class Share(NamedTuple):
    """Where an edge is cut: weights |p|, |q|, their sum, t = |p| / sum as double-doubles, t known to a relative r."""

    ph: float
    pl: float
    qh: float
    ql: float
    sum_h: float
    sum_l: float
    th: float
    tl: float
    r: float


@inline
def between(x: Triple, y: Triple, s: Share) -> Triple:
    """Return (x |q| + y |p|) / (|p| + |q|) = x + t (y - x) for coordinates given as double, rest and bound."""
    x_h, x_low, x_bound = x
    y_h, y_low, y_bound = y
    if x_low != 0.0 or y_low != 0.0 or x_bound != 0.0 or y_bound != 0.0:
        ah, al = dd_mul(x_h, x_low, s.qh, s.ql)
        bh, bl = dd_mul(y_h, y_low, s.ph, s.pl)
        nh, nl = dd_add(ah, al, bh, bl)
        h, rest = dd_div(nh, nl, s.sum_h, s.sum_l)
        bound = 1.01 * (max(x_bound, y_bound) + CUT_BOUND * max(abs(x_h), abs(y_h)) + s.r * abs(y_h - x_h))
        return h, rest, bound + TINY
    if x_h == y_h:
        return x_h, 0.0, 0.0
    h, low, mh, dh = point_along(x_h, y_h, s.th, s.tl)
    h, rest = two_sum(h, low)
    return h, rest, 1.01 * (POINT_BOUND * (abs(x_h) + abs(mh)) + s.r * abs(dh)) + TINY


Vertices = namedtuple("Vertices", "pool rests edges names")
"""The vertices of a ring, those that it came with first, then the cut ones.

pool: (room * dim,) float64, their doubles. rests: (room * dim * 2,) float64, for each coordinate of a cut what its
double leaves over, and the bound of its error. edges: (room,) int32, the original edge that goes on from a vertex, by
its first vertex, -1 for one along a plane. names: as many numbers as there are axes, so that their count is known when
this is compiled.
"""


@merged
def are_same(s: Vertices, v: int, u: int) -> bool:
    """Tell whether the doubles of two vertices are equal."""
    d, is_same = len(s.names), True
    for k in range(d):
        is_same = is_same & (s.pool[v * d + k] == s.pool[u * d + k])
    return is_same


@merged
def coordinate(s: Vertices, v: int, k: int, n_ring: int) -> Triple:
    """Return a coordinate of a vertex: its double, what that leaves over, and the bound."""
    place = v * len(s.names) + k
    rest, bound = (s.rests[2 * place], s.rests[2 * place + 1]) if v >= n_ring else (0.0, 0.0)
    return s.pool[place], rest, bound


@merged
def put_coordinate(s: Vertices, v: int, k: int, h: float, rest: float, bound: float) -> None:
    """Set a coordinate of a cut vertex."""
    place = v * len(s.names) + k
    s.pool[place], s.rests[2 * place], s.rests[2 * place + 1] = h, rest, bound


@merged
def value_of(s: Vertices, plane: Plane, v: int, n_ring: int) -> Triple:
    """Return the value of a plane at a vertex as a double-double, and its bound."""
    if plane.axis >= 0:
        x, rest, bound = coordinate(s, v, plane.axis, n_ring)
        return distance_across(x, rest, bound, plane.place)
    d, number = len(s.names), plane.number
    h, low = plane.high[number, d], plane.low[number, d]
    size, moved = abs(h), 0.0
    for k in range(d):
        x, rest, bound = coordinate(s, v, k, n_ring)
        ph, pl = dd_mul(plane.high[number, k], plane.low[number, k], x, rest)
        h, low = dd_add(h, low, ph, pl)
        size, moved = size + abs(ph), moved + abs(plane.high[number, k]) * bound
    return h, low, DD_VALUE_BOUND * size + 1.01 * moved + TINY


@merged
def cut_original(s: Vertices, plane: Plane, p: int, q: int, j: int) -> bool:
    """Set vertex j to where an original edge crosses a plane across an axis; return whether its doubles are sure."""
    d, axis, place = len(s.names), plane.axis, plane.place
    a, b = s.pool[p * d + axis], s.pool[q * d + axis]
    th, tl, is_sure = share_of_edge(a, b, place)
    for k in range(d):
        h, rest, bound = place, 0.0, 0.0
        if k != axis:
            x, y = s.pool[p * d + k], s.pool[q * d + k]
            h, rest, bound = on_edge(x, y, th, tl)
            if abs(rest) <= bound:
                near_double = h if abs(h) > bound else 0.0
                if is_at(x, y, a, b, place, near_double):
                    h, rest, bound = near_double, 0.0, 0.0
            is_sure = is_sure & surely_rounded(h, rest, bound)
        put_coordinate(s, j, k, h, rest, bound)
    return is_sure


@merged
def is_along_axis(s: Vertices, axis: int, p: int, q: int, n_ring: int) -> bool:
    """Tell whether p and q have the same doubles as coordinates, but for those of an axis."""
    d, is_along = len(s.names), True
    for k in range(d):
        is_double = (p < n_ring or s.rests[2 * (p * d + k) + 1] == 0.0) and (
            q < n_ring or s.rests[2 * (q * d + k) + 1] == 0.0
        )
        is_along = is_along and (k == axis or (is_double and s.pool[p * d + k] == s.pool[q * d + k]))
    return is_along


@merged
def cut_anew(s: Vertices, plane: Plane, p: int, q: int, n_ring: int, j: int) -> bool:
    """Set vertex j to where an edge between any vertices crosses a plane; return whether its doubles are sure."""
    d = len(s.names)
    ph, pl, p_bound = value_of(s, plane, p, n_ring)
    qh, ql, q_bound = value_of(s, plane, q, n_ring)
    if ph < 0.0:
        ph, pl = -ph, -pl
    if qh < 0.0:
        qh, ql = -qh, -ql
    if not (p_bound < 0.001 * ph and q_bound < 0.001 * qh and min(ph, qh) > WIDEST):
        return False
    r = 1.01 * max(p_bound / ph, q_bound / qh) if p_bound > 0.0 or q_bound > 0.0 else 0.0
    sum_h, sum_l = dd_add(ph, pl, qh, ql)
    th, tl = dd_div(ph, pl, sum_h, sum_l)
    share, is_sure = Share(ph, pl, qh, ql, sum_h, sum_l, th, tl, r), True
    for k in range(d):
        h, rest, bound = plane.place, 0.0, 0.0
        if k != plane.axis:
            h, rest, bound = between(coordinate(s, p, k, n_ring), coordinate(s, q, k, n_ring), share)
        is_sure = is_sure & surely_rounded(h, rest, bound)
        put_coordinate(s, j, k, h, rest, bound)
    return is_sure


@merged
def cut_edge(s: Vertices, plane: Plane, v: int, w: int, n_ring: int, j: int) -> bool:
    """Set vertex j to where the edge v w crosses a plane; return whether its doubles are sure.

    A part of an original edge is cut as the whole of it is.
    """
    edge, p, q = s.edges[v], v, w
    if edge >= 0:
        p, q = edge, edge + 1 if edge + 1 < n_ring else 0
        if plane.axis >= 0:
            return cut_original(s, plane, p, q, j)
    elif plane.axis >= 0 and is_along_axis(s, plane.axis, p, q, n_ring):
        for k in range(len(s.names)):  # case: along a plane across another axis, to a corner of a box
            put_coordinate(s, j, k, plane.place if k == plane.axis else s.pool[p * len(s.names) + k], 0.0, 0.0)
        return True
    return cut_anew(s, plane, p, q, n_ring, j)
