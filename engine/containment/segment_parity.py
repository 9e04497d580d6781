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
from engine.containment.cells import LEVELS, PARTS, finest, parts_of, share_of
from engine.jit import inline, kernel
from engine.types import UNDECIDED

OUTSIDE_CELL: Final = -4
INSIDE_CELL: Final = -2
OPEN_CELL: Final = -1
"""Codes of cells without entries: their location less 3, UNDECIDED where it is open. From 0 on, a brick's number with
the lowest bit set, or the place of a leaf's first entry; one bit above is the side of the leaf's reference point."""
_CODE_SHIFT: Final = 3
_BLOCK: Final = 256
"""Points that pass through the stages together: their scratch fits the first-level cache."""


@inline
def _parity(point: Any, x: int, y: int, z: int, level: int, code: int, cells: Any) -> int:
    """Return the location of a point in a leaf, or UNDECIDED."""
    parts = parts_of(level)
    scale, entries = cells.lattice.scale, cells.entries
    reference = reference_point(cells.lattice, x, y, z, share_of(level))
    wx = np.float32((point[0] - reference[0]) * (scale[0] * parts))
    wy = np.float32((point[1] - reference[1]) * (scale[1] * parts))
    wz = np.float32((point[2] - reference[2]) * (scale[2] * parts))
    n_crossed, is_unsure = 0, False
    for entry in range(code >> 2, len(entries)):  # bound: the last entry of each leaf says so
        crossed = crossing(entries, entry, wx, wy, wz)
        is_unsure |= crossed == UNDECIDED
        n_crossed += crossed
        if entries[entry, LAST] != 0.0:
            break
    if is_unsure:
        return UNDECIDED
    return ((code ^ (n_crossed << 1)) & 2) - 1


@kernel
def locate_by_cells(points: Any, cells: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 3) from a `Cells`; returns how many are left UNDECIDED.

    A block of points goes through one stage after another, so that the loads of a stage do not wait for each other:
    code on level 0, codes in bricks, first entry of the leaf, parity.
    """
    low, scale, n = cells.lattice.low, cells.lattice.scale, cells.lattice.n
    codes, entries, box_low, box_high = cells.codes, cells.entries, cells.low, cells.high
    n_top = n[0] * n[1] * n[2]
    shift = 2 * (LEVELS - 1)
    places = np.empty((_BLOCK, 3), np.int32)
    code_of, level_of = np.empty(_BLOCK, np.int32), np.empty(_BLOCK, np.int32)
    waiting = np.empty(_BLOCK + 1, np.int32)
    touched = np.empty(_BLOCK, np.float32)
    n_open = 0
    for start in range(0, len(points), _BLOCK):
        if flag[0]:
            break
        n_waiting = 0
        for item in range(min(_BLOCK, len(points) - start)):
            px, py, pz = points[start + item, 0], points[start + item, 1], points[start + item, 2]
            is_out = (
                (px < box_low[0])
                | (px > box_high[0])
                | (py < box_low[1])
                | (py > box_high[1])
                | (pz < box_low[2])
                | (pz > box_high[2])
            )
            if is_out:
                locations[start + item] = -1
                continue
            x, y, z = finest(px, low[0], scale[0]), finest(py, low[1], scale[1]), finest(pz, low[2], scale[2])
            code = codes[((z >> shift) * n[1] + (y >> shift)) * n[0] + (x >> shift)]
            locations[start + item] = min(code, OPEN_CELL) + _CODE_SHIFT  # UNDECIDED where there is more to do
            places[item, 0], places[item, 1], places[item, 2] = x, y, z
            code_of[item], level_of[item] = code, 0
            waiting[n_waiting] = item
            n_waiting += code >= 0
        for level in range(1, LEVELS):
            n_left, part_shift = 0, 2 * (LEVELS - 1 - level)
            for turn in range(n_waiting):
                item = waiting[turn]
                code = code_of[item]
                if code & 1:
                    x, y, z = (
                        places[item, 0] >> part_shift,
                        places[item, 1] >> part_shift,
                        places[item, 2] >> part_shift,
                    )
                    code = codes[n_top + (code >> 1) * PARTS + (((z & 3) << 4) | ((y & 3) << 2) | (x & 3))]
                    locations[start + item] = min(code, OPEN_CELL) + _CODE_SHIFT
                    code_of[item], level_of[item] = code, level
                waiting[n_left] = item
                n_left += code >= 0
            n_waiting = n_left
        for turn in range(n_waiting):
            first = code_of[waiting[turn]] >> 2
            touched[turn] = entries[first, 0] + entries[first, LAST]  # brings both ends of the entry near
        for turn in range(n_waiting):
            item = waiting[turn]
            level = level_of[item]
            part_shift = 2 * (LEVELS - 1 - level)
            point = (points[start + item, 0], points[start + item, 1], points[start + item, 2])
            x, y, z = places[item, 0] >> part_shift, places[item, 1] >> part_shift, places[item, 2] >> part_shift
            locations[start + item] = _parity(point, x, y, z, level, code_of[item], cells)
        for item in range(start, min(start + _BLOCK, len(points))):
            n_open += locations[item] == UNDECIDED
    return n_open
