"""Pairs of boxes with a common point: by a grid of cells at least as wide as all boxes but a few, or by a sweep.

A box stands in the cell of its low corner. Two boxes of one cell's width or less that meet have their low corners at
most a width apart on each axis, so in the same or in neighbouring cells. Each pair is looked for from one side only:

    y   a a a      boxes are laid out by cell, so that the cells marked with one letter are one run of boxes: b the
    ^   . B b      later ones of the box's own cell B and those of the next cell, a the row above; then three such
    +-> . . . x    rows of the layer behind. A rim of empty cells saves every question whether a neighbour exists.

The few largest boxes, infinite ones among them, stand last and are compared with all others. `cell_of` is monotone in
floating point and corners a width apart are at most one cell apart, because the width is enlarged first. Right for many
boxes of like size.

Few are all compared. Others are sorted by their start on one axis, each compared with those that start before it ends:
on the axis on which the boxes cover the smallest share of the whole width. Infinite bounds are welcome: such a box
meets everything that its finite bounds allow.

Source: C. Ericson, Real-Time Collision Detection, 2005, section 7.1 (uniform grids); here by one sort, for one instant;
D. Baraff, Dynamic simulation of non-penetrating rigid bodies, 1992 (sweep and prune), for one instant too.

Uniform grids: which cell a value is in.

It is ``int((x / 2 - low / 2) * cells_per_unit)``, cut off at the last cell. Each of these steps is monotone in floating
point, so what is listed from the cell of its lower side to the cell of its upper side is found from every value between
them, ties and roundings included. Halving keeps the difference finite for every input (for subnormal values it rounds,
monotonically too).
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from engine.compiling.jit import allocating_kernel, entry_of, inline, kernel
from engine.running.budget import Budget
from engine.types import FlagArray, FloatArray, IntArray

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


BLOCK: Final = 1 << 18
"""Pairs given out at once: a scene in which all meet all has n^2 / 2, which need not fit into memory. Sorting one block
takes some 20 ms."""
_FEW, _FEWEST = 96, 256
"""Boxes that are all compared, and those that a grid is made for."""
_LARGE: Final = 64
_ENLARGED: Final = 1.0 + 2.0**-20
_CROWD: Final = 48
"""Boxes that share a cell with one box, on average, beyond which a sweep is no worse."""


CornerGrid = namedtuple("CornerGrid", "boxes numbers cells starts row layer")
"""Boxes by cell, the large ones last; or, without cells, all as large ones.

