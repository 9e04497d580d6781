"""Segments on a convex region given by plane rows, decided exactly: outcodes over signed distances, 2D and 3D.

The region is where every row has a x + b y + c z + d >= 0; it may be empty or unbounded. A plane with both end points
strictly outside drops the segment (the outcodes share a bit). A plane with one end outside is entered or left at
t = s_p / (s_p - s_q); the last plane entered and the first one left bound the piece, if in this order. Each plane is
looked at once, so the loop ends; all signs and all comparisons are exact and about the original end points: a filter,
then expansions, then "open" (where exponents leave the range in which expansions are exact).

Source: M. Cyrus, J. Beck, Generalized two- and three-dimensional clipping, 1978; the textbook's exercise:
Cohen-Sutherland generalised to a convex polyhedron. Changed: exact signs of s, exact order of t, cut points from the
original ends.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.clipping.cohen_sutherland import BEYOND_FILTER, DROPPED, KEPT, OPEN
from engine.clipping.cut_point import cut_coordinate, cut_parameter, is_safe
from engine.jit import inline, kernel
from engine.predicates.double_double import U2, dd_add
from engine.predicates.error_free import two_prod, workspace
from engine.predicates.expansion import Components, compress, grow, grow_product, sign
from engine.predicates.parameters import compare_products, compare_ratios_filter
from engine.types import UNDECIDED

VALUE_BOUND: Final = 8.0 * 2.0**-53
"""Bound of a plane value a x + b y + c z + d in doubles, relative to the sum of absolute terms.

