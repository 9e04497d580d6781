"""The vertical ray of many polyhedra in one pass: candidates grouped by body, each body's columns by their addresses.

What polyhedron_ray_parity.py does body by body, with the filters of posed/filters.py: a point in no pose has the blur
0. Points that the filters leave stay UNDECIDED.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.arrays import FloatArray, Int32Array, IntArray
from engine.bounding.grid import Axis, BoxGrid, cell_of
from engine.containment.posed.filters import parity_in_column
from engine.containment.scene.first_pass import LATER, to_frame
from engine.containment.scene.voxels import side_in_voxels
from engine.jit import inline, kernel
from engine.lanes.addresses import array_at
from engine.types import UNDECIDED, Point3


class ColumnTables(NamedTuple):
    """The prepared structures of the polyhedra of a scene, a row for each solid."""

    rows: Int32Array
    """Row of each body's solid, -1 for bodies that are not asked here."""
    addresses: IntArray
    """``(n, 6)``: of vertices, triangles, boxes, areas, offsets and items of the columns."""
    sizes: IntArray
    """``(n, 5)``: numbers of vertices, triangles and items, cells along u and v."""
    axes: FloatArray
    """``(n, 7)``: low, high and cells per unit of u and of v, and zmin."""
    voxel_places: IntArray
    """``(n, 2)``: address of the packed sides, 0 where there are none, and shift."""
    voxel_frames: FloatArray


@inline
def _in_columns(
    axes: Any, sizes: Any, addresses: Any, row: int, x: float, y: float, z: float, blur: float, flag: Any
) -> int:
    """Return the location of a blurred point by the ray upwards, or UNDECIDED."""
    u = Axis(axes[row, 0], axes[row, 1], axes[row, 2], sizes[row, 3])
    v = Axis(axes[row, 3], axes[row, 4], axes[row, 5], sizes[row, 4])
    if (x + blur < u.low) | (x - blur > u.high) | (y + blur < v.low) | (y - blur > v.high) | (z + blur < axes[row, 6]):
        return -1
    if not ((x - blur >= u.low) & (y - blur >= v.low)):
        return UNDECIDED
    column = cell_of(x - blur, u.low, u.cells_per_unit, u.n_cells)
    line = cell_of(y - blur, v.low, v.cells_per_unit, v.n_cells)
    if blur > 0.0:
        is_one = column == cell_of(x + blur, u.low, u.cells_per_unit, u.n_cells)
        if not (is_one & (line == cell_of(y + blur, v.low, v.cells_per_unit, v.n_cells))):
            return UNDECIDED
    n_vertices, n_triangles, n_items = sizes[row, 0], sizes[row, 1], sizes[row, 2]
    vertices = array_at(addresses[row, 0], (n_vertices, 3), np.float64)
    triangles = array_at(addresses[row, 1], (n_triangles, 3), np.int32)
    boxes = array_at(addresses[row, 2], (n_triangles, 6), np.float64)
    areas = array_at(addresses[row, 3], (n_triangles,), np.int8)
    offsets = array_at(addresses[row, 4], (u.n_cells * v.n_cells + 1,), np.int64)
    items = array_at(addresses[row, 5], (n_items,), np.int32)
    columns = BoxGrid(u, v, offsets, items)
    cell = line * u.n_cells + column
    return parity_in_column(Point3(x, y, z), blur, cell, vertices, triangles, boxes, areas, columns, flag)


@kernel
def locate_groups(
    points: Any,
    owners: Any,
    order: Any,
    begins: Any,
    ends: Any,
    bodies: Any,
    scene: Any,
    tables: Any,
    located: Any,
    flag: Any,
) -> None:
    """Fill located (n_pairs,) int8 for groups of pairs of a body each: those at order[begins[group] : ends[group]].

    owners: (n_pairs,) the point of each pair; bodies: that of each group; scene: the `SceneTables`, for its poses.
    """
    is_flat = points.shape[1] == 2
    rows, axes, sizes, addresses = tables.rows, tables.axes, tables.sizes, tables.addresses
    voxel_places, voxel_frames = tables.voxel_places, tables.voxel_frames
    kinds, frames = scene.kinds, scene.frames
    inverses, translations, is_turn = scene.inverses, scene.translations, scene.is_turn
    for group in range(len(begins)):
        body = bodies[group]
        row, frame = rows[body], frames[body]
        if row < 0 or is_flat:
            continue
        for place in range(begins[group], ends[group]):
            if flag[0]:
                break
            pair = order[place]
            item = owners[pair]
            x, y, z, blur = float(points[item, 0]), float(points[item, 1]), float(points[item, 2]), 0.0
            if frame >= 0:
                x, y, z, blur = to_frame(inverses, translations, is_turn, frame, x, y, z)
            location = UNDECIDED
            address, shift = voxel_places[row, 0], voxel_places[row, 1]
            if address != 0 and kinds[body] == LATER:  # of other kinds, the first pass has asked them
                location = side_in_voxels(voxel_frames, row, address, shift, x, y, z, blur)
            if location == UNDECIDED:
                location = _in_columns(axes, sizes, addresses, row, x, y, z, blur, flag)
            located[pair] = location
