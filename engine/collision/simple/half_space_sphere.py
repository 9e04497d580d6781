"""A half-space and a ball: the signed distance of the centre against the radius, both sides squared."""

from __future__ import annotations

from fractions import Fraction

from engine.collision.exact_images import image_half_space, image_point, value_at
from engine.collision.result import Collision, Witness, Work
from engine.predicates.exact_vectors import squared_length
from engine.solids.half_space import HalfSpace
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.types import Relation


def collide_half_space_sphere(
    half_space: HalfSpace, sphere: Sphere, half_space_pose: Pose | None, sphere_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of a half-space (first) and a ball (second), exact; a half-space is never inside."""
    normal, offset = image_half_space(half_space.normal, half_space.offset, half_space_pose)
    value = value_at((normal, offset), image_point(sphere.center, sphere_pose))
    reach = Fraction(sphere.radius) ** 2 * squared_length(normal)
    if value**2 > reach:
        if value < 0:
            return Collision(Relation.DISJOINT)
        return Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
    # case: the ball touches the plane from outside, or is a point on it
    only_touches = value**2 == reach and value <= 0
    return Collision(Relation.TOUCHING if only_touches else Relation.OVERLAPPING, Witness("surface"))
