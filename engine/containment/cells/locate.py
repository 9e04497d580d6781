"""Polyhedron by cells: the parity of the segment from a cell's reference point, beyond the band of the entries.

A point in a cell without triangles has the cell's side; in another one, the side of the reference point, turned by each
triangle that the segment crosses. Points too close to a plane of an entry are left UNDECIDED, for the vertical ray.

For scenes a point, which may carry a blur (posed/filters.py), is looked up in level 0 of the cells of one of many
polyhedra (tables: top.py). It must lie in one cell with all of its blur: an index is ``int((x - low) * scale)``, each
step monotone.

Source: space-partitioned point containment with reference points; the two-level grid after Kalojanov, Billeter and
Slusallek 2011, "Two-level grids for ray tracing on GPUs". Changed: certified in single precision, exact behind it.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrays import FlagArray, FloatArray, Int8Array, IntArray
from engine.containment.cells.lattice import LEVELS, PARTS, finest, parts_of, reference_point, scaled_difference
from engine.containment.methods.filters import NOT_FINITE, has_not_finite
from engine.jit import allocating_kernel, called, inline, merged
from engine.lanes.addresses import array_at
from engine.lanes.cells import parity_across, prefetch_group
from engine.predicates.vectors import as_point3
from engine.types import UNDECIDED

OUTSIDE_CELL: Final = -4
INSIDE_CELL: Final = -2
MIXED_CELL: Final = -1
"""Codes of cells without entries: their location less 3, UNDECIDED for a mixed one, of which no side is known. From 0
on, a brick's number with the lowest bit set, or the place of a leaf's first entry; one bit above is the side of the
leaf's reference point."""
CODE_SHIFT: Final = 3
_BLOCK: Final = 256
"""Points that pass through the first stage together."""
_FEWEST: Final = 128
"""Points that go on to the later stages together, at least: of most blocks but a few do. The scratch, for at most
`_FEWEST + _BLOCK`, fits the first-level cache."""
_AHEAD: Final = 6
"""Points between asking for a leaf's group and reading it: some 100 ns."""


@inline
def _first_status(points: Any, start: Any, end: Any, cells: Any, locations: Any, item_of: Any, n_kept: Any) -> Any:
    """Write the status of level 0 for points start .. end, and append those that are UNDECIDED to item_of.

    Returns how many that makes, and how many lie beyond the lattice. One pass without a branch: a point beyond, or not
    finite, gets the status behind the last one.
    """
    low, scale, n, statuses = cells.lattice.low, cells.lattice.scale, cells.lattice.n, cells.statuses
    nx, ny, beyond = np.int32(n[0]), np.int32(n[1]), np.uint32(n[0] * n[1] * n[2])
    x_end, y_end, z_end = float(n[0]), float(n[1]), float(n[2])
    n_beyond = np.uint64(0)
    for item in range(start, end):
        x = (points[item, 0] - low[0]) * scale[0]
        y = (points[item, 1] - low[1]) * scale[1]
        z = (points[item, 2] - low[2]) * scale[2]
        is_within = (x >= 0.0) & (y >= 0.0) & (z >= 0.0) & (x < x_end) & (y < y_end) & (z < z_end)
        x, y, z = x if is_within else 0.0, y if is_within else 0.0, z if is_within else 0.0
        cell = np.uint32((np.int32(z) * ny + np.int32(y)) * nx + np.int32(x))
        status = statuses[cell if is_within else beyond]
        locations[item] = status
        item_of[n_kept] = item
        n_kept += np.uint64(status == UNDECIDED)
        n_beyond += np.uint64(not is_within)
    return n_kept, n_beyond


@merged
def _enter(points: FloatArray, cells: Any, kept_points: Any, n_kept: int) -> Any:
    """Look up the codes of level 0 of the points kept; returns how many have a list or a brick, and so wait."""
    low, scale, n, codes = cells.lattice.low, cells.lattice.scale, cells.lattice.n, cells.codes
    item_of, code_of, level_of, places, waiting = kept_points
    top_shift, n_waiting = 2 * (LEVELS - 1), np.uint64(0)
    for kept in range(n_kept):
        item = item_of[kept]
        x = finest(points[item, 0], low[0], scale[0])
        y = finest(points[item, 1], low[1], scale[1])
        z = finest(points[item, 2], low[2], scale[2])
        places[kept, 0], places[kept, 1], places[kept, 2] = x, y, z
        code = codes[np.uint64(((z >> top_shift) * n[1] + (y >> top_shift)) * n[0] + (x >> top_shift))]
        code_of[kept], level_of[kept] = code, 0
        waiting[n_waiting] = kept
        n_waiting += np.uint64(code >= 0)
    return n_waiting


@called
def _descend(cells: Any, kept_points: Any, n_waiting: Any, level: int, locations: Any) -> Any:
    """Look up the codes of a level for the points that wait in a brick; returns how many wait after it."""
    n, codes = cells.lattice.n, cells.codes
    item_of, code_of, level_of, places, waiting = kept_points
    n_top, part_shift, n_left = n[0] * n[1] * n[2], 2 * (LEVELS - 1 - level), np.uint64(0)
    for turn in range(n_waiting):
        kept = waiting[turn]
        code = code_of[kept]
        if code & 1:
            x, y, z = places[kept, 0] >> part_shift, places[kept, 1] >> part_shift, places[kept, 2] >> part_shift
            part = ((z & 3) << 4) | ((y & 3) << 2) | (x & 3)
            code = codes[np.uint64(n_top + (code >> 1) * PARTS + part)]
            locations[item_of[kept]] = min(code, MIXED_CELL) + CODE_SHIFT
            code_of[kept], level_of[kept] = code, level
        waiting[n_left] = kept
        n_left += np.uint64(code >= 0)
    return n_left


