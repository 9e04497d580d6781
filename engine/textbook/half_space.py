"""Point in a half-space, and clipping points on it: dot(n, p) + d >= 0, the normal pointing inward.

Source: section 22.4.1 and 22.4.2 of the chapter on computer graphics in Algorithms of Informatics.
What goes wrong: a point within a few units in the last place of the plane gets either answer.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.arrays import BoolArray, FloatArray
from engine.jit import inline, kernel


@inline
def signed_distance(point: Any, normal: Any, offset: float) -> float:
    """Return dot(normal, point) + offset: a distance up to the length of the normal."""
    total = 0.0
    for k in range(len(normal)):
        total += normal[k] * point[k]
    return total + offset


@kernel
def contains(points: FloatArray, normal: FloatArray, offset: float) -> BoolArray:
    """Tell of each point (n, dim) whether it is in the half-space."""
    contained = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        contained[i] = signed_distance(points[i], normal, offset) >= 0.0
    return contained


def clip_points(points: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
    """Return the points that the half-space holds: each is either removed or preserved."""
    kept: FloatArray = points[contains(points, normal, offset)]
    return kept
