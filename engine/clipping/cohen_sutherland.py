"""Segments on an axis-parallel box by outcodes, decided exactly: 2D and 3D.

                 |        |                One bit for each plane a point lies outside of, in the order
        0101     |  0100  |   0110         xmin, xmax, ymin, ymax, zmin, zmax (drawn: ymax ymin xmax xmin
       ----------+--------+----------      would be 1000, 0100, 0010, 0001). Codes that share a bit: the
        0001     |  0000  |   0010         segment misses the box. Both zero: it lies inside. Else it is
       ----------+--------+----------      cut by planes it crosses, of which at most one per axis is
        1001     |  1000  |   1010         entered and one left.

The textbook cuts the outside end at one plane after another until the codes say accept or reject. Two departures:

1. Its loop can run for ever by rounding, (1, 1)-(-1, -1) on the box [1e-9, 3]^2. Here each plane is looked at once:
   the last plane entered and the first one left bound the piece, if in this order.
2. It decides from rounded points. Here the parameters of the planes, quotients of differences of original coordinates,
   are compared in doubles beyond their bound, else exactly: n_i / d_i against n_j / d_j as n_i d_j against n_j d_i.
   The cut coordinate is the plane's own value.

Two kernels: `decide_*` says which planes bound each piece, `fill_*` makes the points of the pieces that there are.

Source: Cohen and Sutherland in W. M. Newman, R. F. Sproull, Principles of Interactive Computer Graphics, 1979; the
textbook's section on clipping segments on an AABB.
"""

from __future__ import annotations

from typing import Any, Final

from engine.clipping.cut_point import is_safe, parameter_and_point, point_at
from engine.jit import inline, kernel
from engine.predicates.double_double import U2, dd_div
from engine.predicates.error_free import two_diff, workspace
from engine.predicates.parameters import compare_differences, compare_differences_filter
from engine.types import UNDECIDED

DROPPED: Final = 0
KEPT: Final = 1
OPEN: Final = 2
"""The kernel could not settle the item: rational arithmetic must."""
LARGE: Final = 2.0**1000
"""Items whose absolute coordinates add up to more, or to nothing (NaN, infinity), are left open."""
T_GAP: Final = 16.0 * 2.0**-53
"""Parameters t are quotients of two differences, within 3 u (1 + u)^2 of themselves; two of them and this test: 8 u."""
T_TINY: Final = 2.0**-1060
"""Parameters that underflow."""
T_BOUND: Final = 24.0 * U2
"""Of t in double-double, relative: a quotient of two differences without error, and the test of its rounding."""
AFTER: Final = (1, 2, 0, 1)
"""The two axes that follow an axis: AFTER[axis], AFTER[axis + 1]."""


@inline
def plane_outside(value: float, low: float, high: float, axis: int) -> int:
    """Return the plane of `axis` that `value` lies outside of, -1 if none: 2 axis for low, 2 axis + 1 for high."""
    if value < low:
        return 2 * axis
    if value > high:
        return 2 * axis + 1
    return -1


@inline
def plane_value(low: Any, high: Any, plane: int) -> float:
    """Return the coordinate at which `plane` cuts its axis."""
    return high[plane >> 1] if plane & 1 else low[plane >> 1]


@inline
def compare_planes(segments: Any, item: int, low: Any, high: Any, i: int, j: int) -> tuple[int, bool]:
    """Return the sign of t_i - t_j for two planes that a segment meets, and whether the filter sufficed."""
    p_i, q_i, c_i = segments[item, 0, i >> 1], segments[item, 1, i >> 1], plane_value(low, high, i)
    p_j, q_j, c_j = segments[item, 0, j >> 1], segments[item, 1, j >> 1], plane_value(low, high, j)
    # n and d of one plane have one sign, so absolute values keep the ratio and make the products comparable
    order = compare_differences_filter(abs(c_i - p_i), abs(q_j - p_j), abs(c_j - p_j), abs(q_i - p_i))
    if order != UNDECIDED:
        return order, True
    if not (is_safe(p_i) and is_safe(q_i) and is_safe(c_i) and is_safe(p_j) and is_safe(q_j) and is_safe(c_j)):
        return UNDECIDED, False
    e = workspace(16)
    order = compare_differences(c_i, p_i, q_j, p_j, c_j, p_j, q_i, p_i, e)
    return order if (q_i > p_i) == (q_j > p_j) else -order, False


