"""Broad phase: pairs of boxes with a common point, by a grid of cells at least as wide as all boxes but a few, or by a
sweep.

A box stands in the cell of its low corner. Two boxes of one cell's width or less that meet have their low corners at
most a width apart on each axis, so in the same or in neighbouring cells. Each pair is tested from one side only:

    y   a a a      boxes are laid out by cell, so that the cells marked with one letter are one run of boxes: b the
    ^   . B b      later ones of the box's own cell B and those of the next cell, a the row above; then three such
    +-> . . . x    rows of the layer behind. A rim of empty cells saves every question whether a neighbour exists.

The few largest boxes, infinite ones among them, stand last and are compared with all others. `cell_of` is monotone in
floating point and corners a width apart are at most one cell apart, because the width is enlarged first. Right for many
boxes of like size.

Few boxes: all pairs are compared. Others are sorted by their start on one axis, each compared with those that start
before it ends: on the axis on which the boxes cover the smallest share of the whole width. Infinite bounds are welcome:
such a box meets everything that its finite bounds allow.

Source: C. Ericson, Real-Time Collision Detection, 2005, section 7.1 (uniform grids); here by one sort, for one instant;
D. Baraff, Dynamic simulation of non-penetrating rigid bodies, 1992 (sweep and prune), for one instant too.

Uniform grids: which cell a value is in.

It is ``int((x / 2 - low / 2) * cells_per_unit)``, cut off at the last cell. Each of these steps is monotone in floating
point, so an item listed from the cell of its lower bound to the cell of its upper bound is listed in the cell of every
value between them, ties and roundings included. Halving keeps the difference finite for every input (for subnormal
values it rounds, monotonically too).
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterator
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from engine.compiling.jit import allocating_kernel, entry_of, inline, kernel
from engine.running.budget import Budget
from engine.running.parallel import run_chunks
from engine.types import FlagArray, FloatArray, IntArray

_FASTEST: Final = 1e300
"""Bound on cells per unit: keeps the product in `cell_of` finite where all values of an axis are nearly equal."""


class Axis(NamedTuple):
    """A uniform division of the interval low .. high into n_cells cells; `cells_per_unit`: for each unit of x / 2, see
    the module; 0.0 for an empty interval, of one cell."""

    low: float
    high: float
    cells_per_unit: float
    n_cells: int


@inline
def cell_of(value: float, low: float, cells_per_unit: float, n_cells: int) -> int:
    """Return the index of the cell that contains `value` >= `low`; values above the last cell count to it."""
    return int(min((value * 0.5 - low * 0.5) * cells_per_unit, n_cells - 1.0))


def make_axis(low: float, high: float, n_cells: int) -> Axis:
    """Return an `Axis` of `n_cells` cells from low to high, of one cell where low = high."""
    extent = high * 0.5 - low * 0.5
    return Axis(low, high, 0.0, 1) if extent <= 0.0 else Axis(low, high, min(n_cells / extent, _FASTEST), n_cells)


BLOCK: Final = 1 << 18
"""Number of pairs in a block, since n boxes have up to n^2 / 2 pairs, which need not fit into memory; sorting a block
takes some 20 ms."""
_SAMPLE: Final = 1 << 10
"""Every so-many-th pair of a block is a sample, when many blocks are sorted in ranges."""
_FEW, _FEWEST = 96, 256
"""Fewer than _FEW boxes: all pairs are compared. From _FEWEST boxes on a grid is built; between, a sweep."""
_PARTED, _N_PARTS = 1 << 14, 64
"""Boxes from which on parts of them may go to several threads, and how many parts."""
_LARGE: Final = 64
_ENLARGED: Final = 1.0 + 2.0**-20
_MOST_PER_CELL: Final = 48
"""Mean number of boxes that share a box's cell, from which a sweep is as fast as the grid."""


CornerGrid = namedtuple("CornerGrid", "boxes numbers cells starts row layer")
"""Boxes sorted by the cell of their low corner, large boxes last; without cells (a sweep) every box counts as large.

boxes (n, 6): low, then high. numbers (n,): index of each box in the input. cells (n,): cell of each box, -1 for a large
box. starts (n_cells + 1,) int32: first box of each cell. row, layer: cells from one to the next along y and z; row 0:
boxes are sorted by their first coordinate, for a sweep.
"""


