"""Polyhedron by cells: the parity of the segment from a cell's reference point, beyond the band of the entries.

A point in a cell without triangles has the cell's side; in another one, the side of the reference point, turned by each
triangle that the segment crosses. Points too close to a plane of an entry are left UNDECIDED, for the vertical ray.

For scenes a point, which may carry a blur (filters.py), is looked up in the cells of one of many polyhedra (`Sides`).
It must lie in one cell with all of its blur.

Source: space-partitioned point containment with reference points, over the uniform grid of C. Ericson, 2005.
Changed: certified in single precision, exact behind.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.compiling.jit import allocating_kernel, inline, merged
from engine.containment.cells.build import MIXED_CELL
from engine.containment.cells.lattice import index_of, reference_point, scaled_difference
from engine.containment.methods.filters import NOT_FINITE, has_not_finite
from engine.lanes.cells import parity_across, prefetch_group
from engine.lanes.lanes import array_at
from engine.predicates.vectors import as_point3
from engine.types import UNDECIDED, FlagArray, FloatArray, Int8Array, IntArray

_BLOCK: Final = 256
"""Points that pass through the first stage together."""
_FEWEST: Final = 128
"""Points that go on to the later stages together, at least: of most blocks but a few do. The scratch, for at most
`_FEWEST + _BLOCK`, fits the first-level cache."""
_AHEAD: Final = 6
"""Points between asking for a list's first group and reading it: some 100 ns."""


@inline
def _first_status(points: Any, start: Any, end: Any, cells: Any, locations: Any, item_of: Any, n_kept: Any) -> Any:
    """Write the status of the cells of points start .. end, and append those that are UNDECIDED to item_of.

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
def _enter(points: Any, cells: Any, kept_points: Any, n_kept: int) -> Any:
    """Look up the codes of the points kept; return how many have a list, and so wait."""
    low, scale, n, codes = cells.lattice.low, cells.lattice.scale, cells.lattice.n, cells.codes
    item_of, code_of, places, waiting = kept_points
    n_waiting = np.uint64(0)
    for kept in range(n_kept):
        item = item_of[kept]
        x = index_of(points[item, 0], low[0], scale[0])
        y = index_of(points[item, 1], low[1], scale[1])
        z = index_of(points[item, 2], low[2], scale[2])
        places[kept, 0], places[kept, 1], places[kept, 2] = x, y, z
        code_of[kept] = codes[np.uint64((z * n[1] + y) * n[0] + x)]
        waiting[n_waiting] = kept
        n_waiting += np.uint64(code_of[kept] != MIXED_CELL)
    return n_waiting


@merged
def _ask_lists(points: Any, cells: Any, kept_points: Any, n_waiting: Any, locations: Any) -> None:
    """Locate the points that wait, by the lists of their cells."""
    lattice, groups = cells.lattice, cells.groups
    item_of, code_of, places, waiting = kept_points
    for turn in range(min(n_waiting, np.uint64(_AHEAD))):
        prefetch_group(groups, code_of[waiting[turn]] >> 1)
    for turn in range(n_waiting):
        if turn + np.uint64(_AHEAD) < n_waiting:
            prefetch_group(groups, code_of[waiting[turn + np.uint64(_AHEAD)]] >> 1)
        kept = waiting[turn]
        item, code = item_of[kept], code_of[kept]
        reference = reference_point(lattice, places[kept, 0], places[kept, 1], places[kept, 2])
        w = scaled_difference(as_point3(points, item), reference, lattice.scale)
        parity = parity_across(groups, code >> 1, np.float32(w[0]), np.float32(w[1]), np.float32(w[2]))
        locations[item] = UNDECIDED if parity & UNDECIDED else ((code ^ parity) & 1) * 2 - 1


@allocating_kernel
def locate_by_cells(points: FloatArray, cells: Any, locations: Int8Array, flag: FlagArray) -> int:
    """Fill `locations` (n,) int8 for points (n, 3) from a `Cells`; returns how many are left UNDECIDED.

    Points go through one stage after another, many at a time, so that the loads of a stage do not wait for each other:
    status, where most points end; code; groups of the list, parity.
    Returns NOT_FINITE, with the rest undone, where a point is not: it is in no cell, so it costs little to look.
    """
    room = _FEWEST + _BLOCK + 1
    item_of, waiting = np.empty(room, np.uint64), np.empty(room, np.uint64)
    kept_points = item_of, np.empty(room, np.int32), np.empty((room, 3), np.int32), waiting
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
        _ask_lists(points, cells, kept_points, n_waiting, locations)
        for kept in range(n_kept):
            n_open += locations[item_of[kept]] == UNDECIDED
        n_kept = np.uint64(0)
    return n_open


@inline
def side_in_cell(frames: FloatArray, places: IntArray, row: int, p: tuple[float, ...], blur: float) -> int:
    """Return the location of a blurred point (x, y, z) if its cell tells it, else UNDECIDED.

    frames: (n, 6), places: (n, 4), what `Sides` has of each polyhedron, of which `row` counts.
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
    column, line, layer = index_of(x, x_low, x_scale), index_of(y, y_low, y_scale), index_of(z, z_low, z_scale)
    if blur > 0.0:
        is_one = index_of(x - blur, x_low, x_scale) == index_of(x + blur, x_low, x_scale)
        is_one &= index_of(y - blur, y_low, y_scale) == index_of(y + blur, y_low, y_scale)
        is_one &= index_of(z - blur, z_low, z_scale) == index_of(z + blur, z_low, z_scale)
        if not is_one:
            return UNDECIDED
    return int(array_at(address, (nx * ny * nz,), np.int8)[(layer * ny + line) * nx + column])
