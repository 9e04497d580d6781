"""Uniform grids: which boxes reach into which cell, listed per cell, in one to three dimensions.

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


@inline
def cell_of(value: float, low: float, cells_per_unit: float, n_cells: int) -> int:
    """Return the cell of a value that is not below `low`."""
    return int(min((value * 0.5 - low * 0.5) * cells_per_unit, n_cells - 1.0))


def make_axis(low: float, high: float, n_cells: int) -> Axis:
    """Return `n_cells` cells from low to high, one where there is no extent."""
    extent = high * 0.5 - low * 0.5
    return Axis(low, high, 0.0, 1) if extent <= 0.0 else Axis(low, high, min(n_cells / extent, _FASTEST), n_cells)


@inline
def _span(lows: Any, highs: Any, box: int, axis: Any) -> tuple[int, int]:
    """Return the first and last cell of a box along an axis; an axis of one cell is not looked up."""
    if axis.n_cells == 1:
        return 0, 0
    return (
        cell_of(lows[box], axis.low, axis.cells_per_unit, axis.n_cells),
        cell_of(highs[box], axis.low, axis.cells_per_unit, axis.n_cells),
    )


@kernel
def list_boxes(lows: Any, highs: Any, axes: Any, ends: Any, items: Any, is_fill: bool) -> None:
    """Count (ends[cell] += 1) or list (items[ends[cell]] = box) the boxes that reach into each cell.

    lows, highs: (n,) of each of three axes, where not all boxes are alike there.
    """
    u, v, w = axes
    for box in range(len(lows[0])):
        first, last = _span(lows[0], highs[0], box, u)
        line, last_line = _span(lows[1], highs[1], box, v)
        layer, last_layer = _span(lows[2], highs[2], box, w)
        for row in range(layer * v.n_cells + line, last_layer * v.n_cells + line + 1, v.n_cells):
            for head in range(row * u.n_cells, (row + last_line - line + 1) * u.n_cells, u.n_cells):
                for cell in range(head + first, head + last + 1):
                    if is_fill:
                        items[ends[cell]] = box
                    ends[cell] += 1


def list_in_cells(
    lows: list[FloatArray], highs: list[FloatArray], n_cells: list[int], limit: int, check: Callable[[], object]
) -> tuple[list[Axis], IntArray, Int32Array]:
    """List boxes, given by their sides on three axes, in a grid of about `n_cells` cells along them over all of them.

    An axis on which all boxes are alike may be given by one of them. Cells are halved in number, along the axis with
    most of them, until the entries are at most `limit`: long boxes cannot fill the memory.

    Returns axes, offsets, items.
    """
    lows = [np.ascontiguousarray(low) for low in lows]  # columns of a table: one signature
    highs = [np.ascontiguousarray(high) for high in highs]
    ends = [(float(low.min()), float(high.max())) for low, high in zip(lows, highs)]
    while True:  # bound: every turn halves a number of cells, and one cell lists each box once
        axes = [make_axis(*ends[k], n_cells[k]) for k in range(3)]
        along = [(high * 0.5 - low * 0.5) * axis.cells_per_unit + 1.0 for low, high, axis in zip(lows, highs, axes)]
        if max(n_cells) == 1 or float((along[0] * along[1] * along[2]).sum()) <= limit:  # about how many entries
            break
        check()
        longest = n_cells.index(max(n_cells))
        n_cells[longest] = (n_cells[longest] + 1) // 2
    check()
    offsets = np.zeros(axes[0].n_cells * axes[1].n_cells * axes[2].n_cells + 1, np.int64)
    list_boxes(tuple(lows), tuple(highs), tuple(axes), offsets[1:], np.empty(0, np.int32), False)
    check()
    np.cumsum(offsets, out=offsets)
    items = np.empty(offsets[-1], np.int32)
    list_boxes(tuple(lows), tuple(highs), tuple(axes), offsets[:-1].copy(), items, True)
    return axes, offsets, items
