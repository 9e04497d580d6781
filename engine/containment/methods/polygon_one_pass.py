"""Polygon by ray and parity in one pass over the edges, with nothing prepared: the float filter without a branch.

The ray and the parity are those of polygon_ray_parity.py. An edge is passed if one end has y <= q.y and the other y >
q.y; every edge takes part in every sum, so that the compiler works on several at a time: on edges for one point, or on
points for one edge, where points are many and edges few. Where the sign at a passed edge is not sure, or a vertex is
level with q (which may then lie on a horizontal edge), the edges are taken one by one.

A point may carry a blur, a bound on its coordinates' error as in posed/filters.py; then what is not sure stays
UNDECIDED.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.containment.methods.polygon_ray_parity import CROSSED, ON_EDGE, meet_edge
from engine.containment.posed.filters import NOT_FINITE, has_not_finite
from engine.jit import allocating, allocating_kernel, called, inline, merged
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.predicates.vectors import as_point2
from engine.types import UNDECIDED, Point2

_BLOCK: Final = 256
"""Edges, or points, looked at together: their coordinates fit the first-level cache."""
_FEW_POINTS, _MANY_EDGES = 16, 96
"""Below the one, above the other, edges are worked on together, not points."""


def close_rings(vertices: FloatArray, ring_offsets: IntArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the xs and ys of the rings of vertices (n, 2), each ended by its first vertex, and where they begin."""
    offsets = ring_offsets + np.arange(len(ring_offsets))
    rows = np.arange(offsets[-1]) - np.repeat(np.arange(len(ring_offsets) - 1), np.diff(offsets))
    rows[offsets[1:] - 1] = ring_offsets[:-1]
    return vertices[rows, 0], vertices[rows, 1], offsets


@merged
def _pass_edge(ax: Any, ay: Any, bx: Any, by: Any, x: Any, y: Any, blur: Any) -> tuple[bool, bool]:
    """Tell whether the edge counts for q, and whether that is not sure."""
    above = ay - y
    left = (ax - x) * (by - y)
    right = above * (bx - x)
    turn = left - right
    bound = BOUND_2D * (abs(left) + abs(right)) + GUARD_2D
    bound += blur * (abs(bx - ax) + abs(by - ay))
    is_passed = (ay <= y) != (by <= y)
    is_unsure = (is_passed & (not abs(turn) > bound)) | (not abs(above) > blur)  # NaN is not sure
    return is_passed & ((turn > 0.0) == (ay < by)), is_unsure


@merged
def _count_crossings(xs: Any, ys: Any, first: int, last: int, x: float, y: float, blur: float) -> tuple[int, int]:
    """Return how many edges between the vertices first ... last count for q, and how many are not sure."""
    n_crossed = n_unsure = 0
    for edge in range(np.uint64(first), np.uint64(last - 1)):  # unsigned: no index that counts from the end
        follow = edge + np.uint64(1)
        is_crossed, is_unsure = _pass_edge(xs[edge], ys[edge], xs[follow], ys[follow], x, y, blur)
        n_crossed += is_crossed
        n_unsure += is_unsure
    return n_crossed, n_unsure


@called
def _one_by_one(xs: Any, ys: Any, ring_offsets: Any, rings: tuple[int, int], q: Any) -> int:
    """Return the location of q in the rings rings[0] up to rings[1], which may end with their first vertex or not.

    UNDECIDED where a sign is out of the compiled range.
    """
    is_odd, is_open = False, False
    for ring in range(rings[0], rings[1]):
        first, last = ring_offsets[ring], ring_offsets[ring + 1]
        for edge in range(first, last):
            follow = edge + 1 if edge + 1 < last else first
            ay, by = ys[edge], ys[follow]
            if (ay < q.y and by < q.y) or (ay > q.y and by > q.y):
                continue
            met = meet_edge(Point2(float(xs[edge]), float(ay)), Point2(float(xs[follow]), float(by)), q) & 3
            if met == ON_EDGE:
                return 0
            is_open |= met == UNDECIDED
            is_odd ^= met == CROSSED
    return UNDECIDED if is_open else 1 if is_odd else -1


