"""Polyhedra, surfaces and boxes against each other in 3D: the relation, by contacts, then locations, then regions; and
of two that overlap, which sticks out of the other and whether their boundaries meet.

1. **Contacts**: every pair of faces with a common point. A strict crossing that `parity.py` accepts proves that the
   open interiors meet, and ends the search.
2. **Patches** (mesh_pair.py): faces without contact, connected through vertices, lie wholly inside or wholly outside
   the other body, so one vertex decides. Without any contact disjoint or inside follow. A patch inside the other body
   proves overlapping, if its own body is inside next to some face of it.
3. **Regions**: what is left are weak contacts (a vertex on a face, flush faces, edges that touch). If the open
   interiors meet, the border of their intersection has a piece with area on some face of either body; on patches that
   is decided, so a region that both cut from a face in contact has both insides on one side.

Faces that cancel under even-odd (stacked) prove nothing; their patches go through step 3 too.

**Parts.** A body A sticks out of B if A's open interior meets the outside of B: on one side of some region of a face of
either, A is inside and B is not. A crossing that proves overlapping shows all four combinations around it; a patch has
one status of the other body on both sides; a face in contact is decided by either side of each region, and it is a
single region if the other body meets it only in faces of its own plane.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from engine.collision.codes import DISJOINT, OVERLAPPING, RELATION, TOUCHING, UNSETTLED
from engine.collision.meshes import exact_regions as regions
from engine.collision.meshes.contact_kinds import CONTAINED, FACE_FACE, STRENGTH
from engine.collision.meshes.dual_traversal import PIERCING, SEEK_CROSSING, SEEK_OVERLAP, Contacts
from engine.collision.meshes.exact_body import ExactBody, as_simplex, value_at
from engine.collision.meshes.mesh_arrays import STATE_CLEAN, STILL, MeshBody, mesh_body_of
from engine.collision.meshes.mesh_pair import MeshPair, PosedPair, relate, search_goal, unless_identity
from engine.collision.meshes.parity import INSIDE, OUTSIDE, state_at
from engine.collision.meshes.pose_batch import DETAIL, ONE_SETTLES, OPPOSITE, SAME_SIDE
from engine.collision.result import NO_CONTACT, RELATIONS, UNNAMED, Collision, Containing, Parts, Poses, Witness, Work
from engine.predicates.rational import sign_of
from engine.solids.base import Solid
from engine.types import FloatArray, IntArray, Relation


def inspect_regions(pair: MeshPair, own: int, face: int, has_interior: bool) -> tuple[bool, bool]:
    """Return (overlaps, pierces) for a face in contact. overlaps: on one side of some region of the face both bodies
    are inside, so their open interiors intersect. pierces: the face has a point inside the other body; valid if
    overlaps is False. own: 0 or 1, the body of the face; has_interior: False if that body has none."""
    body, other = pair.exact[own], pair.exact[1 - own]
    axis = body.axis(face)
    if axis < 0:
        return False, False
    side = regions.side_of_clean(body, face) if has_interior and pair.state(own, face) == STATE_CLEAN else 0
    if side != 0:  # all that counts lies on one side: only faces that reach there cut it
        met = pair.contacts[pair.contacts[:, own] == face, 1 - own].tolist()
        is_above = side == sign_of(body.plane(face)[axis])
        for q in regions.regions_of(body, face, [other], pair.work.budget, (side, met)):
            theirs = regions.sides_at(other, q, axis)
            if theirs.above if is_above else theirs.below:
                return True, False
        return False, False  # a point of the face within the other body has both insides next to it
    pierces = False
    for q in regions.regions_of(body, face, [other, body] if has_interior else [other], pair.work.budget):
        theirs = regions.sides_at(other, q, axis)
        if has_interior and (theirs.above or theirs.below):
            ours = regions.sides_at(body, q, axis)
            if (ours.above and theirs.above) or (ours.below and theirs.below):
                return True, False
        pierces = pierces or theirs.at
    return False, pierces


def pierces_without_area(pair: MeshPair, own: int, face: int) -> bool:
    """Return whether a face of body `own` (0, 1) that is only a segment has a point in the other's open interior; False
    for other faces."""
    body, other = pair.exact[own], pair.exact[1 - own]
    if body.axis(face) >= 0 or not other.mesh.has_inside:
        return False
    ends = as_simplex(body.corners(face))
    if len(ends) < 2:
        return False
    pieces = regions.pieces_of_segment(body, (ends[0], ends[1]), other, pair.work.budget)
    # every face with area that holds a point lies across some axis
    return any(all(regions.sides_at(other, q, axis).at for axis in range(3)) for q in pieces)


def mesh_mesh(first: Solid, second: Solid, poses: Poses, work: Work) -> Collision:
    """Return the relation of two polyhedra, surfaces or 3D boxes under poses, with its witness if requested."""
    a, b = mesh_body_of(first), mesh_body_of(second)
    posed = STILL, STILL
    if poses[0] is not None or poses[1] is not None:
        poses = unless_identity(poses)
        posed = a.posed(poses[0]), b.posed(poses[1])
    if poses[0] == poses[1] and not work.boolean and _have_same_arrays(a, b) and _has_clean_face(a):
        face = int(a.faces[a.arrays.axis >= 0].min())
        same = decode_row(OVERLAPPING, FACE_FACE, face, face, False)
        return same if work.witness and same is not None else UNNAMED[OVERLAPPING]
    answer = relation_from_kernel(a, b, posed, work)
    if isinstance(answer, Collision):
        return answer
    work.budget.check()
    with np.errstate(all="ignore"):  # kernels, where they run uncompiled
        pair = MeshPair(a, b, poses, work)
        pair.find_contacts(answer)
        return _relation(pair)


def _have_same_arrays(first: MeshBody, second: MeshBody) -> bool:
    """Return whether two bodies with an inside have the same vertices and faces in the same order."""
    a, b = first.arrays, second.arrays
    if not (a.has_inside and b.has_inside):
        return False
    if a is b:
        return True
    if a.extent != b.extent or len(a.faces) != len(b.faces) or len(a.vertices) != len(b.vertices):
        return False
    pairs = (a.vertices, b.vertices), (a.triangles, b.triangles), (a.faces, b.faces)
    return all(np.array_equal(own, their) for own, their in pairs)


def _has_clean_face(body: MeshBody) -> bool:
    """Return whether one of the first faces is clean, so that the body has an interior beside it."""
    with np.errstate(all="ignore"):
        return any(state_at(body.arrays, face) == STATE_CLEAN for face in range(min(len(body.faces), 4)))


def relation_from_kernel(
    first: MeshBody, second: MeshBody, posed: PosedPair, work: Work
) -> Collision | tuple[list[int], Contacts]:
    """Return the `Collision` of two posed meshes by the kernel if its answer is complete, the witness included if
    requested; else the row and the contacts that `relate` returns."""
    seek = search_goal(first, second, work)
    row, contacts = relate(first, second, posed, seek, work)
    relation, kind, face, their_face, n = row
    if work.witness or relation == UNSETTLED:
        answer = decode_row(relation, kind, face, their_face, n == ONE_SETTLES and seek in PIERCING)
        if answer is None:
            return row, contacts
    else:
        answer = UNNAMED[relation]
    if n > 0:
        work.n_beyond_filter += n
    return answer


@lru_cache(1 << 14)
def decode_row(relation: int, kind: int, face: int, their_face: int, pierces: bool) -> Collision | None:
    """Return the answer encoded in a row of `relate_poses` by its relation, kind of contact and the two faces; None if
    relation or kind is UNSETTLED. pierces: the contact shows a surface inside the other body. Cached, since
    constructing one costs more than a search."""
    if relation == DISJOINT:
        return NO_CONTACT
    if UNSETTLED in (relation, kind):
        return None
    containing: Containing = "" if kind != CONTAINED else ("second" if their_face < 0 else "first")
    return Collision(RELATIONS[relation], Witness(STRENGTH[kind], face, their_face, containing, pierces))


def _relation(pair: MeshPair) -> Collision:
    """Return the relation of a pair: by its contacts if they decide it, else by its patches (connected faces without
    contact), else by regions of the faces in contact."""
    contacts = pair.contacts
    if pair.is_settled:
        relation = Relation.OVERLAPPING if pair.seek == SEEK_OVERLAP else Relation.TOUCHING
        return Collision(relation, pair.named(piercing=pair.seek in PIERCING))
    if pair.row[RELATION] in (OVERLAPPING, TOUCHING) and len(contacts):
        return Collision(RELATIONS[pair.row[RELATION]], pair.named())
    patches = [pair.patches(own, contacts[:, own], INSIDE) for own in (0, 1)]
    if not len(contacts):
        n_inside = [sum(map(len, vertices)) for vertices in patches]
        if n_inside == [0, 0]:
            return NO_CONTACT
        for own in (0, 1):
            if n_inside[own] == len(pair.meshes[own].faces) and n_inside[1 - own] == 0:
                relation = (Relation.FIRST_INSIDE_SECOND, Relation.SECOND_INSIDE_FIRST)[own]
                return _containment(pair, relation, own, patches[own][0])
    return _overlap_or_touch(pair, patches)


def _overlap_or_touch(pair: MeshPair, patches: list[list[IntArray]]) -> Collision:
    """Return OVERLAPPING or TOUCHING for a pair that meets, but of which no crossing proves OVERLAPPING. patches: by
    body, the sets of its connected faces without contact that lie inside the other body."""
    contacts, piercing = pair.contacts, bool(patches[0] or patches[1])
    solid = [_may_have_interior(body) for body in pair.exact]
    for own in (0, 1):
        for patch in patches[own]:
            if all(solid) and any(sides.above or sides.below for sides in pair.patch_sides(own, patch)):
                if len(contacts):
                    return Collision(Relation.OVERLAPPING, pair.named())
                return _containment(pair, Relation.OVERLAPPING, own, patch)
    for own in (0, 1):
        is_decided = not all(solid) and (piercing or not pair.work.witness or not solid[1 - own])
        for face in [] if is_decided else np.unique(contacts[:, own]).tolist():
            pair.work.budget.check()
            overlaps, pierces = inspect_regions(pair, own, face, solid[own])
            if overlaps:
                return Collision(Relation.OVERLAPPING, pair.named())
            piercing = piercing or pierces
    if pair.work.witness and not piercing:
        faces = [(own, face) for own in (0, 1) for face in np.unique(contacts[:, own]).tolist()]
        piercing = any(pierces_without_area(pair, own, face) for own, face in faces)
    if len(contacts):
        return Collision(Relation.TOUCHING, pair.named(piercing=piercing))
    own = 0 if patches[0] else 1
    return _containment(pair, Relation.TOUCHING, own, patches[own][0], piercing=piercing)


def _may_have_interior(body: ExactBody) -> bool:
    """Return False for a surface, and for a closed mesh whose vertices all lie in the plane of its first face with
    area: it has no interior, which else each region of its faces would show."""
    plane = next((body.plane(face) for face in range(len(body.mesh.faces)) if body.axis(face) >= 0), (0, 0, 0, 0))
    n_vertices = len(body.mesh.arrays.vertices)
    return body.mesh.has_inside and any(value_at(plane, body.vertex(number)) for number in range(n_vertices))


def _containment(pair: MeshPair, relation: Relation, own: int, patch: IntArray, *, piercing: bool = False) -> Collision:
    """Return `relation` with a containment as witness: the least face of `patch`, faces of body `own` (0, 1) that lie
    inside the other body. piercing: the value of `Witness.piercing`."""
    face = int(pair.meshes[own].faces[patch].min())
    answer = decode_row(relation, CONTAINED, *((face, -1), (-1, face))[own], piercing)
    return answer if pair.work.witness and answer is not None else UNNAMED[relation]


_BOTH, _NEITHER = regions.Sides(True, True, True), regions.Sides(False, False, False)
_ABOVE, _BELOW = regions.Sides(True, False, False), regions.Sides(False, True, False)


def mesh_parts(first: Solid, second: Solid, poses: Poses, work: Work) -> Parts:
    """Return which of two overlapping polyhedra or boxes has a part outside the other, and whether their boundaries
    meet."""
    with np.errstate(all="ignore"):  # kernels, where they run uncompiled
        a, b, poses = mesh_body_of(first), mesh_body_of(second), unless_identity(poses)
        if poses == (None, None) and _have_equal_faces(a, b):
            return Parts(False, False, True)
        return _OverlappingPair(a, b, poses, Work(work.budget, witness=False), DETAIL).parts()


def _have_equal_faces(first: MeshBody, second: MeshBody) -> bool:
    """Return whether two meshes have the same triangles, in any order and orientation."""
    if _have_same_arrays(first, second):
        return True
    if len(first.faces) != len(second.faces) or first.arrays.extent.reach != second.arrays.extent.reach:
        return False
    return bool((_sorted_faces(first) == _sorted_faces(second)).all())


def _sorted_faces(mesh: MeshBody) -> FloatArray:
    """Return the triangles as rows (n, 9), corners of each row sorted, then rows sorted."""
    corners = mesh.arrays.vertices[mesh.arrays.triangles]
    order = np.lexsort(tuple(np.moveaxis(corners, 2, 0)[::-1]), axis=1)
    rows = np.take_along_axis(corners, order[:, :, None], axis=1).reshape(-1, 9)
    return rows[np.lexsort(rows.T[::-1])]


class _OverlappingPair(MeshPair):
    """Two bodies known to overlap; decides which of them has a part outside the other."""

    def parts(self) -> Parts:
        """Return whether the first, and whether the second body sticks out, and whether their boundaries meet."""
        self.seek = SEEK_CROSSING
        self.find_contacts()
        if self.is_settled:  # by a crossing: overlapping is known
            return Parts(True, True, True)
        sticks_out = [False, False]
        for own, ours, theirs in self._regions():
            for mine, other in ((ours.above, theirs.above), (ours.below, theirs.below)):
                sticks_out[own] |= mine and not other
                sticks_out[1 - own] |= other and not mine
            if all(sticks_out):
                break
        return Parts(sticks_out[0], sticks_out[1], len(self.contacts) > 0)

    def _regions(self) -> Iterator[tuple[int, regions.Sides, regions.Sides]]:
        """Yield (own, ours, theirs) of regions of patches, then of faces in contact: whether their body `own` (0, 1),
        and the other, is inside above and below."""
        for own in (0, 1):
            for place, theirs in ((INSIDE, _BOTH), (OUTSIDE, _NEITHER)):
                for patch in self.patches(own, self.contacts[:, own], place):
                    yield from ((own, ours, theirs) for ours in self.patch_sides(own, patch))
        for own in (0, 1):
            order = np.argsort(self.contacts[:, own], kind="stable")
            faces, firsts = np.unique(self.contacts[order, own], return_index=True)
            for face, kinds in zip(faces.tolist(), np.split(self.kinds[order], firsts[1:])):
                self.work.budget.check()
                yield from ((own, *sides) for sides in self._regions_of_face(own, face, set(kinds.tolist())))

    def _regions_of_face(self, own: int, face: int, kinds: set[int]) -> Iterator[tuple[regions.Sides, regions.Sides]]:
        """Yield (ours, theirs) of the regions of a face of body `own`. kinds: what `classify_in_detail` wrote for its
        contacts: NO_SHARED_AREA + bits of cut faces, SAME_SIDE, OPPOSITE."""
        body, other = self.exact[own], self.exact[1 - own]
        axis = body.axis(face)
        if axis < 0:
            return
        is_clean = self.state(own, face) == STATE_CLEAN
        is_cut = any(kind < SAME_SIDE and kind >> own & 1 for kind in kinds)
        if is_clean and not is_cut:  # one region, and its own body on one side of it: call that above
            if not kinds.isdisjoint((SAME_SIDE, OPPOSITE)):
                yield _ABOVE, _ABOVE if SAME_SIDE in kinds else _BELOW
                return
            for q in regions.points_within(body.corners(face)):
                theirs = regions.sides_over(other, q, axis, body.plane(face))
                if theirs is not None and theirs.above == theirs.below:
                    yield _ABOVE, theirs
                    return
        for q in regions.regions_of(body, face, [other] if is_clean else [other, body], self.work.budget):
            yield regions.sides_at(body, q, axis), regions.sides_at(other, q, axis)
