"""Polygon by ray and parity: even-odd over all edges of all rings, exact, with no ray ever cast again.

The ray goes right from q. Moving q up by an infinitesimal eps makes it miss every vertex: an edge is passed if one end
has y <= q.y and the other y > q.y, and counts if its crossing lies to the right, which is a sign of orient2d. Where
that sign is zero and q is between the ends, q is on the edge: BOUNDARY, whatever the parity. Horizontal edges are
never passed and are only looked at for BOUNDARY.

Edges are listed by horizontal slabs (grid.py), those reaching farthest right first: the list is left at the first
edge that ends to the left of q.

Source: Shimrat 1962, "Algorithm 112: position of point relative to polygon"; Hormann and Agathos 2001, "The point in
polygon problem for arbitrary polygons". Changed: exact signs, three values.
"""

from __future__ import annotations

from typing import Any

from engine.bounding.grid import cell_of
from engine.jit import kernel
from engine.predicates.loading import as_point2
from engine.predicates.orientation import orient2d_exact, orient2d_filter
from engine.types import UNDECIDED


@kernel
def locate_in_rings(
    points: Any, starts: Any, ends: Any, x_highs: Any, slabs: Any, box: Any, locations: Any, flag: Any
) -> int:
    """Fill `locations` (n,) int8 for points (n, 2); returns how many needed more than the filter.

    starts, ends: (m, 2) edges, by falling x_highs (m,), the larger x of each edge.
    slabs: a `BoxGrid` over y whose second axis has one cell; box: xmin, xmax, ymin, ymax of all edges.
    Caller guarantees rings: every vertex starts as many edges as it ends.
    """
    x_min, x_max, y_min, y_max = box
    n_beyond = 0
    for item in range(len(points)):
        if flag[0]:
            break
        q = as_point2(points, item)
        if q.x < x_min or q.x > x_max or q.y < y_min or q.y > y_max:
            locations[item] = -1
            continue
        slab = cell_of(q.y, slabs.u.low, slabs.u.cells_per_unit, slabs.u.n_cells)
        is_odd, is_unsure, is_open = False, False, False
        location = -1
        for entry in range(slabs.offsets[slab], slabs.offsets[slab + 1]):
            edge = slabs.items[entry]
            if x_highs[edge] < q.x:
                break
            if entry & 4095 == 4095 and flag[0]:
                break
            a, b = as_point2(starts, edge), as_point2(ends, edge)
            if (a.y < q.y and b.y < q.y) or (a.y > q.y and b.y > q.y):
                continue
            is_passed = (a.y <= q.y) != (b.y <= q.y)
            if a.x > q.x and b.x > q.x:  # wholly to the right: no sign needed
                is_odd ^= is_passed
                continue
            turn = orient2d_filter(a, b, q)
            if turn == UNDECIDED:
                is_unsure = True
                turn = orient2d_exact(a, b, q)
            if turn == UNDECIDED:
                is_open = True
            elif turn == 0:
                # on the line, and between the ends in y; in x too, unless the edge is horizontal and q beyond it
                if min(a.x, b.x) <= q.x and q.x <= max(a.x, b.x):
                    location = 0
                    break
            elif is_passed:
                is_odd ^= (turn > 0) == (a.y < b.y)
        if location != 0:
            location = UNDECIDED if is_open else 1 if is_odd else -1
        locations[item] = location
        n_beyond += is_unsure
    return n_beyond
