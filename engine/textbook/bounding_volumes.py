"""Bounding box and bounding sphere of a polyhedron, and whether two of them meet.

Source: section 22.4.1 (bounding volumes) and exercise 22.4-4 of the chapter on computer graphics in Algorithms of
Informatics. The sphere is that of J. Ritter, An efficient bounding sphere, Graphics Gems, 1990: the farthest of the
farthest span a first sphere, which grows for every vertex still outside.
What goes wrong: Ritter's sphere is some 5 to 20 % too large, and rounding may leave a vertex just outside.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from engine.arrays import FloatArray
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3
from engine.predicates.vectors import along, dot, minus
from engine.types import Point3


@inline
def distance(a: Point3, b: Point3) -> float:
    """Return |a - b|."""
    return sqrt(dot(minus(a, b), minus(a, b)))


@inline
def farthest(vertices: FloatArray, start: Point3) -> Point3:
    """Return the vertex farthest from `start`."""
    best, at = -1.0, start
    for i in range(len(vertices)):
        d = distance(as_point3(vertices, i), start)
        if d > best:
            best, at = d, as_point3(vertices, i)
    return at


@kernel
def bounding_sphere(vertices: FloatArray) -> tuple[FloatArray, float]:
    """Return centre (3,) and radius of Ritter's sphere around vertices (n, 3)."""
    p = farthest(vertices, as_point3(vertices, 0))
    q = farthest(vertices, p)
    center, radius = along(p, q, 0.5), 0.5 * distance(p, q)
    for i in range(len(vertices)):
        v = as_point3(vertices, i)
        d = distance(center, v)
        if d > radius:
            center = along(center, v, 0.5 * (d - radius) / d)
            radius = 0.5 * (d + radius)
    return np.array([center.x, center.y, center.z]), radius


def boxes_meet(low: FloatArray, high: FloatArray, other_low: FloatArray, other_high: FloatArray) -> bool:
    """Tell whether two closed boxes have a common point."""
    return bool((low <= other_high).all() and (other_low <= high).all())


def spheres_meet(center: FloatArray, radius: float, other_center: FloatArray, other_radius: float) -> bool:
    """Tell whether two closed spheres have a common point."""
    return float(np.linalg.norm(center - other_center)) <= radius + other_radius
