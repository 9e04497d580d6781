"""Uniform grids: which boxes reach into which cell, listed per cell, in one or two dimensions.

A value's cell is ``int((x / 2 - low / 2) * cells_per_unit)``, cut off at the last cell. Each of these steps is monotone
in floating point, so a box listed from the cell of its lower side to the cell of its upper side is found from every
value between them, ties and roundings included: the lists are conservative by construction. Halving keeps the
difference finite for every input (for subnormal values it rounds, monotonically too).

Items of a cell keep the order in which the boxes were given.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import FloatArray, Int32Array, IntArray
from engine.jit import inline, kernel

_FASTEST: Final = 1e300
"""Most cells per unit: keeps the product finite where all values of an axis lie within some subnormals."""


class Axis(NamedTuple):
    """The cells along one axis."""

    low: float
    high: float
    cells_per_unit: float
    n_cells: int


class BoxGrid(NamedTuple):
    """Boxes listed by cell: those of cell (u, v) are ``items[offsets[k]:offsets[k + 1]]`` with k = v * u_cells + u."""

    u: Axis
    v: Axis
    offsets: IntArray
    items: Int32Array


@inline
def cell_of(value: float, low: float, cells_per_unit: float, n_cells: int) -> int:
    """Return the cell of a value that is not below `low`."""
    return int(min((value * 0.5 - low * 0.5) * cells_per_unit, n_cells - 1.0))


def make_axis(low: float, high: float, n_cells: int) -> Axis:
    """Return `n_cells` cells from low to high, one where there is no extent."""
    extent = high * 0.5 - low * 0.5
    if extent <= 0.0:
        return Axis(low, high, 0.0, 1)
    return Axis(low, high, min(n_cells / extent, _FASTEST), n_cells)


@kernel
def count_boxes(u_low: Any, u_high: Any, u: Any, v_low: Any, v_high: Any, v: Any, counts: Any) -> None:
    """Add to counts (n_cells,) int64 how many boxes reach into each cell."""
    for box in range(len(u_low)):
        first = cell_of(u_low[box], u.low, u.cells_per_unit, u.n_cells)
        last = cell_of(u_high[box], u.low, u.cells_per_unit, u.n_cells)
        for row in range(
            cell_of(v_low[box], v.low, v.cells_per_unit, v.n_cells),
            cell_of(v_high[box], v.low, v.cells_per_unit, v.n_cells) + 1,
        ):
            for column in range(first, last + 1):
                counts[row * u.n_cells + column] += 1


@kernel
def fill_boxes(u_low: Any, u_high: Any, u: Any, v_low: Any, v_high: Any, v: Any, ends: Any, items: Any) -> None:
    """List the boxes by cell; ends (n_cells,) int64 holds each cell's first place and is moved behind its last."""
    for box in range(len(u_low)):
        first = cell_of(u_low[box], u.low, u.cells_per_unit, u.n_cells)
        last = cell_of(u_high[box], u.low, u.cells_per_unit, u.n_cells)
        for row in range(
            cell_of(v_low[box], v.low, v.cells_per_unit, v.n_cells),
            cell_of(v_high[box], v.low, v.cells_per_unit, v.n_cells) + 1,
        ):
            for column in range(first, last + 1):
                cell = row * u.n_cells + column
                items[ends[cell]] = box
                ends[cell] += 1


def build_box_grid(
    u_low: FloatArray,
    u_high: FloatArray,
    v_low: FloatArray,
    v_high: FloatArray,
    u_cells: int,
    v_cells: int,
    check: Callable[[], object] = lambda: None,
) -> BoxGrid:
    """List boxes, given by their four sides (n,), in a grid of about u_cells x v_cells cells over all of them.

    Cost: linear in the boxes and the entries; cells are halved, the longer row of them first, until the entries are at
    most four for each box and cell together, so long boxes cannot fill the memory.

    check: called between the steps; what it raises ends the building.
    """
    u_low, u_high = np.ascontiguousarray(u_low), np.ascontiguousarray(u_high)  # columns of a table: one signature
    v_low, v_high = np.ascontiguousarray(v_low), np.ascontiguousarray(v_high)
    limit = 4 * (len(u_low) + u_cells * v_cells) + 64
    while True:  # bound: every turn halves a number of cells, and one cell lists each box once
        u = make_axis(float(u_low.min()), float(u_high.max()), u_cells)
        v = make_axis(float(v_low.min()), float(v_high.max()), v_cells)
        counts = np.zeros(u.n_cells * v.n_cells, np.int64)
        if u_cells * v_cells == 1 or _estimate(u_low, u_high, u, v_low, v_high, v) <= limit:
            break
        check()
        if u_cells >= v_cells:
            u_cells = (u_cells + 1) // 2
        else:
            v_cells = (v_cells + 1) // 2
    check()
    count_boxes(u_low, u_high, u, v_low, v_high, v, counts)
    check()
    offsets = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=offsets[1:])
    items = np.empty(offsets[-1], np.int32)
    fill_boxes(u_low, u_high, u, v_low, v_high, v, offsets[:-1].copy(), items)
    return BoxGrid(u, v, offsets, items)


def _estimate(u_low: FloatArray, u_high: FloatArray, u: Axis, v_low: FloatArray, v_high: FloatArray, v: Axis) -> float:
    """Return about how many entries the lists would have."""
    columns = (u_high * 0.5 - u_low * 0.5) * u.cells_per_unit + 1.0
    rows = (v_high * 0.5 - v_low * 0.5) * v.cells_per_unit + 1.0
    return float(np.dot(columns, rows))
