"""Vectors of space in kernels: of floats, or of eight lanes of them."""

from __future__ import annotations

import numpy as np

from engine.jit import merged
from engine.types import Point3


@merged
def minus(a: Point3, b: Point3) -> Point3:
    """Return a - b."""
    return Point3(a.x - b.x, a.y - b.y, a.z - b.z)


@merged
def negative(a: Point3) -> Point3:
    """Return -a."""
    return Point3(-a.x, -a.y, -a.z)


@merged
def dot(a: Point3, b: Point3) -> float:
    """Return a . b."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@merged
def cross(a: Point3, b: Point3) -> Point3:
    """Return a x b."""
    return Point3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@merged
def length(a: Point3) -> float:
    """Return |a|."""
    return float(np.sqrt(dot(a, a)))


@merged
def largest_of(a: Point3) -> float:
    """Return the largest magnitude of a component."""
    return max(abs(a.x), abs(a.y), abs(a.z))


@merged
def along(a: Point3, b: Point3, t: float) -> Point3:
    """Return a + t (b - a)."""
    return Point3(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z))