boxes (n, 6): low, then high. numbers (n,): which box each is. cells (n,): its cell, -1 where it is large. starts
(n_cells + 1,) int32: where each cell begins among them. row, layer: how far the next cell on y and on z is; 0
without cells where the first column of `boxes` ascends.
"""


def pairs_of_boxes(low: FloatArray, high: FloatArray, flag: FlagArray, block: int = BLOCK) -> Iterator[IntArray]:
    """Yield ``(n_pairs, 2)`` pairs first < second of closed boxes ``(n, d)`` with a common point, block by block.

    Each block is sorted, but where there are several a later one may hold smaller indices; it has about `block` pairs,
    or those of one box if these are more.
    Polls `flag` (1,) uint8 and ends early, with wrong blocks, when it is set: the caller looks at it after each.
    """
    for keys in _keys_of_pairs(low, high, flag, block):
        yield np.stack([keys // len(low), keys % len(low)], axis=1)


def all_pairs_of_boxes(low: FloatArray, high: FloatArray, budget: Budget) -> IntArray:
    """Return all of `pairs_of_boxes` at once, sorted. Raises as `Budget.check` when the call must end."""
    blocks = [np.zeros(0, np.int64)]
    for block in _keys_of_pairs(low, high, budget.flag, BLOCK):
        budget.check()
        blocks.append(block)
    budget.check()
    keys = np.sort(np.concatenate(blocks))
    pairs = np.empty((len(keys), 2), np.int64)
    for start in range(0, len(keys), BLOCK):
        budget.check()
        some = pairs[start : start + BLOCK]
        np.divmod(keys[start : start + BLOCK], len(low), out=(some[:, 0], some[:, 1]))
    return pairs


def _keys_of_pairs(low: FloatArray, high: FloatArray, flag: FlagArray, block: int) -> Iterator[IntArray]:
    """Yield the blocks of `pairs_of_boxes`, a pair as first * n + second."""
    n_boxes = len(low)
    grid = _without_cells(low, high, np.arange(n_boxes), 1) if n_boxes < _FEW else None
    grid = grid or (_grid_of(low, high) if n_boxes >= _FEWEST else None) or _sorted_along_axis(low, high)
    start, enough = 0, max(block, 1)
    keys = np.empty(min(enough, n_boxes * n_boxes // 2) + n_boxes, np.int64)  # one box meets fewer than there are
    while start < n_boxes:  # bound: start grows
        n_found, start = entry_of(_collect)(grid, start, enough, keys, flag)
        if n_found:
            yield np.sort(keys[:n_found])


@np.errstate(all="ignore")
def _sorted_along_axis(low: FloatArray, high: FloatArray) -> CornerGrid:
    """Return boxes by where they start on the axis on which they are thin against the width of the whole."""
    finite = np.isfinite(low) & np.isfinite(high)
    width = np.where(finite, high, -np.inf).max(axis=0) - np.where(finite, low, np.inf).min(axis=0)
    share = np.where(finite, high - low, 0.0).sum(axis=0) / width
    axis = int(np.argmin(np.where(np.isfinite(share), share, np.inf)))
    columns = (axis + np.arange(low.shape[1])) % low.shape[1]
    order = np.argsort(low[:, axis], kind="stable")
    return _without_cells(low[order][:, columns], high[order][:, columns], order, 0)


def _without_cells(low: FloatArray, high: FloatArray, numbers: IntArray, row: int) -> CornerGrid:
    (n_boxes, dimension), boxes = low.shape, np.zeros((len(low), 6))
    boxes[:, :dimension], boxes[:, 3 : 3 + dimension] = low, high
    return CornerGrid(boxes, numbers, np.full(n_boxes, -1), np.zeros(1, np.int32), row, 0)


@np.errstate(all="ignore")
def _grid_of(low: FloatArray, high: FloatArray) -> CornerGrid | None:
    """Return the grid of boxes (n, d), None where a sweep is better."""
    n_boxes, dimension = low.shape
    extent = np.empty(n_boxes)
    _measure(low, high, extent)
    widest, widest_of_all = float(np.partition(extent, n_boxes - _LARGE - 1)[n_boxes - _LARGE - 1]), float(extent.max())
    if widest * 4.0 >= widest_of_all:  # all of like size: none is large
        widest = widest_of_all
    span = np.array([[np.inf] * 3, [-np.inf] * 3])
    _spread(low, extent, widest, span)
    least, most = span
    least[dimension:] = most[dimension:] = 0.0
    width = np.maximum(widest, (most - least) / (n_boxes ** (1.0 / dimension) * 2.0))
    width = width * _ENLARGED + 2.0**-52 * np.maximum(np.abs(least), np.abs(most)) * 4.0 + 2.0**-1000
    last = np.floor((most - least) / width)
    if not (np.isfinite(last).all() and np.isfinite(width).all()):
        return None
    counts = last.astype(np.int64) + 3  # a rim of one cell on either side
    row, layer = int(counts[0]), int(counts[0] * counts[1])
    boxes, numbers, cells = np.zeros((n_boxes, 6)), np.empty(n_boxes, np.int64), np.empty(n_boxes, np.int64)
    starts = np.zeros(layer * int(counts[2]) + 1, np.int32)
    grid = CornerGrid(boxes, numbers, cells, starts, row, layer)
    return None if _sort_into_cells(low, high, extent, widest, least, width, grid) > _CROWD * n_boxes else grid


@kernel
def _measure(low: FloatArray, high: FloatArray, extent: FloatArray) -> None:
    """Fill extent (n,) with the largest side of each box, infinite where a bound is or the side overflows."""
    for box in range(low.shape[0]):
        side = 0.0
        for axis in range(low.shape[1]):
            side = max(side, high[box, axis] - low[box, axis])
            if not (np.isfinite(low[box, axis]) and np.isfinite(high[box, axis])):
                side = np.inf
        extent[box] = side


@kernel
def _spread(low: FloatArray, extent: FloatArray, widest: float, span: FloatArray) -> None:
    """Fill span (2, 3) with the least and the greatest low corner of boxes that are not large."""
    for box in range(low.shape[0]):
        if extent[box] <= widest:
            for axis in range(low.shape[1]):
                span[0, axis] = min(span[0, axis], low[box, axis])
                span[1, axis] = max(span[1, axis], low[box, axis])


@allocating_kernel
def _sort_into_cells(
    low: FloatArray, high: FloatArray, extent: FloatArray, widest: float, least: FloatArray, width: FloatArray,
    grid: CornerGrid,
) -> int:  # fmt: skip
    """Fill the arrays of the grid, boxes and starts zero before; return the sum of the squares of how many share a
    cell."""
    starts, n_boxes, n_cells, dimension = grid.starts, low.shape[0], grid.starts.shape[0] - 1, low.shape[1]
    cells = np.empty(n_boxes, np.int64)
    n_small = 0
    for box in range(n_boxes):
        cells[box] = -1
        if extent[box] <= widest:
            cell = 1 + grid.row + grid.layer
            for axis in range(dimension):
                step = 1 if axis == 0 else (grid.row if axis == 1 else grid.layer)
                cell += step * int((low[box, axis] - least[axis]) / width[axis])
            cells[box] = cell
            starts[cell + 1] += 1
            n_small += 1
    n_sharing = 0
    for cell in range(n_cells):
        n_sharing += int(starts[cell + 1]) * int(starts[cell + 1])
        starts[cell + 1] += starts[cell]
    filled, n_large = starts[:-1].copy(), 0
    for box in range(n_boxes):
        cell = cells[box]
        if cell >= 0:
            place = int(filled[cell])
            filled[cell] += 1
        else:
            place = n_small + n_large
            n_large += 1
        grid.numbers[place], grid.cells[place] = box, cell
        for axis in range(dimension):
            grid.boxes[place, axis], grid.boxes[place, 3 + axis] = low[box, axis], high[box, axis]
    return n_sharing


@inline
def _meet(boxes: FloatArray, box: int, other: int) -> bool:
    """Tell whether two closed boxes have a common point; without branches, which would be guessed wrong."""
    return (
        (boxes[box, 0] <= boxes[other, 3])
        & (boxes[other, 0] <= boxes[box, 3])
        & (boxes[box, 1] <= boxes[other, 4])
        & (boxes[other, 1] <= boxes[box, 4])
        & (boxes[box, 2] <= boxes[other, 5])
        & (boxes[other, 2] <= boxes[box, 5])
    )


@inline
def _add_run(
    boxes: FloatArray, numbers: IntArray, box: int, start: int, stop: int, keys: IntArray, n_found: int
) -> int:
    """Write the keys of the pairs of a box with those of a run that it meets; return the number then found. One key
    more than is found may be written."""
    n_boxes, own = numbers.shape[0], numbers[box]
    for other in range(start, stop):
        number = numbers[other]
        keys[n_found] = min(own, number) * n_boxes + max(own, number)
        n_found += 1 if _meet(boxes, box, other) else 0
    return n_found


@kernel
def _collect(grid: CornerGrid, start: int, enough: int, keys: IntArray, flag: FlagArray) -> tuple[int, int]:
    """Write first * n + second of the pairs of boxes from place `start` on with those after them, until `enough` are
    found; return their number and the place to go on from."""
    boxes, numbers, starts, row, layer = grid.boxes, grid.numbers, grid.starts, grid.row, grid.layer
    n_boxes, n_small, n_found = numbers.shape[0], int(starts[-1]), 0
    for box in range(start, n_boxes):
        if flag[0] != 0:
            return 0, n_boxes
        if n_found >= enough:
            return n_found, box
        cell = grid.cells[box]
        if cell < 0:
            stop = n_boxes if row > 0 else box + 1
            while stop < n_boxes and boxes[stop, 0] <= boxes[box, 3]:
                stop += 1
            n_found = _add_run(boxes, numbers, box, box + 1, stop, keys, n_found)
            continue
        n_found = _add_run(boxes, numbers, box, box + 1, starts[cell + 2], keys, n_found)
        cell += row
        n_found = _add_run(boxes, numbers, box, starts[cell - 1], starts[cell + 2], keys, n_found)
        cell += layer - 2 * row
        for _ in range(3):
            n_found = _add_run(boxes, numbers, box, starts[cell - 1], starts[cell + 2], keys, n_found)
            cell += row
        n_found = _add_run(boxes, numbers, box, n_small, n_boxes, keys, n_found)
    return n_found, n_boxes
