"""Boxes around single bodies, rounded outward: of those whose box is not that of the solid moved."""

from __future__ import annotations

import numpy as np

from engine.arrays import FloatArray
from engine.containment.methods.frames import frames_of
from engine.containment.methods.rational_locate import Check, over_tree
from engine.scenes.located import moved_boxes
from engine.solids.base import Solid
from engine.solids.csg import Csg
from engine.solids.pose import Pose
from engine.solids.registry import own_box
from engine.solids.sphere import Sphere

Box = tuple[FloatArray, FloatArray]


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
    if np.isinf(low).any():
        return low, high
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
