"""Boxes of posed bodies, rounded outward: no point of a body lies outside its box."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.arrays import BoolArray, FloatArray, Int32Array
from engine.containment.rational_locate import Check
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.csg import Csg
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.solids.triangle import Triangle

Box = tuple[FloatArray, FloatArray]

_SLACK: Final = 16.0 * 2.0**-53
"""Bound, in terms of the sizes summed, on the roundings of three products, three sums and the widening itself."""
_TINY: Final = 1e-320


class Frames(NamedTuple):
    """The poses of many bodies; those of the plane in the upper left."""

    rows: Int32Array
    """Row of each body's pose in what follows, -1 for a body that stays where it is."""
    rotations: FloatArray
    """``(n, 3, 3)``."""
    inverses: FloatArray
    """``(n, 3, 3)``: each entry off by less than 32 units of rounding (posed/body_frame.py)."""
    translations: FloatArray
    is_turn: BoolArray
    """Whether a rotation only turns the axes onto each other."""


def frames_of(poses: list[Pose | None], dimension: int) -> Frames:
    """Return the poses that move something, with their inverses."""
    given = [(body, pose) for body, pose in enumerate(poses) if pose is not None]
    rotations, translations = np.zeros((len(given), 3, 3)), np.zeros((len(given), 3))
    rotations[:, 2, 2] = 1.0
    rows = np.full(len(poses), -1, np.int32)
    if not given:
        return Frames(rows, rotations, rotations, translations, np.zeros(0, np.bool_))
    rotations[:, :dimension, :dimension] = [pose.rotation for _, pose in given]
    translations[:, :dimension] = [pose.translation for _, pose in given]
    is_moved = translations.any(axis=1) | (rotations != np.eye(3)).any(axis=(1, 2))
    rotations, translations = rotations[is_moved], np.ascontiguousarray(translations[is_moved])
    rows[np.array([body for body, _ in given])[is_moved]] = np.arange(len(rotations))
    return Frames(rows, rotations, _inverses(rotations), translations, _is_turn(rotations))


def _is_turn(rotations: FloatArray) -> BoolArray:
    is_unit = np.isin(rotations, (-1.0, 0.0, 1.0)).all(axis=(1, 2))
    found: BoolArray = is_unit & (np.abs(rotations).sum(axis=1) == 1.0).all(axis=1)
    return found


def _inverses(rotations: FloatArray) -> FloatArray:
    """Return adj(R) / det(R) of (n, 3, 3) matrices; exact for quarter turns."""
    after = (1, 2, 0)
    adjugates = np.empty_like(rotations)
    for i in range(3):
        for j in range(3):
            r, s, p, q = after[j], after[after[j]], after[i], after[after[i]]
            adjugates[:, i, j] = rotations[:, r, p] * rotations[:, s, q] - rotations[:, s, p] * rotations[:, r, q]
    determinants = (rotations[:, 0, :] * adjugates[:, :, 0]).sum(axis=1)
    return np.ascontiguousarray(adjugates / determinants[:, None, None]) + 0.0


def moved_boxes(lows: FloatArray, highs: FloatArray, frames: Frames, rows: Int32Array) -> Box:
    """Return boxes (n, 3) around the images of finite boxes under poses: least and largest sums over the axes.

    Infinite where the sums are out of range.
    """
    rotations, translations = frames.rotations[rows], frames.translations[rows]
    with np.errstate(over="ignore", invalid="ignore"):
        at_low, at_high = rotations * lows[:, None, :], rotations * highs[:, None, :]
        least = np.minimum(at_low, at_high).sum(axis=2) + translations
        most = np.maximum(at_low, at_high).sum(axis=2) + translations
        size = np.maximum(np.abs(at_low), np.abs(at_high)).sum(axis=2) + np.abs(translations)
        margin = _SLACK * size + _TINY
        least, most = least - margin, most + margin
    is_out = ~(np.isfinite(least).all(axis=1) & np.isfinite(most).all(axis=1))
    least[is_out], most[is_out] = -np.inf, np.inf
    return least, most


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
        return _csg_box(solid, pose, check, {})
    low, high = own_box(solid, check)
    if np.isinf(low).any() or (pose is None and not isinstance(solid, Sphere)):
        return low, high
    lows, highs = np.zeros((1, 3)), np.zeros((1, 3))
    lows[0, : len(low)], highs[0, : len(high)] = low, high
    if pose is not None:
        frames = frames_of([pose], len(low))
        if frames.rows[0] >= 0:
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


def _csg_box(solid: Csg, pose: Pose | None, check: Check, known: dict[int, Box]) -> Box:
    """Return the box of a Boolean tree; an intersection that is empty keeps a box that holds nothing."""
    if id(solid) in known:
        return known[id(solid)]
    boxes = [
        _csg_box(operand, pose, check, known) if isinstance(operand, Csg) else body_box(operand, pose, check)
        for operand in (solid.operands[:1] if solid.operation == "difference" else solid.operands)
    ]
    lows, highs = np.array([box[0] for box in boxes]), np.array([box[1] for box in boxes])
    if solid.operation == "union":
        known[id(solid)] = lows.min(axis=0), highs.max(axis=0)
    else:
        known[id(solid)] = lows.max(axis=0), highs.min(axis=0)
    return known[id(solid)]
