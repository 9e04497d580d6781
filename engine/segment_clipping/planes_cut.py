"""The points where segments cross planes, each coordinate the nearest double: what `decide_on_rows` has chosen is cut.

t = s_p / (s_p - s_q) and the point are taken in double-double with a bound; where that leaves a coordinate open, from
expansions of both plane values (cut_point.py). In the plane z is 0.
"""

from __future__ import annotations

from typing import Any

from engine.jit import called, inline, kernel, merged
from engine.predicates.cut_point import parameter_and_point, point_at
from engine.predicates.double_double import dd_add, dd_div
from engine.predicates.error_free import two_diff, workspace
from engine.predicates.expansion import Components, grow, is_safe, sign
from engine.predicates.side import dd_value
from engine.segment_clipping.cyrus_beck import expand_value, is_row_safe, is_segment_safe
from engine.segment_clipping.pieces import Pieces, Triple, point_of, put_end, put_own_end
from engine.segment_clipping.plane_meeting import T_BOUND


@inline
def parameter_of(sp: Triple, sq: Triple) -> tuple[float, float, float, bool]:
    """Return t = s_p / (s_p - s_q) as a double-double, how far relative to itself it may be off, and if that holds."""
    sp_h, sp_l, sp_bound = sp
    sq_h, sq_l, sq_bound = sq
    sum_h, sum_l = dd_add(sp_h, sp_l, -sq_h, -sq_l)
    th, tl = dd_div(sp_h, sp_l, sum_h, sum_l)
    r = 1.01 * (sp_bound / abs(sp_h) + sq_bound / abs(sq_h))
    return th, tl, r, (r < 0.001) & (abs(sum_h) >= 2.0**-400) & (abs(sum_h) <= 2.0**400) & (abs(sp_h) >= 2.0**-500)


@inline
def expand_difference(x: float, y: float, e: Components) -> int:
    """Set e to x - y as an expansion; two places. Returns its length."""
    h, low = two_diff(x, y)
    return grow(e, grow(e, 0, low), h)


@called
def cut_by_signs(row: Any, segment: Any, point: Any, axis: int, at: float) -> tuple[float, bool]:
    """Set `point` to where `segment` crosses the plane of `row`, by exact signs; return t and whether all is sure.

    axis, at: across an axis, where, so that values are differences; else -1 and anything.
    """
    wp, wq, e = workspace(8), workspace(8), workspace(96)
    if axis >= 0:
        p, q = segment[0, axis], segment[1, axis]
        if not (is_safe(p) and is_safe(q) and is_safe(at)):
            return 0.0, False
        n_wp, n_wq = expand_difference(p, at, wp), expand_difference(q, at, wq)
    else:
        if not (is_row_safe(row) and is_segment_safe(segment)):
            return 0.0, False
        n_wp, n_wq = expand_value(row, segment[0], wp), expand_value(row, segment[1], wq)
    for e_w, n_w in ((wp, n_wp), (wq, n_wq)):
        if sign(e_w, n_w) < 0:
            for i in range(n_w):
                e_w[i] = -e_w[i]
    return parameter_and_point(segment, wp, n_wp, wq, n_wq, axis, at, point, e)


@merged
def cut_by_values(p: Triple, q: Triple, sp: Triple, sq: Triple) -> tuple[float, float, float, float, bool]:
    """Return where p q crosses a plane that has these values there, t, and whether all is surely nearest."""
    th, tl, slack, sure = parameter_of(sp, sq)
    x, is_x = point_at(p[0], q[0], th, tl, slack)
    y, is_y = point_at(p[1], q[1], th, tl, slack)
    z, is_z = point_at(p[2], q[2], th, tl, slack)
    bound = (T_BOUND + slack) * th
    return x, y, z, th + tl, sure & is_x & is_y & is_z & (th + (tl - bound) == th + (tl + bound))


@kernel
def fill_on_rows(
    segments: Any, columns: Any, items: Any, planes: Any, begin: int, size: int, stop: Any, pieces: Pieces, still: Any,
    n: Any,
) -> None:  # fmt: skip
    """Fill the pieces of ``segments`` ((n, 2, dim) float64): see `fill_on_boxes`."""
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
