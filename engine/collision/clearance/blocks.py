"""The triangles of two blocks: how far they reach along the line, and which pairs of them may be the nearest."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.collision.clearance.boxes import Search, View, scaled, set_line, size_of, way_of
from engine.collision.clearance.near_triangles import nearest_points, rounding_of, seen_from
from engine.collision.meshes.mesh_arrays import triangle_of
from engine.collision.meshes.placement import placed
from engine.collision.meshes.triangle_triangle import Facet
from engine.jit import inline, merged
from engine.lanes.boxes import EMPTY
from engine.lanes.gaps import near_triangle, place_triangles, triangle_reaches
from engine.lanes.lanes import lowest_bit
from engine.lanes.tracing import LANES
from engine.predicates.vectors import dot
from engine.types import Point3

DONE: Final = 0
FULL: Final = 1
CLOSER: Final = 2
INTERRUPTED: Final = 3
"""How a search ended: with all pairs; without room for more pairs of boxes or triangles; with two points nearer than
asked; by the flag."""
_REACH: Final = 2.0**-18
"""More than what a product of a direction with two vectors of float32, none of them above 2, is off by."""
_ABOVE_ONE: Final = 1.0 + 2.0**-22


@merged
def _triangle(view: View, item: int) -> Facet:
    """Return a placed triangle, rounded, times the unit."""
    t, place, unit = triangle_of(view.mesh, item), view.place, view.unit
    return Facet(scaled(placed(t.p, place), unit), scaled(placed(t.q, place), unit), scaled(placed(t.r, place), unit))


@inline
def _measure(s: Facet, t: Facet, error: float, most: float) -> tuple[float, float, Point3, tuple[int, int]]:
    """Return bounds on the distance of two triangles, from below and above, and direction and features of nearly
    nearest points; of any where the lower bound is above `most`.

    error: bound on the distance of a point from its rounded one, both bodies together.
    """
    origin = s.p
    s, t = seen_from(origin, s), seen_from(origin, t)
    slack = rounding_of(s, t) + error
    best, across = nearest_points(s, t, most + slack)
    return max(across.low - slack, 0.0), across.size + slack, across.way, (best.first, best.second)


@inline
def keep_below(found: Any, n: int, most: float) -> int:
    """Leave out the candidates above the bound; return how many there are."""
    n_kept = 0
    for item in range(n):
        if found.bounds[item] <= most:
            found.bounds[n_kept] = found.bounds[item]
            for column in range(4):
                found.pairs[n_kept, column] = found.pairs[item, column]
            n_kept += 1
    return n_kept


@merged
def reach_from(s: Search, view: View, row: int) -> float:
    """Return how far the origin of a body's tree reaches along the line toward the other body, rounding left out."""
    line, o, unit = s.room.line, view.mesh.origin, view.unit
    d = Point3(line[3 * row], line[3 * row + 1], line[3 * row + 2])
    return (1.0 - 2.0 * row) * (dot(d, scaled(Point3(o[0], o[1], o[2]), unit)) + line[9 + row]) + _REACH * size_of(view)


@merged
def block_reach(s: Search, view: View, row: int, node: int) -> float:
    """Return how far the triangles of a block reach along the line, toward the other body; kept until that turns."""
    kept, sign = s.room.kept[node], 1.0 - 2.0 * row
    if kept[2 * row] != s.room.line[11]:
        triangle_reaches(view.mesh.blocks, node, way_of(s.room.line, row, sign), s.room.work)
        kept[2 * row] = s.room.line[11]
        most = _most_of_block(view.mesh.child, node, s.room.work)
        kept[2 * row + 1] = sign * (reach_from(s, view, row) + most * size_of(view))
    return float(kept[2 * row + 1])


@inline
def _most_of_block(child: Any, node: int, work: Any) -> float:
    """Return the largest number in the first row of work in a lane with a triangle."""
    most = np.float64(work[0, 0])
    for lane in range(1, LANES):
        if child[node, lane] == EMPTY:
            break
        most = max(most, np.float64(work[0, lane]))
    return most


@merged
def measure_blocks(s: Search, i: int, j: int, n_found: int, limits: Any) -> tuple[int, int]:
    """Add the pairs of triangles of two blocks that may be the nearest; return how that ended, and their number.

    limits: as in `find_nearest`; the first falls.
    """
    line, frames, work, found = s.room.line, s.room.frames, s.room.work, s.room.found
    way, per_size = way_of(line, 0, 1.0), _ABOVE_ONE / size_of(s.a)
    place_triangles(s.b.mesh.blocks, j, frames, way, work)
    for k in range(LANES):
        own = int(s.a.mesh.child[i, k])
        if own == EMPTY:
            break
        bits = near_triangle(s.a.mesh.blocks, i, k, frames, way, limits[0] * per_size, work)
        t = _triangle(s.a, -1 - own)
        while bits != 0:  # bound: each turn takes a bit
            their = int(s.b.mesh.child[j, lowest_bit(bits)])
            bits &= bits - 1
            if their == EMPTY:
                break
            low, high, d, features = _measure(t, _triangle(s.b, -1 - their), s.error, limits[0])
            if high < limits[1]:
                return CLOSER, 0
            if high < limits[0]:
                limits[0] = high
                set_line(line, s.a, s.b, d)
            if low > limits[0]:
                continue
            if n_found == len(found.bounds):
                n_found = keep_below(found, n_found, limits[0])
                if 2 * n_found > len(found.bounds):
                    return FULL, 0
            found.bounds[n_found] = low
            found.pairs[n_found, 0], found.pairs[n_found, 1] = -1 - own, -1 - their
            found.pairs[n_found, 2], found.pairs[n_found, 3] = features
            n_found += 1
    return DONE, n_found
