"""Polyhedra, surfaces and boxes against each other in 3D: the relation, by contacts, then locations, then regions.

1. **Contacts**: every pair of faces with a common point. A strict crossing that `face_state.py` accepts proves that the
   open interiors meet, and ends the search.
2. **Patches** (mesh_pair.py): faces without contact, connected through vertices, lie wholly inside or wholly outside
   the other body, so one vertex tells. Without any contact disjoint or inside follow. A patch inside the other body
   proves overlapping, if some face of it has an inside of its own body beside it.
3. **Regions**: what is left are weak contacts (a vertex on a face, flush faces, edges that touch). If the open
   interiors meet, the border of their intersection has a piece with area on some face of either body; on patches that
   is settled, so look at every region that the two bodies cut from each face in contact: overlapping shows as one with
   both insides on one side of it.

Faces that cancel under even-odd (stacked) have nothing to show for themselves; their patches go through step 3 too.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from engine.arrays import IntArray
from engine.collision.codes import DISJOINT, OVERLAPPING, TOUCHING, UNSETTLED
from engine.collision.meshes.contact_kinds import CONTAINED, STRENGTH
from engine.collision.meshes.dual_traversal import PIERCING, SEEK_OVERLAP, Found
from engine.collision.meshes.exact_body import as_simplex
from engine.collision.meshes.exact_regions import pieces_of_segment, regions_of, side_of_clean, sides_at
from engine.collision.meshes.mesh_arrays import STATE_CLEAN, MeshBody, mesh_body_of
from engine.collision.meshes.mesh_pair import MeshPair, PosedPair, relate, unless_identity, what_to_seek
from engine.collision.meshes.parity import INSIDE
from engine.collision.meshes.pose_batch import ONE_SETTLES, RELATION
from engine.collision.result import NO_CONTACT, RELATIONS, UNNAMED, Collision, Containing, Poses, Witness, Work
from engine.predicates.rational import sign_of
from engine.solids.base import Solid
from engine.types import Relation


def look_at_regions(pair: MeshPair, own: int, face: int) -> tuple[bool, bool]:
    """Tell whether both insides come up to one side of a region of a face; and whether one is inside the other."""
    body, other = pair.exact[own], pair.exact[1 - own]
    axis = body.axis(face)
    if axis < 0:
        return False, False
    side = side_of_clean(body, face) if body.mesh.has_inside and pair.state(own, face) == STATE_CLEAN else 0
    if side != 0:  # all that counts lies on one side: only faces that reach there cut it
        met = pair.contacts[pair.contacts[:, own] == face, 1 - own].tolist()
        is_above = side == sign_of(body.plane(face)[axis])
        for q in regions_of(body, face, [other], pair.work.budget, (side, met)):
            theirs = sides_at(other, q, axis)
            if theirs.above if is_above else theirs.below:
                return True, False
        return False, False  # a point of the face within the other body has both insides beside it
    pierces = False
    for q in regions_of(body, face, [other, body] if body.mesh.has_inside else [other], pair.work.budget):
        theirs = sides_at(other, q, axis)
        if theirs.above or theirs.below:
            ours = sides_at(body, q, axis)
            if (ours.above and theirs.above) or (ours.below and theirs.below):
                return True, False
        pierces = pierces or theirs.at
    return False, pierces


def pierces_without_area(pair: MeshPair, own: int, face: int) -> bool:
    """Tell whether a face that is only a segment has a point in the other body's open interior."""
    body, other = pair.exact[own], pair.exact[1 - own]
    if body.axis(face) >= 0 or not other.mesh.has_inside:
        return False
    ends = as_simplex(body.corners(face))
    if len(ends) < 2:
        return False
    pieces = pieces_of_segment(body, (ends[0], ends[1]), other, pair.work.budget)
    # every face with area that holds a point lies across some axis
    return any(all(sides_at(other, q, axis).at for axis in range(3)) for q in pieces)


def mesh_mesh(first: Solid, second: Solid, poses: Poses, work: Work) -> Collision:
    """Return the relation of two polyhedra, surfaces or 3D boxes."""
    a, b = mesh_body_of(first), mesh_body_of(second)
    if poses[0] is not None or poses[1] is not None:
        poses = unless_identity(poses)
    told = told_by_kernel(a, b, (a.posed(poses[0]), b.posed(poses[1])), work)
    if isinstance(told, Collision):
        return told
    work.budget.check()
    with np.errstate(all="ignore"):  # kernels, where they run uncompiled
        pair = MeshPair(a, b, poses, work)
        pair.find_contacts(told)
        return _relation(pair)


