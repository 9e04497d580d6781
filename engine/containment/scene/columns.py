"""The vertical ray of many polyhedra in one pass: candidates grouped by body, each body's columns by their addresses.

What polyhedron_ray_parity.py does body by body, with the filters of posed/filters.py: a point in no pose has the blur
0. Points that the filters leave stay UNDECIDED.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.arrays import FloatArray, Int32Array, IntArray
from engine.bounding.grid import Axis
from engine.containment.cells.side import side_in_cell
from engine.containment.posed.filters import BESIDE, column_of, in_space, parity_in_column
from engine.containment.scene.first_pass import SECOND_PASS, to_frame
from engine.jit import kernel, merged
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
    cell_places: IntArray
    """``(n, 4)``: address and numbers of the cells of level 0, 0 where there are none."""
    cell_frames: FloatArray


@merged
def _in_columns(tables: Any, row: int, q: Any, blur: float, flag: Any) -> int:
    """Return the location of a blurred point by the ray upwards, or UNDECIDED."""
    axes, sizes, addresses = tables.axes, tables.sizes, tables.addresses
    u = Axis(axes[row, 0], axes[row, 1], axes[row, 2], sizes[row, 3])
    v = Axis(axes[row, 3], axes[row, 4], axes[row, 5], sizes[row, 4])
    column = column_of(q, blur, u, v, axes[row, 6])
    if column < 0:
        return -1 if column == BESIDE else UNDECIDED
    n_vertices, n_triangles, n_items = sizes[row, 0], sizes[row, 1], sizes[row, 2]
    lists = (
        array_at(addresses[row, 0], (n_vertices, 3), np.float64),
        array_at(addresses[row, 1], (n_triangles, 3), np.int32),
        array_at(addresses[row, 2], (n_triangles, 6), np.float64),
        array_at(addresses[row, 3], (n_triangles,), np.int8),
        array_at(addresses[row, 4], (u.n_cells * v.n_cells + 1,), np.int64),
        array_at(addresses[row, 5], (n_items,), np.int32),
    )
    return int(parity_in_column(q, blur, column, lists, flag))


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
    for group in range(len(begins)):
        body = bodies[group]
        row, frame = tables.rows[body], scene.frames[body]
        if row < 0 or points.shape[1] == 2:
            continue
        has_cells = tables.cell_places[row, 0] != 0 and scene.kinds[body] == SECOND_PASS  # else they have been asked
        for place in range(begins[group], ends[group]):
            if flag[0]:
                break
            q, blur = to_frame(scene, frame, in_space(points, owners[order[place]]))
            location = UNDECIDED
            if has_cells:
                location = side_in_cell(tables.cell_frames, tables.cell_places, row, q, blur)
            if location == UNDECIDED:
                location = _in_columns(tables, row, Point3(q[0], q[1], q[2]), blur, flag)
            located[order[place]] = location
