"""Polyhedra, surfaces and boxes against each other in 3D: the relation, by contacts, then locations, then regions.

1. **Contacts** (face_contacts.py): every pair of faces with a common point. A strict crossing that `face_state.py`
   accepts proves that the open interiors meet, and ends the search.
2. **Patches** (mesh_pair.py): faces without contact, connected through vertices, lie wholly inside or wholly outside
   the other body, so one vertex tells. Without any contact disjoint or inside follow. A patch inside the other body
   proves overlapping, if some face of it has an inside of its own body beside it.
3. **Regions** (face_regions.py): what is left are weak contacts (a vertex on a face, flush faces, edges that touch). If
   the open interiors meet, the border of their intersection has a piece with area on some face of either body; on
   patches that is settled, so look at every region that the two bodies cut from each face in contact.

Faces that cancel under even-odd (stacked) have nothing to show for themselves; their patches go through step 3 too.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from engine.arrays import IntArray
from engine.collision.meshes.dual_traversal import SEEK_OVERLAP, SEEK_PIERCING_BY_FIRST, SEEK_PIERCING_BY_SECOND
from engine.collision.meshes.face_contacts import find_all_contacts
from engine.collision.meshes.face_regions import look_at_regions, pierces_without_area
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.mesh_pair import MeshPair, met_by_face, simplest
from engine.collision.meshes.parity import INSIDE
from engine.collision.result import Collision, Witness, Work
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.types import Relation


def mesh_mesh(first: Solid, second: Solid, first_pose: Pose | None, second_pose: Pose | None, work: Work) -> Collision:
    """Return the relation of two polyhedra, surfaces or 3D boxes."""
    with np.errstate(all="ignore"):  # kernels, where they run uncompiled
        pair = simplest(mesh_body_of(first), first_pose, mesh_body_of(second), second_pose)
        return _relation(MeshPair(*pair, work))


def _relation(pair: MeshPair) -> Collision:
    """Return the answer: by contacts, by patches, by regions."""
    contacts, is_settled = find_all_contacts(pair)
    if pair.is_disjoint:
        return Collision(Relation.DISJOINT)
    if is_settled:
        relation = Relation.OVERLAPPING if pair.seek == SEEK_OVERLAP else Relation.TOUCHING
        pierces = pair.seek in (SEEK_PIERCING_BY_FIRST, SEEK_PIERCING_BY_SECOND)
        return Collision(relation, pair.named(contacts, piercing=pierces))
    if len(contacts) and pair.is_separated(contacts):
        return Collision(Relation.TOUCHING, pair.named(contacts))
    patches = [pair.patches(own, contacts[:, own], INSIDE) for own in (0, 1)]
    if not len(contacts):
        n_inside = [sum(map(len, found)) for found in patches]
        if n_inside == [0, 0]:
            return Collision(Relation.DISJOINT)
        for own in (0, 1):
            if n_inside[own] == len(pair.meshes[own].faces) and n_inside[1 - own] == 0:
                relation = (Relation.FIRST_INSIDE_SECOND, Relation.SECOND_INSIDE_FIRST)[own]
                return _contain(pair, relation, own, patches[own][0])
    return _overlap_or_touch(pair, contacts, patches)


def _overlap_or_touch(pair: MeshPair, contacts: IntArray, patches: list[list[IntArray]]) -> Collision:
    """Return overlapping or touching, where no crossing has proven the first."""
    piercing = bool(patches[0] or patches[1])
    both = pair.meshes[0].has_inside and pair.meshes[1].has_inside
    for own in (0, 1):
        for patch in patches[own]:
            if both and any(sides.above or sides.below for sides in pair.sides_beside(own, patch)):
                if len(contacts):
                    return Collision(Relation.OVERLAPPING, pair.named(contacts))
                return _contain(pair, Relation.OVERLAPPING, own, patch)
    for own in (0, 1):
        if not both and (piercing or not pair.work.witness or not pair.meshes[1 - own].has_inside):
            continue
        for face, met in met_by_face(contacts, own):
            pair.work.budget.check()
            overlaps, pierces = look_at_regions(pair, own, face, met)
            if overlaps:
                return Collision(Relation.OVERLAPPING, pair.named(contacts))
            piercing = piercing or pierces
    if pair.work.witness and not piercing:
        piercing = any(
            pierces_without_area(pair, own, face) for own in (0, 1) for face in np.unique(contacts[:, own]).tolist()
        )
    if len(contacts):
        return Collision(Relation.TOUCHING, pair.named(contacts, piercing=piercing))
    own = 0 if patches[0] else 1
    return _contain(pair, Relation.TOUCHING, own, patches[own][0], piercing=piercing)


def _contain(pair: MeshPair, relation: Relation, own: int, patch: IntArray, *, piercing: bool = False) -> Collision:
    """Return a relation with a part of body `own` inside the other one as its witness."""
    if not pair.work.witness:
        return Collision(relation)
    face = int(pair.meshes[own].faces[patch].min())
    containing: Literal["first", "second"] = "second" if own == 0 else "first"
    return Collision(
        relation, Witness("containment", face if own == 0 else -1, face if own == 1 else -1, containing, piercing)
    )
