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
from engine.collision.meshes.dual_traversal import SEEK_CONTACT, SEEK_OVERLAP
from engine.collision.meshes.exact_triangles import is_flush, kind_of_contact
from engine.collision.meshes.face_contacts import find_all_contacts
from engine.collision.meshes.face_regions import look_at_regions, pierces_without_area
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.mesh_pair import MeshPair, simplest
from engine.collision.meshes.parity import INSIDE
from engine.collision.meshes.separating_plane import is_separated
from engine.collision.result import Collision, Kind, Witness, Work
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.types import Relation

_NAMED = 32
STRENGTH: tuple[Kind, ...] = ("face_face", "edge_face", "vertex_face", "edge_edge", "vertex_edge", "vertex_vertex")
"""Of several contacts the witness is the one of the kind that stands first here; at most `_NAMED` are looked at."""


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
        if pair.seek == SEEK_OVERLAP:
            return _touch(pair, Relation.OVERLAPPING, contacts)
        return _touch(pair, Relation.TOUCHING, contacts, piercing=pair.seek != SEEK_CONTACT)
    if len(contacts) and _is_separated(pair, contacts):
        return _touch(pair, Relation.TOUCHING, contacts)
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


def _is_separated(pair: MeshPair, contacts: IntArray) -> bool:
    """Tell whether a plane is known that separates the two bodies."""
    (first, second), (first_pose, second_pose) = pair.meshes, pair.posed
    found = is_separated(first.arrays, first_pose, second.arrays, second_pose, contacts, pair.work.budget.flag)
    pair.work.budget.check()
    return bool(found)


def _overlap_or_touch(pair: MeshPair, contacts: IntArray, patches: list[list[IntArray]]) -> Collision:
    """Return overlapping or touching, where no crossing has proven the first."""
    piercing = bool(patches[0] or patches[1])
    both = pair.meshes[0].has_inside and pair.meshes[1].has_inside
    for own in (0, 1):
        for patch in patches[own]:
            if both and any(sides.above or sides.below for sides in pair.sides_beside(own, patch)):
                if len(contacts):
                    return _touch(pair, Relation.OVERLAPPING, contacts)
                return _contain(pair, Relation.OVERLAPPING, own, patch)
    for own in (0, 1):
        if not both and (piercing or not pair.work.witness or not pair.meshes[1 - own].has_inside):
            continue
        faces = np.unique(contacts[:, own])
        for face in faces.tolist():
            overlaps, pierces = look_at_regions(pair, own, face, contacts[contacts[:, own] == face, 1 - own])
            if overlaps:
                return _touch(pair, Relation.OVERLAPPING, contacts)
            piercing = piercing or pierces
    if pair.work.witness and not piercing:
        piercing = any(
            pierces_without_area(pair, own, face) for own in (0, 1) for face in np.unique(contacts[:, own]).tolist()
        )
    if len(contacts):
        return _touch(pair, Relation.TOUCHING, contacts, piercing=piercing)
    own = 0 if patches[0] else 1
    return _contain(pair, Relation.TOUCHING, own, patches[own][0], piercing=piercing)


def _touch(pair: MeshPair, relation: Relation, contacts: IntArray, *, piercing: bool = False) -> Collision:
    """Return a relation with two faces as its witness: the strongest kind among the first contacts."""
    if not pair.work.witness:
        return Collision(relation)
    named: list[tuple[int, int, int]] = []
    a, b = pair.exact
    for is_short in (True, False):  # order: flush faces are found soonest, and nothing is stronger
        for i, j in contacts[: 0 if named else _NAMED].tolist():
            pair.work.budget.check()
            faces = a.corners(i), b.corners(j), a.plane(i), b.plane(j)
            if is_short and not is_flush(*faces):
                continue
            kind = STRENGTH[0] if is_short else kind_of_contact(*faces)
            named.append((STRENGTH.index(kind), int(pair.meshes[0].faces[i]), int(pair.meshes[1].faces[j])))
            if is_short:  # coplanar pairs stand first, in the order of the caller's faces
                break
    strength, first_face, second_face = min(named)
    return Collision(relation, Witness(STRENGTH[strength], first_face, second_face, "", piercing))


def _contain(pair: MeshPair, relation: Relation, own: int, patch: IntArray, *, piercing: bool = False) -> Collision:
    """Return a relation with a part of body `own` inside the other one as its witness."""
    if not pair.work.witness:
        return Collision(relation)
    face = int(pair.meshes[own].faces[patch].min())
    containing: Literal["first", "second"] = "second" if own == 0 else "first"
    return Collision(
        relation, Witness("containment", face if own == 0 else -1, face if own == 1 else -1, containing, piercing)
    )
