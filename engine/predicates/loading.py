"""Loads rows of flat arrays into named tuples: the only place where a column number appears.

``float()`` costs nothing compiled; uncompiled it turns numpy's scalars into Python's, which are faster and do not warn.
"""

from __future__ import annotations

from typing import Any

from engine.jit import inline
from engine.types import Point2, Point3


@inline
def as_point2(points: Any, row: int) -> Point2:
    """Return row `row` of points (n, 2) float64."""
    return Point2(float(points[row, 0]), float(points[row, 1]))


@inline
def as_point3(points: Any, row: int) -> Point3:
    """Return row `row` of points (n, 3) float64."""
    return Point3(float(points[row, 0]), float(points[row, 1]), float(points[row, 2]))
