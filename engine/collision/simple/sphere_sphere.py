"""Two balls: the squared distance of their centres against the squares of the sum and the difference of their radii."""

from __future__ import annotations

from fractions import Fraction

from engine.collision.exact_images import image_point
from engine.collision.result import Collision, Witness, Work
from engine.predicates.exact_vectors import minus, squared_length
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.types import Relation


def collide_sphere_sphere(
    first: Sphere, second: Sphere, first_pose: Pose | None, second_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of two balls (discs in 2D), exact. A ball of radius 0 is a point: it never overlaps."""
    between = squared_length(minus(image_point(first.center, first_pose), image_point(second.center, second_pose)))
    r, s = Fraction(first.radius), Fraction(second.radius)
    if between > (r + s) ** 2:
        return Collision(Relation.DISJOINT)
    if between < (s - r) ** 2:
        if r < s:
            return Collision(Relation.FIRST_INSIDE_SECOND, Witness("containment", containing="second"))
        return Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
    meet = r > 0 and s > 0 and between < (r + s) ** 2
    return Collision(Relation.OVERLAPPING if meet else Relation.TOUCHING, Witness("surface"))
