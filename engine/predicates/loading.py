"""Loads rows of flat arrays into named tuples: the only place where a column number appears.

``float()`` costs nothing compiled; uncompiled it turns numpy's scalars into Python's, which are faster and do not warn.
"""

from __future__ import annotations

from typing import Any

from engine.jit import inline, merged
from engine.types import Point2, Point3


@inline
def as_point2(points: Any, row: int) -> Point2:
    """Return row `row` of points (n, 2) float64."""
    return Point2(float(points[row, 0]), float(points[row, 1]))


@inline
def as_point3(points: Any, row: int) -> Point3:
    """Return row `row` of points (n, 3) float64."""
    return Point3(float(points[row, 0]), float(points[row, 1]), float(points[row, 2]))


@merged
def corners_of(vertices: Any, triangles: Any, triangle: int) -> tuple[Point3, Point3, Point3]:
    """Return the corners of a triangle."""
    a, b = as_point3(vertices, triangles[triangle, 0]), as_point3(vertices, triangles[triangle, 1])
    return a, b, as_point3(vertices, triangles[triangle, 2])
