"""Point in a polyhedron by parity; where the half-line passes close to an edge, another half-line is cast.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics: "because of numerical
inaccuracies we might have difficulties to count the number of intersections when the half line is close to the edges.
In such cases, the simplest solution is to find another half line and carry out the test with that."
What goes wrong: "close" needs a tolerance that the textbook does not name (`margin`, in barycentric units); a point on
the surface, or a mesh of needles, has no good half-line at all, so the search must be cut off and says `unfinished`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3
from engine.textbook.ray_triangle import intersect, is_hit
from engine.types import Point3

OUT, IN, CLOSE_TO_AN_EDGE = 0, 1, 2


@inline
def count(point: Point3, direction: Point3, vertices: Any, triangles: Any, margin: float) -> int:
    """Return the parity of the triangles met, or CLOSE_TO_AN_EDGE."""
    parity = OUT
    for j in range(len(triangles)):
        a, b, c = triangles[j, 0], triangles[j, 1], triangles[j, 2]
        hit = intersect(point, direction, as_point3(vertices, a), as_point3(vertices, b), as_point3(vertices, c))
        inner = min(hit.u, hit.v, 1.0 - hit.u - hit.v)
        if hit.s > -margin and abs(inner) < margin:
            return CLOSE_TO_AN_EDGE
        if is_hit(hit):
            parity = IN - parity
    return parity


@kernel
def contains(
    points: FloatArray, vertices: FloatArray, triangles: IntArray, directions: FloatArray, margin: float
) -> tuple[BoolArray, BoolArray]:
    """Return (contained, unfinished); unfinished where each of the directions (k, 3) passed close to an edge."""
    contained, unfinished = np.zeros(len(points), np.bool_), np.ones(len(points), np.bool_)
    for i in range(len(points)):
        for j in range(len(directions)):
            answer = count(as_point3(points, i), as_point3(directions, j), vertices, triangles, margin)
            if answer != CLOSE_TO_AN_EDGE:
                contained[i], unfinished[i] = answer == IN, False
                break
    return contained, unfinished
