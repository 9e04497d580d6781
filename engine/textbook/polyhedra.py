"""Points in a polyhedron: cast a half-line and count the faces it meets; an odd number means inside.

The half-line meets a triangle where the barycentric coordinates of its intersection with the plane say so.
Source: sections 22.4.1 (figure 22.22, right) and 22.6 of the chapter on computer graphics in Algorithms of Informatics;
the form of the intersection is that of T. Moeller and B. Trumbore, Fast, minimum storage ray/triangle intersection,
1997.
What goes wrong: at an edge the two faces decide each for itself, so a half-line through an edge or a vertex may slip
between them or meet both, and the parity is a matter of luck. A point on the surface gets either answer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from engine.compiling.jit import allocating_kernel, inline
from engine.predicates.vectors import as_point3, cross, dot, minus
from engine.types import BoolArray, FloatArray, IntArray, Point3

OUT, IN, CLOSE_TO_AN_EDGE = 0, 1, 2


class Hit(NamedTuple):
    """Intersection of a half-line with a triangle's plane: s, the parameter along the half-line; u, v, the weights of
    the second and third vertex; NaN if parallel."""

    s: float
    u: float
    v: float


@inline
def intersect(origin: Point3, direction: Point3, a: Point3, b: Point3, c: Point3) -> Hit:
    """Return s, u, v with origin + s direction = a + u (b - a) + v (c - a)."""
    ab, ac = minus(b, a), minus(c, a)
    p = cross(direction, ac)
    determinant = dot(ab, p)
    if determinant == 0.0:
        nan = float("nan")
        return Hit(nan, nan, nan)
    from_a = minus(origin, a)
    q = cross(from_a, ab)
    return Hit(dot(ac, q) / determinant, dot(from_a, p) / determinant, dot(direction, q) / determinant)


@inline
def parity_of(point: Point3, direction: Point3, vertices: FloatArray, triangles: IntArray, margin: float) -> int:
    """Return IN or OUT by the parity of the triangles that a half-line meets, edges included (crossing number);
    CLOSE_TO_AN_EDGE if it passes an edge by less than `margin`, in barycentric units."""
    parity = OUT
    for j in range(len(triangles)):
        a, b, c = triangles[j, 0], triangles[j, 1], triangles[j, 2]
        hit = intersect(point, direction, as_point3(vertices, a), as_point3(vertices, b), as_point3(vertices, c))
        if hit.s > -margin and abs(min(hit.u, hit.v, 1.0 - hit.u - hit.v)) < margin:
            return CLOSE_TO_AN_EDGE
        if hit.s > 0.0 and hit.u >= 0.0 and hit.v >= 0.0 and hit.u + hit.v <= 1.0:
            parity = IN - parity
    return parity


@allocating_kernel
def by_half_line(points: FloatArray, vertices: FloatArray, triangles: IntArray, direction: FloatArray) -> BoolArray:
    """Return (n,) bool for points (n, 3): whether the half-line in `direction` (3,) meets an odd number of triangles
    (m, 3)."""
    contained = np.zeros(len(points), np.bool_)
    ahead = Point3(direction[0], direction[1], direction[2])
    for i in range(len(points)):
        contained[i] = parity_of(as_point3(points, i), ahead, vertices, triangles, 0.0) == IN
    return contained


@allocating_kernel
def by_other_half_lines(
    points: FloatArray, vertices: FloatArray, triangles: IntArray, directions: FloatArray, margin: float
) -> tuple[BoolArray, BoolArray]:
    """Return (contained, unfinished), each (n,) bool, for points (n, 3) and half-lines in directions (k, 3), tried in
    turn: unfinished where every one of them passed close to an edge.

    "Because of numerical inaccuracies we might have difficulties to count the number of intersections when the half
    line is close to the edges. In such cases, the simplest solution is to find another half line and carry out the test
    with that." What goes wrong: "close" needs a tolerance that the textbook does not name (`margin`); a point on the
    surface, or a mesh of needles, has no good half-line at all, so the search must be cut off."""
    contained, unfinished = np.zeros(len(points), np.bool_), np.ones(len(points), np.bool_)
    for i in range(len(points)):
        for j in range(len(directions)):
            answer = parity_of(as_point3(points, i), as_point3(directions, j), vertices, triangles, margin)
            if answer != CLOSE_TO_AN_EDGE:
                contained[i], unfinished[i] = answer == IN, False
                break
    return contained, unfinished
