"""Vertices that planes have cut, as double-doubles with bounds: the arithmetic of sutherland_hodgman.py.

points: (room, dim, 3) float64, for each coordinate a double-double and the bound of its error; an original vertex has
the bound zero, and so has a coordinate that is known to be a double. high, low: a plane's row as double-doubles.

Bound of a cut coordinate: the larger bound of both ends (x lies between them), the roundings of cut_point.py, and
r |q - p| for weights known to a relative r: the parameter moves by at most 2 r t (1 - t) <= r / 2.
"""

from __future__ import annotations

from typing import Any, Final

from engine.clipping.cut_point import CUT_BOUND, POINT_BOUND, side_of
from engine.clipping.cyrus_beck import exact_sign, expand_value
from engine.jit import inline
from engine.predicates.double_double import U2, dd_add, dd_div, dd_mul, dd_sub
from engine.predicates.error_free import two_diff, two_prod, two_sum, workspace
from engine.types import UNDECIDED

VALUE_BOUND: Final = 16.0 * 2.0**-53
"""Signs in doubles: a term loses the low parts of row and vertex, a product, three sums; its size as much again."""
ACROSS_BOUND: Final = 4.0 * 2.0**-53
"""A difference of a coordinate and a plane's, rounded twice."""
DD_VALUE_BOUND: Final = 32.0 * U2
"""Signs in double-double: rows known to 2 u^2, products 5 u^2, three sums of 4 u^2."""


@inline
def rough_sign(row: Any, points: Any, i: int) -> int:
    """Return the sign of a row at vertex i from doubles, UNDECIDED where they do not prove it."""
    d = row.size - 1
    value, size, moved = row[d], abs(row[d]), 0.0
    for k in range(d):
        term = row[k] * points[i, k, 0]
        value += term
        size += abs(term)
        moved += abs(row[k]) * points[i, k, 2]
    bound = VALUE_BOUND * size + 1.01 * moved
    return 1 if value > bound else (-1 if -value > bound else UNDECIDED)


@inline
def value_of(high: Any, low: Any, points: Any, i: int) -> tuple[float, float, float]:
    """Return the value of a row of double-doubles at vertex i, and its bound."""
    d = high.size - 1
    h, rest, size, moved = high[d], low[d], abs(high[d]), 0.0
    for k in range(d):
        ph, pl = dd_mul(high[k], low[k], points[i, k, 0], points[i, k, 1])
        h, rest = dd_add(h, rest, ph, pl)
        size += abs(ph)
        moved += abs(high[k]) * points[i, k, 2]
    return h, rest, DD_VALUE_BOUND * size + 1.01 * moved


@inline
def sign_across(sense: float, axis: int, at: float, points: Any, i: int) -> int:
    """Return the exact sign at vertex i of the plane where a coordinate is `at`, or UNDECIDED; sense: of its normal."""
    h, low, bound = points[i, axis, 0], points[i, axis, 1], points[i, axis, 2]
    gap = (h - at) + low  # h and at close: the difference is exact; else far beyond any bound
    if low == 0.0 and bound == 0.0:
        gap, slack = (1.0 if h > at else (-1.0 if h < at else 0.0)), 0.0
        if gap == 0.0:
            return 0
    else:
        slack = bound + 4.0 * 2.0**-53 * abs(low) + ACROSS_BOUND * abs(gap)
    if abs(gap) > slack:
        return 1 if gap * sense > 0.0 else -1
    return UNDECIDED


@inline
def is_exact(points: Any, i: int) -> bool:
    """Tell whether every coordinate of vertex i is a known double."""
    exact = True
    for k in range(points.shape[1]):
        exact = exact and points[i, k, 2] == 0.0 and points[i, k, 1] == 0.0
    return exact


@inline
def is_double_row(low: Any) -> bool:
    """Tell whether a row of double-doubles is one of doubles."""
    exact = True
    for k in range(low.size):
        exact = exact and low[k] == 0.0
    return exact


@inline
def sign_at(high: Any, low: Any, points: Any, i: int) -> int:
    """Return the exact sign of a row at vertex i, or UNDECIDED."""
    roughly = rough_sign(high, points, i)
    if roughly != UNDECIDED:
        return roughly
    if is_double_row(low) and is_exact(points, i):
        return exact_sign(high, points[i, :, 0])
    h, _, bound = value_of(high, low, points, i)
    return 1 if h > bound else (-1 if -h > bound else UNDECIDED)


