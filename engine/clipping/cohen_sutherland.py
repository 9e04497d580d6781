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
2. It decides from rounded points. Here parameters n_i / d_i of two planes compare as n_i d_j against n_j d_i on the
   original end points: a filter, then sixteen exact terms. The cut coordinate is the plane's own value.

Source: Cohen and Sutherland in W. M. Newman, R. F. Sproull, Principles of Interactive Computer Graphics, 1979; the
textbook's section on clipping segments on an AABB.
"""

from __future__ import annotations

from typing import Any, Final

from engine.clipping.cut_point import cut_coordinate, cut_parameter, is_safe
from engine.jit import inline, kernel
from engine.predicates.error_free import two_diff, workspace
from engine.predicates.parameters import compare_differences, compare_differences_filter
from engine.types import UNDECIDED

DROPPED: Final = 0
KEPT: Final = 1
OPEN: Final = 2
"""The kernel could not settle the item: rational arithmetic must."""
BEYOND_FILTER: Final = 4
"""A bit beside the three states: the item needed more than the floating-point filter."""


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
def compare_planes(segment: Any, low: Any, high: Any, i: int, j: int) -> tuple[int, bool]:
    """Return the sign of t_i - t_j for two planes that `segment` meets, and whether the filter sufficed."""
    p_i, q_i, c_i = segment[0, i >> 1], segment[1, i >> 1], plane_value(low, high, i)
    p_j, q_j, c_j = segment[0, j >> 1], segment[1, j >> 1], plane_value(low, high, j)
    # n and d of one plane have one sign, so absolute values keep the ratio and make the products comparable
    order = compare_differences_filter(abs(c_i - p_i), abs(q_j - p_j), abs(c_j - p_j), abs(q_i - p_i))
    if order != UNDECIDED:
        return order, True
    e = workspace(16)
    order = compare_differences(c_i, p_i, q_j, p_j, c_j, p_j, q_i, p_i, e)
    return order if (q_i > p_i) == (q_j > p_j) else -order, False


@inline
def cut(segment: Any, low: Any, high: Any, plane: int, point: Any) -> tuple[float, bool]:
    """Set `point` to where `segment` meets `plane`; return t and whether all numbers are surely the nearest doubles."""
    axis, c = plane >> 1, plane_value(low, high, plane)
    p, q = segment[0, axis], segment[1, axis]
    wp_h, wp_l = two_diff(c, p)
    wq_h, wq_l = two_diff(q, c)
    sum_h, sum_l = two_diff(q, p)
    t, sure = cut_parameter(wp_h, wp_l, wq_h, wq_l, sum_h, sum_l, 0.0)
    for k in range(low.size):
        if k == axis:
            point[k] = c
        else:
            point[k], is_sure = cut_coordinate(segment[0, k], segment[1, k], wp_h, wp_l, wq_h, wq_l, sum_h, sum_l, 0.0)
            sure = sure and is_sure
    return t, sure


@inline
def clip_crossing(segment: Any, low: Any, high: Any, start: Any, end: Any, t: Any, faces: Any) -> int:
    """Clip a segment whose outcodes do not settle it; `start` and `end` hold its end points. Return its state."""
    for k in range(low.size):
        if not (is_safe(segment[0, k]) and is_safe(segment[1, k]) and is_safe(low[k]) and is_safe(high[k])):
            return OPEN | BEYOND_FILTER
    entered = left = -1
    filtered = True
    for axis in range(low.size):
        plane = plane_outside(segment[0, axis], low[axis], high[axis], axis)
        if plane >= 0:
            if entered < 0:
                entered = plane
            else:
                order, by_filter = compare_planes(segment, low, high, plane, entered)
                filtered = filtered and by_filter
                if order > 0:  # equal: the smaller plane stays
                    entered = plane
        plane = plane_outside(segment[1, axis], low[axis], high[axis], axis)
        if plane >= 0:
            if left < 0:
                left = plane
            else:
                order, by_filter = compare_planes(segment, low, high, plane, left)
                filtered = filtered and by_filter
                if order < 0:
                    left = plane
    if entered >= 0 and left >= 0:
        order, by_filter = compare_planes(segment, low, high, entered, left)
        filtered = filtered and by_filter
        if order > 0:
            return DROPPED if filtered else DROPPED | BEYOND_FILTER
    sure = True
    if entered >= 0:
        faces[0] = entered
        t[0], is_sure = cut(segment, low, high, entered, start)
        sure = sure and is_sure
    if left >= 0:
        faces[1] = left
        t[1], is_sure = cut(segment, low, high, left, end)
        sure = sure and is_sure
    if not sure:
        return OPEN | BEYOND_FILTER
    return KEPT if filtered else KEPT | BEYOND_FILTER


@kernel
def clip_on_boxes_2d(
    segments: Any, low: Any, high: Any, first: int, last: int, start: Any, end: Any, t: Any, faces: Any, state: Any
) -> None:
    """Clip ``segments[first:last]`` ((n, 2, 2) float64) on the box `low`, `high`; fill the rows of the outputs.

    start, end: (n, 2) float64. t: (n, 2) float64. faces: (n, 2) int64. state: (n,) uint8. Rows not kept are undefined.
    """
    x0, x1, y0, y1 = low[0], high[0], low[1], high[1]
    for i in range(first, last):
        px, py, qx, qy = segments[i, 0, 0], segments[i, 0, 1], segments[i, 1, 0], segments[i, 1, 1]
        if (px < x0 and qx < x0) or (px > x1 and qx > x1) or (py < y0 and qy < y0) or (py > y1 and qy > y1):
            state[i] = DROPPED  # the outcodes share a bit
            continue
        start[i, 0], start[i, 1], end[i, 0], end[i, 1] = px, py, qx, qy
        t[i, 0], t[i, 1], faces[i, 0], faces[i, 1] = 0.0, 1.0, -1, -1
        p_in = x0 <= px <= x1 and y0 <= py <= y1
        if p_in and x0 <= qx <= x1 and y0 <= qy <= y1:
            state[i] = KEPT  # both outcodes are zero
            continue
        state[i] = clip_crossing(segments[i], low, high, start[i], end[i], t[i], faces[i])


@kernel
def clip_on_boxes_3d(
    segments: Any, low: Any, high: Any, first: int, last: int, start: Any, end: Any, t: Any, faces: Any, state: Any
) -> None:
    """Clip ``segments[first:last]`` ((n, 2, 3) float64) on the box `low`, `high`: see `clip_on_boxes_2d`."""
    x0, x1, y0, y1, z0, z1 = low[0], high[0], low[1], high[1], low[2], high[2]
    for i in range(first, last):
        px, py, pz = segments[i, 0, 0], segments[i, 0, 1], segments[i, 0, 2]
        qx, qy, qz = segments[i, 1, 0], segments[i, 1, 1], segments[i, 1, 2]
        if (px < x0 and qx < x0) or (px > x1 and qx > x1) or (py < y0 and qy < y0) or (py > y1 and qy > y1):
            state[i] = DROPPED
            continue
        if (pz < z0 and qz < z0) or (pz > z1 and qz > z1):
            state[i] = DROPPED
            continue
        start[i, 0], start[i, 1], start[i, 2] = px, py, pz
        end[i, 0], end[i, 1], end[i, 2] = qx, qy, qz
        t[i, 0], t[i, 1], faces[i, 0], faces[i, 1] = 0.0, 1.0, -1, -1
        p_in = x0 <= px <= x1 and y0 <= py <= y1 and z0 <= pz <= z1
        if p_in and x0 <= qx <= x1 and y0 <= qy <= y1 and z0 <= qz <= z1:
            state[i] = KEPT
            continue
        state[i] = clip_crossing(segments[i], low, high, start[i], end[i], t[i], faces[i])
