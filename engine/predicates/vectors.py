"""Points and vectors in kernels: loaded from rows of flat arrays, the only place where a column number appears, and the
arithmetic of those of space, of floats or of eight lanes of them.

``float()`` costs nothing compiled; uncompiled it turns numpy's scalars into Python's, which are faster and do not warn.
"""

from __future__ import annotations

import numpy as np

from engine.compiling.jit import inline, merged
from engine.types import FloatArray, IntArray, Point2, Point3


@inline
def as_point2(points: FloatArray, row: int) -> Point2:
    """Return row ``row`` of points (n, 2) float64 as a point."""
    return Point2(float(points[row, 0]), float(points[row, 1]))


@inline
def as_point3(points: FloatArray, row: int) -> Point3:
    """Return row ``row`` of points (n, 3) float64 as a point."""
    return Point3(float(points[row, 0]), float(points[row, 1]), float(points[row, 2]))


@merged
def corners_of(vertices: FloatArray, triangles: IntArray, triangle: int) -> tuple[Point3, Point3, Point3]:
    """Return the three corners of triangle number ``triangle`` of triangles (m, 3), as points."""
    a, b = as_point3(vertices, triangles[triangle, 0]), as_point3(vertices, triangles[triangle, 1])
    return a, b, as_point3(vertices, triangles[triangle, 2])


@merged
def minus(a: Point3, b: Point3) -> Point3:
    """Return the vector a - b."""
    return Point3(a.x - b.x, a.y - b.y, a.z - b.z)


@merged
def negative(a: Point3) -> Point3:
    """Return the vector -a."""
    return Point3(-a.x, -a.y, -a.z)


@merged
def dot(a: Point3, b: Point3) -> float:
    """Return the scalar product a . b."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@merged
def cross(a: Point3, b: Point3) -> Point3:
    """Return the cross product a x b."""
    return Point3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@merged
def length(a: Point3) -> float:
    """Return the Euclidean length |a|."""
    return float(np.sqrt(dot(a, a)))


@merged
def largest_of(a: Point3) -> float:
    """Return the largest magnitude of a coordinate of a."""
    return max(abs(a.x), abs(a.y), abs(a.z))


@merged
def along(a: Point3, b: Point3, t: float) -> Point3:
    """Return the point a + t (b - a)."""
    return Point3(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z))
