"""The vertical ray of many polyhedra in one pass: candidates grouped by body, each body's tree by its addresses.

What polyhedron_ray_parity.py does body by body: a point in no pose has the blur 0. Points that it leaves stay
UNDECIDED.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.arrays import FloatArray, Int32Array, IntArray
from engine.bounding.bvh import WIDTH
from engine.containment.cells.locate import side_in_cell
from engine.containment.methods.polyhedron_ray_parity import locate_in_tree
from engine.containment.posed.filters import in_space
from engine.containment.posed.frames import to_frame
from engine.containment.prepared import TriangleTree
from engine.containment.scene.first_pass import SECOND_PASS
from engine.jit import inline, kernel
from engine.lanes.addresses import array_at
from engine.lanes.boxes import BOX_ROWS
from engine.lanes.triangles import OVERHEAD_ROWS
from engine.types import UNDECIDED, Point3


class TreeTables(NamedTuple):
    """The prepared structures of the polyhedra of a scene, a row for each solid."""

    rows: Int32Array
    """Row of each body's solid, -1 for bodies that are not asked here."""
    addresses: IntArray
    """``(n, 5)``: of vertices, triangles, boxes, children and blocks."""
    sizes: IntArray
    """``(n, 3)``: numbers of vertices, triangles and nodes."""
    places: FloatArray
    """``(n, 10)``: origin, scale, low and high of the tree."""
    cell_places: IntArray
    """``(n, 4)``: address and numbers of the cells of level 0, 0 where there are none."""
    cell_frames: FloatArray


def tree_line(tree: TriangleTree) -> tuple[tuple[int, ...], tuple[int, ...], tuple[float, ...]]:
    """Return a solid's row of addresses, sizes and places."""
    arrays: Any = tree.vertices, tree.triangles, tree.boxes, tree.child, tree.blocks
    sizes = len(tree.vertices), len(tree.triangles), len(tree.child)
    return tuple(array.ctypes.data for array in arrays), sizes, (*tree.origin, tree.scale, *tree.low, *tree.high)


@inline
def tree_at(tables: Any, row: int) -> TriangleTree:
    """Return the tree of a row of what has `addresses`, `sizes` and `places` as `TreeTables` does."""
    addresses, sizes, places = tables.addresses, tables.sizes, tables.places
    return TriangleTree(
        array_at(addresses[row, 0], (sizes[row, 0], 3), np.float64),
        array_at(addresses[row, 1], (sizes[row, 1], 3), np.int32),
        array_at(addresses[row, 2], (sizes[row, 2], BOX_ROWS, WIDTH), np.float32),
        array_at(addresses[row, 3], (sizes[row, 2], WIDTH), np.int32),
        array_at(addresses[row, 4], (sizes[row, 2], OVERHEAD_ROWS, WIDTH), np.float32),
        (places[row, 0], places[row, 1], places[row, 2]), places[row, 3],
        (places[row, 4], places[row, 5], places[row, 6]), (places[row, 7], places[row, 8], places[row, 9]),
    )  # fmt: skip


@kernel
def locate_groups(
    points: Any, owners: Any, order: Any, begins: Any, ends: Any, bodies: Any, scene: Any, tables: Any, located: Any,
    stack: Any, flag: Any,
) -> None:  # fmt: skip
    """Fill located (n_pairs,) int8 for groups of pairs of a body each: those at order[begins[group] : ends[group]].

    owners: (n_pairs,) the point of each pair; bodies: that of each group; scene: the `SceneTables`, for its poses;
    stack: (STACK,) int32, scratch.
    """
    for group in range(len(begins)):
        body = bodies[group]
        row, frame = tables.rows[body], scene.frames[body]
        if row < 0 or points.shape[1] == 2:
            continue
        tree = tree_at(tables, row)
        has_cells = tables.cell_places[row, 0] != 0 and scene.kinds[body] == SECOND_PASS  # else they have been asked
        for place in range(begins[group], ends[group]):
            if flag[0]:
                break
            q, blur = to_frame(scene, frame, in_space(points, owners[order[place]]))
            location = UNDECIDED
            if has_cells:
                location = side_in_cell(tables.cell_frames, tables.cell_places, row, q, blur)
            if location == UNDECIDED:
                location, _ = locate_in_tree(tree, Point3(q[0], q[1], q[2]), blur, stack, flag)
            located[order[place]] = location
