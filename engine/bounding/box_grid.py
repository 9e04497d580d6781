"""Pairs of boxes with a common point, by a grid of cells at least as wide as all boxes but a few large ones.

A box stands in the cell of its low corner. Two boxes of one cell's width or less that meet have their low corners at
most a width apart on each axis, so in the same or in neighbouring cells: three runs of cells side by side in the plane,
nine in space. The few largest boxes, infinite ones among them, are compared with all others. `cell_of` is monotone in
floating point and corners a width apart are at most one cell apart, because the width is enlarged first. Right for many
boxes of like size; `engine.bounding.sweep` is for others.

Source: C. Ericson, Real-Time Collision Detection, 2005, section 7.1 (uniform grids); here by one sort, for one instant.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from engine.bounding.sweep import BLOCK, meeting_boxes
from engine.jit import inline, kernel

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

_FEWEST: Final = 256
_LARGE: Final = 64
_ENLARGED: Final = 1.0 + 2.0**-20
_CROWD: Final = 48
"""Boxes that share a cell with one box, on average, beyond which a sweep is no worse."""


def pairs_of_boxes(low: FloatArray, high: FloatArray, flag: Any, block: int = BLOCK) -> Iterator[IntArray]:
    """Yield what `meeting_boxes` yields, by a grid where the boxes are many and of like size."""
    n_boxes, dimension = low.shape
    grid = None
    if n_boxes >= _FEWEST:
        boxes = np.zeros((n_boxes, 6))
        boxes[:, :dimension], boxes[:, 3 : 3 + dimension] = low, high
        with np.errstate(all="ignore"):
            grid = _grid_of(boxes, dimension)
    if grid is None:
        yield from meeting_boxes(low, high, flag, block)
        return
    start, room = 0, max(block, 1) + n_boxes  # one box meets fewer others than there are
    keys = np.empty(room, np.int64)
    while start < n_boxes:  # bound: start grows
        n_found, start = _collect(boxes, *grid, start, max(block, 1), keys, flag)
        found = np.sort(keys[:n_found])
        if n_found:
            yield np.stack([found // n_boxes, found % n_boxes], axis=1)


def _grid_of(boxes: FloatArray, dimension: int) -> tuple[IntArray, IntArray, IntArray, IntArray, IntArray] | None:
    """Return the cell of each box (-1: large), cells on each axis, the large ones, the others by cell and where each
    cell starts among them; None where a sweep is better."""
    n_boxes = len(boxes)
    extent = np.empty(n_boxes)
    _measure(boxes, extent)
    widest, widest_of_all = float(np.partition(extent, n_boxes - _LARGE - 1)[n_boxes - _LARGE - 1]), float(extent.max())
    if widest * 4.0 >= widest_of_all:  # all of like size: none is large
        widest = widest_of_all
    span = np.array([[np.inf] * 3, [-np.inf] * 3])
    _spread(boxes, extent, widest, span)
    least, most = span
    width = np.maximum(widest, (most - least) / (n_boxes ** (1.0 / dimension) * 2.0))
    width = width * _ENLARGED + 2.0**-52 * np.maximum(np.abs(least), np.abs(most)) * 4.0 + 2.0**-1000
    last = np.floor((most - least) / width)
    if not (np.isfinite(last).all() and np.isfinite(width).all()):
        return None
    counts = last.astype(np.int64) + 1
    cells, order = np.empty(n_boxes, np.int64), np.empty(n_boxes, np.int64)
    starts = np.zeros(int(counts.prod()) + 1, np.int64)
    if _sort_into_cells(boxes, extent, widest, least, width, counts, cells, order, starts) > _CROWD * n_boxes:
        return None
    return cells, counts, np.flatnonzero(extent > widest), order, starts


@kernel
def _measure(boxes: Any, extent: Any) -> None:
    """Fill extent (n,) with the largest side of each box, infinite where a bound is or the side overflows."""
    for box in range(boxes.shape[0]):
        side = 0.0
        for axis in range(3):
            side = max(side, boxes[box, 3 + axis] - boxes[box, axis])
            if not (np.isfinite(boxes[box, axis]) and np.isfinite(boxes[box, 3 + axis])):
                side = np.inf
        extent[box] = side


@kernel
def _spread(boxes: Any, extent: Any, widest: float, span: Any) -> None:
    """Fill span (2, 3) with the least and the greatest low corner of boxes that are not large."""
    for box in range(boxes.shape[0]):
        if extent[box] <= widest:
            for axis in range(3):
                span[0, axis] = min(span[0, axis], boxes[box, axis])
                span[1, axis] = max(span[1, axis], boxes[box, axis])


@kernel
def _sort_into_cells(
    boxes: Any, extent: Any, widest: float, least: Any, width: Any, counts: Any, cells: Any, order: Any, starts: Any
) -> int:
    """Fill cells (n,), order (boxes that are not large, by cell) and starts (n_cells + 1,), zeros before; return the
    sum of the squares of how many share a cell."""
    n_boxes, n_cells = boxes.shape[0], starts.shape[0] - 1
    for box in range(n_boxes):
        cells[box] = -1
        if extent[box] <= widest:
            cell = 0
            for axis in range(2, -1, -1):
                cell = cell * counts[axis] + int((boxes[box, axis] - least[axis]) / width[axis])
            cells[box] = cell
            starts[cell + 1] += 1
    n_sharing = 0
    for cell in range(n_cells):
        n_sharing += starts[cell + 1] * starts[cell + 1]
        starts[cell + 1] += starts[cell]
    filled = starts[:-1].copy()
    for box in range(n_boxes):
        cell = cells[box]
        if cell >= 0:
            order[filled[cell]] = box
            filled[cell] += 1
    return n_sharing


@inline
def _meet(boxes: Any, box: int, other: int) -> bool:
    """Tell whether two closed boxes have a common point; without branches, which would be guessed wrong."""
    return (
        (boxes[box, 0] <= boxes[other, 3])
        & (boxes[other, 0] <= boxes[box, 3])
        & (boxes[box, 1] <= boxes[other, 4])
        & (boxes[other, 1] <= boxes[box, 4])
        & (boxes[box, 2] <= boxes[other, 5])
        & (boxes[other, 2] <= boxes[box, 5])
    )


@kernel
def _collect(
    boxes: Any,
    cells: Any,
    counts: Any,
    large: Any,
    order: Any,
    starts: Any,
    start: int,
    enough: int,
    keys: Any,
    flag: Any,
) -> tuple[int, int]:
    """Write first * n + second of pairs with first >= start until `enough` are found; return number and next first."""
    n_boxes, n_found = boxes.shape[0], 0
    for box in range(start, n_boxes):
        if flag[0] != 0:
            return 0, n_boxes
        if n_found >= enough:
            return n_found, box
        cell = cells[box]
        if cell < 0:
            for other in range(box + 1, n_boxes):
                if _meet(boxes, box, other):
                    keys[n_found] = box * n_boxes + other
                    n_found += 1
            continue
        for item in range(large.shape[0]):
            other = large[item]
            if other > box and _meet(boxes, box, other):
                keys[n_found] = box * n_boxes + other
                n_found += 1
        x, row = cell % counts[0], cell // counts[0]
        y, z = row % counts[1], row // counts[1]
        for k in range(max(z - 1, 0), min(z + 2, counts[2])):
            for j in range(max(y - 1, 0), min(y + 2, counts[1])):
                line = (k * counts[1] + j) * counts[0]
                stop = starts[line + min(x + 2, counts[0])]
                for item in range(starts[line + max(x - 1, 0)], stop):
                    other = order[item]
                    if other > box and _meet(boxes, box, other):
                        keys[n_found] = box * n_boxes + other
                        n_found += 1
    return n_found, n_boxes