@inline
def decide_crossing(segments: Any, item: int, low: Any, high: Any) -> tuple[int, int, int, bool]:
    """Decide on a segment whose outcodes share no bit: state, plane entered, plane left, whether filters sufficed."""
    entered = left = -1
    filtered = True
    for axis in range(low.size):
        plane = plane_outside(segments[item, 0, axis], low[axis], high[axis], axis)
        if plane >= 0:
            order, by_filter = 1, True
            if entered >= 0:
                order, by_filter = compare_planes(segments, item, low, high, plane, entered)
            if order == UNDECIDED:
                return OPEN, -1, -1, False
            filtered = filtered and by_filter
            if order > 0:  # equal: the smaller plane stays
                entered = plane
        plane = plane_outside(segments[item, 1, axis], low[axis], high[axis], axis)
        if plane >= 0:
            order, by_filter = -1, True
            if left >= 0:
                order, by_filter = compare_planes(segments, item, low, high, plane, left)
            if order == UNDECIDED:
                return OPEN, -1, -1, False
            filtered = filtered and by_filter
            if order < 0:
                left = plane
    if entered >= 0 and left >= 0:
        order, by_filter = compare_planes(segments, item, low, high, entered, left)
        if order == UNDECIDED:
            return OPEN, -1, -1, False
        filtered = filtered and by_filter
        if order > 0:
            return DROPPED, -1, -1, filtered
    return KEPT, entered, left, filtered


@inline
def parameters(p: float, q: float, low: float, high: float) -> tuple[float, float]:
    """Return where a segment enters and leaves the slab low .. high of one axis: -1 and 2 where it does not.

    Written without branches, which no processor could foretell.
    """
    d = q - p
    enters, leaves = (low if p < low else high) - p, (low if q < low else high) - p
    t_enter, t_leave = enters / d, leaves / d
    return (t_enter if (p < low) | (p > high) else -1.0), (t_leave if (q < low) | (q > high) else 2.0)


@kernel
def decide_on_boxes_2d(
    segments: Any, low: Any, high: Any, first: int, last: int, stop: Any, items: Any, planes: Any, still: Any, n: Any
) -> None:
    """Decide on ``segments[first:last]`` ((n, 2, 2) float64) and the box `low`, `high`.

    items: from ``items[first]`` on the segments that are kept, in order, in planes (n, 2) the planes entered and left,
    -1 for an end of the segment. still: likewise the segments left open. n: how many are kept, open, and went beyond
    the filter. stop: one uint8, polled.
    """
    x0, x1, y0, y1 = low[0], high[0], low[1], high[1]
    kept, n_open, beyond = first, first, 0
    for i in range(first, last):
        if stop[0]:
            return
        px, py, qx, qy = segments[i, 0, 0], segments[i, 0, 1], segments[i, 1, 0], segments[i, 1, 1]
        if not (abs(px) + abs(py) + abs(qx) + abs(qy) < LARGE):
            still[n_open] = i
            n_open += 1
            continue
        if (max(px, qx) < x0) | (min(px, qx) > x1) | (max(py, qy) < y0) | (min(py, qy) > y1):
            continue  # the outcodes share a bit
        a, c = parameters(px, qx, x0, x1)
        b, d = parameters(py, qy, y0, y1)
        start, end = max(a, b), min(c, d)
        entered = left = -1
        if start > end:
            if start - end > T_GAP * start + T_TINY:
                continue
            sure = False
        else:
            sure = end - start > T_GAP * end + T_TINY
            if start >= 0.0:
                sure = sure and abs(a - b) > T_GAP * start + T_TINY
                entered = (0 + (px > x1)) if a == start else 2 + (py > y1)
            if end <= 1.5:
                sure = sure and abs(c - d) > T_GAP * end + T_TINY
                left = (0 + (qx > x1)) if c == end else 2 + (qy > y1)
        if not sure:
            state, entered, left, filtered = decide_crossing(segments, i, low, high)
            if not filtered:
                beyond += 1
            if state == OPEN:
                still[n_open] = i
                n_open += 1
            if state != KEPT:
                continue
        items[kept], planes[kept, 0], planes[kept, 1] = i, entered, left
        kept += 1
    n[0], n[1], n[2] = kept - first, n_open - first, beyond