def pairs_of_boxes(
    low: FloatArray, high: FloatArray, budget: Budget, block: int = BLOCK, n_left: int | None = None,
    workers: int | None = 1,
) -> Iterator[IntArray]:  # fmt: skip
    """Yield the pairs ``(n_pairs, 2)``, first < second, of closed boxes ``(n, d)`` that have a common point, in blocks.

    n_left: if given, only pairs of one of the first `n_left` boxes and one of the others.
    Each block is sorted, and has about `block` pairs, or all pairs of one box if these are more; a later block may have
    smaller indices. Raises: as `Budget.check`.
    """
    for keys in _keys_of_pairs(low, high, budget, block, n_left, workers):
        yield np.stack([keys // len(low), keys % len(low)], axis=1)


def all_pairs_of_boxes(low: FloatArray, high: FloatArray, budget: Budget) -> IntArray:
    """Return the pairs of `pairs_of_boxes` as one sorted array (n_pairs, 2). Raises: as `Budget.check`."""
    blocks = [np.zeros(0, np.int64), *_keys_of_pairs(low, high, budget, BLOCK)]
    # One sort of millions takes half a second: keys are sorted in ranges of about `BLOCK`, as samples bound them.
    samples = np.sort(np.concatenate([block[::_SAMPLE] for block in blocks]))
    cuts = np.stack([np.searchsorted(block, samples[BLOCK // _SAMPLE :: BLOCK // _SAMPLE]) for block in blocks], axis=1)
    pairs = np.empty((sum(map(len, blocks)), 2), np.int64)
    stop, before = 0, np.zeros(len(blocks), np.int64)
    for after in [*cuts, np.array([len(block) for block in blocks])]:
        budget.check()
        keys = np.sort(np.concatenate([block[i:j] for block, i, j in zip(blocks, before, after)]))
        start, stop, before = stop, stop + len(keys), after
        np.divmod(keys, len(low), out=(pairs[start:stop, 0], pairs[start:stop, 1]))
    return pairs


def _keys_of_pairs(
    low: FloatArray, high: FloatArray, budget: Budget, block: int, n_left: int | None = None,
    workers: int | None = 1,
) -> Iterator[IntArray]:  # fmt: skip
    """Yield the pairs of `pairs_of_boxes` in sorted blocks, each pair as the key first * n + second. Parts of the boxes
    are passed over side by side, each up to its share of a block at a time."""
    n_boxes = len(low)
    budget.check()
    grid = _sweep_grid(low, high, np.arange(n_boxes), 1) if n_boxes < _FEW else None
    grid = grid or (_build_grid(low, high, budget, workers) if n_boxes >= _FEWEST else None)
    grid = grid or _sorted_along_axis(low, high)
    n_parts = 1 if n_boxes < _PARTED or workers == 1 else _N_PARTS
    parts, n_taken = list(pairwise(n_boxes * part // n_parts for part in range(n_parts + 1))), 1
    while parts:  # bound: each turn ends a part, or lists pairs
        some, parts = parts[:n_taken], parts[n_taken:]
        keys = _keys_of_parts(grid, some, max(block // n_parts, 1), -1 if n_left is None else n_left, budget, workers)
        if len(keys):
            yield keys
        parts = [part for part in some if part[0] < part[1]] + parts
        n_taken = max(1, min(8 * n_taken, n_taken * block // max(len(keys), 1), n_parts))  # one box may meet all others


def _keys_of_parts(
    grid: CornerGrid, parts: list[tuple[int, int]], enough: int, n_left: int, budget: Budget, workers: int | None
) -> IntArray:
    """Return the sorted keys of pairs of the boxes of each part (start, stop), about `enough` a part; `parts` then
    holds what is left of them."""
    n_boxes, listed = len(grid.numbers), [np.zeros(0, np.int64)] * len(parts)

    def collect(first: int, last: int) -> None:
        keys = np.empty(min(enough, n_boxes * n_boxes // 2) + n_boxes, np.int64)  # one box meets fewer than there are
        for part in range(first, last):
            n, start = entry_of(_collect_pairs)(grid, *parts[part], enough, n_left, keys, budget.flag)
            listed[part], parts[part] = np.sort(keys[:n]), (start, parts[part][1])

    if len(parts) == 1:
        collect(0, 1)
        budget.check()
        return listed[0]
    run_chunks(collect, len(parts), budget=budget, first_chunk=1, workers=workers)
    return np.sort(np.concatenate(listed), kind="stable")


@np.errstate(all="ignore")
def _sorted_along_axis(low: FloatArray, high: FloatArray) -> CornerGrid:
    """Return a `CornerGrid` for a sweep along the axis where the boxes are thinnest, relative to the whole extent."""
    finite = np.isfinite(low) & np.isfinite(high)
    width = np.where(finite, high, -np.inf).max(axis=0) - np.where(finite, low, np.inf).min(axis=0)
    share = np.where(finite, high - low, 0.0).sum(axis=0) / width
    axis = int(np.argmin(np.where(np.isfinite(share), share, np.inf)))
    columns = (axis + np.arange(low.shape[1])) % low.shape[1]
    order = np.argsort(low[:, axis], kind="stable")
    return _sweep_grid(low[order][:, columns], high[order][:, columns], order, 0)


def _sweep_grid(low: FloatArray, high: FloatArray, numbers: IntArray, row: int) -> CornerGrid:
    (n_boxes, dimension), boxes = low.shape, np.zeros((len(low), 6))
    boxes[:, :dimension], boxes[:, 3 : 3 + dimension] = low, high
    return CornerGrid(boxes, numbers, np.full(n_boxes, -1), np.zeros(1, np.int32), row, 0)


@np.errstate(all="ignore")
def _build_grid(low: FloatArray, high: FloatArray, budget: Budget, workers: int | None) -> CornerGrid | None:
    """Return the `CornerGrid` of boxes (n, d), or None where a sweep is faster or coordinates are not finite."""
    n_boxes, dimension = low.shape
    extent = np.zeros(n_boxes)
    for axis in range(dimension):
        side = high[:, axis] - low[:, axis]
        np.maximum(extent, np.where(np.isfinite(side), side, np.inf), out=extent)
    widest, widest_of_all = float(np.partition(extent, n_boxes - _LARGE - 1)[n_boxes - _LARGE - 1]), float(extent.max())
    if widest * 4.0 >= widest_of_all:  # all of like size: none is large
        widest = widest_of_all
    least, most, small = np.zeros(3), np.zeros(3), low if widest == widest_of_all else low[extent <= widest]
    least[:dimension], most[:dimension] = small.min(axis=0), small.max(axis=0)
    width = np.maximum(widest, (most - least) / (n_boxes ** (1.0 / dimension) * 2.0))
    width = width * _ENLARGED + 2.0**-52 * np.maximum(np.abs(least), np.abs(most)) * 4.0 + 2.0**-1000
    last = np.floor((most - least) / width)
    if not (np.isfinite(last).all() and np.isfinite(width).all()):
        return None
    counts = last.astype(np.int64) + 3  # a rim of one cell on either side
    row, layer = int(counts[0]), int(counts[0] * counts[1])
    boxes, numbers, cells = np.empty((n_boxes, 6)), np.empty(n_boxes, np.int64), np.empty(n_boxes, np.int64)
    starts = np.zeros(layer * int(counts[2]) + 1, np.int32)
    grid = CornerGrid(boxes, numbers, cells, starts, row, layer)
    if _sort_into_cells(low, extent, widest, least, width, grid) > _MOST_PER_CELL * n_boxes:
        return None

    def fill(start: int, stop: int) -> None:
        entry_of(_fill_boxes)(low, high, numbers[start:stop], boxes[start:stop])

    run_chunks(fill, n_boxes, budget=budget, workers=workers)
    return grid


@allocating_kernel
def _sort_into_cells(
    low: FloatArray, extent: FloatArray, widest: float, least: FloatArray, width: FloatArray, grid: CornerGrid
) -> int:
    """Fill the arrays of `grid` but the boxes, starts zero on entry: those of extent <= `widest` by the cell of their
    low corner, then the others. least, width (3,): corner of the first cell, and size of a cell. Returns the sum of
    (number of boxes)^2 over the cells."""
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
    return n_sharing


@kernel
def _fill_boxes(low: FloatArray, high: FloatArray, numbers: IntArray, boxes: FloatArray) -> None:
    """Fill boxes (n, 6) with low and high of the boxes of these numbers, 0 on an axis that they lack."""
    for place in range(numbers.shape[0]):
        for axis in range(3):
            is_there = axis < low.shape[1]
            boxes[place, axis] = low[numbers[place], axis] if is_there else 0.0
            boxes[place, 3 + axis] = high[numbers[place], axis] if is_there else 0.0


@inline
def _boxes_intersect(boxes: FloatArray, box: int, other: int) -> bool:
    """Return whether two closed boxes have a common point; without branches, which would be mispredicted."""
    return (
        (boxes[box, 0] <= boxes[other, 3])
        & (boxes[other, 0] <= boxes[box, 3])
        & (boxes[box, 1] <= boxes[other, 4])
        & (boxes[other, 1] <= boxes[box, 4])
        & (boxes[box, 2] <= boxes[other, 5])
        & (boxes[other, 2] <= boxes[box, 5])
    )


@inline
def _append_run(
    boxes: FloatArray, numbers: IntArray, box: int, start: int, stop: int, n_left: int, keys: IntArray, n_pairs: int
) -> int:
    """Append to keys those pairs of `box` with boxes start .. stop - 1 that intersect, as first * n_boxes + second in
    input numbers; return the new number of keys. The entry after the last key may be overwritten. n_left: only
    pairs with one number below it and one not; -1: all pairs."""
    n_boxes, own = numbers.shape[0], numbers[box]
    is_left = own < n_left or n_left < 0
    for other in range(start, stop):
        number = numbers[other]
        keys[n_pairs] = min(own, number) * n_boxes + max(own, number)
        n_pairs += 1 if _boxes_intersect(boxes, box, other) & ((number < n_left) != is_left) else 0
    return n_pairs


@kernel
def _collect_pairs(
    grid: CornerGrid, start: int, end: int, enough: int, n_left: int, keys: IntArray, flag: FlagArray
) -> tuple[int, int]:
    """Write keys first * n + second of the pairs of boxes start .. end - 1 of the grid with later ones, until there are
    at least `enough` keys. n_left: as in `_append_run`. Returns the number of keys, and the index to go on from;
    (0, end) if the flag is set."""
    boxes, numbers, starts, row, layer = grid.boxes, grid.numbers, grid.starts, grid.row, grid.layer
    n_boxes, n_small, n_pairs = numbers.shape[0], int(starts[-1]), 0
    for box in range(start, end):
        if flag[0] != 0:
            return 0, end
        if n_pairs >= enough:
            return n_pairs, box
        cell = grid.cells[box]
        if cell < 0:
            stop = n_boxes if row > 0 else box + 1
            while stop < n_boxes and boxes[stop, 0] <= boxes[box, 3]:
                stop += 1
            n_pairs = _append_run(boxes, numbers, box, box + 1, stop, n_left, keys, n_pairs)
            continue
        n_pairs = _append_run(boxes, numbers, box, box + 1, starts[cell + 2], n_left, keys, n_pairs)
        cell += row
        n_pairs = _append_run(boxes, numbers, box, starts[cell - 1], starts[cell + 2], n_left, keys, n_pairs)
        cell += layer - 2 * row
        for _ in range(3):
            n_pairs = _append_run(boxes, numbers, box, starts[cell - 1], starts[cell + 2], n_left, keys, n_pairs)
            cell += row
        n_pairs = _append_run(boxes, numbers, box, n_small, n_boxes, n_left, keys, n_pairs)
    return n_pairs, end
