"""Orders points by the cell of level 0, so that points that read the same lists come one after another.

Near the surface of a large mesh nearly every point reads entries from memory; in order, most of them are in the cache.
A counting sort costs some 20 ns a point, and pays only where many points reach lists that do not fit the cache.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.containment.cells.build import Cells
from engine.jit import kernel
from engine.running.budget import Budget

_FEWEST_POINTS: Final = 1 << 17
_FEWEST_GROUPS: Final = 1 << 14
"""Of 448 bytes each: 7 MB, more than a core's cache."""
_SAMPLE: Final = 2048
_SHARE: Final = 0.4
"""Share of points in cells with lists from which ordering pays."""


@kernel
def top_cells(points: Any, cells: Any, keys: Any, flag: Any) -> int:
    """Fill keys (n,) int32 with each point's cell of level 0, the last one for points beyond.

    Returns how many of the cells have lists.
    """
    low, scale, n = cells.lattice.low, cells.lattice.scale, cells.lattice.n
    x_end, y_end, z_end, n_listed = float(n[0]), float(n[1]), float(n[2]), 0
    for item in range(len(points)):
        if item & 4095 == 0 and flag[0]:
            break
        key, x = n[0] * n[1] * n[2], (points[item, 0] - low[0]) * scale[0]
        y, z = (points[item, 1] - low[1]) * scale[1], (points[item, 2] - low[2]) * scale[2]
        if (x >= 0.0) & (y >= 0.0) & (z >= 0.0) & (x < x_end) & (y < y_end) & (z < z_end):
            key = (int(z) * n[1] + int(y)) * n[0] + int(x)
            n_listed += cells.codes[key] >= 0
        keys[item] = key
    return n_listed


@kernel
def counting_sort(keys: Any, ends: Any, order: Any, flag: Any) -> None:
    """Fill order with the positions of keys (n,) by rising key; ends holds each key's first place and is moved on."""
    for item in range(len(keys)):
        if item & 4095 == 0 and flag[0]:
            break
        order[ends[keys[item]]] = item
        ends[keys[item]] += 1


def order_if_it_pays(points: FloatArray, cells: Cells, budget: Budget) -> IntArray | None:
    """Return an order of the points that keeps memory near, None where it would cost more than it saves."""
    if len(points) < _FEWEST_POINTS or len(cells.groups) < _FEWEST_GROUPS:
        return None
    sample = points[:: len(points) // _SAMPLE].copy()
    sample.setflags(write=False)  # as the points themselves: one kind of array for the compiler
    if top_cells(sample, cells, np.empty(len(sample), np.int32), budget.flag) < _SHARE * len(sample):
        return None
    return order_by_cell(points, cells, budget)


def order_by_cell(points: FloatArray, cells: Cells, budget: Budget) -> IntArray:
    """Return the order of points (n, 3), read-only, by their cells of level 0, equal ones as they stand."""
    nx, ny, nz = cells.lattice.n
    keys, order = np.empty(len(points), np.int32), np.empty(len(points), np.int64)
    top_cells(points, cells, keys, budget.flag)
    budget.check()
    counts = np.bincount(keys, minlength=nx * ny * nz + 1)
    counting_sort(keys, np.cumsum(counts) - counts, order, budget.flag)
    budget.check()
    return order


def gathered(points: FloatArray, places: IntArray) -> FloatArray:
    """Return the rows of points (n, 3) at `places`, read-only."""
    return read_only(points.take(places, axis=0, mode="clip"))
