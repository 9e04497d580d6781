"""The triangles of two blocks: how far they reach along the line, and which pairs of them may be the nearest."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.collision.clearance.boxes import Search, View, box_bound, lane_centre, lane_half, scaled, set_line
from engine.collision.clearance.near_triangles import nearest_points, rounding_of, seen_from
from engine.collision.meshes.mesh_arrays import triangle_of
from engine.collision.meshes.placement import placed
from engine.collision.meshes.triangle_triangle import Facet
from engine.jit import inline
from engine.lanes.boxes import EMPTY
from engine.lanes.tracing import LANES
from engine.predicates.loading import as_point3
from engine.predicates.vectors import dot, minus
from engine.types import Point3

DONE: Final = 0
FULL: Final = 1
CLOSER: Final = 2
INTERRUPTED: Final = 3
"""How a search ended: with all pairs; without room for more pairs of boxes or triangles; with two points nearer than
asked; by the flag."""


@inline
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


@inline
def _reach(s: Search, view: View, row: int, item: int) -> float:
    """Return how far a triangle reaches along the line, toward the other body."""
    d = Point3(s.room.line[3 * row], s.room.line[3 * row + 1], s.room.line[3 * row + 2])
    sign, reach = 1.0 - 2.0 * row, -np.inf
    for corner in range(3):
        p = scaled(as_point3(view.mesh.vertices, view.mesh.triangles[item, corner]), view.unit)
        reach = max(reach, sign * dot(d, p))
    return sign * reach + s.room.line[9 + row]


@inline
def block_reach(s: Search, view: View, row: int, node: int) -> float:
    """Return how far the triangles of a block reach along the line, toward the other body; kept until that turns."""
    turn, sign, reach = s.room.line[11], 1.0 - 2.0 * row, -np.inf
    if s.room.kept[node, 2 * row] == turn:
        return float(s.room.kept[node, 2 * row + 1])
    for lane in range(LANES):
        if view.mesh.child[node, lane] == EMPTY:
            break
        reach = max(reach, sign * _reach(s, view, row, -1 - int(view.mesh.child[node, lane])))
    s.room.kept[node, 2 * row], s.room.kept[node, 2 * row + 1] = turn, sign * reach
    return sign * reach


@inline
def _box_of_block(view: View, node: int) -> tuple[Point3, Point3]:
    """Return centre and half widths of a box around the boxes of a block."""
    c, h = lane_centre(view, node * LANES), lane_half(view, node * LANES)
    low, high = minus(c, h), minus(c, minus(Point3(0.0, 0.0, 0.0), h))
    for lane in range(1, LANES):
        if view.mesh.child[node, lane] == EMPTY:
            break
        c, h = lane_centre(view, node * LANES + lane), lane_half(view, node * LANES + lane)
        low = Point3(min(low.x, c.x - h.x), min(low.y, c.y - h.y), min(low.z, c.z - h.z))
        high = Point3(max(high.x, c.x + h.x), max(high.y, c.y + h.y), max(high.z, c.z + h.z))
    middle = Point3(0.5 * (low.x + high.x), 0.5 * (low.y + high.y), 0.5 * (low.z + high.z))
    return middle, minus(high, middle)


@inline
def measure_blocks(s: Search, i: int, j: int, n_found: int, limits: Any) -> tuple[int, int]:
    """Add the pairs of triangles of two blocks that may be the nearest; return how that ended, and their number.

    limits: as in `find_nearest`; the first falls.
    """
    (c, h), (other, half) = _box_of_block(s.a, i), _box_of_block(s.b, j)
    if box_bound(s, limits[0], c, h, other, half) > limits[0]:
        return DONE, n_found
    for k in range(LANES):
        own = int(s.a.mesh.child[i, k])
        if own == EMPTY:
            break
        c, h = lane_centre(s.a, i * LANES + k), lane_half(s.a, i * LANES + k)
        if box_bound(s, limits[0], c, h, other, half) > limits[0]:
            continue
        t = _triangle(s.a, -1 - own)
        for m in range(LANES):
            their = int(s.b.mesh.child[j, m])
            if their == EMPTY:
                break
            # order: both by one line, which turns below
            if _reach(s, s.b, 1, -1 - their) - _reach(s, s.a, 0, -1 - own) - s.frame.margin > limits[0]:
                continue
            at = j * LANES + m
            if box_bound(s, limits[0], c, h, lane_centre(s.b, at), lane_half(s.b, at)) > limits[0]:
                continue
            low, high, d, features = _measure(t, _triangle(s.b, -1 - their), s.error, limits[0])
            if high < limits[1]:
                return CLOSER, 0
            if high < limits[0]:
                limits[0] = high
                set_line(s.room.line, s.a, s.b, d)
            if low > limits[0]:
                continue
            if n_found == len(s.room.found.bounds):
                n_found = keep_below(s.room.found, n_found, limits[0])
                if 2 * n_found > len(s.room.found.bounds):
                    return FULL, 0
            pairs = s.room.found.pairs
            s.room.found.bounds[n_found] = low
            pairs[n_found, 0], pairs[n_found, 1] = -1 - own, -1 - their
            pairs[n_found, 2], pairs[n_found, 3] = features
            n_found += 1
    return DONE, n_found
