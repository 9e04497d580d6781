"""Cyrus-Beck clipping of segments to a convex region given by plane rows, decided exactly: 2D and 3D.

The region is where every row has a x + b y + c z + d >= 0; it may be empty or unbounded. A plane with both end points
strictly outside drops the segment (the outcodes share a bit). A plane with one end outside is entered or left at
t = s_p / (s_p - s_q); the last plane entered and the first one left bound the piece, if in this order. Each plane is
tested once, so the loop ends; all signs and all comparisons are exact and about the original end points: a filter,
then expansions, then OPEN (if exponents leave the range in which expansions are exact).

Plane values and parameters are computed in doubles for a block of segments, column by column; what these leave open is
decided again by the planes that an end is not certainly inside of. In 2D z is 0. As for boxes, one kernel decides which
planes bound each piece, `fill_on_rows` (planes_cut.py) computes the ends.

Source: M. Cyrus, J. Beck, Generalized two- and three-dimensional clipping, 1978; the textbook's exercise:
Cohen-Sutherland generalised to a convex polyhedron. Changed: exact signs of s, exact order of t, cut points from the
original ends.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import allocating_kernel, called, inline, merged
from engine.predicates.error_free import workspace
from engine.predicates.expansion import Components, compress, grow, grow_product, is_safe, sign
from engine.predicates.parameters import compare_products, compare_ratios_filter
from engine.segment_clipping.pieces import ACCEPTED, BLOCK, REJECTED, is_plain, point_of
from engine.types import OPEN, UNDECIDED, FlagArray, FloatArray, Int32Array, IntArray

VALUE_BOUND: Final = 8.0 * 2.0**-53
"""Error bound of a plane value a x + b y + c z + d in doubles, relative to sum |terms|. Each term has a factor of at
most (1 + u)^4, so has sum |terms|: 8 u covers both and the rounding of the bound."""
VALUE_TINY: Final = 2.0**-1070
"""Error bound of products that underflow: 2^-1074 each."""
T_ROUNDINGS: Final = 8.0 * 2.0**-53
"""Error of a parameter in doubles besides that of its plane values: two or three roundings of a number up to 1."""
WIDEST: Final = 2.0**900
"""Bound on plane values below which no term overflows."""
NARROWEST: Final = 2.0**-960
"""If the difference of two plane values of different signs is larger, its inverse does not overflow."""


class Latest(NamedTuple):
    """The last of the planes that a segment crosses. t, slack: its parameter, to +- slack; plane: its number, -1.0 for
    none; rival: upper bound on the parameter of every other plane."""

    t: float
    slack: float
    plane: float
    rival: float


def as_columns(rows: FloatArray) -> FloatArray:
    """Return plane rows (m, dim + 1) as columns (dim + 3, m), the last two of which bound the error of a plane's value
    in doubles: per unit of the largest coordinate, and absolutely. Both are 0.0 if the value is one coordinate plus a
    number, rounded once: its sign is exact, and comparisons have room for a rounding of each."""
    with np.errstate(all="ignore"):  # what overflows bounds nothing, and is left to exact arithmetic
        slope = VALUE_BOUND * np.abs(rows[:, :-1]).sum(axis=1)
        floor = VALUE_BOUND * np.abs(rows[:, -1]) + VALUE_TINY
        is_rounded_once = (np.sort(np.abs(rows[:, :-1]))[:, -2:] == (0.0, 1.0)).all(axis=1) & (floor < WIDEST)
        slope[is_rounded_once] = floor[is_rounded_once] = 0.0
        columns = np.ascontiguousarray(np.vstack([rows.T, slope, floor]))
    columns.setflags(write=False)
    return columns


@inline
def are_safe(row: FloatArray, segment: FloatArray) -> bool:
    """Return whether all numbers of a plane row (dim + 1,) and a segment (2, dim) are zero or in the range in which
    expansions are exact."""
    safe = True
    for k in range(row.size):
        safe = safe and is_safe(row[k])
    for k in range(segment.shape[1]):
        safe = safe and is_safe(segment[0, k]) and is_safe(segment[1, k])
    return safe


@inline
def expand_value(row: FloatArray, point: FloatArray, e: Components) -> int:
    """Set expansion e to the value of a plane row at a point; return its number of components, at most 7 in 3D."""
    d = row.size - 1
    n = grow(e, 0, row[d])
    for k in range(d):
        n = grow_product(e, n, row[k], point[k])
    return compress(e, n)


@called
def exact_sign(row: FloatArray, point: FloatArray) -> int:
    """Return the exact sign of a plane row at a point, both in the range of `are_safe`."""
    e = workspace(8)
    return sign(e, expand_value(row, point, e))


@called
def exact_order(row_i: FloatArray, row_j: FloatArray, segment: FloatArray) -> int:
    """Return the exact sign of t_i - t_j, the parameters at which a segment crosses the planes of two rows. Caller
    guarantees `are_safe`."""
    p_i, q_i, p_j, q_j, e = workspace(8), workspace(8), workspace(8), workspace(8), workspace(200)
    n_pi, n_qi = expand_value(row_i, segment[0], p_i), expand_value(row_i, segment[1], q_i)
    n_pj, n_qj = expand_value(row_j, segment[0], p_j), expand_value(row_j, segment[1], q_j)
    return compare_products(p_i, n_pi, q_j, n_qj, p_j, n_pj, q_i, n_qi, e)


@inline
def decide_by_rows(
    segment: FloatArray, columns: FloatArray, s_p: Any, s_q: Any, bounds: Any, chosen: Any, n: int
) -> tuple[int, int, int, int]:
    """Decide one segment by n chosen planes; return (state, plane entered, plane left, beyond): planes as indices into
    `chosen`, -1 for none; beyond: 1 if doubles do not decide a sign or order, else 0. chosen: the column of each plane.
    s_p, s_q, bounds: value of each plane at both ends, and its error bound. The state is OPEN if an uncertain sign or
    order is outside the safe range."""
    entered = left = -1
    beyond = 0
    for i in range(n):
        unsure = UNDECIDED if bounds[i] > 0.0 else 0
        sign_p = 1 if s_p[i] > bounds[i] else (-1 if -s_p[i] > bounds[i] else unsure)
        sign_q = 1 if s_q[i] > bounds[i] else (-1 if -s_q[i] > bounds[i] else unsure)
        if sign_p == UNDECIDED or sign_q == UNDECIDED:
            beyond = 1
            row = columns[:-2, int(chosen[i])]
            if not are_safe(row, segment):
                return OPEN, -1, -1, 1
            if sign_p == UNDECIDED:
                sign_p = exact_sign(row, segment[0])
            if sign_q == UNDECIDED:
                sign_q = exact_sign(row, segment[1])
        if sign_p >= 0 and sign_q >= 0:
            continue
        if sign_p < 0 and sign_q < 0:
            return REJECTED, -1, -1, beyond
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
            return REJECTED, -1, -1, beyond
    return ACCEPTED, entered, left, beyond


@inline
def compare_rows(
    segment: FloatArray, columns: FloatArray, s_p: Any, s_q: Any, bounds: Any, chosen: Any, i: int, j: int
) -> tuple[int, bool]:
    """Return the sign of t_i - t_j, the parameters at which a segment crosses the planes chosen[i] and chosen[j], or
    UNDECIDED outside the safe range; and whether doubles sufficed. The other arguments: as in `decide_by_rows`."""
    order = compare_ratios_filter(s_p[i], bounds[i], s_q[j], bounds[j], s_p[j], bounds[j], s_q[i], bounds[i])
    if order != UNDECIDED:
        return order, True
    row_i, row_j = columns[:-2, int(chosen[i])], columns[:-2, int(chosen[j])]
    if not (are_safe(row_i, segment) and are_safe(row_j, segment)):
        return UNDECIDED, False
    return exact_order(row_i, row_j, segment), False


@merged
def later_crossing(t: float, slack: float, plane: float, is_crossed: bool, best: Latest) -> Latest:
    """Return the latest crossing after one more plane: `best`, or the crossing of plane `plane` at t +- slack if
    is_crossed and t is larger; the rival is updated."""
    is_later = is_crossed & (t > best.t)
    other = best.t + best.slack if is_later else (t + slack if is_crossed else best.rival)
    return Latest(
        t if is_later else best.t, slack if is_later else best.slack, plane if is_later else best.plane,
        other if other > best.rival else best.rival,
    )  # fmt: skip


@merged
def state_of(entered: Latest, left: Latest, is_out: bool, is_open: bool) -> float:
    """Return the state of a segment: 0.0 REJECTED, 1.0 ACCEPTED, 2.0 OPEN. entered: the last plane entered; left: the
    first plane left, as a `Latest` of -t. t = s_p / (s_p - s_q) has the error bound / (|s_p| + |s_q|) if both values
    have the error bound. is_out: it is rejected already; is_open: a sign is open."""
    start, end = entered.t, -left.t
    is_sure = max(start + entered.slack, entered.rival) < min(end - left.slack, -left.rival)
    is_sure = is_sure & ((entered.plane < 0.0) | (entered.rival < start - entered.slack))
    is_sure = is_sure & ((left.plane < 0.0) | (-left.rival > end + left.slack))
    is_out = is_out | ((start - entered.slack > end + left.slack) & (not is_open))
    return 0.0 if is_out else (1.0 if is_sure & (not is_open) else 2.0)


@inline
def coordinate_limit(columns: FloatArray) -> float:
    """Return a bound on |coordinates| of segments below which the error bounds of all plane values are below `WIDEST`.
    columns: of `as_columns`."""
    limit = np.inf
    for j in range(columns.shape[1]):
        limit = min(limit, (WIDEST - columns[-1, j]) / columns[-2, j])
    return limit


@called
def decide_alone(
    segments: FloatArray, item: int, columns: FloatArray, limit: float, numbers: Any, chosen: Any
) -> tuple[int, int, int, int]:
    """Decide segment ``item`` by all planes; return (state, plane entered, plane left, beyond): planes as numbers of
    rows, -1 for none; beyond: 1 if doubles do not decide it, else 0. limit: of `coordinate_limit`. numbers (3, m),
    chosen (m,): scratch."""
    is_flat = segments.shape[2] == 2
    k = columns.shape[0] - 3  # in the plane any column is that of c, since z is 0
    a, b, c, d = columns[0], columns[1], columns[k - 1], columns[k]
    p, q = point_of(segments, item, 0, is_flat), point_of(segments, item, 1, is_flat)
    most = max(abs(p[0]), abs(p[1]), abs(p[2]), abs(q[0]), abs(q[1]), abs(q[2]))
    if not (is_plain(p, q) and most < limit):
        return OPEN, -1, -1, 0
    s_p, s_q, bounds, n = numbers[0], numbers[1], numbers[2], 0
    for j in range(d.size):
        s_p[n] = a[j] * p[0] + b[j] * p[1] + c[j] * p[2] + d[j]
        s_q[n] = a[j] * q[0] + b[j] * q[1] + c[j] * q[2] + d[j]
        bounds[n], chosen[n] = columns[-2, j] * most + columns[-1, j], j
        n += not min(s_p[n], s_q[n]) > bounds[n]
    state, entered, left, beyond = decide_by_rows(segments[item], columns, s_p, s_q, bounds, chosen, n)
    return state, (int(chosen[entered]) if entered >= 0 else -1), (int(chosen[left]) if left >= 0 else -1), beyond


@allocating_kernel
def decide_on_rows(
    segments: FloatArray, columns: FloatArray, first: int, last: int, stop: FlagArray, items: Int32Array,
    planes: Int32Array, still: Int32Array, n: IntArray,
) -> None:  # fmt: skip
    """Decide which planes bound the pieces of ``segments[first:last]`` ((n, 2, dim) float64) in a convex region, plane
    by plane over a block of segments, without branches. columns: of `as_columns`; the other arguments: table of
    `decide_on_boxes`, planes being numbers of rows."""
    is_flat = segments.shape[2] == 2
    k = columns.shape[0] - 3  # in the plane any column is that of c, since z is 0
    a, b, c, d = columns[0], columns[1], columns[k - 1], columns[k]
    m, limit = d.size, coordinate_limit(columns)
    numbers, chosen = np.empty((3, m + 1)), np.empty(m + 1, np.int64)
    px, py, pz, qx, qy, qz, most = (
        workspace(64), workspace(64), workspace(64), workspace(64), workspace(64), workspace(64), workspace(64),
    )  # fmt: skip
    t0, slack0, plane0, rival0, t1, slack1, plane1, rival1, is_open, is_out = (
        workspace(64), workspace(64), workspace(64), workspace(64), workspace(64), workspace(64), workspace(64),
        workspace(64), workspace(64), workspace(64),
    )  # fmt: skip
    lanes = workspace(64)
    n_accepted, n_open, beyond = 0, 0, 0
    for begin in range(first, last, BLOCK):
        size = min(BLOCK, last - begin)
        n_lanes = (size + 7) >> 3 << 3  # whole vectors, filled by the last one: what lies there may take long to divide
        for i in range(n_lanes):
            lanes[i] = i
            px[i], py[i], pz[i] = point_of(segments, min(begin + i, last - 1), 0, is_flat)
            qx[i], qy[i], qz[i] = point_of(segments, min(begin + i, last - 1), 1, is_flat)
        for i in range(n_lanes):
            largest = max(abs(px[i]), abs(py[i]), abs(pz[i]), abs(qx[i]), abs(qy[i]), abs(qz[i]))
            is_good = is_plain((px[i], py[i], pz[i]), (qx[i], qy[i], qz[i])) & (largest < limit)
            most[i], is_open[i], is_out[i] = (largest if is_good else np.inf), (0.0 if is_good else 1.0), 0.0
            t0[i], slack0[i], plane0[i], rival0[i] = -1.0, 0.0, -1.0, -1.0
            t1[i], slack1[i], plane1[i], rival1[i] = -2.0, 0.0, -1.0, -2.0
        for j in range(m):
            if stop[0]:
                return
            if j & 3 == 0 and j > 0:
                n_out = 0
                for i in range(size):
                    n_out += is_out[i] != 0.0
                if 2 * n_out >= size:  # the others are moved together, in order
                    n_left = 0
                    for i in range(size):
                        to = n_left
                        px[to], py[to], pz[to], qx[to], qy[to], qz[to] = px[i], py[i], pz[i], qx[i], qy[i], qz[i]
                        t0[to], slack0[to], plane0[to], rival0[to] = t0[i], slack0[i], plane0[i], rival0[i]
                        t1[to], slack1[to], plane1[to], rival1[to] = t1[i], slack1[i], plane1[i], rival1[i]
                        most[to], is_open[to], lanes[to] = most[i], is_open[i], lanes[i]
                        n_left += is_out[i] == 0.0
                    size = n_left
                    n_lanes = (size + 7) >> 3 << 3
                    for i in range(n_lanes):
                        is_out[i] = 0.0
                    if size == 0:
                        break
            aj, bj, cj, dj, slope, floor = a[j], b[j], c[j], d[j], columns[-2, j], columns[-1, j] + NARROWEST
            for i in range(n_lanes):
                p = aj * px[i] + bj * py[i] + cj * pz[i] + dj
                q = aj * qx[i] + bj * qy[i] + cj * qz[i] + dj
                bound = slope * most[i] + floor
                p_in, p_out, q_in, q_out = p > bound, p < -bound, q > bound, q < -bound
                is_open[i] = is_open[i] if (p_in | p_out) & (q_in | q_out) else 1.0
                is_out[i] = 1.0 if p_out & q_out else is_out[i]
                inverse = 1.0 / (p - q)
                t, slack = p * inverse, 1.01 * bound * abs(inverse) + T_ROUNDINGS
                t0[i], slack0[i], plane0[i], rival0[i] = later_crossing(
                    t, slack, float(j), p_out & q_in, Latest(t0[i], slack0[i], plane0[i], rival0[i])
                )
                t1[i], slack1[i], plane1[i], rival1[i] = later_crossing(
                    -t, slack, float(j), p_in & q_out, Latest(t1[i], slack1[i], plane1[i], rival1[i])
                )
        for i in range(size):
            item = begin + int(lanes[i])
            entered, left = (
                Latest(t0[i], slack0[i], plane0[i], rival0[i]),
                Latest(t1[i], slack1[i], plane1[i], rival1[i]),
            )
            state = int(state_of(entered, left, is_out[i] != 0.0, is_open[i] != 0.0))
            plane_in, plane_out = int(entered.plane), int(left.plane)
            if state == OPEN:
                state, plane_in, plane_out, more = decide_alone(segments, item, columns, limit, numbers, chosen)
                beyond += more
                if state == OPEN:
                    still[n_open] = item
                    n_open += 1
            items[n_accepted], planes[n_accepted, 0], planes[n_accepted, 1] = item, plane_in, plane_out
            n_accepted += state == ACCEPTED
    n[0], n[1], n[2] = n_accepted, n_open, beyond
