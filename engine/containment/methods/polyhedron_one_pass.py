"""Point location in a polyhedron by ray parity in one pass over the triangles, with nothing prepared.

Points are sorted into a grid over x and y, and each triangle looks up the points below it. The decisions are those of
polyhedron_ray_parity.py, so the answers are too. A pass costs some 20 ns a triangle, building a tree 0.5 us: a pass is
for the first few batches on a solid.

Source: ray parity after Shimrat 1962; the grid over the points after C. Ericson, Real-Time Collision Detection, 2005.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.bounding.box_grid import Axis, cell_of
from engine.compiling.jit import allocating_kernel, inline
from engine.containment.methods.filters import NOT_FINITE, has_not_finite
from engine.containment.methods.polyhedron_ray_parity import BEYOND, CROSSED, ON_FACE, meet_upwards
from engine.predicates.vectors import as_point3, corners_of
from engine.types import UNDECIDED, FlagArray, FloatArray, Int8Array, Int32Array, IntArray

_ODD, _ON_FACE, _OPEN, _BEYOND = 1, 2, 4, 8
"""Bits of a point's state: odd number of crossings, on a face, a sign undecided, the filter left a sign open."""


@inline
def _sort_into_cells(points: FloatArray, u: Axis, v: Axis, firsts: IntArray, order: Int32Array) -> None:
    """Sort the numbers of points (n, 3) by grid cell into order (n,) int32, and fill firsts (n_cells + 1,) int64, zero
    on entry, with the offsets of the cells. u, v: the grid's axes along x and y."""
    for item in range(len(points)):
        firsts[_cell_at(points, item, u, v) + 1] += 1
    for cell in range(1, len(firsts)):
        firsts[cell] += firsts[cell - 1]
    for item in range(len(points) - 1, -1, -1):  # from behind: firsts[cell + 1] comes down to the cell's first place
        cell = _cell_at(points, item, u, v)
        firsts[cell + 1] -= 1
        order[firsts[cell + 1]] = item
    for cell in range(len(firsts) - 1):
        firsts[cell] = firsts[cell + 1]
    firsts[len(firsts) - 1] = len(points)


@inline
def _cell_at(points: FloatArray, item: int, u: Axis, v: Axis) -> int:
    row = cell_of(points[item, 1], v.low, v.cells_per_unit, v.n_cells)
    return row * u.n_cells + cell_of(points[item, 0], u.low, u.cells_per_unit, u.n_cells)


@inline
def _record(states: FlagArray, item: int, met: int) -> None:
    """Update the state of point `item` by `met`, how its upward ray meets one triangle (result of `meet_upwards`)."""
    if met & BEYOND:
        states[item] |= _BEYOND
    met &= 3
    if met == ON_FACE:
        states[item] |= _ON_FACE
    elif met == UNDECIDED:
        states[item] |= _OPEN
    elif met == CROSSED:
        states[item] ^= _ODD


@inline
def _write_locations(states: FlagArray, locations: Int8Array) -> int:
    """Fill the locations from the points' states; return how many the filter left open."""
    n_beyond = 0
    for item in range(len(states)):
        state = states[item]
        n_beyond += (state & _BEYOND) != 0
        if state & _ON_FACE:
            locations[item] = 0
        elif state & _OPEN:
            locations[item] = UNDECIDED
        else:
            locations[item] = 1 if state & _ODD else -1
    return n_beyond


@inline
def _cast_rays(
    points: FloatArray, cells: Any, vertices: FloatArray, triangles: IntArray, z_min: float, states: FlagArray,
    flag: FlagArray,
) -> None:  # fmt: skip
    """Record in states (n,) uint8 how the upward rays from points (n, 3) meet the triangles (m, 3). cells: (u, v,
    firsts, order), the grid over the points (`_sort_into_cells`). z_min: least z of the points."""
    u, v, firsts, order = cells
    for triangle in range(len(triangles)):
        if flag[0]:
            break
        a, b, c = corners_of(vertices, triangles, triangle)
        x_low, x_high = max(min(a.x, b.x, c.x), u.low), min(max(a.x, b.x, c.x), u.high)
        y_low, y_high = max(min(a.y, b.y, c.y), v.low), min(max(a.y, b.y, c.y), v.high)
        z_high = max(a.z, b.z, c.z)
        if x_low > x_high or y_low > y_high or z_high < z_min:
            continue
        first = cell_of(x_low, u.low, u.cells_per_unit, u.n_cells)
        last = cell_of(x_high, u.low, u.cells_per_unit, u.n_cells)
        row = cell_of(y_low, v.low, v.cells_per_unit, v.n_cells)
        last_row = cell_of(y_high, v.low, v.cells_per_unit, v.n_cells)
        for line in range(row * u.n_cells, (last_row + 1) * u.n_cells, u.n_cells):
            for place in range(firsts[line + first], firsts[line + last + 1]):
                item = order[place]
                q = as_point3(points, item)
                is_above = q.z > z_high
                if is_above or q.x < x_low or q.x > x_high or q.y < y_low or q.y > y_high or states[item] & _ON_FACE:
                    continue
                _record(states, item, meet_upwards(a, b, c, q))


@inline
def _axis_over(points: FloatArray, axis: int, n_cells: int) -> Axis:
    """Return an `Axis` of `n_cells` cells over the range of coordinate `axis` of the points, or of one cell if that
    range is empty."""
    low = high = float(points[0, axis])
    for item in range(1, len(points)):
        low, high = min(low, float(points[item, axis])), max(high, float(points[item, axis]))
    extent = high * 0.5 - low * 0.5
    return Axis(low, high, min(n_cells / extent, 1e300) if extent > 0.0 else 0.0, n_cells if extent > 0.0 else 1)


@allocating_kernel
def locate_by_pass(
    points: FloatArray, vertices: FloatArray, triangles: IntArray, locations: Int8Array, flag: FlagArray
) -> int:
    """Fill locations (n,) int8 of points (n, 3), n > 0, in a polyhedron; return how many the filter left open, or
    NOT_FINITE. triangles: (m, 3) int64. Caller guarantees that an even number of triangles meets at each edge."""
    if has_not_finite(points):
        return NOT_FINITE
    side = max(1, int(len(points) ** 0.5))
    u, v, z_min = _axis_over(points, 0, side), _axis_over(points, 1, side), _axis_over(points, 2, 1).low
    firsts, order = np.zeros(u.n_cells * v.n_cells + 1, np.int64), np.empty(len(points), np.int32)
    _sort_into_cells(points, u, v, firsts, order)
    states = np.zeros(len(points), np.uint8)
    _cast_rays(points, (u, v, firsts, order), vertices, triangles, z_min, states, flag)
    return int(_write_locations(states, locations))
