"""Point in a convex polygon: add the angles under which its edges are seen from the point.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics: "if the sum is 360 degrees,
then the point is inside, otherwise it is outside."
Two readings. `contains_signed` adds angles with their sign: the sum is a full turn inside and 0 outside, so comparing
it with half a turn leaves room for every rounding error. `contains_unsigned` is the textbook's sum: inside it is a full
turn, outside less, but just outside an edge it is as close to a full turn as one likes, and no float sum equals 360
degrees; so it needs a tolerance, which calls points within some distance of the boundary inside.
What goes wrong: twelve times slower than sides, and on an edge the angle is half a turn of either sign.
"""

from __future__ import annotations

from math import acos, atan2, hypot, pi
from typing import Any

import numpy as np

from engine.arrays import BoolArray, FloatArray
from engine.jit import inline, kernel


@inline
def signed_angle(ux: float, uy: float, vx: float, vy: float) -> float:
    """Return the angle from u to v in (-pi, pi]."""
    return atan2(ux * vy - uy * vx, ux * vx + uy * vy)


@inline
def unsigned_angle(ux: float, uy: float, vx: float, vy: float) -> float:
    """Return the angle between u and v in [0, pi], by the scalar product; pi where one of them is zero."""
    size = hypot(ux, uy) * hypot(vx, vy)
    if size == 0.0:
        return pi
    return acos(min(1.0, max(-1.0, (ux * vx + uy * vy) / size)))


@kernel
def contains_signed(points: FloatArray, vertices: FloatArray) -> BoolArray:
    """Tell of each point (n, 2) whether the signed sum exceeds half a turn in size."""
    contained = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        total = 0.0
        for j in range(len(vertices)):
            u, v = vertices[j - 1] - points[i], vertices[j] - points[i]
            total += signed_angle(u[0], u[1], v[0], v[1])
        contained[i] = abs(total) > pi
    return contained


@kernel
def contains_unsigned(points: FloatArray, vertices: FloatArray, tolerance: Any) -> BoolArray:
    """Tell of each point (n, 2) whether the unsigned sum is at least a full turn less `tolerance` (radians)."""
    contained = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        total = 0.0
        for j in range(len(vertices)):
            u, v = vertices[j - 1] - points[i], vertices[j] - points[i]
            total += unsigned_angle(u[0], u[1], v[0], v[1])
        contained[i] = total >= 2.0 * pi - tolerance
    return contained
