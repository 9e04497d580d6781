"""Segments on a convex region given by plane rows, decided exactly: outcodes over signed distances, 2D and 3D.

The region is where every row has a x + b y + c z + d >= 0; it may be empty or unbounded. A plane with both end points
strictly outside drops the segment (the outcodes share a bit). A plane with one end outside is entered or left at
t = s_p / (s_p - s_q); the last plane entered and the first one left bound the piece, if in this order. Each plane is
looked at once, so the loop ends; all signs and all comparisons are exact and about the original end points: a filter,
then expansions, then "open" (where exponents leave the range in which expansions are exact).

Plane values come from columns; only planes that an end is not surely inside of are looked at again. In the plane z is
0. As for boxes, one kernel says which planes bound each piece, `fill_on_rows` (planes_cut.py) makes their points.

Source: M. Cyrus, J. Beck, Generalized two- and three-dimensional clipping, 1978; the textbook's exercise:
Cohen-Sutherland generalised to a convex polyhedron. Changed: exact signs of s, exact order of t, cut points from the
original ends.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray
from engine.jit import inline, kernel
from engine.predicates.error_free import workspace
from engine.predicates.expansion import Components, compress, grow, grow_product, is_safe, sign
from engine.predicates.parameters import compare_products, compare_ratios_filter
from engine.segment_clipping.cohen_sutherland import DROPPED, KEPT, is_plain
from engine.segment_clipping.pieces import point_of
from engine.types import OPEN, UNDECIDED

VALUE_BOUND: Final = 8.0 * 2.0**-53
"""Bound of a plane value a x + b y + c z + d in doubles, relative to the sum of absolute terms.

