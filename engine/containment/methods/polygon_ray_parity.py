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
from engine.containment.posed.filters import NOT_FINITE, has_not_finite, orient2d_blurred
from engine.jit import called, inline, kernel, merged
from engine.predicates.orientation import orient2d_exact, orient2d_filter
from engine.predicates.vectors import as_point2
from engine.types import UNDECIDED

MISSED, CROSSED, ON_EDGE, BEYOND = 0, 1, 3, 4
"""How a ray meets an edge, as `polyhedron_ray_parity.py` has it for faces."""


@kernel
def locate_in_rings(
    points: Any, blurs: Any, starts: Any, ends: Any, x_highs: Any, slabs: Any, box: Any, locations: Any, flag: Any
) -> int:
    """Fill `locations` (n,) int8 for points (n, 2); returns how many needed more than the filter.

    blurs: (n,), or (0,) for points that are exact; then NOT_FINITE is returned where one is not finite.
    starts, ends: (m, 2) edges, by falling x_highs (m,), the larger x of each edge.
    slabs: a `BoxGrid` over y whose second axis has one cell; box: xmin, xmax, ymin, ymax of all edges.
    Caller guarantees rings: every vertex starts as many edges as it ends.
    """
    if len(blurs) == 0 and has_not_finite(points):
        return NOT_FINITE
    x_min, x_max, y_min, y_max = box
    edges, u, n_beyond = (starts, ends, x_highs), slabs.u, 0
    for item in range(len(points)):
        if flag[0]:
            break
        q, blur = as_point2(points, item), float(blurs[item]) if len(blurs) > 0 else 0.0
        below, above = q.y - blur, q.y + blur
        if q.x + blur < x_min or q.x - blur > x_max or above < y_min or below > y_max:
            locations[item] = -1
            continue
        location, is_beyond = UNDECIDED, True
        if below >= y_min and q.x - blur >= x_min:  # false for NaN; what sticks out of the box is left open
            slab = cell_of(below, u.low, u.cells_per_unit, u.n_cells)
            if blur == 0.0:
                location, is_beyond = _locate_in_slab(q, 0.0, edges, slabs, slab, flag)
            elif slab == cell_of(above, u.low, u.cells_per_unit, u.n_cells):
                location, is_beyond = _locate_in_slab(q, blur, edges, slabs, slab, flag)
        locations[item] = location
        n_beyond += is_beyond
    return n_beyond


@merged
def _locate_in_slab(q: Any, blur: float, edges: Any, slabs: Any, slab: int, flag: Any) -> tuple[int, bool]:
    """Return the location of a blurred q by the edges of a slab, and whether it took more than the filter."""
    starts, ends, x_highs = edges
    is_odd, is_open, beyond = False, False, 0
    for entry in range(slabs.offsets[slab], slabs.offsets[slab + 1]):
        edge = slabs.items[entry]
        if x_highs[edge] < q.x - blur:
            break
        if entry & 4095 == 4095 and flag[0]:
            break
        a, b = as_point2(starts, edge), as_point2(ends, edge)
        met = meet_edge(a, b, q) if blur == 0.0 else _meet_blurred(a, b, q, blur)
        beyond |= met & BEYOND
        if met & 3 == ON_EDGE:
            return 0, True
        is_open |= met & 3 == UNDECIDED
        is_odd ^= met & 3 == CROSSED
    return UNDECIDED if is_open else 1 if is_odd else -1, beyond != 0


@inline
def meet_edge(a: Any, b: Any, q: Any) -> int:
    """Return CROSSED if the ray to the right from q passes the edge, MISSED, ON_EDGE or UNDECIDED.

    BEYOND is added where it took more than the filter.
    """
    if (a.y < q.y and b.y < q.y) or (a.y > q.y and b.y > q.y) or (a.x < q.x and b.x < q.x):
        return MISSED
    is_passed = (a.y <= q.y) != (b.y <= q.y)
    if a.x > q.x and b.x > q.x:  # wholly to the right: no sign needed
        return CROSSED if is_passed else MISSED
    turn, beyond = orient2d_filter(a, b, q), 0
    if turn == UNDECIDED:
        turn, beyond = orient2d_exact(a, b, q), BEYOND
    if turn == UNDECIDED:
        return UNDECIDED | beyond
    if turn == 0:
        # on the line, and between the ends in y; in x too, unless the edge is horizontal and q beyond it
        return (ON_EDGE if min(a.x, b.x) <= q.x and q.x <= max(a.x, b.x) else MISSED) | beyond
    return (CROSSED if is_passed and (turn > 0) == (a.y < b.y) else MISSED) | beyond


@called
def _meet_blurred(a: Any, b: Any, q: Any, blur: float) -> int:
    """Return CROSSED if the rays from all of the blurred q pass the edge, MISSED if none does, or UNDECIDED."""
    left, right, below, above = q.x - blur, q.x + blur, q.y - blur, q.y + blur
    if (a.y < below and b.y < below) or (a.y > above and b.y > above) or (a.x < left and b.x < left):
        return MISSED
    if (below <= a.y and a.y <= above) or (below <= b.y and b.y <= above):
        return UNDECIDED | BEYOND
    is_passed = (a.y <= q.y) != (b.y <= q.y)
    if a.x > right and b.x > right:
        return CROSSED if is_passed else MISSED
    turn = orient2d_blurred(a, b, q, blur)
    if turn == UNDECIDED:
        return UNDECIDED | BEYOND
    return CROSSED if is_passed and (turn > 0) == (a.y < b.y) else MISSED