@merged
def ask_leaves(points: Any, cells: Any, kept_points: Any, n_waiting: Any, locations: Any) -> None:
    """Locate the points that wait, in their leaves."""
    lattice, groups = cells.lattice, cells.groups
    item_of, code_of, level_of, places, waiting = kept_points
    for turn in range(min(n_waiting, np.uint64(_AHEAD))):
        prefetch_group(groups, code_of[waiting[turn]] >> 2)
    for turn in range(n_waiting):
        if turn + np.uint64(_AHEAD) < n_waiting:
            prefetch_group(groups, code_of[waiting[turn + np.uint64(_AHEAD)]] >> 2)
        kept = waiting[turn]
        item, level, code = item_of[kept], level_of[kept], code_of[kept]
        part_shift = 2 * (LEVELS - 1 - level)
        x, y, z = places[kept, 0] >> part_shift, places[kept, 1] >> part_shift, places[kept, 2] >> part_shift
        reference = reference_point(lattice, x, y, z, level)
        w = scaled_difference(as_point3(points, item), reference, lattice.scale, parts_of(level))
        parity = parity_across(groups, code >> 2, np.float32(w[0]), np.float32(w[1]), np.float32(w[2]))
        locations[item] = UNDECIDED if parity & UNDECIDED else ((code ^ (parity << 1)) & 2) - 1


@allocating_kernel
def locate_by_cells(points: FloatArray, cells: Any, locations: Int8Array, flag: FlagArray) -> int:
    """Fill `locations` (n,) int8 for points (n, 3) from a `Cells`; returns how many are left UNDECIDED.

    Points go through one stage after another, many at a time, so that the loads of a stage do not wait for each other:
    status on level 0, where most points end; codes there and in bricks; first group of the leaf, parity.
    Returns NOT_FINITE, with the rest undone, where a point is not: it is in no cell, so it costs little to look.
    """
    room = _FEWEST + _BLOCK + 1
    item_of, code_of, level_of = np.empty(room, np.uint64), np.empty(room, np.int32), np.empty(room, np.int32)
    places, waiting = np.empty((room, 3), np.int32), np.empty(room, np.uint64)
    kept_points = item_of, code_of, level_of, places, waiting
    n_open, n_kept = 0, np.uint64(0)
    for start in range(0, len(points), _BLOCK):
        if flag[0]:
            break
        first, end = np.uint64(start), np.uint64(min(start + _BLOCK, len(points)))
        n_kept, n_beyond = _first_status(points, first, end, cells, locations, item_of, n_kept)
        if n_beyond > 0 and has_not_finite(points[first:end]):
            return NOT_FINITE
        if n_kept < _FEWEST and end < len(points):
            continue
        n_waiting = _enter(points, cells, kept_points, n_kept)
        for level in range(1, cells.n_levels):
            n_waiting = _descend(cells, kept_points, n_waiting, level, locations)
        ask_leaves(points, cells, kept_points, n_waiting, locations)
        for kept in range(n_kept):
            n_open += locations[item_of[kept]] == UNDECIDED
        n_kept = np.uint64(0)
    return n_open


@inline
def _index(value: float, low: float, scale: float) -> int:
    """Return the index of a value that is not below `low`."""
    return int((value - low) * scale)


@inline
def side_in_cell(frames: FloatArray, places: IntArray, row: int, p: tuple[float, ...], blur: float) -> int:
    """Return the location of a blurred point (x, y, z) if its cell tells it, else UNDECIDED.

    frames: (n, 6), places: (n, 4), what `TopCells` has of each polyhedron, of which `row` counts.
    """
    x, y, z = p
    x_low, y_low, z_low = frames[row, 0], frames[row, 1], frames[row, 2]
    x_scale, y_scale, z_scale = frames[row, 3], frames[row, 4], frames[row, 5]
    address, nx, ny, nz = places[row, 0], places[row, 1], places[row, 2], places[row, 3]
    is_within = (x - blur >= x_low) & (y - blur >= y_low) & (z - blur >= z_low)
    is_within &= ((x + blur) - x_low) * x_scale < nx
    is_within &= ((y + blur) - y_low) * y_scale < ny
    is_within &= ((z + blur) - z_low) * z_scale < nz
    if not is_within:
        return UNDECIDED
    column, line, layer = _index(x, x_low, x_scale), _index(y, y_low, y_scale), _index(z, z_low, z_scale)
    if blur > 0.0:
        is_one = _index(x - blur, x_low, x_scale) == _index(x + blur, x_low, x_scale)
        is_one &= _index(y - blur, y_low, y_scale) == _index(y + blur, y_low, y_scale)
        is_one &= _index(z - blur, z_low, z_scale) == _index(z + blur, z_low, z_scale)
        if not is_one:
            return UNDECIDED
    return int(array_at(address, (nx * ny * nz,), np.int8)[(layer * ny + line) * nx + column])
