"""Points of space as the textbook writes them: difference, scalar product, cross product, in plain float64."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from engine.jit import inline
from engine.types import Point3

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


@inline
def minus(a: Point3, b: Point3) -> Point3:
    """Return a - b."""
    return Point3(a.x - b.x, a.y - b.y, a.z - b.z)


@inline
def dot(a: Point3, b: Point3) -> float:
    """Return the scalar product."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@inline
def cross(a: Point3, b: Point3) -> Point3:
    """Return the cross product."""
    return Point3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@inline
def along(a: Point3, b: Point3, t: float) -> Point3:
    """Return a + t (b - a)."""
    return Point3(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z))
