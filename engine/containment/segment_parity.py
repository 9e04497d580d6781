"""Polyhedron by cells: the parity of the segment from a cell's reference point, beyond the band of the entries.

A point in a cell without triangles has the cell's side; in another one, the side of the reference point, turned by each
triangle that the segment crosses. Points too close to a plane of an entry are left UNDECIDED, for the vertical ray.

Source: space-partitioned point containment with reference points; the two-level grid after Kalojanov, Billeter and
Slusallek 2011, "Two-level grids for ray tracing on GPUs". Changed: certified in single precision, exact behind it.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.containment.cell_entries import LAST, crossing
from engine.containment.cell_status import reference_point
from engine.containment.cells import LEVELS, PARTS, finest, parts_of
from engine.jit import inline, kernel
from engine.types import UNDECIDED

OUTSIDE_CELL: Final = -1
INSIDE_CELL: Final = -2
OPEN_CELL: Final = -3
"""Codes of cells without entries. From 0 on, a brick's number with the lowest bit set, or the place of a leaf's first
entry; one bit above is the side of the leaf's reference point."""


@inline
def _parity(point: Any, x: int, y: int, z: int, level: int, code: int, cells: Any) -> int:
    """Return the location of a point in a leaf, or UNDECIDED."""
    parts = parts_of(level)
    scale = cells.lattice.scale
    reference = reference_point(cells.lattice, x, y, z, parts)
    wx = np.float32((point[0] - reference[0]) * (scale[0] * parts))
    wy = np.float32((point[1] - reference[1]) * (scale[1] * parts))
    wz = np.float32((point[2] - reference[2]) * (scale[2] * parts))
    side = 1 if code & 2 else -1
    for entry in range(code >> 2, len(cells.entries)):  # bound: the last entry of each leaf says so
        crossed = crossing(cells.entries, entry, wx, wy, wz)
        if crossed == UNDECIDED:
            return UNDECIDED
        if crossed == 1:
            side = -side
        if cells.entries[entry, LAST] != 0.0:
            break
    return side


@kernel
def locate_by_cells(points: Any, cells: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 3) from a `Cells`; returns how many are left UNDECIDED."""
    low, scale, n = cells.lattice.low, cells.lattice.scale, cells.lattice.n
    box_low, box_high = cells.low, cells.high
    n_top = n[0] * n[1] * n[2]
    n_open = 0
    for item in range(len(points)):
        if item & 1023 == 0 and flag[0]:
            break
        px, py, pz = points[item, 0], points[item, 1], points[item, 2]
        if (
            px < box_low[0]
            or px > box_high[0]
            or py < box_low[1]
            or py > box_high[1]
            or pz < box_low[2]
            or pz > box_high[2]
        ):
            locations[item] = -1
            continue
        x, y, z = finest(px, low[0], scale[0]), finest(py, low[1], scale[1]), finest(pz, low[2], scale[2])
        shift = 2 * (LEVELS - 1)
        code = cells.codes[((z >> shift) * n[1] + (y >> shift)) * n[0] + (x >> shift)]
        level = 0
        while code >= 0 and code & 1:  # bound: a brick's cells are one level finer, and there are three
            level += 1
            shift -= 2
            part = (((z >> shift) & 3) << 4) | (((y >> shift) & 3) << 2) | ((x >> shift) & 3)
            code = cells.codes[n_top + (code >> 1) * PARTS + part]
        if code == OUTSIDE_CELL:
            locations[item] = -1
        elif code == INSIDE_CELL:
            locations[item] = 1
        elif code == OPEN_CELL:
            locations[item] = UNDECIDED
            n_open += 1
        else:
            location = _parity((px, py, pz), x >> shift, y >> shift, z >> shift, level, code, cells)
            locations[item] = location
            n_open += location == UNDECIDED
    return n_open
