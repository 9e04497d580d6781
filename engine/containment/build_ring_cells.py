"""Builds the cells of a polygon, with the budget of the call that pays for it."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from engine.bounding.grid import Axis, BoxGrid, build_box_grid
from engine.containment.prepared import Rings, rings_of
from engine.containment.ring_cells import walk_rows
from engine.containment.ring_crossing import locate_in_rings
from engine.parallel import Budget
from engine.solids.base import FloatArray, as_read_only
from engine.solids.polygon import Polygon

_PAYS_FROM: Final = 1 << 12
_PAYS_PER_EDGE: Final = 1
_PLACE: Final = (0.5 + 287.0 / 4096.0, 0.5 - 413.0 / 4096.0)
"""Where the reference point lies in its cell: no symmetry that edges might share."""
_RANGE: Final = 2.0**500
_AT_ONCE: Final = 1024
_ROUNDS: Final = 4
"""How often cells that the walk left open are asked by rays, in rising numbers; the last ones stay open."""


class RingCells(NamedTuple):
    """What `locate_by_ring_cells` reads."""

    starts: FloatArray
    ends: FloatArray
    grid: BoxGrid
    columns: FloatArray
    """x of the reference points."""
    rows: FloatArray
    """y of the reference points."""
    sides: npt.NDArray[np.int8]
    """Side of each cell's reference point, 0 where it is not known."""


def ring_cells_if_they_pay(solid: Polygon, n_points: int, budget: Budget) -> RingCells | None:
    """Return the cells of `solid` if they are there, or if the points asked so far would have paid for them."""
    seen = solid.prepared("points_seen", lambda: [0])
    seen[0] += n_points
    if seen[0] < _PAYS_FROM + _PAYS_PER_EDGE * len(solid.vertices) or np.abs(solid.vertices).max() > _RANGE:
        return None
    return solid.prepared("ring_cells", lambda: build_ring_cells(solid, budget))


def build_ring_cells(solid: Polygon, budget: Budget) -> RingCells:
    """Return the cells of `solid`. Raises what `Budget.check` raises."""
    rings = rings_of(solid, budget.check)
    starts, ends = rings.starts, rings.ends
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    side = int(min(1024.0, max(32.0, 4.0 * len(starts) ** 0.5)))
    sides_of_boxes = (np.ascontiguousarray(s[:, k]) for k in (0, 1) for s in (low, high))
    x_low, x_high, y_low, y_high = sides_of_boxes
    grid = build_box_grid(x_low, x_high, y_low, y_high, side, side)
    budget.check()
    columns, rows = _references(grid.u, _PLACE[0]), _references(grid.v, _PLACE[1])
    heads = np.zeros(grid.u.n_cells * grid.v.n_cells, np.int8)
    sides = np.empty_like(heads)
    asked = np.arange(grid.v.n_cells) * grid.u.n_cells
    for _ in range(_ROUNDS):
        _ask(rings, asked, grid, columns, rows, heads, budget)
        with np.errstate(all="ignore"):
            walk_rows(starts, ends, grid, columns, rows, heads, sides, budget.flag)
        budget.check()
        is_head = (sides == 0) & (heads == 0)
        is_head[1:] &= sides[:-1] != 0  # the first that is open, in each run
        asked = np.flatnonzero(is_head)
        if not len(asked):
            break
    return RingCells(starts, ends, grid, columns, rows, sides)


def _references(axis: Axis, place: float) -> FloatArray:
    """Return a coordinate of the reference points along an axis, NaN where rounding puts it into another cell."""
    index = np.arange(axis.n_cells)
    if axis.cells_per_unit == 0.0:
        return np.full(1, np.nan)
    values = np.asarray(axis.low + 2.0 * (index + place) / axis.cells_per_unit, np.float64)
    found = np.minimum((values * 0.5 - axis.low * 0.5) * axis.cells_per_unit, axis.n_cells - 1.0)
    values[(found.astype(np.int64) != index) | (values < axis.low)] = np.nan
    return values


def _ask(
    rings: Rings,
    cells: npt.NDArray[np.int64],
    grid: BoxGrid,
    columns: FloatArray,
    rows: FloatArray,
    heads: npt.NDArray[np.int8],
    budget: Budget,
) -> None:
    """Write the sides of the reference points of `cells` to `heads`, by the exact ray."""
    points = np.stack([columns[cells % grid.u.n_cells], rows[cells // grid.u.n_cells]], axis=1)
    is_valid = ~np.isnan(points).any(axis=1)
    cells, points = cells[is_valid], np.ascontiguousarray(points[is_valid])
    for start in range(0, len(cells), _AT_ONCE):
        found = np.empty(len(points[start : start + _AT_ONCE]), np.int8)
        locate_in_rings(as_read_only(points[start : start + _AT_ONCE]), *rings, found, budget.flag)
        budget.check()
        found[np.abs(found) != 1] = 0
        heads[cells[start : start + _AT_ONCE]] = found