@inline
def locate_in_small_rings(
    xs: Any, ys: Any, ring_offsets: Any, rings: tuple[int, int], q: Any, blur: float
) -> tuple[int, bool]:
    """Return the location of q = (x, y, ...) in closed rings from rings[0] on, and whether it took more than a filter.

    xs, ys, ring_offsets: as `close_rings` leaves them.
    """
    n_crossed = n_unsure = 0
    for ring in range(rings[0], rings[1]):
        crossed, unsure = _count_crossings(xs, ys, ring_offsets[ring], ring_offsets[ring + 1], q[0], q[1], blur)
        n_crossed += crossed
        n_unsure += unsure
    if n_unsure == 0:
        return (1 if n_crossed & 1 else -1), False
    if blur != 0.0:
        return UNDECIDED, True
    return _one_by_one(xs, ys, ring_offsets, rings, Point2(q[0], q[1])), True


@allocating
def _by_edges(points: Any, blurs: Any, vertices: Any, ring_offsets: Any, crossed: Any, unsure: Any, flag: Any) -> None:
    """Count for each point the edges that it meets, and those that are not sure, a block of edges at a time."""
    xs, ys = np.empty(_BLOCK + 1), np.empty(_BLOCK + 1)
    for ring in range(len(ring_offsets) - 1):
        first, last = ring_offsets[ring], ring_offsets[ring + 1]
        for start in range(first, last, _BLOCK):
            if flag[0]:
                return
            size = min(_BLOCK, last - start)
            for k in range(size + 1):
                vertex = start + k if start + k < last else first
                xs[k], ys[k] = vertices[vertex, 0], vertices[vertex, 1]
            for item in range(len(points)):
                q, blur = as_point2(points, item), float(blurs[item]) if len(blurs) > 0 else 0.0
                n_crossed, n_unsure = _count_crossings(xs, ys, 0, size + 1, q.x, q.y, blur)
                crossed[item] += n_crossed
                unsure[item] += n_unsure


@allocating
def _by_points(points: Any, blurs: Any, vertices: Any, ring_offsets: Any, crossed: Any, unsure: Any, flag: Any) -> None:
    """Do what `_by_edges` does, a block of points at a time."""
    xs, ys, block_blurs = np.empty(_BLOCK), np.empty(_BLOCK), np.zeros(_BLOCK)
    n_crossed, n_unsure = np.empty(_BLOCK, np.int64), np.empty(_BLOCK, np.int64)
    for start in range(0, len(points), _BLOCK):
        if flag[0]:
            return
        size = min(_BLOCK, len(points) - start)
        for k in range(size):
            xs[k], ys[k], n_crossed[k], n_unsure[k] = points[start + k, 0], points[start + k, 1], 0, 0
        for k in range(size if len(blurs) > 0 else 0):
            block_blurs[k] = blurs[start + k]
        for ring in range(len(ring_offsets) - 1):
            first, last = ring_offsets[ring], ring_offsets[ring + 1]
            for edge in range(first, last):
                follow = edge + 1 if edge + 1 < last else first
                ax, ay, bx, by = vertices[edge, 0], vertices[edge, 1], vertices[follow, 0], vertices[follow, 1]
                for k in range(np.uint64(size)):
                    is_crossed, is_unsure = _pass_edge(ax, ay, bx, by, xs[k], ys[k], block_blurs[k])
                    n_crossed[k] += is_crossed
                    n_unsure[k] += is_unsure
        for k in range(size):
            crossed[start + k], unsure[start + k] = n_crossed[k], n_unsure[k]


@allocating_kernel
def locate_by_ring_pass(points: Any, blurs: Any, vertices: Any, ring_offsets: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 2); returns how many needed more than the filter.

    blurs: (n,), or (0,) for points that are exact; then NOT_FINITE is returned where one is not finite. vertices,
    ring_offsets: a polygon's.
    """
    if len(blurs) == 0 and has_not_finite(points):
        return NOT_FINITE
    crossed, unsure = np.zeros(len(points), np.int64), np.zeros(len(points), np.int64)
    if len(points) < _FEW_POINTS or len(vertices) > _MANY_EDGES:
        _by_edges(points, blurs, vertices, ring_offsets, crossed, unsure, flag)
    else:
        _by_points(points, blurs, vertices, ring_offsets, crossed, unsure, flag)
    n_beyond, rings, xs, ys = 0, (0, len(ring_offsets) - 1), vertices[:, 0], vertices[:, 1]
    for item in range(len(points)):
        if unsure[item] == 0:
            locations[item] = 2 * (crossed[item] & 1) - 1
            continue
        n_beyond += 1
        locations[item] = UNDECIDED
        if flag[0]:
            break
        if len(blurs) == 0 or blurs[item] == 0.0:
            locations[item] = _one_by_one(xs, ys, ring_offsets, rings, as_point2(points, item))
    return n_beyond
