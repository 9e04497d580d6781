"""Polyhedron by cells: the parity of the segment from a cell's reference point, beyond the band of the entries.

A point in a cell without triangles has the cell's side; in another one, the side of the reference point, turned by each
triangle that the segment crosses. Points too close to a plane of an entry are left UNDECIDED, for the vertical ray.

Source: space-partitioned point containment with reference points; the two-level grid after Kalojanov, Billeter and
Slusallek 2011, "Two-level grids for ray tracing on GPUs". Changed: certified in single precision, exact behind it.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.containment.cell_lanes import ROWS, UNSURE, group_parity, prefetch_group
from engine.containment.cells import LEVELS, PARTS, PLACE, finest, parts_of, reference_coordinate, share_of
from engine.jit import kernel
from engine.types import UNDECIDED

OUTSIDE_CELL: Final = -4
INSIDE_CELL: Final = -2
OPEN_CELL: Final = -1
"""Codes of cells without entries: their location less 3, UNDECIDED where it is open. From 0 on, a brick's number with
the lowest bit set, or the place of a leaf's first entry; one bit above is the side of the leaf's reference point."""
_CODE_SHIFT: Final = 3
_BLOCK: Final = 256
"""Points that pass through the stages together: their scratch fits the first-level cache."""
_AHEAD: Final = 6
"""Points between asking for a leaf's group and reading it: some 100 ns."""


@kernel
def locate_by_cells(points: Any, cells: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 3) from a `Cells`; returns how many are left UNDECIDED.

    A block of points goes through one stage after another, so that the loads of a stage do not wait for each other:
    code on level 0, codes in bricks, first entry of the leaf, parity.
    """
    low, scale, size, n = cells.lattice.low, cells.lattice.scale, cells.lattice.size, cells.lattice.n
    codes, groups, box_low, box_high = cells.codes, cells.groups, cells.low, cells.high
    n_top = n[0] * n[1] * n[2]
    shift = 2 * (LEVELS - 1)
    places = np.empty((_BLOCK, 3), np.int32)
    code_of, level_of = np.empty(_BLOCK, np.int32), np.empty(_BLOCK, np.int32)
    waiting = np.empty(_BLOCK + 1, np.int32)
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
        for turn in range(min(n_waiting, _AHEAD)):
            prefetch_group(groups, code_of[waiting[turn]] >> 2)
        for turn in range(n_waiting):
            if turn + _AHEAD < n_waiting:
                prefetch_group(groups, code_of[waiting[turn + _AHEAD]] >> 2)
            item = waiting[turn]
            level, code = level_of[item], code_of[item]
            parts, share, part_shift = parts_of(level), share_of(level), 2 * (LEVELS - 1 - level)
            x, y, z = places[item, 0] >> part_shift, places[item, 1] >> part_shift, places[item, 2] >> part_shift
            rx = reference_coordinate(low[0], size[0] * share, x, PLACE[0])
            ry = reference_coordinate(low[1], size[1] * share, y, PLACE[1])
            rz = reference_coordinate(low[2], size[2] * share, z, PLACE[2])
            wx = np.float32((points[start + item, 0] - rx) * (scale[0] * parts))
            wy = np.float32((points[start + item, 1] - ry) * (scale[1] * parts))
            wz = np.float32((points[start + item, 2] - rz) * (scale[2] * parts))
            group = code >> 2
            parity = group_parity(groups, group, wx, wy, wz)
            while groups[group, ROWS - 1, 0] == 0.0:  # bound: the last group of each leaf says so
                group += 1
                found = group_parity(groups, group, wx, wy, wz)
                parity = ((parity ^ found) & 1) | ((parity | found) & UNSURE)
            locations[start + item] = UNDECIDED if parity & UNSURE else ((code ^ (parity << 1)) & 2) - 1
        for item in range(start, min(start + _BLOCK, len(points))):
            n_open += locations[item] == UNDECIDED
    return n_open
