"""Which side of the surface cells without triangles and reference points of the others lie on.

Two cells without triangles that share a wall lie on one side, so only the first of each such group, in scanning
order, is asked about; the others copy. Parts of a cell are asked by their parent's own segment test; level 0, and
what that test leaves open, by vertical rays.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.containment.cells.entries import set_entry, set_nothing
from engine.containment.cells.lattice import (
    LEVELS,
    PARTS,
    PLACE,
    SPLIT,
    corner,
    finest,
    parts_of,
    reference_coordinate,
    scaled_difference,
    share_of,
)
from engine.jit import inline, kernel
from engine.lanes.cells import LANES, ROWS, UNSURE, group_parity

OPEN: Final = 0
"""Status of a cell that is not known, or whose reference point lies on the surface or in another cell."""


@kernel
def label_empty(counts: Any, nx: int, ny: int, nz: int, labels: Any) -> int:
    """Fill labels (nz * ny * nx,) int64 with the cell that each empty cell copies from, itself for one that is asked.

    Cells with a list label themselves. Returns how many empty cells are asked.
    """
    n_asked = 0
    for z in range(nz):
        for y in range(ny):
            for x in range(nx):
                cell = (z * ny + y) * nx + x
                labels[cell] = cell
                if counts[cell] > 0:
                    continue
                if x > 0 and counts[cell - 1] == 0:
                    labels[cell] = labels[cell - 1]
                elif y > 0 and counts[cell - nx] == 0:
                    labels[cell] = labels[cell - nx]
                elif z > 0 and counts[cell - nx * ny] == 0:
                    labels[cell] = labels[cell - nx * ny]
                else:
                    n_asked += 1
    return n_asked


@inline
def reference_point(lattice: Any, x: int, y: int, z: int, share: float) -> Any:
    """Return the reference point of a cell by its indices on a level whose cells are `share` of one of level 0."""
    low, size = lattice.low, lattice.size
    return (
        reference_coordinate(low[0], size[0] * share, x, PLACE[0]),
        reference_coordinate(low[1], size[1] * share, y, PLACE[1]),
        reference_coordinate(low[2], size[2] * share, z, PLACE[2]),
    )


@inline
def _is_in_cell(lattice: Any, point: Any, x: int, y: int, z: int, shift: int) -> bool:
    low, scale = lattice.low, lattice.scale
    return (
        finest(point[0], low[0], scale[0]) >> shift == x
        and finest(point[1], low[1], scale[1]) >> shift == y
        and finest(point[2], low[2], scale[2]) >> shift == z
    )


@kernel
def reference_points(lattice: Any, places: Any, level: int, points: Any, is_valid: Any) -> None:
    """Fill points (n, 3) and is_valid (n,) with the reference points of cells and whether they lie in them."""
    for item in range(len(places)):
        x, y, z = places[item, 0], places[item, 1], places[item, 2]
        point = reference_point(lattice, x, y, z, share_of(level))
        points[item, 0], points[item, 1], points[item, 2] = point
        is_valid[item] = _is_in_cell(lattice, point, x, y, z, 2 * (LEVELS - 1 - level))


@inline
def fill_groups(
    groups: Any,
    first_group: int,
    vertices: Any,
    triangles: Any,
    lists: Any,
    first: int,
    last: int,
    lattice: Any,
    reference: Any,
    parts: float,
) -> int:
    """Write the groups of the triangles lists[first:last] about a reference point, in units of the cells of a level.

    Returns the group after the last one written.
    """
    scale = lattice.scale
    n_groups = (last - first + LANES - 1) // LANES
    for group in range(first_group, first_group + n_groups):
        for lane in range(LANES):
            groups[group, ROWS - 1, lane] = 1.0 if group == first_group + n_groups - 1 else 0.0
    for place in range(last - first, n_groups * LANES):
        set_nothing(groups[first_group + place // LANES, :, place % LANES])
    for place in range(last - first):
        row = groups[first_group + place // LANES, :, place % LANES]
        triangle = lists[first + place]
        a = corner(vertices, triangles[triangle, 0])
        b = corner(vertices, triangles[triangle, 1])
        c = corner(vertices, triangles[triangle, 2])
        set_entry(
            row,
            scaled_difference(a, reference, scale, parts),
            scaled_difference(b, reference, scale, parts),
            scaled_difference(c, reference, scale, parts),
            scaled_difference(b, a, scale, parts),
            scaled_difference(c, a, scale, parts),
        )
    return first_group + n_groups


@kernel
def locate_parts(
    vertices: Any,
    triangles: Any,
    lattice: Any,
    parents: Any,
    places: Any,
    statuses: Any,
    firsts: Any,
    lists: Any,
    level: int,
    counts: Any,
    groups: Any,
    found: Any,
    flag: Any,
) -> None:
    """Fill found (p * 64,) int8 with the status of each part: of its reference point, or of all of it if it is empty.

    parents, places, firsts, lists, level: as for `list_parts`; statuses: (cells,) int8; counts: (p * 64,) lengths of
    the parts' lists; groups: workspace for the longest
    list of a parent.
    """
    scale = lattice.scale
    parts = parts_of(level - 1)
    shift = 2 * (LEVELS - 1 - level)
    for parent in range(len(parents)):
        if flag[0]:
            break
        cell = parents[parent]
        x0, y0, z0 = places[cell, 0], places[cell, 1], places[cell, 2]
        reference = reference_point(lattice, x0, y0, z0, share_of(level - 1))
        n_groups = fill_groups(
            groups, 0, vertices, triangles, lists, firsts[cell], firsts[cell + 1], lattice, reference, parts
        )
        for part in range(PARTS):
            place = parent * PARTS + part
            x, y, z = part % SPLIT, part // SPLIT % SPLIT, part // (SPLIT * SPLIT)
            if counts[place] == 0:
                if x > 0 and counts[place - 1] == 0:
                    found[place] = found[place - 1]
                    continue
                if y > 0 and counts[place - SPLIT] == 0:
                    found[place] = found[place - SPLIT]
                    continue
                if z > 0 and counts[place - SPLIT * SPLIT] == 0:
                    found[place] = found[place - SPLIT * SPLIT]
                    continue
            x, y, z = x0 * SPLIT + x, y0 * SPLIT + y, z0 * SPLIT + z
            point = reference_point(lattice, x, y, z, share_of(level))
            status = statuses[cell] if _is_in_cell(lattice, point, x, y, z, shift) else OPEN
            if status != OPEN:
                w = scaled_difference(point, reference, scale, parts)
                wx, wy, wz = np.float32(w[0]), np.float32(w[1]), np.float32(w[2])
                parity = 0
                for group in range(n_groups):
                    parity ^= group_parity(groups, group, wx, wy, wz)
                    if parity & UNSURE:
                        status = OPEN
                        break
                if parity & 1:
                    status = -status
            found[place] = status


@kernel
def fill_leaves(
    vertices: Any,
    triangles: Any,
    lattice: Any,
    cells: Any,
    places: Any,
    firsts: Any,
    lists: Any,
    level: int,
    starts: Any,
    groups: Any,
    flag: Any,
) -> None:
    """Fill groups (n, 14, 8) float32 with the lists of `cells`, each from the group in starts."""
    parts = parts_of(level)
    for item in range(len(cells)):
        if flag[0]:
            break
        cell = cells[item]
        reference = reference_point(lattice, places[cell, 0], places[cell, 1], places[cell, 2], share_of(level))
        fill_groups(
            groups, starts[item], vertices, triangles, lists, firsts[cell], firsts[cell + 1], lattice, reference, parts
        )
