"""Point in a polyhedron: cast a half-line and count the faces it meets; an odd number means inside.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics (figure 22.22, right).
What goes wrong: a half-line through an edge or a vertex meets two faces or more, or none: the parity is then a matter
of luck. A point on the surface gets either answer. See `polyhedron_recast.py` for the textbook's own remedy.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3
from engine.textbook.ray_triangle import intersect, is_hit
from engine.types import Point3


@inline
def is_inside(point: Point3, direction: Point3, vertices: Any, triangles: Any) -> bool:
    """Return the parity of the triangles that the half-line meets."""
    parity = False
    for j in range(len(triangles)):
        a, b, c = triangles[j, 0], triangles[j, 1], triangles[j, 2]
        hit = intersect(point, direction, as_point3(vertices, a), as_point3(vertices, b), as_point3(vertices, c))
        if is_hit(hit):
            parity = not parity
    return parity


@kernel
def contains(points: FloatArray, vertices: FloatArray, triangles: IntArray, direction: FloatArray) -> BoolArray:
    """Tell of each point (n, 3) whether an odd number of triangles (m, 3) lies ahead in `direction` (3,)."""
    contained = np.zeros(len(points), np.bool_)
    ahead = Point3(direction[0], direction[1], direction[2])
    for i in range(len(points)):
        contained[i] = is_inside(as_point3(points, i), ahead, vertices, triangles)
    return contained
