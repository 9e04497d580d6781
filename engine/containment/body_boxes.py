"""Boxes of posed bodies, rounded outward: no point of a body lies outside its box."""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.containment.posed import posed_center
from engine.solids.aabb import Aabb
from engine.solids.base import FloatArray, Solid
from engine.solids.csg import Csg
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.solids.triangle import Triangle

Box = tuple[FloatArray, FloatArray]

_SLACK: Final = 16.0 * 2.0**-53
"""Bound, in terms of the sizes summed, on the roundings of three products, three sums and the widening itself."""


def body_box(solid: Solid, pose: Pose | None) -> Box:
    """Return low, high (dim,) around a body; infinite for one that may have no bounds (half-spaces and the like)."""
    if pose is not None and pose.is_identity:
        pose = None
    if isinstance(solid, Csg):
        return _csg_box(solid, pose, {})
    if isinstance(solid, Sphere):
        center, blur = (solid.center, 0.0) if pose is None else posed_center(solid, pose)
        with np.errstate(over="ignore"):
            low, high = center - (solid.radius + blur), center + (solid.radius + blur)
            return np.nextafter(np.nextafter(low, -np.inf), -np.inf), np.nextafter(np.nextafter(high, np.inf), np.inf)
    low, high = _own_box(solid)
    return (low, high) if pose is None else _posed_box(low, high, pose)


def _own_box(solid: Solid) -> Box:
    if isinstance(solid, Aabb):
        return solid.min, solid.max
    if isinstance(solid, (Polygon, Polyhedron)) or (isinstance(solid, Triangle) and solid.dimension == 2):
        vertices = solid.vertices
        return solid.prepared("vertex_box", lambda: (vertices.min(axis=0), vertices.max(axis=0)))
    return np.full(solid.dimension, -np.inf), np.full(solid.dimension, np.inf)


def _posed_box(low: FloatArray, high: FloatArray, pose: Pose) -> Box:
    """Return a box around the image of a box: each coordinate's least and largest sum over the axes."""
    if np.isinf(low).any():
        return low, high
    with np.errstate(over="ignore", invalid="ignore"):
        at_low, at_high = pose.rotation * low, pose.rotation * high
        least = np.minimum(at_low, at_high).sum(axis=1) + pose.translation
        most = np.maximum(at_low, at_high).sum(axis=1) + pose.translation
        size = np.maximum(np.abs(at_low), np.abs(at_high)).sum(axis=1) + np.abs(pose.translation)
        margin = _SLACK * size + 1e-320
        least, most = least - margin, most + margin
    least[np.isnan(least)], most[np.isnan(most)] = -np.inf, np.inf
    return least, most


def _csg_box(solid: Csg, pose: Pose | None, known: dict[int, Box]) -> Box:
    """Return the box of a Boolean tree; an intersection that is empty keeps a box that holds nothing."""
    if id(solid) in known:
        return known[id(solid)]
    boxes = [
        _csg_box(operand, pose, known) if isinstance(operand, Csg) else body_box(operand, pose)
        for operand in (solid.operands[:1] if solid.operation == "difference" else solid.operands)
    ]
    lows, highs = np.array([box[0] for box in boxes]), np.array([box[1] for box in boxes])
    if solid.operation == "union":
        known[id(solid)] = lows.min(axis=0), highs.max(axis=0)
    else:
        known[id(solid)] = lows.max(axis=0), highs.min(axis=0)
    return known[id(solid)]