Each term carries at most (1 + u)^4, the sum of absolute terms the same; 8 u covers both and its own rounding.
"""
VALUE_TINY: Final = 2.0**-1070
"""Products that underflow lose at most 2^-1074 each."""
T_ROUNDINGS: Final = 8.0 * 2.0**-53
"""Of a parameter in doubles, beside the bounds of its plane values."""


def as_columns(rows: FloatArray) -> FloatArray:
    """Return plane rows (m, dim + 1) as columns (dim + 3, m).

    The last two bound the error of a value in doubles: times the largest coordinate, and by themselves.
    """
    with np.errstate(all="ignore"):  # what overflows bounds nothing, and is left to exact arithmetic
        slope = VALUE_BOUND * np.abs(rows[:, :-1]).sum(axis=1)
        columns = np.ascontiguousarray(np.vstack([rows.T, slope, VALUE_BOUND * np.abs(rows[:, -1]) + VALUE_TINY]))
    columns.setflags(write=False)
    return columns


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
def is_segment_safe(segment: Any) -> bool:
    """Tell whether every coordinate is zero or of a size for which expansions are exact."""
    safe = True
    for k in range(segment.shape[1]):
        safe = safe and is_safe(segment[0, k]) and is_safe(segment[1, k])
    return safe


@inline
def decide_by_rows(
    segment: Any, columns: Any, s_p: Any, s_q: Any, bounds: Any, chosen: Any, n: int
) -> tuple[int, int, int, int]:
    """Decide on one segment by the n `chosen` planes: state, plane entered, plane left, 1 where filters did not do.

    s_p, s_q, bounds: of each of them the values at both ends and their bound. An item with an
    open sign or order outside of the safe range is left open.
    """
    entered = left = -1
    beyond, checked = 0, False
    for i in range(n):
        sign_p = 1 if s_p[i] > bounds[i] else (-1 if -s_p[i] > bounds[i] else UNDECIDED)
        sign_q = 1 if s_q[i] > bounds[i] else (-1 if -s_q[i] > bounds[i] else UNDECIDED)
        if sign_p == UNDECIDED or sign_q == UNDECIDED:
            beyond = 1
            checked = checked or is_segment_safe(segment)
            row = columns[:-2, chosen[i]]
            if not (checked and is_row_safe(row)):
                return OPEN, -1, -1, 1
            if sign_p == UNDECIDED:
                sign_p = exact_sign(row, segment[0])
            if sign_q == UNDECIDED:
                sign_q = exact_sign(row, segment[1])
        if sign_p >= 0 and sign_q >= 0:
            continue
        if sign_p < 0 and sign_q < 0:
            return DROPPED, -1, -1, beyond
        other = entered if sign_p < 0 else left
        if other >= 0:
            order, by_filter = compare_rows(segment, columns, s_p, s_q, bounds, chosen, i, other)
            beyond = beyond if by_filter else 1
            if order == UNDECIDED:
                return OPEN, -1, -1, 1
        if sign_p < 0 and (other < 0 or order > 0):
            entered = i
        elif sign_p >= 0 and (other < 0 or order < 0):
            left = i
    if entered >= 0 and left >= 0:
        order, by_filter = compare_rows(segment, columns, s_p, s_q, bounds, chosen, entered, left)
        beyond = beyond if by_filter else 1
        if order == UNDECIDED:
            return OPEN, -1, -1, 1
        if order > 0:
            return DROPPED, -1, -1, beyond
    return KEPT, entered, left, beyond


@inline
def compare_rows(
    segment: Any, columns: Any, s_p: Any, s_q: Any, bounds: Any, chosen: Any, i: int, j: int
) -> tuple[int, bool]:
    """Return the sign of t_i - t_j for two planes that `segment` crosses, and whether the filter sufficed."""
    order = compare_ratios_filter(s_p[i], bounds[i], s_q[j], bounds[j], s_p[j], bounds[j], s_q[i], bounds[i])
    if order != UNDECIDED:
        return order, True
    row_i, row_j = columns[:-2, chosen[i]], columns[:-2, chosen[j]]
    if not (is_segment_safe(segment) and is_row_safe(row_i) and is_row_safe(row_j)):
        return UNDECIDED, False
    return exact_order(row_i, row_j, segment), False


@inline
def decide_by_parameters(s_p: Any, s_q: Any, bounds: Any, chosen: Any, n: int) -> tuple[int, int, int]:
    """Decide on one segment by the n `chosen` planes from doubles: state, plane entered, plane left; OPEN: unsure.

    t = s_p / (s_p - s_q) moves by at most bound / (|s_p| + |s_q|) when both values move by a bound.
    """
    entered = left = -1
    start, start_slack, start_rival = -1.0, 0.0, -1.0  # the last plane entered, the next to last at its latest
    end, end_slack, end_rival = 2.0, 0.0, 2.0  # the first plane left, the second at its earliest
    for i in range(n):
        p, q, bound = s_p[i], s_q[i], bounds[i]
        if not (abs(p) > bound and abs(q) > bound):
            return OPEN, -1, -1
        if p > 0.0 and q > 0.0:
            continue
        t = p / (p - q)
        slack = 1.01 * bound / abs(p - q) + T_ROUNDINGS
        if p < 0.0:
            if t > start:
                start_rival = max(start_rival, start + start_slack)
                start, start_slack, entered = t, slack, i
            else:
                start_rival = max(start_rival, t + slack)
        elif t < end:
            end_rival = min(end_rival, end - end_slack)
            end, end_slack, left = t, slack, i
        else:
            end_rival = min(end_rival, t - slack)
    if start - start_slack > end + end_slack:
        return DROPPED, -1, -1
    is_sure = max(start + start_slack, start_rival) < min(end - end_slack, end_rival)
    is_sure = is_sure and (entered < 0 or start_rival < start - start_slack)
    is_sure = is_sure and (left < 0 or end_rival > end + end_slack)
    return (KEPT, entered, left) if is_sure else (OPEN, -1, -1)


@inline
def columns_of(columns: Any) -> tuple[Any, Any, Any, Any]:
    """Return the columns of a, b, c and d; in the plane any for c, since z is 0."""
    d = columns.shape[0] - 3
    return columns[0], columns[1], columns[d - 1], columns[d]


@kernel
def decide_on_rows(
    segments: Any, columns: Any, first: int, last: int, stop: Any, items: Any, planes: Any, still: Any, n: Any
) -> None:
    """Decide on ``segments[first:last]`` ((n, 2, dim) float64) where all planes (`as_columns`) are >= 0.

    Outputs: see `decide_on_boxes`.
    """
    is_flat = segments.shape[2] == 2
    a, b, c, d = columns_of(columns)
    slopes, floors = columns[-2], columns[-1]
    m = d.size
    s_p, s_q, bounds, chosen = np.empty(m), np.empty(m), np.empty(m), np.empty(m, np.int64)
    kept, n_open, beyond = 0, 0, 0
    for i in range(first, last):
        px, py, pz = point_of(segments, i, 0, is_flat)
        qx, qy, qz = point_of(segments, i, 1, is_flat)
        if not is_plain((px, py, pz), (qx, qy, qz)):
            still[n_open] = i
            n_open += 1
            continue
        most = max(abs(px), abs(py), abs(pz), abs(qx), abs(qy), abs(qz))
        n_chosen, is_out = 0, False
        for j in range(m):
            p = a[j] * px + b[j] * py + c[j] * pz + d[j]
            q = a[j] * qx + b[j] * qy + c[j] * qz + d[j]
            bound = slopes[j] * most + floors[j]
            if min(p, q) > bound:
                continue
            if max(p, q) < -bound:
                is_out = True
                break
            s_p[n_chosen], s_q[n_chosen], bounds[n_chosen], chosen[n_chosen] = p, q, bound, j
            n_chosen += 1
            if stop[0]:
                return
        if is_out:
            continue
        state, entered, left = decide_by_parameters(s_p, s_q, bounds, chosen, n_chosen)
        if state == OPEN:
            state, entered, left, more = decide_by_rows(segments[i], columns, s_p, s_q, bounds, chosen, n_chosen)
            beyond += more
        if state == OPEN:
            still[n_open] = i
            n_open += 1
        if state != KEPT:
            continue
        items[kept] = i
        planes[kept, 0] = chosen[entered] if entered >= 0 else -1
        planes[kept, 1] = chosen[left] if left >= 0 else -1
        kept += 1
    n[0], n[1], n[2] = kept, n_open, beyond
