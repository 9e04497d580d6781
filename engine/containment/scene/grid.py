"""Broad phase of a scene: boxes of posed bodies, rounded outward, so that no point of a body lies outside its box, and
these boxes listed by the cells of a grid over all of them.

The cells are those of bounding/grid.py, along two axes or three: conservative by monotone steps. The bodies of a cell
are listed in ascending order.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import FloatArray, Int32Array, IntArray
from engine.bounding.aabb import place_boxes
from engine.bounding.grid import Axis, cell_of, list_in_cells
from engine.containment.posed.frames import Frames, frames_of
from engine.containment.rational_locate import Check, over_tree
from engine.jit import inline
from engine.solids.base import Solid
from engine.solids.bounds import own_box
from engine.solids.csg import Csg
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.solids.triangle import Triangle

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
def cell_at(p: Any, grid: Any) -> int:
    """Return the cell of a point (x, y, z), -1 beside the grid."""
    (x, y, z), u, v, w = p, grid.u, grid.v, grid.w
    if (x < u.low) | (x > u.high) | (y < v.low) | (y > v.high) | (z < w.low) | (z > w.high):
        return -1
    return (_place(z, w) * v.n_cells + _place(y, v)) * u.n_cells + _place(x, u)


def build_scene_grid(bodies: IntArray, lows: FloatArray, highs: FloatArray) -> SceneGrid:
    """List `bodies`, ascending, by the cells of a grid; lows, highs: (n_bodies, 3), flat in a scene of the plane."""
    if not len(bodies):
        nothing = Axis(np.inf, -np.inf, 0.0, 1)
        return SceneGrid(nothing, nothing, nothing, np.zeros(2, np.int64), np.zeros(0, np.int32))
    low, high = lows[bodies].T, highs[bodies].T
    extent = high.max(axis=1) * 0.5 - low.min(axis=1) * 0.5
    n_cells = _cells_along(extent.tolist(), _CELLS_A_BOX * len(bodies))
    limit = _ENTRIES_A_BOX * len(bodies) + 64
    (u, v, w), offsets, items = list_in_cells(list(low), list(high), n_cells, limit, lambda: None)
    return SceneGrid(u, v, w, offsets, bodies[items].astype(np.int32))


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


Box = tuple[FloatArray, FloatArray]


def moved_boxes(lows: FloatArray, highs: FloatArray, frames: Frames, rows: Int32Array) -> Box:
    """Return boxes (n, 2 or 3) around the images of finite boxes under poses, of each its row; -1 for none."""
    low, high, n = np.empty_like(lows), np.empty_like(highs), len(rows)
    boxes, moves = np.stack([lows, highs], axis=1), (frames.rotations, frames.translations)
    with np.errstate(all="ignore"):
        place_boxes(boxes, np.full(n, np.inf), np.zeros(n), np.arange(n), rows.astype(np.int64), *moves, low, high)
    return low, high


def grown_boxes(centers: FloatArray, reach: FloatArray) -> Box:
    """Return boxes (n, 2 or 3) around balls of a radius (n,), rounded outward."""
    with np.errstate(over="ignore"):
        low, high = centers - reach[:, None], centers + reach[:, None]
        return np.nextafter(np.nextafter(low, -np.inf), -np.inf), np.nextafter(np.nextafter(high, np.inf), np.inf)


def body_box(solid: Solid, pose: Pose | None, check: Check) -> Box:
    """Return low, high (dim,) around a body; infinite for one that may have no bounds (half-spaces and the like).

    check: as for `Solid.prepared`.
    """
    if isinstance(solid, Csg):
        found: Box = over_tree(solid, lambda leaf: body_box(leaf, pose, check), _csg_box)
        return found
    low, high, _ = own_box(solid, check)
    if np.isinf(low).any() or (isinstance(solid, Triangle) and solid.dimension == 3):  # a prism
        return np.full(solid.dimension, -np.inf), np.full(solid.dimension, np.inf)
    frames = frames_of([pose], len(low))
    lows, highs = moved_boxes(low[None], high[None], frames, frames.rows)
    if isinstance(solid, Sphere):  # its box was that of its centre
        reach = np.array([solid.radius])
        lows, highs = grown_boxes(lows, reach)[0], grown_boxes(highs, reach)[1]
    return lows[0], highs[0]


def _csg_box(operation: str, boxes: list[Box]) -> Box:
    """Return the box of a Boolean tree; an intersection that is empty keeps a box that holds nothing."""
    lows, highs = (np.array(sides) for sides in zip(*(boxes[:1] if operation == "difference" else boxes)))
    if operation == "union":
        return lows.min(axis=0), highs.max(axis=0)
    return lows.max(axis=0), highs.min(axis=0)
