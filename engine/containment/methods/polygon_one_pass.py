"""Polygon by ray and parity in one pass over the edges, with nothing prepared: the float filter without a branch.

The ray and the parity are those of polygon_ray_parity.py. An edge is passed if one end has y <= q.y and the other y >
q.y; every edge takes part in every sum, so that the compiler works on four at a time. Where the sign at a passed edge
is not sure, or a vertex is level with q (which may then lie on a horizontal edge), the edges are taken one by one.

A point may carry a blur, a bound on its coordinates' error as in posed/filters.py; then what is not sure stays
UNDECIDED.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.containment.methods.polygon_ray_parity import CROSSED, ON_EDGE, meet_edge
from engine.jit import inline, kernel
from engine.predicates.loading import as_point2
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.types import UNDECIDED, Point2


def close_rings(vertices: FloatArray, ring_offsets: IntArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the xs and ys of the rings of vertices (n, 2), each ended by its first vertex, and where they begin."""
    offsets = ring_offsets + np.arange(len(ring_offsets))
    is_last, closed = np.zeros(offsets[-1], np.bool_), np.empty((2, offsets[-1]))
    is_last[offsets[1:] - 1] = True
    for axis in (0, 1):
        closed[axis, ~is_last] = vertices[:, axis]
        closed[axis, is_last] = vertices[ring_offsets[:-1], axis]
    return closed[0], closed[1], offsets


@inline
def _count_crossings(xs: Any, ys: Any, first: int, last: int, x: float, y: float, blur: float) -> Any:
    """Return how many edges first ... last of a ring count for q, and how many are not sure."""
    n_crossed = n_unsure = 0
    for edge in range(np.uint64(first), np.uint64(last - 1)):  # unsigned: no index that counts from the end
        ax, ay, bx, by = xs[edge], ys[edge], xs[edge + np.uint64(1)], ys[edge + np.uint64(1)]
        above = ay - y
        left = (ax - x) * (by - y)
        right = above * (bx - x)
        turn = left - right
        bound = BOUND_2D * (abs(left) + abs(right)) + GUARD_2D
        bound += blur * (abs(bx - ax) + abs(by - ay))
        is_passed = (ay <= y) != (by <= y)
        n_crossed += is_passed & ((turn > 0.0) == (ay < by))
        n_unsure += (is_passed & (not abs(turn) > bound)) | (not abs(above) > blur)  # NaN is not sure
    return n_crossed, n_unsure


@inline
def _one_by_one(xs: Any, ys: Any, first: int, last: int, q: Any) -> int:
    """Return 0 if q is on an edge first ... last of a ring, else 1 if an odd number of edges counts, -1 if an even one.

    UNDECIDED where a sign is out of the compiled range.
    """
    is_odd, is_open = False, False
    for edge in range(first, last - 1):
        a, b = Point2(float(xs[edge]), float(ys[edge])), Point2(float(xs[edge + 1]), float(ys[edge + 1]))
        met = meet_edge(a, b, q, 0.0) & 3
        if met == ON_EDGE:
            return 0
        is_open |= met == UNDECIDED
        is_odd ^= met == CROSSED
    return UNDECIDED if is_open else 1 if is_odd else -1


@inline
def locate_in_small_rings(
    xs: Any, ys: Any, ring_offsets: Any, rings: tuple[int, int], q: Any, blur: float
) -> tuple[int, bool]:
    """Return the location of q = (x, y, ...) in the rings from rings[0] on, and whether it took more than a filter."""
    x, y, first_ring, last_ring = q[0], q[1], rings[0], rings[1]
    n_crossed = n_unsure = 0
    for ring in range(first_ring, last_ring):
        crossed, unsure = _count_crossings(xs, ys, ring_offsets[ring], ring_offsets[ring + 1], x, y, blur)
        n_crossed += crossed
        n_unsure += unsure
    if n_unsure == 0:
        return (1 if n_crossed & 1 else -1), False
    if blur > 0.0:
        return UNDECIDED, True
    is_odd, is_open = False, False
    for ring in range(first_ring, last_ring):
        location = _one_by_one(xs, ys, ring_offsets[ring], ring_offsets[ring + 1], Point2(x, y))
        if location == 0:
            return 0, True
        is_open |= location == UNDECIDED
        is_odd ^= location == 1
    return (UNDECIDED if is_open else 1 if is_odd else -1), True


@kernel
def locate_by_ring_pass(points: Any, blurs: Any, rings: Any, box: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 2) with blurs (n,); returns how many needed more than the filter.

    rings: xs, ys and the offsets of the rings, as `close_rings` leaves them; box: xmin, xmax, ymin, ymax.
    """
    (xs, ys, offsets), (x_min, x_max, y_min, y_max) = rings, box
    n_beyond, all_rings = 0, (0, len(offsets) - 1)
    for item in range(len(points)):
        if flag[0]:
            break
        q, blur = as_point2(points, item), float(blurs[item])
        location, is_beyond = -1, False
        if not ((q.x + blur < x_min) | (q.x - blur > x_max) | (q.y + blur < y_min) | (q.y - blur > y_max)):
            location, is_beyond = locate_in_small_rings(xs, ys, offsets, all_rings, q, blur)
        locations[item] = location
        n_beyond += is_beyond
    return n_beyond
