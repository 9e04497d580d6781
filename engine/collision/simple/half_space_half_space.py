"""Two half-spaces: they overlap unless their planes are parallel; then their thresholds along one normal decide."""

from __future__ import annotations

from engine.collision.exact_images import image_half_space
from engine.collision.result import Collision, Witness, Work
from engine.predicates.exact_vectors import largest_axis
from engine.solids.half_space import HalfSpace
from engine.solids.pose import Pose
from engine.types import Relation


def collide_half_space_half_space(
    first: HalfSpace, second: HalfSpace, first_pose: Pose | None, second_pose: Pose | None, work: Work
) -> Collision:
    """Return the relation of two half-spaces (half-planes in 2D), exact.

    Equal ones overlap; opposite ones that share only their plane touch. Neither holds the other unless its plane lies
    strictly inside.
    """
    n, d = image_half_space(first.normal, first.offset, first_pose)
    m, e = image_half_space(second.normal, second.offset, second_pose)
    axis = largest_axis(n)
    factor = m[axis] / n[axis]  # m = factor n if parallel
    if any(m[k] != factor * n[k] for k in range(len(n))):
        return Collision(Relation.OVERLAPPING, Witness("surface"))
    low, bound = -d, -e / factor if factor != 0 else -d  # first: n . x >= low; factor = 0 only if not parallel
    if factor > 0:
        if low > bound:
            return Collision(Relation.FIRST_INSIDE_SECOND, Witness("containment", containing="second"))
        if low < bound:
            return Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
        return Collision(Relation.OVERLAPPING, Witness("surface"))
    if low > bound:
        return Collision(Relation.DISJOINT)
    return Collision(Relation.TOUCHING if low == bound else Relation.OVERLAPPING, Witness("surface"))
