"""Point in a triangle of space by cross and scalar products: three conditions, true in the whole prism over it.

    ((b - a) x (p - a)) . n >= 0,  ((c - b) x (p - b)) . n >= 0,  ((a - c) x (p - c)) . n >= 0,  n = (b - a) x (c - a)

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics (figure 22.23). The textbook
calls it robust since the point need not lie in the plane exactly.
What goes wrong: near the side faces of the prism the sign is rounding's; n underflows for small triangles (all inside).
"""

from __future__ import annotations

import numpy as np

from engine.arrays import BoolArray, FloatArray
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3
from engine.predicates.vectors import cross, dot, minus
from engine.types import Point3


@inline
def is_in_prism(p: Point3, a: Point3, b: Point3, c: Point3) -> bool:
    """Tell whether p is in the prism over abc, its side faces included."""
    n = cross(minus(b, a), minus(c, a))
    return (
        dot(cross(minus(b, a), minus(p, a)), n) >= 0.0
        and dot(cross(minus(c, b), minus(p, b)), n) >= 0.0
        and dot(cross(minus(a, c), minus(p, c)), n) >= 0.0
    )


@kernel
def contains(points: FloatArray, triangle: FloatArray) -> BoolArray:
    """Tell of each point (n, 3) whether it is in the prism over the triangle (3, 3)."""
    contained = np.zeros(len(points), np.bool_)
    a, b, c = as_point3(triangle, 0), as_point3(triangle, 1), as_point3(triangle, 2)
    for i in range(len(points)):
        contained[i] = is_in_prism(as_point3(points, i), a, b, c)
    return contained
