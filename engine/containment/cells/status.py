"""Which side of the surface cells without triangles and reference points of the others lie on.

Two cells without triangles that share a wall lie on one side, so only the first of each such group, in scanning
order, is asked about; the others copy. Parts of a cell are asked by their parent's own segment test; level 0, and
what that test leaves open, by vertical rays.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import BoolArray, FlagArray, Float32Array, FloatArray, Int8Array, Int32Array, IntArray
from engine.containment.cells.lattice import (
    LEVELS,
    PARTS,
    SPLIT,
    UNKNOWN,
    Lattice,
    Level,
    Mesh,
    finest,
    parts_of,
    reference_point,
    scaled_difference,
)
from engine.jit import inline, kernel
from engine.lanes.cells import ROWS, parity_across, set_entry, set_nothing
from engine.lanes.tracing import LANES
from engine.predicates.vectors import corners_of
from engine.types import UNDECIDED


@inline
def _empty_before(counts: IntArray, first: int, place: int, nx: int, ny: int) -> int:
    """Return an empty cell of a block that shares a wall with this one and comes before it, -1 if there is none."""
    if place % nx > 0 and counts[first + place - 1] == 0:
        return first + place - 1
    if place // nx % ny > 0 and counts[first + place - nx] == 0:
        return first + place - nx
    if place >= nx * ny and counts[first + place - nx * ny] == 0:
        return first + place - nx * ny
    return -1


@kernel
def label_empty(counts: IntArray, nx: int, ny: int, labels: IntArray) -> None:
    """Fill labels (nz * ny * nx,) int64 with the cell that each empty cell copies from, itself for one that is asked.

    Cells with a list label themselves.
    """
    for cell in range(len(counts)):
        before = _empty_before(counts, 0, cell, nx, ny) if counts[cell] == 0 else -1
        labels[cell] = labels[before] if before >= 0 else cell


@inline
def _is_in_cell(lattice: Lattice, point: tuple[float, ...], x: int, y: int, z: int, shift: int) -> bool:
    low, scale = lattice.low, lattice.scale
    return (
        finest(point[0], low[0], scale[0]) >> shift == x
        and finest(point[1], low[1], scale[1]) >> shift == y
        and finest(point[2], low[2], scale[2]) >> shift == z
    )


@kernel
def reference_points(lattice: Lattice, places: Int32Array, level: int, points: FloatArray, is_valid: BoolArray) -> None:
    """Fill points (n, 3) and is_valid (n,) with the reference points of cells and whether they lie in them."""
    for item in range(len(places)):
        x, y, z = places[item, 0], places[item, 1], places[item, 2]
        point = reference_point(lattice, x, y, z, level)
        points[item, 0], points[item, 1], points[item, 2] = point
        is_valid[item] = _is_in_cell(lattice, point, x, y, z, 2 * (LEVELS - 1 - level))


@inline
def _fill_groups(
    groups: Float32Array, first_group: int, mesh: Mesh, level: Level, cell: int, reference: tuple[float, ...]
) -> None:
    """Write the groups of a cell's triangles about its reference point, in units of the cells of its level."""
    scale, parts = mesh.lattice.scale, parts_of(level.depth)
    first, last = level.firsts[cell], level.firsts[cell + 1]
    n_groups = (last - first + LANES - 1) // LANES
    for group in range(first_group, first_group + n_groups):
        for lane in range(LANES):
            groups[group, ROWS - 1, lane] = 1.0 if group == first_group + n_groups - 1 else 0.0
    for place in range(last - first, n_groups * LANES):
        set_nothing(groups[first_group + place // LANES, :, place % LANES])
    for place in range(last - first):
        row = groups[first_group + place // LANES, :, place % LANES]
        a, b, c = corners_of(mesh.vertices, mesh.triangles, level.lists[first + place])
        set_entry(
            row, scaled_difference(a, reference, scale, parts), scaled_difference(b, reference, scale, parts),
            scaled_difference(c, reference, scale, parts), scaled_difference(b, a, scale, parts),
            scaled_difference(c, a, scale, parts),
        )  # fmt: skip


@kernel
def locate_parts(
    mesh: Mesh, level: Level, parents: IntArray, counts: IntArray, groups: Float32Array, found: Int8Array,
    flag: FlagArray,
) -> None:  # fmt: skip
    """Fill found (p * 64,) int8 with the status of each part: of its reference point, or of all of it if it is empty.

    level, parents: as for `list_parts`; counts: (p * 64,) lengths of the parts' lists; groups: workspace for the
    longest list of a parent.
    """
    lattice, below = mesh.lattice, level.depth + 1
    parts, shift = parts_of(level.depth), 2 * (LEVELS - 1 - below)
    for parent in range(len(parents)):
        if flag[0]:
            break
        cell, first = parents[parent], parent * PARTS
        x0, y0, z0 = level.places[cell, 0], level.places[cell, 1], level.places[cell, 2]
        reference = reference_point(lattice, x0, y0, z0, level.depth)
        _fill_groups(groups, 0, mesh, level, cell, reference)
        for part in range(PARTS):
            before = _empty_before(counts, first, part, SPLIT, SPLIT) if counts[first + part] == 0 else -1
            if before >= 0:
                found[first + part] = found[before]
                continue
            x, y, z = x0 * SPLIT + part % SPLIT, y0 * SPLIT + part // SPLIT % SPLIT, z0 * SPLIT + part // SPLIT**2
            point, status = reference_point(lattice, x, y, z, below), UNKNOWN
            if level.statuses[cell] != UNKNOWN and _is_in_cell(lattice, point, x, y, z, shift):
                w = scaled_difference(point, reference, lattice.scale, parts)
                parity = parity_across(groups, 0, np.float32(w[0]), np.float32(w[1]), np.float32(w[2]))
                status = UNKNOWN if parity & UNDECIDED else level.statuses[cell] * (1 - 2 * parity)
            found[first + part] = status


@kernel
def fill_leaves(
    mesh: Mesh, level: Level, leaves: IntArray, starts: IntArray, groups: Float32Array, flag: FlagArray
) -> None:
    """Fill groups (n, 14, 8) float32 with the lists of `leaves`, cells of a level, each from the group in starts."""
    for item in range(len(leaves)):
        if flag[0]:
            break
        x, y, z = level.places[leaves[item], 0], level.places[leaves[item], 1], level.places[leaves[item], 2]
        reference = reference_point(mesh.lattice, x, y, z, level.depth)
        _fill_groups(groups, starts[item], mesh, level, leaves[item], reference)
