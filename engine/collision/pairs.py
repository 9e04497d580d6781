"""Which function decides which pair of types: one explicit table."""

from __future__ import annotations

from typing import Any

from engine.collision.meshes.mesh_mesh import mesh_mesh
from engine.collision.planar.outline_outline import collide_outline_outline
from engine.collision.result import Collision, PairFunction, Work
from engine.collision.simple.aabb_aabb import collide_aabb_aabb
from engine.collision.simple.aabb_sphere import collide_aabb_sphere
from engine.collision.simple.half_space_half_space import collide_half_space_half_space
from engine.collision.simple.half_space_sphere import collide_half_space_sphere
from engine.collision.simple.half_space_vertices import collide_half_space_mesh, collide_half_space_outline
from engine.collision.simple.mesh_sphere import collide_mesh_sphere, collide_outline_sphere
from engine.collision.simple.sphere_sphere import collide_sphere_sphere
from engine.solids.pose import Pose

MESHES = ("polyhedron", "surface", "aabb")
OUTLINES = ("polygon", "triangle", "aabb")


def _boxes(outlines_or_meshes: PairFunction) -> PairFunction:
    """Return the pair of boxes: comparisons where neither has a pose; a witness of a contact as for other bodies."""

    def aabb_aabb(first: Any, second: Any, first_pose: Pose | None, second_pose: Pose | None, work: Work) -> Collision:
        if first_pose is None and second_pose is None:
            answer = collide_aabb_aabb(first, second, None, None, work)
            if not work.witness or answer.witness is None or answer.witness.kind == "containment":
                return answer
        return outlines_or_meshes(first, second, first_pose, second_pose, work)

    return aabb_aabb


def _box_and_ball(body_sphere: PairFunction) -> PairFunction:
    """Return the pair of box and ball: axis by axis where the box has no pose."""

    def aabb_sphere(box: Any, sphere: Any, box_pose: Pose | None, sphere_pose: Pose | None, work: Work) -> Collision:
        function: PairFunction = collide_aabb_sphere if box_pose is None else body_sphere
        return function(box, sphere, box_pose, sphere_pose, work)

    return aabb_sphere


PAIRS: dict[tuple[int, str, str], PairFunction] = {
    **{(3, first, second): mesh_mesh for first in MESHES for second in MESHES},
    **{(2, first, second): collide_outline_outline for first in OUTLINES for second in OUTLINES},
    **{(3, "half_space", body): collide_half_space_mesh for body in MESHES},
    **{(2, "half_space", body): collide_half_space_outline for body in OUTLINES},
    **{(3, body, "sphere"): collide_mesh_sphere for body in MESHES},
    **{(2, body, "sphere"): collide_outline_sphere for body in OUTLINES},
    (3, "aabb", "sphere"): _box_and_ball(collide_mesh_sphere),
    (2, "aabb", "sphere"): _box_and_ball(collide_outline_sphere),
    (3, "aabb", "aabb"): _boxes(mesh_mesh),
    (2, "aabb", "aabb"): _boxes(collide_outline_outline),
}
for _dimension in (2, 3):
    PAIRS[_dimension, "half_space", "half_space"] = collide_half_space_half_space
    PAIRS[_dimension, "half_space", "sphere"] = collide_half_space_sphere
    PAIRS[_dimension, "sphere", "sphere"] = collide_sphere_sphere
"""Dimension and the two types to the function of that pair; a pair may stand in one order only."""