@inline
def compare_vertices(points: Any, i: int, j: int) -> int:
    """Return 0 if two vertices are the same point, 1 if they surely differ, else UNDECIDED."""
    for k in range(points.shape[1]):
        h, _ = dd_sub(points[i, k, 0], points[i, k, 1], points[j, k, 0], points[j, k, 1])
        slack = 8.0 * U2 * (abs(points[i, k, 0]) + abs(points[j, k, 0]))
        if abs(h) > points[i, k, 2] + points[j, k, 2] + slack:
            return 1
    if not (is_exact(points, i) and is_exact(points, j)):
        return UNDECIDED
    for k in range(points.shape[1]):
        if points[i, k, 0] != points[j, k, 0]:
            return 1
    return 0


@inline
def copy_vertex(source: Any, i: int, target: Any, j: int) -> None:
    for k in range(source.shape[1]):
        target[j, k, 0], target[j, k, 1], target[j, k, 2] = source[i, k, 0], source[i, k, 1], source[i, k, 2]


@inline
def is_at(high: Any, source: Any, p: int, q: int, k: int, x: float) -> bool:
    """Tell whether coordinate k is exactly x where the edge p q crosses the plane of a row; all three known doubles."""
    wp, wq, e = workspace(8), workspace(8), workspace(96)
    n_wp, n_wq = expand_value(high, source[p, :, 0], wp), expand_value(high, source[q, :, 0], wq)
    # the values have two signs: turned over, one of them is a weight, and the sign asked for is not that of zero
    for i in range(n_wq):
        wq[i] = -wq[i]
    return side_of(source[p, k, 0], source[q, k, 0], wp, n_wp, wq, n_wq, x, 0.0, e) == 0


@inline
def cut_edge(high: Any, low: Any, axis: int, at: float, source: Any, p: int, q: int, target: Any, j: int) -> bool:
    """Set vertex j of `target` to where the edge p q crosses a plane; False where a value is known too roughly.

    A coordinate that may be a double is compared with it exactly, where both ends and the row are doubles: cuts that
    hit a lattice or another plane stay exact.
    """
    if axis >= 0:
        ph, pl = dd_add(source[p, axis, 0], source[p, axis, 1], -at, 0.0)
        qh, ql = dd_add(source[q, axis, 0], source[q, axis, 1], -at, 0.0)
        p_bound = source[p, axis, 2] + 4.0 * U2 * abs(ph)
        q_bound = source[q, axis, 2] + 4.0 * U2 * abs(qh)
    else:
        ph, pl, p_bound = value_of(high, low, source, p)
        qh, ql, q_bound = value_of(high, low, source, q)
    if ph < 0.0:
        ph, pl = -ph, -pl
    if qh < 0.0:
        qh, ql = -qh, -ql
    if not (p_bound < 0.001 * ph and q_bound < 0.001 * qh):
        return False
    r = 1.01 * max(p_bound / ph, q_bound / qh)
    sum_h, sum_l = dd_add(ph, pl, qh, ql)
    th, tl = dd_div(ph, pl, sum_h, sum_l)
    for k in range(source.shape[1]):
        xh, xl, x_bound = source[p, k, 0], source[p, k, 1], source[p, k, 2]
        yh, yl, y_bound = source[q, k, 0], source[q, k, 1], source[q, k, 2]
        if k == axis:
            target[j, k, 0], target[j, k, 1], target[j, k, 2] = at, 0.0, 0.0
        elif xh == yh and xl == yl and x_bound == 0.0 and y_bound == 0.0:
            target[j, k, 0], target[j, k, 1], target[j, k, 2] = xh, xl, 0.0
        elif xl == 0.0 and yl == 0.0 and x_bound == 0.0 and y_bound == 0.0:
            dh, dl = two_diff(yh, xh)
            mh, ml = two_prod(th, dh)
            sh, sl = two_sum(xh, mh)
            h, rest = two_sum(sh, (sl + ml) + (tl * dh + th * dl))
            bound = 1.01 * (POINT_BOUND * (abs(xh) + abs(mh)) + r * abs(dh))
            if abs(rest) <= bound:
                double = h if abs(h) > bound else 0.0
                if is_double_row(low) and is_exact(source, p) and is_exact(source, q):
                    if is_at(high, source, p, q, k, double):
                        h, rest, bound = double, 0.0, 0.0
            target[j, k, 0], target[j, k, 1], target[j, k, 2] = h, rest, bound
        else:
            ah, al = dd_mul(xh, xl, qh, ql)
            bh, bl = dd_mul(yh, yl, ph, pl)
            nh, nl = dd_add(ah, al, bh, bl)
            target[j, k, 0], target[j, k, 1] = dd_div(nh, nl, sum_h, sum_l)
            roundings = CUT_BOUND * max(abs(xh), abs(yh)) + r * abs(yh - xh)
            target[j, k, 2] = 1.01 * (max(x_bound, y_bound) + roundings)
    return True