@kernel
def decide_on_boxes_3d(
    segments: Any, low: Any, high: Any, first: int, last: int, stop: Any, items: Any, planes: Any, still: Any, n: Any
) -> None:
    """Decide on ``segments[first:last]`` ((n, 2, 3) float64) and the box `low`, `high`: see `decide_on_boxes_2d`."""
    x0, x1, y0, y1, z0, z1 = low[0], high[0], low[1], high[1], low[2], high[2]
    kept, n_open, beyond = first, first, 0
    for i in range(first, last):
        if stop[0]:
            return
        px, py, pz = segments[i, 0, 0], segments[i, 0, 1], segments[i, 0, 2]
        qx, qy, qz = segments[i, 1, 0], segments[i, 1, 1], segments[i, 1, 2]
        if not (abs(px) + abs(py) + abs(pz) + abs(qx) + abs(qy) + abs(qz) < LARGE):
            still[n_open] = i
            n_open += 1
            continue
        misses = (max(px, qx) < x0) | (min(px, qx) > x1) | (max(py, qy) < y0) | (min(py, qy) > y1)
        if misses | (max(pz, qz) < z0) | (min(pz, qz) > z1):
            continue
        a, d = parameters(px, qx, x0, x1)
        b, e = parameters(py, qy, y0, y1)
        c, f = parameters(pz, qz, z0, z1)
        start, end = max(a, max(b, c)), min(d, min(e, f))
        entered = left = -1
        if start > end:
            if start - end > T_GAP * start + T_TINY:
                continue
            sure = False
        else:
            sure = end - start > T_GAP * end + T_TINY
            if start >= 0.0:
                # the second largest of three, without branches
                second = max(min(a, b), min(max(a, b), c))
                sure = sure and start - second > T_GAP * start + T_TINY
                entered = (0 + (px > x1)) if a == start else ((2 + (py > y1)) if b == start else 4 + (pz > z1))
            if end <= 1.5:
                second = min(max(d, e), max(min(d, e), f))
                sure = sure and second - end > T_GAP * end + T_TINY
                left = (0 + (qx > x1)) if d == end else ((2 + (qy > y1)) if e == end else 4 + (qz > z1))
        if not sure:
            state, entered, left, filtered = decide_crossing(segments, i, low, high)
            if not filtered:
                beyond += 1
            if state == OPEN:
                still[n_open] = i
                n_open += 1
            if state != KEPT:
                continue
        items[kept], planes[kept, 0], planes[kept, 1] = i, entered, left
        kept += 1
    n[0], n[1], n[2] = kept - first, n_open - first, beyond


@inline
def cut_roughly(p: float, q: float, at: float) -> tuple[float, float, bool]:
    """Return the parameter at which one coordinate from p to q is `at`, and whether it is within T_BOUND of itself."""
    wh, wl = two_diff(at, p)
    sh, sl = two_diff(q, p)
    th, tl = dd_div(wh, wl, sh, sl)
    return th, tl, abs(wh) >= 2.0**-500 and 2.0**-400 <= abs(sh) <= 2.0**400


@inline
def cut_by_signs(segment: Any, low: Any, high: Any, plane: int, point: Any) -> tuple[float, bool]:
    """Set `point` to where `segment` crosses `plane`, settled by exact signs; return t and whether all is sure."""
    axis, at = plane >> 1, plane_value(low, high, plane)
    p, q = segment[0, axis], segment[1, axis]
    if not (is_safe(p) and is_safe(q) and is_safe(at)):
        return 0.0, False
    wp, wq, e = workspace(2), workspace(2), workspace(24)
    flip = 1.0 if q > p else -1.0
    n_wp, n_wq = difference(flip * at, flip * p, wp), difference(flip * q, flip * at, wq)
    return parameter_and_point(segment, wp, n_wp, wq, n_wq, axis, at, point, e)


@inline
def difference(a: float, b: float, e: Any) -> int:
    """Set e to a - b as an expansion; two places."""
    h, low = two_diff(a, b)
    n = 0
    for part in (low, h):
        if part != 0.0:
            e[n] = part
            n += 1
    return n


