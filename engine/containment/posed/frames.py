"""The poses of many bodies side by side, with their inverses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from engine.arrays import BoolArray, FloatArray, Int32Array
from engine.solids.pose import Pose


class Frames(NamedTuple):
    """The poses of many bodies; those of the plane in the upper left."""

    rows: Int32Array
    """Row of each body's pose in what follows, -1 for a body that stays where it is."""
    rotations: FloatArray
    """``(n, 3, 3)``."""
    inverses: FloatArray
    """``(n, 3, 3)``: each entry off by less than 32 units of rounding (body_frame.py)."""
    translations: FloatArray
    is_turn: BoolArray
    """Whether a rotation only turns the axes onto each other."""


def frames_of(poses: Sequence[Pose | None], dimension: int) -> Frames:
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
    sizes = np.abs(rotations)
    is_turn = ((sizes == 0.0) | (sizes == 1.0)).all(axis=(1, 2)) & (sizes.sum(axis=1) == 1.0).all(axis=1)
    return Frames(rows, rotations, _inverses(rotations), translations, is_turn)


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
