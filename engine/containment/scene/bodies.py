"""Boxes of posed bodies, rounded outward: no point of a body lies outside its box."""

from __future__ import annotations

import numpy as np

from engine.arrays import FloatArray, Int32Array
from engine.bounding.posed_boxes import place_boxes
from engine.containment.posed.frames import Frames, frames_of
from engine.containment.rational_locate import Check, over_tree
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.csg import Csg
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.solids.triangle import Triangle

Box = tuple[FloatArray, FloatArray]


def moved_boxes(lows: FloatArray, highs: FloatArray, frames: Frames, rows: Int32Array) -> Box:
    """Return boxes (n, 3) around the images of finite boxes under poses, of each its row; -1 for none."""
    low, high, n = np.empty_like(lows), np.empty_like(highs), len(rows)
    boxes, moves = np.stack([lows, highs], axis=1), (frames.rotations, frames.translations)
    with np.errstate(all="ignore"):
        place_boxes(boxes, np.full(n, np.inf), np.zeros(n), np.arange(n), rows.astype(np.int64), *moves, low, high)
    return low, high


def grown_boxes(centers: FloatArray, reach: FloatArray) -> Box:
    """Return boxes (n, 3) around balls of a radius (n,), rounded outward."""
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
    low, high = own_box(solid, check)
    if np.isinf(low).any() or (pose is None and not isinstance(solid, Sphere)):
        return low, high
    lows, highs = np.zeros((1, 3)), np.zeros((1, 3))
    lows[0, : len(low)], highs[0, : len(high)] = low, high
    frames = frames_of([pose], len(low))
    lows, highs = moved_boxes(lows, highs, frames, frames.rows)
    if isinstance(solid, Sphere):  # its box was that of its centre
        lows = grown_boxes(lows, np.array([solid.radius]))[0]
        highs = grown_boxes(highs, np.array([solid.radius]))[1]
    return lows[0, : len(low)], highs[0, : len(high)]


def own_box(solid: Solid, check: Check) -> Box:
    """Return the box of a solid in its own frame, of a sphere that of its centre."""
    if isinstance(solid, Sphere):
        return solid.center, solid.center
    if isinstance(solid, Aabb):
        return solid.min, solid.max
    if isinstance(solid, (Polygon, Polyhedron)) or (isinstance(solid, Triangle) and solid.dimension == 2):
        vertices = solid.vertices
        return solid.prepared("vertex_box", lambda: (vertices.min(axis=0), vertices.max(axis=0)), check)
    return np.full(solid.dimension, -np.inf), np.full(solid.dimension, np.inf)


def _csg_box(operation: str, boxes: list[Box]) -> Box:
    """Return the box of a Boolean tree; an intersection that is empty keeps a box that holds nothing."""
    lows, highs = (np.array(sides) for sides in zip(*(boxes[:1] if operation == "difference" else boxes)))
    if operation == "union":
        return lows.min(axis=0), highs.max(axis=0)
    return lows.max(axis=0), highs.min(axis=0)