@kernel
def fill_on_boxes_2d(
    segments: Any,
    low: Any,
    high: Any,
    items: Any,
    planes: Any,
    first: int,
    last: int,
    stop: Any,
    source: Any,
    ends: Any,
    t: Any,
    faces: Any,
    still: Any,
    n: Any,
) -> None:
    """Fill rows first .. last - 1 of the pieces of ``segments`` ((n, 2, 2) float64) on the box `low`, `high`.

    items: (m,) int32, planes: (m, 2) int32, as decided. source: (m,) int64. ends: start and end, (m, 2) float64 each.
    t, faces: (m, 2) float64 and int64. still: from ``still[first]`` on the rows that are not surely rounded. n: how
    many of them, and how many needed more than the first try. stop: one uint8, polled.
    """
    n_open = beyond = 0
    for row in range(first, last):
        if stop[0]:
            return
        i = items[row]
        source[row] = i
        px, py, qx, qy = segments[i, 0, 0], segments[i, 0, 1], segments[i, 1, 0], segments[i, 1, 1]
        all_sure = tried = True
        for side in range(2):
            plane = planes[row, side]
            faces[row, side] = plane
            if plane < 0:
                t[row, side] = side
                ends[side, row, 0], ends[side, row, 1] = segments[i, side, 0] + 0.0, segments[i, side, 1] + 0.0
                continue
            at = plane_value(low, high, plane)
            if plane < 2:
                th, tl, sure = cut_roughly(px, qx, at)
                x, y, is_x = at, at, True
                y, is_y = point_at(py, qy, th, tl, 0.0)
            else:
                th, tl, sure = cut_roughly(py, qy, at)
                x, is_x = point_at(px, qx, th, tl, 0.0)
                y, is_y = at, True
            bound = T_BOUND * th
            if sure & is_x & is_y & (th + (tl - bound) == th + (tl + bound)):
                t[row, side] = th + tl
                ends[side, row, 0], ends[side, row, 1] = x + 0.0, y + 0.0
            else:
                tried = False
                t[row, side], sure = cut_by_signs(segments[i], low, high, plane, ends[side, row])
                all_sure = all_sure and sure
        if not tried:
            beyond += 1
        if not all_sure:
            still[first + n_open] = row
            n_open += 1
    n[0], n[1] = n_open, beyond


@kernel
def fill_on_boxes_3d(
    segments: Any,
    low: Any,
    high: Any,
    items: Any,
    planes: Any,
    first: int,
    last: int,
    stop: Any,
    source: Any,
    ends: Any,
    t: Any,
    faces: Any,
    still: Any,
    n: Any,
) -> None:
    """Fill rows first .. last - 1 of the pieces of ``segments`` ((n, 2, 3) float64): see `fill_on_boxes_2d`."""
    n_open = beyond = 0
    for row in range(first, last):
        if stop[0]:
            return
        i = items[row]
        source[row] = i
        all_sure = tried = True
        for side in range(2):
            plane = planes[row, side]
            faces[row, side] = plane
            if plane < 0:
                t[row, side] = side
                ends[side, row, 0], ends[side, row, 1] = segments[i, side, 0] + 0.0, segments[i, side, 1] + 0.0
                ends[side, row, 2] = segments[i, side, 2] + 0.0
                continue
            axis, at = plane >> 1, plane_value(low, high, plane)
            j, k = AFTER[axis], AFTER[axis + 1]
            th, tl, sure = cut_roughly(segments[i, 0, axis], segments[i, 1, axis], at)
            x, is_x = point_at(segments[i, 0, j], segments[i, 1, j], th, tl, 0.0)
            y, is_y = point_at(segments[i, 0, k], segments[i, 1, k], th, tl, 0.0)
            bound = T_BOUND * th
            if sure & is_x & is_y & (th + (tl - bound) == th + (tl + bound)):
                t[row, side] = th + tl
                ends[side, row, axis], ends[side, row, j], ends[side, row, k] = at, x + 0.0, y + 0.0
            else:
                tried = False
                t[row, side], sure = cut_by_signs(segments[i], low, high, plane, ends[side, row])
                all_sure = all_sure and sure
        if not tried:
            beyond += 1
        if not all_sure:
            still[first + n_open] = row
            n_open += 1
    n[0], n[1] = n_open, beyond
