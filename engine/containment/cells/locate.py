"""Point location in a polyhedron by cells: parity of the crossings on the segment from the cell's reference point.

A point in a cell without triangles has the side of the cell. In another cell it has the side of the reference point,
flipped by each triangle that the segment to it crosses. Points too close to the plane of an entry stay UNDECIDED and go
to the vertical ray.

Scenes look up a blurred point (filters.py) in the cells of one of many polyhedra (`Sides`): it is decided if one cell
contains all of its blur.

Source: reference points over the uniform grid of C. Ericson, Real-Time Collision Detection, 2005. Changed: certified in
single precision, with an exact fallback.
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
"""Number of points whose statuses are looked up together."""
_FEWEST: Final = 128
"""Number of UNDECIDED points from which the later stages run; scratch for `_FEWEST + _BLOCK` points fits the L1 cache.
"""
_AHEAD: Final = 6
"""Number of points between the prefetch of a list and its use: some 100 ns."""


@inline
def _look_up_statuses(
    points: Any, start: Any, end: Any, cells: Any, locations: Any, item_of: Any, n_undecided: Any
) -> Any:
    """Write the cell statuses of points start .. end - 1 to locations, and append the numbers of UNDECIDED points to
    item_of, after the n_undecided there. Returns the new length of item_of, and how many points are outside the grid;
    these, and points with NaN, get the last status. Without branches."""
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
        item_of[n_undecided] = item
        n_undecided += np.uint64(status == UNDECIDED)
        n_beyond += np.uint64(not is_within)
    return n_undecided, n_beyond


@merged
def _look_up_codes(points: Any, cells: Any, undecided: Any, n_undecided: int) -> Any:
    """Look up the cell codes of the n_undecided UNDECIDED points; return how many of their cells have a list of
    triangles. undecided: (item_of, code_of, places, waiting): of each the point, the code, the cell's indices; and
    those with a list."""
    low, scale, n, codes = cells.lattice.low, cells.lattice.scale, cells.lattice.n, cells.codes
    item_of, code_of, places, waiting = undecided
    n_waiting = np.uint64(0)
    for slot in range(n_undecided):
        item = item_of[slot]
        x = index_of(points[item, 0], low[0], scale[0])
        y = index_of(points[item, 1], low[1], scale[1])
        z = index_of(points[item, 2], low[2], scale[2])
        places[slot, 0], places[slot, 1], places[slot, 2] = x, y, z
        code_of[slot] = codes[np.uint64((z * n[1] + y) * n[0] + x)]
        waiting[n_waiting] = slot
        n_waiting += np.uint64(code_of[slot] != MIXED_CELL)
    return n_waiting


@merged
def _query_lists(points: Any, cells: Any, undecided: Any, n_waiting: Any, locations: Any) -> None:
    """Locate the UNDECIDED points whose cells list triangles: the parity of crossings between the cell's reference
    point, whose side is known, and the point. undecided: as `_look_up_codes` fills it, n_waiting of them in
    `waiting`."""
    lattice, groups = cells.lattice, cells.groups
    item_of, code_of, places, waiting = undecided
    for turn in range(min(n_waiting, np.uint64(_AHEAD))):
        prefetch_group(groups, code_of[waiting[turn]] >> 1)
    for turn in range(n_waiting):
        if turn + np.uint64(_AHEAD) < n_waiting:
            prefetch_group(groups, code_of[waiting[turn + np.uint64(_AHEAD)]] >> 1)
        slot = waiting[turn]
        item, code = item_of[slot], code_of[slot]
        reference = reference_point(lattice, places[slot, 0], places[slot, 1], places[slot, 2])
        w = scaled_difference(as_point3(points, item), reference, lattice.scale)
        parity = parity_across(groups, code >> 1, np.float32(w[0]), np.float32(w[1]), np.float32(w[2]))
        locations[item] = UNDECIDED if parity & UNDECIDED else ((code ^ parity) & 1) * 2 - 1


@allocating_kernel
def locate_by_cells(points: FloatArray, cells: Any, locations: Int8Array, flag: FlagArray) -> int:
    """Fill locations (n,) int8 of points (n, 3) by the `Cells` of a polyhedron; return how many stay UNDECIDED, or
    NOT_FINITE. Points go through the stages in blocks, so that memory loads of a stage overlap: status (enough for most
    points), code, parity over the list. Only points outside the grid are tested for NaN and infinity."""
    room = _FEWEST + _BLOCK + 1
    item_of, waiting = np.empty(room, np.uint64), np.empty(room, np.uint64)
    undecided = item_of, np.empty(room, np.int32), np.empty((room, 3), np.int32), waiting
    n_open, n_undecided = 0, np.uint64(0)
    for start in range(0, len(points), _BLOCK):
        if flag[0]:
            break
        first, end = np.uint64(start), np.uint64(min(start + _BLOCK, len(points)))
        n_undecided, n_beyond = _look_up_statuses(points, first, end, cells, locations, item_of, n_undecided)
        if n_beyond > 0 and has_not_finite(points[first:end]):
            return NOT_FINITE
        if n_undecided < _FEWEST and end < len(points):
            continue
        n_waiting = _look_up_codes(points, cells, undecided, n_undecided)
        _query_lists(points, cells, undecided, n_waiting, locations)
        for slot in range(n_undecided):
            n_open += locations[item_of[slot]] == UNDECIDED
        n_undecided = np.uint64(0)
    return n_open


@inline
def side_in_cell(frames: FloatArray, places: IntArray, row: int, p: tuple[float, ...], blur: float) -> int:
    """Return the location of a blurred point p = (x, y, z) if the box p +- blur lies in one cell, else UNDECIDED.
    frames (n, 6), places (n, 4): `frame` and `place` of the `Sides` of each polyhedron; row: the polyhedron."""
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
