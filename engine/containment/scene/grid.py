"""Broad phase of a scene: the boxes of bodies listed by the cells of a grid over all of them.

The cells are those of bounding/grid.py, along two axes or three: conservative by monotone steps. The bodies of a cell
are listed in ascending order.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import FloatArray, Int32Array, IntArray
from engine.bounding.grid import Axis, cell_of, make_axis
from engine.jit import inline, kernel

_CELLS_A_BOX: Final = 8.0
_ENTRIES_A_BOX: Final = 48
"""Entries a box (and 64 more) above which the cells are made larger."""
_MOST_ALONG: Final = 1024


class SceneGrid(NamedTuple):
    """Bodies by cell: those of cell (u, v, w) are ``items[offsets[k]:offsets[k + 1]]``, k = (w * nv + v) * nu + u."""

    u: Axis
    v: Axis
    w: Axis
    offsets: IntArray
    items: Int32Array


@inline
def _place(value: float, axis: Any) -> int:
    return cell_of(value, axis.low, axis.cells_per_unit, axis.n_cells)


@inline
def cell_at(x: float, y: float, z: float, u: Any, v: Any, w: Any) -> int:
    """Return the cell of a point, -1 beside the grid."""
    if (x < u.low) | (x > u.high) | (y < v.low) | (y > v.high) | (z < w.low) | (z > w.high):
        return -1
    return (_place(z, w) * v.n_cells + _place(y, v)) * u.n_cells + _place(x, u)


@kernel
def list_boxes(
    bodies: Any, lows: Any, highs: Any, u: Any, v: Any, w: Any, ends: Any, items: Any, is_fill: bool
) -> None:
    """Count (ends[cell] += 1) or list (items[ends[cell]] = body) the bodies whose boxes reach into each cell.

    lows, highs: (n_bodies, 3).
    """
    for place in range(len(bodies)):
        body = bodies[place]
        first, last = _place(lows[body, 0], u), _place(highs[body, 0], u)
        for layer in range(_place(lows[body, 2], w), _place(highs[body, 2], w) + 1):
            for row in range(_place(lows[body, 1], v), _place(highs[body, 1], v) + 1):
                for column in range(first, last + 1):
                    cell = (layer * v.n_cells + row) * u.n_cells + column
                    if is_fill:
                        items[ends[cell]] = body
                    ends[cell] += 1


def build_scene_grid(bodies: IntArray, lows: FloatArray, highs: FloatArray) -> SceneGrid:
    """List `bodies`, ascending, by the cells of a grid; lows, highs: (n_bodies, 3), flat in a scene of the plane.

    The cells are halved in number, along the axis with most of them, until the entries are few: long boxes cannot fill
    the memory.
    """
    if not len(bodies):
        nothing = Axis(np.inf, -np.inf, 0.0, 1)
        return SceneGrid(nothing, nothing, nothing, np.zeros(2, np.int64), np.zeros(0, np.int32))
    low, high = lows[bodies], highs[bodies]
    least, most = low.min(axis=0), high.max(axis=0)
    n_cells = _cells_along((most * 0.5 - least * 0.5).tolist(), _CELLS_A_BOX * len(bodies))
    limit = _ENTRIES_A_BOX * len(bodies) + 64
    while True:  # bound: every turn halves a number of cells, and one cell lists each box once
        axes = [make_axis(float(least[k]), float(most[k]), n_cells[k]) for k in range(3)]
        reach = [(high[:, k] * 0.5 - low[:, k] * 0.5) * axes[k].cells_per_unit + 1.0 for k in range(3)]
        if max(n_cells) == 1 or float((reach[0] * reach[1] * reach[2]).sum()) <= limit:
            break
        longest = n_cells.index(max(n_cells))
        n_cells[longest] = (n_cells[longest] + 1) // 2
    u, v, w = axes
    counts = np.zeros(u.n_cells * v.n_cells * w.n_cells, np.int64)
    list_boxes(bodies, lows, highs, u, v, w, counts, np.empty(0, np.int32), False)
    offsets = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=offsets[1:])
    items = np.empty(int(offsets[-1]), np.int32)
    list_boxes(bodies, lows, highs, u, v, w, offsets[:-1].copy(), items, True)
    return SceneGrid(u, v, w, offsets, items)


def _cells_along(extent: list[float], n_cells: float) -> list[int]:
    """Return numbers of cells along the axes, about `n_cells` in all, in proportion to the extents."""
    along = [1, 1, 1]
    axes = [k for k in sorted(range(3), key=extent.__getitem__) if extent[k] > 0.0]
    left = n_cells
    for turn, k in enumerate(axes):  # the shortest first: what it does not need the others share
        others = axes[turn:]
        ratio = 1.0
        for other in others:
            ratio *= min(extent[other] / extent[k], 1e9)
        along[k] = max(1, min(_MOST_ALONG, int((left / ratio) ** (1.0 / len(others)))))
        left = max(1.0, left / along[k])
    return along