Each term carries at most (1 + u)^4, the sum of absolute terms the same; 8 u covers both and its own rounding.
"""
VALUE_TINY: Final = 2.0**-1070
"""Products that underflow lose at most 2^-1074 each."""
DD_VALUE_BOUND: Final = 16.0 * U2
"""Bound of a plane value in double-double: exact products, three sums of 4 u^2 relative to the partial sums."""


@inline
def is_row_safe(row: Any) -> bool:
    """Tell whether every number of a row is zero or of a size for which expansions are exact."""
    safe = True
    for k in range(row.size):
        safe = safe and is_safe(row[k])
    return safe


@inline
def expand_value(row: Any, point: Any, e: Components) -> int:
    """Set e to the exact value of `row` at `point` as an expansion; seven places in 3D. Returns its length."""
    d = row.size - 1
    n = grow(e, 0, row[d])
    for k in range(d):
        n = grow_product(e, n, row[k], point[k])
    return compress(e, n)


@inline
def exact_sign(row: Any, point: Any) -> int:
    """Return the exact sign of `row` at `point`, both within the safe range."""
    e = workspace(8)
    return sign(e, expand_value(row, point, e))


@inline
def exact_order(row_i: Any, row_j: Any, segment: Any) -> int:
    """Return the exact sign of t_i - t_j for two planes that `segment` crosses, all within the safe range."""
    p_i, q_i, p_j, q_j, e = workspace(8), workspace(8), workspace(8), workspace(8), workspace(200)
    n_pi, n_qi = expand_value(row_i, segment[0], p_i), expand_value(row_i, segment[1], q_i)
    n_pj, n_qj = expand_value(row_j, segment[0], p_j), expand_value(row_j, segment[1], q_j)
    return compare_products(p_i, n_pi, q_j, n_qj, p_j, n_pj, q_i, n_qi, e)


@inline
def dd_value(row: Any, point: Any) -> tuple[float, float, float]:
    """Return the value of `row` at `point` as a double-double and a bound of its error."""
    d = row.size - 1
    h, low, magnitude = row[d], 0.0, abs(row[d])
    for k in range(d):
        ph, pl = two_prod(row[k], point[k])
        h, low = dd_add(h, low, ph, pl)
        magnitude += abs(ph)
    return h, low, DD_VALUE_BOUND * magnitude


@inline
def leading_value(row: Any, point: Any) -> tuple[float, float, float]:
    """Return the value of `row` at `point` as a double-double from its expansion, and a bound: zero if exact."""
    e = workspace(8)
    n = expand_value(row, point, e)
    if n == 0:
        return 0.0, 0.0, 0.0
    if n == 1:
        return e[0], 0.0, 0.0
    return e[n - 1], e[n - 2], 0.0 if n == 2 else 4.0 * U2 * abs(e[n - 1])


@inline
def cut_with(
    segment: Any, point: Any, sp: tuple[float, float, float], sq: tuple[float, float, float]
) -> tuple[float, bool]:
    """Set `point` to where `segment` meets a plane of values `sp`, `sq`; return t and whether all is surely nearest."""
    sp_h, sp_l, sp_bound = sp
    sq_h, sq_l, sq_bound = sq
    if sp_h < 0.0:
        sp_h, sp_l = -sp_h, -sp_l
    if sq_h < 0.0:
        sq_h, sq_l = -sq_h, -sq_l
    if sp_bound > 0.001 * sp_h or sq_bound > 0.001 * sq_h:
        return 0.0, False
    r = 0.0
    if sp_bound > 0.0:
        r = 1.01 * sp_bound / sp_h
    if sq_bound > 0.0:
        r = max(r, 1.01 * sq_bound / sq_h)
    sum_h, sum_l = dd_add(sp_h, sp_l, sq_h, sq_l)
    t, sure = cut_parameter(sp_h, sp_l, sq_h, sq_l, sum_h, sum_l, r)
    for k in range(point.size):
        point[k], is_sure = cut_coordinate(segment[0, k], segment[1, k], sp_h, sp_l, sq_h, sq_l, sum_h, sum_l, r)
        sure = sure and is_sure
    return t, sure


@inline
def cut(row: Any, segment: Any, point: Any) -> tuple[float, bool]:
    """Set `point` to where `segment` crosses the plane of `row`; return t and whether all is surely nearest."""
    t, sure = cut_with(segment, point, dd_value(row, segment[0]), dd_value(row, segment[1]))
    if not sure:  # case: a value close to zero loses its digits to cancellation, its expansion does not
        t, sure = cut_with(segment, point, leading_value(row, segment[0]), leading_value(row, segment[1]))
    return t, sure


@inline
def is_segment_safe(segment: Any) -> bool:
    """Tell whether every coordinate is zero or of a size for which expansions are exact."""
    safe = True
    for k in range(segment.shape[1]):
        safe = safe and is_safe(segment[0, k]) and is_safe(segment[1, k])
    return safe


@inline
def store(segment: Any, rows: Any, entered: int, left: int, start: Any, end: Any, t: Any, faces: Any) -> bool:
    """Write the piece between planes `entered` and `left` (-1: the end itself); False where not surely rounded."""
    t[0], t[1], faces[0], faces[1] = 0.0, 1.0, entered, left
    for k in range(start.size):
        start[k], end[k] = segment[0, k], segment[1, k]
    sure = True
    if entered >= 0:
        t[0], sure = cut(rows[entered], segment, start)
    if left >= 0:
        t[1], is_sure = cut(rows[left], segment, end)
        sure = sure and is_sure
    return sure


@inline
def clip_by_rows(
    segment: Any,
    rows: Any,
    is_safe_row: Any,
    s_p: Any,
    s_q: Any,
    b_p: Any,
    b_q: Any,
    start: Any,
    end: Any,
    t: Any,
    faces: Any,
) -> int:
    """Clip one segment; s and b hold each row's value and bound at either end. Return the item's state.

    The core knows no dimension: the kernels fill s and b. An item with an open sign or order outside of the safe range
    is returned as open.
    """
    n = rows.shape[0]
    entered = left = -1
    beyond, checked = 0, False
    for i in range(n):
        sign_p = 1 if s_p[i] > b_p[i] else (-1 if -s_p[i] > b_p[i] else UNDECIDED)
        sign_q = 1 if s_q[i] > b_q[i] else (-1 if -s_q[i] > b_q[i] else UNDECIDED)
        if sign_p == UNDECIDED or sign_q == UNDECIDED:
            beyond = BEYOND_FILTER
            checked = checked or is_segment_safe(segment)
            if not (checked and is_safe_row[i]):
                return OPEN | BEYOND_FILTER
            if sign_p == UNDECIDED:
                sign_p = exact_sign(rows[i], segment[0])
            if sign_q == UNDECIDED:
                sign_q = exact_sign(rows[i], segment[1])
        if sign_p >= 0 and sign_q >= 0:
            continue
        if sign_p < 0 and sign_q < 0:
            return DROPPED | beyond
        other = entered if sign_p < 0 else left
        order = -1 if other < 0 else UNDECIDED
        if other >= 0:
            order = compare_ratios_filter(
                s_p[i], b_p[i], s_q[other], b_q[other], s_p[other], b_p[other], s_q[i], b_q[i]
            )
            if order == UNDECIDED:
                beyond = BEYOND_FILTER
                checked = checked or is_segment_safe(segment)
                if not (checked and is_safe_row[i] and is_safe_row[other]):
                    return OPEN | BEYOND_FILTER
                order = exact_order(rows[i], rows[other], segment)
        if sign_p < 0 and (other < 0 or order > 0):
            entered = i
        elif sign_p >= 0 and order < 0:
            left = i
    if entered >= 0 and left >= 0:
        order = compare_ratios_filter(
            s_p[entered], b_p[entered], s_q[left], b_q[left], s_p[left], b_p[left], s_q[entered], b_q[entered]
        )
        if order == UNDECIDED:
            beyond = BEYOND_FILTER
            checked = checked or is_segment_safe(segment)
            if not (checked and is_safe_row[entered] and is_safe_row[left]):
                return OPEN | BEYOND_FILTER
            order = exact_order(rows[entered], rows[left], segment)
        if order > 0:
            return DROPPED | beyond
    if entered < 0 and left < 0:
        return (KEPT if store(segment, rows, -1, -1, start, end, t, faces) else OPEN) | beyond
    checked = checked or is_segment_safe(segment)
    for plane in (entered, left):
        if plane >= 0 and not is_safe_row[plane]:
            checked = False
    if not (checked and store(segment, rows, entered, left, start, end, t, faces)):
        return OPEN | BEYOND_FILTER
    return KEPT | beyond


@inline
def value_2d(a: float, b: float, d: float, x: float, y: float) -> tuple[float, float]:
    """Return a x + b y + d and a bound of its error; infinities and NaN make the bound useless, never wrong."""
    ax, by = a * x, b * y
    return ax + by + d, VALUE_BOUND * (abs(ax) + abs(by) + abs(d)) + VALUE_TINY


@inline
def value_3d(a: float, b: float, c: float, d: float, x: float, y: float, z: float) -> tuple[float, float]:
    """Return a x + b y + c z + d and a bound of its error: see `value_2d`."""
    ax, by, cz = a * x, b * y, c * z
    return ax + by + cz + d, VALUE_BOUND * (abs(ax) + abs(by) + abs(cz) + abs(d)) + VALUE_TINY


@kernel
def clip_on_rows_2d(
    segments: Any, rows: Any, first: int, last: int, start: Any, end: Any, t: Any, faces: Any, state: Any
) -> None:
    """Clip ``segments[first:last]`` ((n, 2, 2) float64) where ``rows`` ((m, 3) float64) are all >= 0.

    start, end: (n, 2) float64. t: (n, 2) float64. faces: (n, 2) int64. state: (n,) uint8. Rows not kept are undefined.
    """
    m = rows.shape[0]
    s_p, s_q, b_p, b_q = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    safe = np.empty(m, np.bool_)
    for j in range(m):
        safe[j] = is_row_safe(rows[j])
    for i in range(first, last):
        px, py, qx, qy = segments[i, 0, 0], segments[i, 0, 1], segments[i, 1, 0], segments[i, 1, 1]
        for j in range(m):
            a, b, d = rows[j, 0], rows[j, 1], rows[j, 2]
            s_p[j], b_p[j] = value_2d(a, b, d, px, py)
            s_q[j], b_q[j] = value_2d(a, b, d, qx, qy)
        state[i] = clip_by_rows(segments[i], rows, safe, s_p, s_q, b_p, b_q, start[i], end[i], t[i], faces[i])


@kernel
def clip_on_rows_3d(
    segments: Any, rows: Any, first: int, last: int, start: Any, end: Any, t: Any, faces: Any, state: Any
) -> None:
    """Clip ``segments[first:last]`` ((n, 2, 3) float64) where ``rows`` ((m, 4) float64) are all >= 0."""
    m = rows.shape[0]
    s_p, s_q, b_p, b_q = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    safe = np.empty(m, np.bool_)
    for j in range(m):
        safe[j] = is_row_safe(rows[j])
    for i in range(first, last):
        px, py, pz = segments[i, 0, 0], segments[i, 0, 1], segments[i, 0, 2]
        qx, qy, qz = segments[i, 1, 0], segments[i, 1, 1], segments[i, 1, 2]
        for j in range(m):
            a, b, c, d = rows[j, 0], rows[j, 1], rows[j, 2], rows[j, 3]
            s_p[j], b_p[j] = value_3d(a, b, c, d, px, py, pz)
            s_q[j], b_q[j] = value_3d(a, b, c, d, qx, qy, qz)
        state[i] = clip_by_rows(segments[i], rows, safe, s_p, s_q, b_p, b_q, start[i], end[i], t[i], faces[i])
