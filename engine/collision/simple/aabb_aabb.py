"""Two axis-aligned boxes: comparisons of their bounds, exact as they stand."""

from __future__ import annotations

from engine.collision.result import Collision, Witness
from engine.solids.aabb import Aabb
from engine.types import Relation


def collide_aabb_aabb(first: Aabb, second: Aabb) -> Collision:
    """Return the relation of two boxes without poses, in 2D or 3D; a witness only of one inside the other.

    A flat box (min = max on an axis) has no interior: it never overlaps.
    """
    a0, a1, b0, b1 = first.min, first.max, second.min, second.max
    if (a0 > b1).any() or (b0 > a1).any():
        return Collision(Relation.DISJOINT)
    if (b0 < a0).all() and (a1 < b1).all():
        return Collision(Relation.FIRST_INSIDE_SECOND, Witness("containment", containing="second"))
    if (a0 < b0).all() and (b1 < a1).all():
        return Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
    are_solid = (a0 < a1).all() and (b0 < b1).all()
    crossing = (a0 < b1).all() and (b0 < a1).all()
    return Collision(Relation.OVERLAPPING if are_solid and crossing else Relation.TOUCHING)
