"""Ends of pieces on planes, each coordinate the nearest double, for the planes chosen by cohen_sutherland.py and
cyrus_beck.py, 2D and 3D.

t = s_p / (s_p - s_q) and the point are computed in double-double with a bound; an end that is not certainly rounded is
recomputed from expansions of both plane values (cut_point.py). On a box these are exact differences, and a block of
pieces is computed without branches, both ends alike. In 2D z is 0.
"""

from __future__ import annotations

from engine.compiling.jit import called, kernel, merged
from engine.predicates.cut_point import T_BOUND, parameter_and_point, point_at
from engine.predicates.error_free import dd_add, dd_div, workspace
from engine.predicates.expansion import is_safe, magnitude
from engine.predicates.side import dd_value
from engine.segment_clipping.cohen_sutherland import LONGEST, SHORTEST, corners_of, plane_crossing
from engine.segment_clipping.cyrus_beck import are_safe, expand_value
from engine.segment_clipping.pieces import BLOCK, Pieces, Triple, point_of, put_end, put_own_end
from engine.types import FlagArray, FloatArray, Int32Array, IntArray


@called
def cut_by_signs(row: FloatArray, segment: FloatArray, point: FloatArray, axis: int, at: float) -> tuple[float, bool]:
    """Set `point` to the crossing of a segment (2, dim) with the plane of `row`, by expansions; return its parameter t,
    and whether t and all coordinates are proven nearest doubles. axis, at: of a plane across an axis, whose row has a
    single 1 or -1, the axis and the coordinate; for others -1 and any number."""
    wp, wq, e = workspace(8), workspace(8), workspace(96)
    if axis >= 0:  # what is not safe on other axes is multiplied by zero
        safe = is_safe(segment[0, axis]) and is_safe(segment[1, axis]) and is_safe(at)
    else:
        safe = are_safe(row, segment)
    if not safe:
        return 0.0, False
    n_wp = magnitude(wp, expand_value(row, segment[0], wp))
    n_wq = magnitude(wq, expand_value(row, segment[1], wq))
    return parameter_and_point(segment, wp, n_wp, wq, n_wq, axis, at, point, e)


@merged
def cut_by_values(p: Triple, q: Triple, sp: Triple, sq: Triple) -> tuple[float, float, float, float, bool]:
    """Return (x, y, z, t, is_proven): the crossing of p q with a plane, its parameter, and whether all are proven
    nearest doubles. sp, sq: the plane's value at p and q, each as (high, low, error bound)."""
    sp_h, sp_l, sp_bound = sp
    sq_h, sq_l, sq_bound = sq
    sum_h, sum_l = dd_add(sp_h, sp_l, -sq_h, -sq_l)
    th, tl = dd_div(sp_h, sp_l, sum_h, sum_l)
    slack = 1.01 * (sp_bound / abs(sp_h) + sq_bound / abs(sq_h))
    sure = (slack < 0.001) & (abs(sum_h) >= 2.0**-400) & (abs(sum_h) <= 2.0**400) & (abs(sp_h) >= 2.0**-500)
    x, is_x = point_at(p[0], q[0], th, tl, slack)
    y, is_y = point_at(p[1], q[1], th, tl, slack)
    z, is_z = point_at(p[2], q[2], th, tl, slack)
    bound = (T_BOUND + slack) * th
    return x, y, z, th + tl, sure & is_x & is_y & is_z & (th + (tl - bound) == th + (tl + bound))


@kernel
def fill_on_rows(
    segments: FloatArray, columns: FloatArray, items: Int32Array, planes: Int32Array, begin: int, size: int,
    stop: FlagArray, pieces: Pieces, still: Int32Array, n: IntArray,
) -> None:  # fmt: skip
    """Write the pieces of ``segments`` (n, 2, dim) float64 in a convex region. columns: of `as_columns`; planes:
    numbers of its rows; the other arguments: table of `fill_on_boxes`."""
    is_flat = segments.shape[2] == 2
    k = columns.shape[0] - 3  # in the plane any column is that of c, since z is 0
    a, b, c, d = columns[0], columns[1], columns[k - 1], columns[k]
    n_open = beyond = 0
    for place in range(size):
        if stop[0]:
            return
        i, row = items[place], begin + place
        pieces.source[row] = i
        all_sure = tried = True
        p, q = point_of(segments, i, 0, is_flat), point_of(segments, i, 1, is_flat)
        for end in range(2):
            j = planes[place, end]
            if j < 0:
                put_own_end(pieces, row, end, segments, i, is_flat)
                continue
            pieces.faces[row, end] = j
            sp, sq = dd_value(a[j], b[j], c[j], d[j], p), dd_value(a[j], b[j], c[j], d[j], q)
            x, y, z, t, sure = cut_by_values(p, q, sp, sq)
            if sure:
                pieces.t[row, end] = t
                put_end(pieces, row, end, (x, y, z), is_flat)
            else:
                tried = False
                pieces.t[row, end], sure = cut_by_signs(columns[:-2, j], segments[i], pieces.ends[end, row], -1, 0.0)
                all_sure = all_sure and sure
        beyond += not tried
        if not all_sure:
            still[n_open] = row
            n_open += 1
    n[0], n[1] = n_open, beyond


