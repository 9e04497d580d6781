"""The poses of many bodies side by side, with their inverses; moves points into a posed solid's own frame, with a bound
on how far off each may be.

The exact preimage of q is R^-1 (q - t). Floating point gives adj(R) (q - t) / det(R): a pose's entries are at most 1
and its determinant 1, up to 1e-11, so an entry of the inverse is off by less than 32 u (u = 2^-53), and with the
roundings of the difference, the products and the sums a coordinate is off by less than 48 u sum |q - t|. The `blur`
of a point is more than twice that: adding it to a coordinate, or taking it off, in floating point leaves a true
bound. From 2^1021 on, where a coordinate may overflow that should not, the blur is infinite, and nothing is sure.

Where R only turns the axes onto each other and every difference is exact, so is the preimage, and the blur is 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import BoolArray, FloatArray, Int32Array
from engine.compiling.jit import inline, kernel
from engine.containment.methods.filters import in_space
from engine.predicates.error_free import two_diff
from engine.solids.pose import Pose


class Frames(NamedTuple):
    """The poses of many bodies; those of the plane in the upper left."""

    rows: Int32Array
    """Row of each body's pose in what follows, -1 for a body that stays where it is."""
    rotations: FloatArray
    """``(n, 3, 3)``."""
    inverses: FloatArray
    """``(n, 3, 3)``: each entry off by less than 32 units of rounding."""
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


_BLUR: Final = 16.0 * 2.0**-53
"""Of eight times the differences: these overflow before a coordinate does."""
_TINY: Final = 1e-320


@inline
def to_frame(frames: Frames, frame: int, p: tuple[float, ...]) -> Any:
    """Return a point (x, y, z) in the frame of a pose, and its blur: 0.0 where it is exact.

    frames: has inverses (n, 3, 3) of R^-1 rounded, translations (n, 3) and is_turn (n,): whether the entries are
    exactly -1, 0 and 1. frame: which of them, -1 for none.
    """
    if frame < 0:
        return p, 0.0
    inverses, translations = frames.inverses, frames.translations
    dx, x_tail = two_diff(p[0], float(translations[frame, 0]))
    dy, y_tail = two_diff(p[1], float(translations[frame, 1]))
    dz, z_tail = two_diff(p[2], float(translations[frame, 2]))
    x = inverses[frame, 0, 0] * dx + inverses[frame, 0, 1] * dy + inverses[frame, 0, 2] * dz
    y = inverses[frame, 1, 0] * dx + inverses[frame, 1, 1] * dy + inverses[frame, 1, 2] * dz
    z = inverses[frame, 2, 0] * dx + inverses[frame, 2, 1] * dy + inverses[frame, 2, 2] * dz
    if frames.is_turn[frame] and x_tail == 0.0 and y_tail == 0.0 and z_tail == 0.0:
        return (x, y, z), 0.0
    return (x, y, z), _BLUR * (8.0 * abs(dx) + 8.0 * abs(dy) + 8.0 * abs(dz)) + _TINY


@kernel
def move_to_body_frame(points: FloatArray, frames: Frames, moved: FloatArray, blurs: FloatArray) -> None:
    """Fill moved (n, dim) and blurs (n,) by the only one of `frames`."""
    for item in range(len(points)):
        p, blurs[item] = to_frame(frames, 0, in_space(points, item))
        moved[item, 0], moved[item, 1] = p[0], p[1]
        if points.shape[1] == 3:
            moved[item, 2] = p[2]
