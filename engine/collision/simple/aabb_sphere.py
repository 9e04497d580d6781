"""An axis-aligned box and a ball: the nearest and the farthest point of the box from the centre, axis by axis."""

from __future__ import annotations

from fractions import Fraction

from engine.collision.exact_images import as_vector, image_point
from engine.collision.result import Collision, Witness, Work
from engine.collision.simple.body_sphere import collide_body_sphere
from engine.predicates.exact_vectors import squared_length
from engine.solids.aabb import Aabb
from engine.solids.pose import Pose
from engine.solids.sphere import Sphere
from engine.types import Relation


def collide_aabb_sphere(
    box: Aabb, sphere: Sphere, box_pose: Pose | None, sphere_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of a box (first) and a ball (second), exact, in 2D or 3D; a posed box is any body.

    Flat boxes and balls of radius 0 have no interior and never overlap.
    """
    if box_pose is not None:
        return collide_body_sphere(box, sphere, box_pose, sphere_pose, work)
    center, low, high = image_point(sphere.center, sphere_pose), as_vector(box.min), as_vector(box.max)
    radius = Fraction(sphere.radius)
    nearest = tuple(max(a - c, c - b, Fraction(0)) for c, a, b in zip(center, low, high))
    farthest = tuple(max(c - a, b - c) for c, a, b in zip(center, low, high))
    near = squared_length(nearest)
    if near > radius**2:
        return Collision(Relation.DISJOINT)
    if squared_length(farthest) < radius**2:
        return Collision(Relation.FIRST_INSIDE_SECOND, Witness("containment", containing="second"))
    if all(c - a > radius and b - c > radius for c, a, b in zip(center, low, high)):
        return Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
    enters = near < radius**2
    if enters and all(a < b for a, b in zip(low, high)):
        return Collision(Relation.OVERLAPPING, Witness("surface"))
    return Collision(Relation.TOUCHING, Witness("surface", piercing=enters))