@merged
def cut_end(
    p: Triple, q: Triple, lowest: Triple, highest: Triple, plane: float, end: float
) -> tuple[float, float, float, float, bool]:
    """Return (x, y, z, t, is_proven): the crossing of p q with a plane of the box lowest .. highest, its parameter, and
    whether all are proven nearest doubles. plane: 0.0 .. 5.0; -1.0: no plane, the result is end 0.0 or 1.0, `end`, of
    the segment itself."""
    (px, py, pz), (qx, qy, qz), (x0, y0, z0), (x1, y1, z1) = p, q, lowest, highest
    is_x, is_y, is_z = plane < 1.5, (plane > 1.5) & (plane < 3.5), plane > 3.5
    is_high = (plane == 1.0) | (plane == 3.0) | (plane == 5.0)
    low, high = (x0 if is_x else (y0 if is_y else z0)), (x1 if is_x else (y1 if is_y else z1))
    at = high if is_high else low
    m = plane_crossing(px if is_x else (py if is_y else pz), qx if is_x else (qy if is_y else qz), at, plane)
    length, bound = abs(m.d), T_BOUND * m.t
    x, x_sure = point_at(px, qx, m.t, m.t_low, 0.0)
    y, y_sure = point_at(py, qy, m.t, m.t_low, 0.0)
    z, z_sure = point_at(pz, qz, m.t, m.t_low, 0.0)
    is_start = m.n == 0.0  # p lies on the plane: t = 0 and p itself
    sure = ((abs(m.n) >= 2.0**-500) | is_start) & (length >= SHORTEST) & (length <= LONGEST)
    sure = sure & (m.t + (m.t_low - bound) == m.t + (m.t_low + bound))
    sure = sure & (x_sure | is_x | is_start) & (y_sure | is_y | is_start) & (z_sure | is_z | is_start)
    x, y, z, t = (at if is_x else x), (at if is_y else y), (at if is_z else z), m.t + m.t_low
    is_own, is_first = plane < 0.0, end == 0.0
    x, y, z = (
        (x if not is_own else px if is_first else qx),
        (y if not is_own else py if is_first else qy),
        (z if not is_own else pz if is_first else qz),
    )
    return x + 0.0, y + 0.0, z + 0.0, (end if is_own else t + 0.0), sure | is_own


@called
def recompute_ends(
    segments: FloatArray, low: FloatArray, high: FloatArray, columns: FloatArray, row: int, unsure: int, pieces: Pieces
) -> bool:  # fmt: skip
    """Recompute by expansions the ends of the piece in row `row` that are set in `unsure` (bit 0: the first, bit 1: the
    last); return whether all numbers are proven nearest doubles. columns: of the box's plane rows."""
    all_sure = True
    for end in range(2):
        if unsure >> end & 1 == 1:
            segment, point, plane = segments[pieces.source[row]], pieces.ends[end, row], pieces.faces[row, end]
            at = high[plane >> 1] if plane & 1 else low[plane >> 1]
            pieces.t[row, end], is_sure = cut_by_signs(columns[:-2, plane], segment, point, plane >> 1, at)
            all_sure = all_sure and is_sure
    return all_sure


@kernel
def fill_on_boxes(
    segments: FloatArray, low: FloatArray, high: FloatArray, columns: FloatArray, items: Int32Array, planes: Int32Array,
    begin: int, size: int, stop: FlagArray, pieces: Pieces, still: Int32Array, n: IntArray,
) -> None:  # fmt: skip
    """Write the pieces of the first `size` items, from row `begin` on: ``segments`` ((n, 2, dim) float64) in a box.

    | argument | content |
    |---|---|
    | items (m,), planes (m, 2) int32 | of `decide_on_boxes` for the box `low`, `high` |
    | columns | of the box's plane rows |
    | pieces | out |
    | still (m,) int32 | out: the rows that are not certainly rounded |
    | n (2,) int64 | out: how many of them, and how many needed a second stage |
    | stop (1,) uint8 | polled |
    """
    is_flat = low.size == 2
    lowest, highest = corners_of(low, high)
    px, py, pz, qx, qy, qz, entered, left, t0, t1, unsure = (
        workspace(64), workspace(64), workspace(64), workspace(64), workspace(64), workspace(64),
        workspace(64), workspace(64), workspace(64), workspace(64), workspace(64),
    )  # fmt: skip
    n_open = beyond = 0
    for start in range(0, size, BLOCK):
        if stop[0]:
            return
        n_here = min(BLOCK, size - start)
        n_lanes = (n_here + 7) >> 3 << 3  # whole vectors
        for j in range(n_lanes):
            place = min(start + j, size - 1)
            px[j], py[j], pz[j] = point_of(segments, items[place], 0, is_flat)
            qx[j], qy[j], qz[j] = point_of(segments, items[place], 1, is_flat)
            entered[j], left[j] = planes[place, 0], planes[place, 1]
        for j in range(n_lanes):
            p, q = (px[j], py[j], pz[j]), (qx[j], qy[j], qz[j])
            px[j], py[j], pz[j], t0[j], p_sure = cut_end(p, q, lowest, highest, entered[j], 0.0)
            qx[j], qy[j], qz[j], t1[j], q_sure = cut_end(p, q, lowest, highest, left[j], 1.0)
            unsure[j] = (0.0 if p_sure else 1.0) + (0.0 if q_sure else 2.0)
        for j in range(n_here):
            row, place = begin + start + j, start + j
            pieces.source[row] = items[place]
            pieces.faces[row, 0], pieces.faces[row, 1] = planes[place, 0], planes[place, 1]
            pieces.t[row, 0], pieces.t[row, 1] = t0[j], t1[j]
            put_end(pieces, row, 0, (px[j], py[j], pz[j]), is_flat)
            put_end(pieces, row, 1, (qx[j], qy[j], qz[j]), is_flat)
        for j in range(n_here):
            if unsure[j] != 0.0:
                beyond += 1
                if not recompute_ends(segments, low, high, columns, begin + start + j, int(unsure[j]), pieces):
                    still[n_open] = begin + start + j
                    n_open += 1
    n[0], n[1] = n_open, beyond
