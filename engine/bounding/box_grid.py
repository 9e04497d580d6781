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
    grid = _grid_of(low, high) if len(low) >= _FEWEST else None
    if grid is None:
        yield from meeting_boxes(low, high, flag, block)
        return
    cells, counts, large = grid
    low, high = np.ascontiguousarray(low), np.ascontiguousarray(high)
    sizes = np.append(counts, np.ones(3 - len(counts), np.int64))
    order = np.argsort(cells, kind="stable")
    starts = np.searchsorted(cells[order], np.arange(int(counts.prod()) + 1))
    start, n_boxes = 0, len(low)
    room = max(block, 1) + n_boxes  # one box meets fewer others than there are
    keys = np.empty(room, np.int64)
    while start < n_boxes:  # bound: start grows
        n_found, start = _collect(low, high, cells, sizes, order, starts, large, start, max(block, 1), keys, flag)
        found = np.sort(keys[:n_found])
        if n_found:
            yield np.stack([found // n_boxes, found % n_boxes], axis=1)


def _grid_of(low: FloatArray, high: FloatArray) -> tuple[IntArray, IntArray, IntArray] | None:
    """Return the cell of each box (-1: large), the number of cells on each axis, the large ones; None: better swept."""
    n_boxes = len(low)
    with np.errstate(all="ignore"):
        extent = (high - low).max(axis=1)
        extent[~np.isfinite(extent) | ~np.isfinite(low).all(axis=1)] = np.inf
        large = np.sort(np.argpartition(extent, n_boxes - _LARGE)[n_boxes - _LARGE :])
        is_large = np.zeros(n_boxes, np.bool_)
        is_large[large] = True
        least, most = low[~is_large].min(axis=0), low[~is_large].max(axis=0)
        widest = float(extent[~is_large].max())
        if widest * 4.0 >= float(extent[large].max()):  # all of like size: none is large
            widest, is_large[:], large = float(extent.max()), False, large[:0]
            least, most = low.min(axis=0), low.max(axis=0)
        width = np.maximum(widest, (most - least) / (n_boxes ** (1.0 / low.shape[1]) * 2.0))
        width = width * _ENLARGED + 2.0**-52 * np.maximum(np.abs(least), np.abs(most)) * 4.0 + 2.0**-1000
        places = np.floor((low - least) / width)
        if not (np.isfinite(places[~is_large]).all() and np.isfinite(width).all()):
            return None
    places[is_large] = 0.0
    steps = places.astype(np.int64)
    counts = steps.max(axis=0) + 1
    cells = steps[:, 0].copy()
    for axis in range(1, low.shape[1]):
        cells = cells + steps[:, axis] * int(counts[:axis].prod())
    fullness = np.bincount(cells[~is_large], minlength=1).astype(np.float64)
    if float((fullness**2).sum()) > _CROWD * n_boxes:
        return None
    cells[is_large] = -1
    return cells, counts, large


@inline
def _meet(low: Any, high: Any, box: int, other: int) -> bool:
    """Tell whether two closed boxes have a common point."""
    for axis in range(low.shape[1]):
        if low[other, axis] > high[box, axis] or low[box, axis] > high[other, axis]:
            return False
    return True


@kernel
def _collect(
    low: Any,
    high: Any,
    cells: Any,
    counts: Any,
    order: Any,
    starts: Any,
    large: Any,
    start: int,
    enough: int,
    keys: Any,
    flag: Any,
) -> tuple[int, int]:
    """Write first * n + second of pairs with first >= start until `enough` are found; return number and next first.

    counts (3,): cells on each axis; order: boxes by cell; starts (n_cells + 1,) from the first that is not large.
    """
    n_boxes, n_found = low.shape[0], 0
    for box in range(start, n_boxes):
        if flag[0] != 0:
            return 0, n_boxes
        if n_found >= enough:
            return n_found, box
        cell = cells[box]
        if cell < 0:
            for other in range(box + 1, n_boxes):
                if _meet(low, high, box, other):
                    keys[n_found] = box * n_boxes + other
                    n_found += 1
            continue
        for item in range(large.shape[0]):
            other = large[item]
            if other > box and _meet(low, high, box, other):
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
                    if other > box and _meet(low, high, box, other):
                        keys[n_found] = box * n_boxes + other
                        n_found += 1
    return n_found, n_boxes
