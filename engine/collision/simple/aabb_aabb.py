"""Two axis-aligned boxes: comparisons of their bounds, exact as they stand."""

from __future__ import annotations

from engine.collision.result import Collision, Witness, Work
from engine.solids.aabb import Aabb
from engine.solids.pose import Pose
from engine.types import Relation


def collide_aabb_aabb(
    first: Aabb, second: Aabb, first_pose: Pose | None, second_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of two boxes without poses, in 2D or 3D; caller guarantees that both poses are None.

    A flat box (min = max on an axis) has no interior: it never overlaps, and `piercing` says that a point of it lies in
    the open interior of the other.
    """
    a0, a1, b0, b1 = first.min, first.max, second.min, second.max
    if (a0 > b1).any() or (b0 > a1).any():
        return Collision(Relation.DISJOINT)
    if (b0 < a0).all() and (a1 < b1).all():
        return Collision(Relation.FIRST_INSIDE_SECOND, Witness("containment", containing="second"))
    if (a0 < b0).all() and (b1 < a1).all():
        return Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
    first_is_solid, second_is_solid = bool((a0 < a1).all()), bool((b0 < b1).all())
    crossing = bool((a0 < b1).all() and (b0 < a1).all())
    if first_is_solid and second_is_solid and crossing:
        return Collision(Relation.OVERLAPPING, Witness("surface"))
    return Collision(Relation.TOUCHING, Witness("surface", piercing=crossing and (first_is_solid or second_is_solid)))
