"""Which function decides which pair of types: one explicit table."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.collision.meshes.mesh_mesh import mesh_mesh
from engine.collision.planar.outline_outline import collide_outline_outline
from engine.collision.result import Collision, Containing, PairFunction, Witness, Work
from engine.collision.simple.aabb_aabb import relate_boxes
from engine.collision.simple.aabb_sphere import collide_aabb_sphere
from engine.collision.simple.body_sphere import collide_body_sphere
from engine.collision.simple.half_space_half_space import collide_half_space_half_space
from engine.collision.simple.half_space_sphere import collide_half_space_sphere
from engine.collision.simple.half_space_vertices import collide_half_space_body
from engine.collision.simple.sphere_sphere import collide_sphere_sphere
from engine.solids.pose import Pose
from engine.types import Relation

MESHES = ("polyhedron", "surface", "aabb")
OUTLINES = ("polygon", "triangle", "aabb")
BODIES = [(3, mesh) for mesh in MESHES] + [(2, outline) for outline in OUTLINES]

_CONTAINING: dict[Any, Containing] = {Relation.FIRST_INSIDE_SECOND: "second", Relation.SECOND_INSIDE_FIRST: "first"}


def _aabb_aabb(first: Any, second: Any, first_pose: Pose | None, second_pose: Pose | None, work: Work) -> Collision:
    """Decide by comparisons where neither box has a pose; a witness of a contact is named as for other bodies."""
    if first_pose is None and second_pose is None:
        low, high = np.array([first.min, second.min]), np.array([first.max, second.max])
        relation = Relation(relate_boxes(low, high, 0, 1))
        if relation in _CONTAINING:
            return Collision(relation, Witness("containment", containing=_CONTAINING[relation]))
        if relation == Relation.DISJOINT or not work.witness:
            return Collision(relation)
    bodies = mesh_mesh if first.dimension == 3 else collide_outline_outline
    return bodies(first, second, first_pose, second_pose, work)


PAIRS: dict[tuple[int, str, str], PairFunction] = {
    **{(3, first, second): mesh_mesh for first in MESHES for second in MESHES},
    **{(2, first, second): collide_outline_outline for first in OUTLINES for second in OUTLINES},
    **{(d, "half_space", body): collide_half_space_body for d, body in BODIES},
    **{(d, body, "sphere"): collide_body_sphere for d, body in BODIES},
}
for _dimension in (2, 3):
    PAIRS[_dimension, "aabb", "aabb"] = _aabb_aabb
    PAIRS[_dimension, "aabb", "sphere"] = collide_aabb_sphere
    PAIRS[_dimension, "half_space", "half_space"] = collide_half_space_half_space
    PAIRS[_dimension, "half_space", "sphere"] = collide_half_space_sphere
    PAIRS[_dimension, "sphere", "sphere"] = collide_sphere_sphere
"""Dimension and the two types to the function of that pair; a pair may stand in one order only."""
