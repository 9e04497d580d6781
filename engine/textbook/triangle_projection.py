"""Point in a triangle of space by projection on the coordinate plane where the triangle's area is largest.

First the vertices are put in an order with c on the left of ab; then the point must be on the left of ab, bc and ca:

    (b.x - a.x) (p.y - a.y) - (b.y - a.y) (p.x - a.x) >= 0    and so on

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics (figure 22.24). It is asked
about points in the triangle's plane; others are answered by their projection.
What goes wrong: near an edge the sign is rounding's, less often than in space since fewer terms are added.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import BoolArray, FloatArray
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3
from engine.predicates.vectors import cross, minus
from engine.types import Point2, Point3


@inline
def is_left(a: Point2, b: Point2, p: Point2) -> bool:
    """Tell whether p is on the left of the line from a to b, or on it."""
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) >= 0.0


@inline
def project(p: Point3, axis: int) -> Point2:
    """Return p without the coordinate `axis`."""
    if axis == 0:
        return Point2(p.y, p.z)
    if axis == 1:
        return Point2(p.z, p.x)
    return Point2(p.x, p.y)


@inline
def axis_of_largest_area(a: Point3, b: Point3, c: Point3) -> int:
    """Return the axis on which the normal has its largest component."""
    n = cross(minus(b, a), minus(c, a))
    if abs(n.x) >= abs(n.y) and abs(n.x) >= abs(n.z):
        return 0
    return 1 if abs(n.y) >= abs(n.z) else 2


@kernel
def contains(points: FloatArray, triangle: FloatArray) -> BoolArray:
    """Tell of each point (n, 3) whether its projection is in that of the triangle (3, 3)."""
    contained = np.zeros(len(points), np.bool_)
    axis = axis_of_largest_area(as_point3(triangle, 0), as_point3(triangle, 1), as_point3(triangle, 2))
    a, b, c = (
        project(as_point3(triangle, 0), axis),
        project(as_point3(triangle, 1), axis),
        project(as_point3(triangle, 2), axis),
    )
    if not is_left(a, b, c):
        a, b = b, a
    for i in range(len(points)):
        p = project(as_point3(points, i), axis)
        contained[i] = is_left(a, b, p) and is_left(b, c, p) and is_left(c, a, p)
    return contained
