"""Vertices cut by planes: each coordinate as a double, its remainder and an error bound.

An original vertex has remainder and bound zero, and so has a coordinate that is known to be a double. With u = 2^-53:

    part of an original edge      x + t (y - x), t = a / (a - b), a and b exact differences to the plane
      t                           1 u^2 of a for each of 2 products, 2 sums, + 2 (2 u)^2 (first quotient): < 20 u^2
      `point_on_edge`             + 4 roundings of low parts, each <= 3 u |t (y - x)| + u |x|
      total                       error <= 40 u^2 (|x| + |t (y - x)|)
    between cut vertices          max of both ends' bounds + 64 u^2 (|x| + |t (y - x)|) + r |y - x|
      t                           3 u^2 for the sum of weights, 22 u^2 for the quotient by an inverse
      `interpolate`               low parts, of remainders up to 2 u |x|: 29 u^2 |x| + 27 u^2 |t (y - x)|, their product
                                  left out 4 u^2 |x| + 3 u^2 |t (y - x)|, the test 2 u^2 of both
      r                           the larger error of both plane values over their sum

Range: coordinates below 2^64. Divisors are above `WIDEST`, so underflows (2^-1074) amount to less than 2^-870, which
`TINY` covers.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final, NamedTuple

import numpy as np

from engine.compiling.jit import called, inline, merged
from engine.polygon_clipping.rings import Plane
from engine.predicates.cut_point import point_along
from engine.predicates.digits import SLOT, sign_of, store_double, sum_products
from engine.predicates.error_free import (
    U2,
    dd_add,
    even_of,
    fast_two_sum,
    fma,
    is_correctly_rounded,
    two_diff,
    two_prod,
    two_sum,
)
from engine.types import UNDECIDED

DOUBT: Final = -1
"""Doubles do not prove a decision; also in place of a number of vertices."""
VALUE_BOUND: Final = 16.0 * 2.0**-53
"""Relative error bound of a plane value in doubles: a term loses the low parts of row and vertex, a product, three
sums; its size as much again."""
DD_VALUE_BOUND: Final = 48.0 * U2
"""The same in double-double, times the sum S of |terms|: the low parts of a term lose 17 u^2 S in all, their sum, at
most 8 u S, 24 u^2 S, what is left out 2 u^2 S, and rows are known to 2 u^2."""
EDGE_BOUND: Final = 64.0 * U2
TINY: Final = 2.0**-800
WIDEST: Final = 2.0**-200
_STEPS: Final = 4
"""How many doubles away the nearest one may be: one, and more below the normal ones."""
_ONE, _A, _B, _X2, _Y2, _PLACE, _H, _OTHER, _G2, _SUM = (place * SLOT for place in range(10))
N_HEAP: Final = 10 * SLOT
"""Places of the numbers of `settle` on its heap (digits.py), and the size of the heap."""
Triple = tuple[float, float, float]
Edge = tuple[float, float, float, float]
"""A coordinate of the first and second end of an edge, then theirs along the axis of a plane."""


@inline
def edge_parameter(a: float, b: float, place: float) -> tuple[float, float, bool]:
    """Return (th, tl, is_safe): t = (a - place) / (a - b) as a double-double, for place between a and b; is_safe is
    False if it may underflow."""
    h, low = two_diff(a, place)
    length, rest = two_diff(a, b)
    inverse = 1.0 / length
    th = h * inverse
    return th, (fma(-th, length, h) + (low - th * rest)) * inverse, abs(length) > WIDEST


@inline
def point_on_edge(x: float, y: float, th: float, tl: float) -> tuple[float, float, float]:
    """Return (h, rest, bound): x + t (y - x), t = th + tl, as a double and its remainder, with an error bound; x and y
    are exact."""
    h, low, mh, _ = point_along(x, y, th, tl)
    h, rest = two_sum(h, low)
    return h, rest, (EDGE_BOUND * (abs(x) + abs(mh)) + TINY if x != y else 0.0)


@inline
def is_exactly_at(x: float, y: float, a: float, b: float, place: float, guess: float) -> bool:
    """Return whether x + t (y - x) with t = (a - place) / (a - b) is proven to be `guess`, by products of exact
    differences."""
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
    """Return (h, rest, bound): x + low - at, the value of a plane across an axis, as a double-double with an error
    bound. bound: error bound of x + low."""
    if low == 0.0:
        h, rest = two_diff(x, at)
        return h, rest, bound
    h, rest = dd_add(x, low, -at, 0.0)
    return h, rest, bound + 4.0 * U2 * abs(h)


class Parameter(NamedTuple):
    """Where an edge is cut: t = th + tl, a double-double; moved: how far it may be off by errors of plane values."""

    th: float
    tl: float
    moved: float


@inline
def parameter_of(p: Triple, q: Triple) -> Parameter:
    """Return t = |p| / (|p| + |q|) for the values of a plane at both ends, of different signs and larger than `WIDEST`,
    each (double, remainder, error bound). By errors e and f of the values it moves by (e |q| - f |p|) / (|p| +
    |q|)^2."""
    (ph, pl, p_bound), (qh, ql, q_bound) = p, q
    if ph < 0.0:
        ph, pl = -ph, -pl
    else:
        qh, ql = -qh, -ql
    sum_h, rest = two_sum(ph, qh)
    sum_h, sum_l = fast_two_sum(sum_h, rest + (pl + ql))
    inverse = 1.0 / sum_h
    th = ph * inverse
    tl = ((fma(-th, sum_h, ph) + pl) - th * sum_l) * inverse
    return Parameter(th, tl, 1.01 * max(p_bound, q_bound) * inverse)


@inline
def interpolate(x: Triple, y: Triple, t: Parameter) -> Triple:
    """Return x + t (y - x); x, y and the result are (double, remainder, error bound)."""
    (x_h, x_low, x_bound), (y_h, y_low, y_bound) = x, y
    if x_h == y_h and x_low == y_low and x_bound + y_bound == 0.0:
        return x_h, x_low, 0.0
    dh, dl = two_diff(y_h, x_h)
    mh, ml = two_prod(t.th, dh)
    h, low = two_sum(x_h, mh)
    low = (low + ml) + (t.tl * dh + t.th * (dl + (y_low - x_low))) + x_low
    h, rest = two_sum(h, low)
    return h, rest, 1.01 * (max(x_bound, y_bound) + EDGE_BOUND * (abs(x_h) + abs(mh)) + t.moved * abs(dh)) + TINY


Vertices = namedtuple("Vertices", "pool rests edges names heap terms")
"""The vertices of a ring, original ones first, then the cut ones.

