"""One point among the edges of one small polygon, all edges at once: the float filter without a branch.

The ray and the parity are those of polygon_ray_parity.py. An edge is passed if one end has y <= q.y and the other y >
q.y; every edge takes part in every sum, so that the compiler works on four at a time. Where the sign at a passed edge
is not sure, or a vertex is level with q (which may then lie on a horizontal edge), the edges are taken one by one.

A point may carry a blur, a bound on its coordinates' error as in posed/filters.py; then what is not sure stays
UNDECIDED.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.jit import inline, kernel
from engine.predicates.orientation import BOUND_2D, GUARD_2D, orient2d
from engine.types import UNDECIDED, Point2


@kernel
def close_rings(vertices: Any, sizes: Any, xs: Any, ys: Any) -> None:
    """Fill xs and ys, (n_vertices + n_rings,), with the rings of vertices (n, 2), each ended by its first vertex."""
    first = place = 0
    for ring in range(len(sizes)):
        for vertex in range(first, first + sizes[ring] + 1):
            row = vertex if vertex < first + sizes[ring] else first
            xs[place], ys[place] = vertices[row, 0], vertices[row, 1]
            place += 1
        first += sizes[ring]


@kernel
def boxes_of_rings(xs: Any, ys: Any, ring_offsets: Any, polygon_offsets: Any, lows: Any, highs: Any) -> None:
    """Fill lows and highs (n_polygons, 2) with the boxes of polygons given by the offsets of their rings."""
    for polygon in range(len(lows)):
        first, last = ring_offsets[polygon_offsets[polygon]], ring_offsets[polygon_offsets[polygon + 1]]
        x_low = x_high = xs[first]
        y_low = y_high = ys[first]
        for place in range(first + 1, last):
            x_low, x_high = min(x_low, xs[place]), max(x_high, xs[place])
            y_low, y_high = min(y_low, ys[place]), max(y_high, ys[place])
        lows[polygon, 0], lows[polygon, 1] = x_low, y_low
        highs[polygon, 0], highs[polygon, 1] = x_high, y_high


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
        if (a.y < q.y and b.y < q.y) or (a.y > q.y and b.y > q.y) or (a.x < q.x and b.x < q.x):
            continue
        is_passed = (a.y <= q.y) != (b.y <= q.y)
        if a.x > q.x and b.x > q.x:
            is_odd ^= is_passed
            continue
        turn = orient2d(a, b, q)
        if turn == UNDECIDED:
            is_open = True
        elif turn == 0:
            if min(a.x, b.x) <= q.x and q.x <= max(a.x, b.x):
                return 0
        elif is_passed:
            is_odd ^= (turn > 0) == (a.y < b.y)
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