def told_by_kernel(
    first: MeshBody, second: MeshBody, posed: PosedPair, work: Work
) -> Collision | tuple[list[int], Found]:
    """Return the answer where `relate_poses` tells it, else what `relate` says."""
    seek = what_to_seek(first, second, work)
    row, found = relate(first, second, posed, seek, work)
    relation, kind, face, their_face, n = row
    if work.witness or relation == UNSETTLED:
        answer = answer_of(relation, kind, face, their_face, n == ONE_SETTLES and seek in PIERCING)
        if answer is None:
            return row, found
    else:
        answer = UNNAMED[relation]
    if n > 0:
        work.n_beyond_filter += n
    return answer


@lru_cache(1 << 14)
def answer_of(relation: int, kind: int, face: int, their_face: int, pierces: bool) -> Collision | None:
    """Return what a row of `relate_poses` says, None where that is not all; made once: that takes longer than to find
    a contact."""
    if relation == DISJOINT:
        return NO_CONTACT
    if UNSETTLED in (relation, kind):
        return None
    containing: Containing = "" if kind != CONTAINED else ("second" if their_face < 0 else "first")
    return Collision(RELATIONS[relation], Witness(STRENGTH[kind], face, their_face, containing, pierces))


def _relation(pair: MeshPair) -> Collision:
    """Return the answer: by contacts, by patches, by regions."""
    contacts = pair.contacts
    if pair.is_settled:
        relation = Relation.OVERLAPPING if pair.seek == SEEK_OVERLAP else Relation.TOUCHING
        return Collision(relation, pair.named(piercing=pair.seek in PIERCING))
    if pair.row[RELATION] in (OVERLAPPING, TOUCHING) and len(contacts):
        return Collision(RELATIONS[pair.row[RELATION]], pair.named())
    patches = [pair.patches(own, contacts[:, own], INSIDE) for own in (0, 1)]
    if not len(contacts):
        n_inside = [sum(map(len, found)) for found in patches]
        if n_inside == [0, 0]:
            return NO_CONTACT
        for own in (0, 1):
            if n_inside[own] == len(pair.meshes[own].faces) and n_inside[1 - own] == 0:
                relation = (Relation.FIRST_INSIDE_SECOND, Relation.SECOND_INSIDE_FIRST)[own]
                return _contain(pair, relation, own, patches[own][0])
    return _overlap_or_touch(pair, patches)


def _overlap_or_touch(pair: MeshPair, patches: list[list[IntArray]]) -> Collision:
    """Return overlapping or touching, where no crossing has proven the first."""
    contacts, piercing = pair.contacts, bool(patches[0] or patches[1])
    both = pair.meshes[0].has_inside and pair.meshes[1].has_inside
    for own in (0, 1):
        for patch in patches[own]:
            if both and any(sides.above or sides.below for sides in pair.sides_beside(own, patch)):
                if len(contacts):
                    return Collision(Relation.OVERLAPPING, pair.named())
                return _contain(pair, Relation.OVERLAPPING, own, patch)
    for own in (0, 1):
        is_told = not both and (piercing or not pair.work.witness or not pair.meshes[1 - own].has_inside)
        for face in [] if is_told else np.unique(contacts[:, own]).tolist():
            pair.work.budget.check()
            overlaps, pierces = look_at_regions(pair, own, face)
            if overlaps:
                return Collision(Relation.OVERLAPPING, pair.named())
            piercing = piercing or pierces
    if pair.work.witness and not piercing:
        piercing = any(
            pierces_without_area(pair, own, face) for own in (0, 1) for face in np.unique(contacts[:, own]).tolist()
        )
    if len(contacts):
        return Collision(Relation.TOUCHING, pair.named(piercing=piercing))
    own = 0 if patches[0] else 1
    return _contain(pair, Relation.TOUCHING, own, patches[own][0], piercing=piercing)


def _contain(pair: MeshPair, relation: Relation, own: int, patch: IntArray, *, piercing: bool = False) -> Collision:
    """Return a relation with a patch of body `own` inside the other one as its witness."""
    face = int(pair.meshes[own].faces[patch].min())
    answer = answer_of(relation, CONTAINED, *((face, -1), (-1, face))[own], piercing)
    return answer if pair.work.witness and answer is not None else UNNAMED[relation]