| field | dtype, shape | meaning |
| --- | --- | --- |
| pool | float64 (room * dim,) | their doubles |
| rests | float64 (room * dim * 2,) | by coordinate of a cut vertex its remainder and error bound |
| edges | int32 (room,) | the original edge that leaves a vertex, by its first vertex, -1: along a plane |
| names | tuple | one number an axis: the dimension is a compile-time constant |
| heap, terms | int64 | scratch of `settle`: ten numbers (digits.py), and (6, 3) |
"""


@merged
def are_same(s: Vertices, v: int, u: int) -> bool:
    """Return whether the rounded coordinates of vertices v and u are equal."""
    d, is_same = len(s.names), True
    for k in range(d):
        is_same = is_same & (s.pool[v * d + k] == s.pool[u * d + k])
    return is_same


@merged
def sameness(s: Vertices, v: int, u: int, n_ring: int) -> int:
    """Return 1 if vertices v and u are one point, 0 if not, DOUBT if that is not proven. Vertices below n_ring are
    original ones."""
    if not are_same(s, v, u):
        return 0
    is_known = True
    for k in range(len(s.names)):
        _, v_rest, v_bound = coordinate(s, v, k, n_ring)
        _, u_rest, u_bound = coordinate(s, u, k, n_ring)
        if abs(v_rest - u_rest) > v_bound + u_bound:
            return 0
        is_known = is_known and v_bound + u_bound == 0.0
    return 1 if is_known else DOUBT


@merged
def coordinate(s: Vertices, v: int, k: int, n_ring: int) -> Triple:
    """Return coordinate k of vertex v as (double, remainder, error bound); the vertices below n_ring are original ones,
    exact."""
    place = v * len(s.names) + k
    rest, bound = (s.rests[2 * place], s.rests[2 * place + 1]) if v >= n_ring else (0.0, 0.0)
    return s.pool[place], rest, bound


@merged
def set_coordinate(s: Vertices, v: int, k: int, h: float, rest: float, bound: float) -> None:
    """Set coordinate k of cut vertex v: its double h, remainder and error bound."""
    place = v * len(s.names) + k
    s.pool[place], s.rests[2 * place], s.rests[2 * place + 1] = h, rest, bound


@merged
def value_of(s: Vertices, plane: Plane, v: int, n_ring: int) -> Triple:
    """Return (h, low, bound): the value of a plane at vertex v as a double-double, with an error bound. Vertices below
    n_ring are original ones."""
    if plane.axis >= 0:
        x, rest, bound = coordinate(s, v, plane.axis, n_ring)
        return distance_across(x, rest, bound, plane.place)
    d, number = len(s.names), plane.number
    h, low = plane.high[number, d], plane.low[number, d]
    size, moved = abs(h), 0.0
    for k in range(d):
        a, (x, rest, bound) = plane.high[number, k], coordinate(s, v, k, n_ring)
        term, term_low = two_prod(a, x)
        h, sum_low = two_sum(h, term)
        low += (sum_low + term_low) + (a * rest + plane.low[number, k] * x)
        size, moved = size + abs(term), moved + abs(a) * bound
    h, low = two_sum(h, low)
    return h, low, DD_VALUE_BOUND * size + 1.01 * moved + TINY


@inline
def _load(s: Vertices, x: float, y: float, a: float, b: float, place: float) -> None:
    """Store the numbers of an edge and a plane as `_beyond` takes them."""
    store_double(s.heap, _ONE, 1.0)
    store_double(s.heap, _A, a)
    store_double(s.heap, _B, b)
    store_double(s.heap, _X2, 2.0 * x)
    store_double(s.heap, _Y2, 2.0 * y)
    store_double(s.heap, _PLACE, place)


@inline
def _set_term(s: Vertices, i: int, first: int, second: int, factor: int) -> None:
    s.terms[i, 0], s.terms[i, 1], s.terms[i, 2] = first, second, factor


@inline
def _beyond(s: Vertices, h: float, other: float) -> int:
    """Return the sign of P - g for the point P of `settle` and g = (h + other) / 2; UNDECIDED if numbers are too long.
    That of ``2 (P - g) (a - b)``, the sum of six products."""
    store_double(s.heap, _H, h)
    store_double(s.heap, _OTHER, other)
    _set_term(s, 0, _H, _ONE, 1)
    _set_term(s, 1, _OTHER, _ONE, 1)
    if not sum_products(s.heap, s.terms, 2, _G2):
        return UNDECIDED
    _set_term(s, 0, _A, _Y2, 1)
    _set_term(s, 1, _A, _G2, -1)
    _set_term(s, 2, _PLACE, _Y2, -1)
    _set_term(s, 3, _X2, _B, -1)
    _set_term(s, 4, _X2, _PLACE, 1)
    _set_term(s, 5, _G2, _B, 1)
    return sign_of(s.heap, _SUM) if sum_products(s.heap, s.terms, 6, _SUM) else UNDECIDED


@called
def settle(s: Vertices, coordinate: Triple, edge: Edge, place: float) -> tuple[Triple, bool]:
    """Return ((h, rest, bound), is_known): the double nearest to P = x + t (y - x), t = (a - place) / (a - b), ties to
    even, and what is left, by exact signs. coordinate: the same as doubles tell it. is_known is False where h is some
    doubles off, as it may be near 0, or numbers are too long for digits.py."""
    (h, rest, bound), (x, y, a, b) = coordinate, edge
    if abs(h) <= bound:
        h, rest = 0.0, h + rest
    _load(s, x, y, a, b, place)
    toward = 1 if a > b else -1
    side = toward * _beyond(s, h, h)
    for _ in range(_STEPS):
        if side == 0:
            return (h + 0.0, 0.0, 0.0), True
        other = np.nextafter(h, np.inf if side > 0 else -np.inf)
        beyond = side * toward * _beyond(s, h, other)
        if abs(side) > 1 or abs(beyond) > 1:
            break
        if beyond < 0:
            return (h + 0.0, rest, bound), True
        if beyond == 0:
            near = even_of(h, other)
            return (near + 0.0, h - near + rest, bound), True
        h, rest = other, h - other + rest
        after = toward * _beyond(s, h, h)
        if after == -side:
            return (h + 0.0, rest, bound), True
        side = after
    return (h, rest, bound), False


@merged
def cut_original(s: Vertices, plane: Plane, p: int, q: int, j: int) -> bool:
    """Set vertex j to the crossing of the edge p q, both original vertices, with a plane across an axis; return whether
    all its doubles are proven nearest."""
    d, axis, place = len(s.names), plane.axis, plane.place
    a, b = s.pool[p * d + axis], s.pool[q * d + axis]
    th, tl, is_certified = edge_parameter(a, b, place)
    for k in range(d):
        h, rest, bound = place, 0.0, 0.0
        if k != axis:
            x, y = s.pool[p * d + k], s.pool[q * d + k]
            h, rest, bound = point_on_edge(x, y, th, tl)
            if abs(rest) <= bound:
                near_double = h if abs(h) > bound else 0.0
                if is_exactly_at(x, y, a, b, place, near_double):
                    h, rest, bound = near_double, 0.0, 0.0
            if not is_correctly_rounded(h, rest, bound):
                (h, rest, bound), is_known = settle(s, (h, rest, bound), (x, y, a, b), place)
                is_certified = is_certified & is_known
        set_coordinate(s, j, k, h, rest, bound)
    return is_certified


@merged
def is_along_axis(s: Vertices, axis: int, p: int, q: int, n_ring: int) -> bool:
    """Return whether vertices p and q have the same coordinates, all doubles, except along axis `axis`. Vertices below
    n_ring are original ones."""
    d, is_along = len(s.names), True
    for k in range(d):
        is_double = (p < n_ring or s.rests[2 * (p * d + k) + 1] == 0.0) and (
            q < n_ring or s.rests[2 * (q * d + k) + 1] == 0.0
        )
        is_along = is_along and (k == axis or (is_double and s.pool[p * d + k] == s.pool[q * d + k]))
    return is_along


@merged
def recompute_intersection(s: Vertices, plane: Plane, p: int, q: int, n_ring: int, j: int) -> bool:
    """Set vertex j to the crossing of edge p q, between original or cut vertices, with a plane; return whether all its
    doubles are proven nearest. Vertices below n_ring are original ones."""
    d, at_p, at_q = len(s.names), value_of(s, plane, p, n_ring), value_of(s, plane, q, n_ring)
    size_p, size_q = abs(at_p[0]), abs(at_q[0])
    if not (at_p[2] < 0.001 * size_p and at_q[2] < 0.001 * size_q and min(size_p, size_q) > WIDEST):
        return False
    t, is_certified = parameter_of(at_p, at_q), True
    for k in range(d):
        h, rest, bound = plane.place, 0.0, 0.0
        if k != plane.axis:
            h, rest, bound = interpolate(coordinate(s, p, k, n_ring), coordinate(s, q, k, n_ring), t)
        is_certified = is_certified & is_correctly_rounded(h, rest, bound)
        set_coordinate(s, j, k, h, rest, bound)
    return is_certified


@merged
def cut_edge(s: Vertices, plane: Plane, v: int, w: int, n_ring: int, j: int) -> bool:
    """Set vertex j to the crossing of edge v w with a plane; return whether all its doubles are proven nearest. A part
    of an original edge is cut as the whole edge. Vertices below n_ring are original ones."""
    edge, p, q = s.edges[v], v, w
    if edge >= 0:
        p, q = edge, edge + 1 if edge + 1 < n_ring else 0
        if plane.axis >= 0:
            return cut_original(s, plane, p, q, j)
    elif plane.axis >= 0 and is_along_axis(s, plane.axis, p, q, n_ring):
        for k in range(len(s.names)):  # case: along a plane across another axis, to a corner of a box
            set_coordinate(s, j, k, plane.place if k == plane.axis else s.pool[p * len(s.names) + k], 0.0, 0.0)
        return True
    return recompute_intersection(s, plane, p, q, n_ring, j)
