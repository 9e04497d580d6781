"""Where a half-line meets a triangle, by the barycentric coordinates of the intersection with the plane.

Source: section 22.6 of the chapter on computer graphics in Algorithms of Informatics; the form is that of
T. Moeller and B. Trumbore, Fast, minimum storage ray/triangle intersection, 1997.
What goes wrong: at an edge the two faces decide each for itself, so a half-line may slip between them or meet both.
"""

from __future__ import annotations

from typing import NamedTuple

from engine.jit import inline
from engine.predicates.vectors import cross, dot, minus
from engine.types import Point3


class Hit(NamedTuple):
    """Parameter along the half-line, weights of the second and third vertex; NaN where the plane is parallel."""

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
def is_hit(hit: Hit) -> bool:
    """Tell whether the half-line meets the triangle, its edges included."""
    return hit.s > 0.0 and hit.u >= 0.0 and hit.v >= 0.0 and hit.u + hit.v <= 1.0
