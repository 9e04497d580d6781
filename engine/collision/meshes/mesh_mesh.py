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

import threading
from typing import Literal

import numpy as np

from engine.arrays import Int8Array, IntArray
from engine.collision.codes import DISJOINT, UNSETTLED
from engine.collision.meshes.contact_kinds import N_NAMED, STRENGTH
from engine.collision.meshes.dual_traversal import (
    FULL,
    SEEK_CONTACT,
    SEEK_OVERLAP,
    SEEK_PIERCING_BY_FIRST,
    SEEK_PIERCING_BY_SECOND,
    SETTLED,
    new_descent,
    new_found,
)
from engine.collision.meshes.exact_regions import even_sides, pieces_of_segment, regions_of, sides_at, sides_within
from engine.collision.meshes.exact_triangles import as_simplex, classify_exact
from engine.collision.meshes.mesh_arrays import STATE_CLEAN, STATE_CROSSED, MeshBody, mesh_body_of
from engine.collision.meshes.mesh_pair import MeshPair, met_by_face, simplest, what_to_seek
from engine.collision.meshes.parity import INSIDE
from engine.collision.meshes.pose_batch import N_COLUMNS, N_CONTACTS, RELATION, find_contacts, relate_poses
from engine.collision.meshes.touching import CUTTING, ONLY_TOUCHING
from engine.collision.meshes.triangle_triangle import APART, COPLANAR, CROSSING
from engine.collision.result import NO_CONTACT, RELATIONS, UNNAMED, Collision, Witness, Work
from engine.direct import entry_of
from engine.solids.base import Solid
from engine.solids.pose import Pose
from engine.types import UNDECIDED, Relation


def look_at_regions(pair: MeshPair, own: int, face: int, met: IntArray | None) -> tuple[bool, bool]:
    """Tell whether both insides come up to one side of a region of a face; and whether one is inside the other."""
    body, other = pair.exact[own], pair.exact[1 - own]
    axis = body.axis(face)
    if axis < 0:
        return False, False
    cutters = [other]
    if body.mesh.has_inside and pair.state(own, face) != STATE_CLEAN:
        cutters.append(body)
    elif body.mesh.has_inside and met is not None:
        overlaps = _overlaps_evenly(pair, own, face, met)
        if overlaps is not None:
            return overlaps, False
    pierces = False
    for q in regions_of(body, face, cutters, pair.work.budget):
        theirs = sides_at(other, q, axis)
        if theirs.above or theirs.below:
            ours = sides_at(body, q, axis)
            if (ours.above and theirs.above) or (ours.below and theirs.below):
                return True, False
        pierces = pierces or theirs.at
    return False, pierces


def _overlaps_evenly(pair: MeshPair, own: int, face: int, met: IntArray) -> bool | None:
    """Tell whether both insides come up to one side of a clean face, None where that is not known.

    It is known where the other's status is one all along the side of the face's inside. No other answer is missing: a
    point of the face in the other's open interior has both insides beside it.
    """
    body, other = pair.exact[own], pair.exact[1 - own]
    is_even_above, is_even_below = even_sides(body, face, other, met)
    if not (is_even_above or is_even_below):
        return None
    sides = sides_within(body, face, other, met)
    if sides is None:
        return None
    ours, theirs = sides
    if (ours.above and not is_even_above) or (ours.below and not is_even_below):
        return None
    return (ours.above and theirs.above) or (ours.below and theirs.below)


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


_ROOM = 1024
ROOM_AT_ONCE = 256
_PROBED = 8


def find_all_contacts(pair: MeshPair, *, looks_at_regions: bool = True) -> tuple[IntArray, bool]:
    """Return the pairs of faces (n, 2) with a common point, ascending, or the one that settles all; tell if it does.

    looks_at_regions: whether regions that prove overlapping settle it too; without, only a crossing does.
    """
    found, descent, budget = new_found(_ROOM), new_descent(), pair.work.budget
    found_pairs: list[IntArray] = []
    found_kinds: list[Int8Array] = []
    (first, second), (first_pose, second_pose) = (mesh.arrays for mesh in pair.meshes), pair.posed
    how = FULL
    while how == FULL:  # bound: each turn finds new pairs
        how, n_pairs = find_contacts(
            first, first_pose, second, second_pose, pair.seek, not found_pairs, descent, found, budget.flag
        )
        budget.check()
        if how == SETTLED:
            return found.pairs[:1], True
        found_pairs.append(found.pairs[:n_pairs].copy())
        found_kinds.append(found.kinds[:n_pairs].copy())
        may_probe = how == FULL and len(found_pairs) == 1 and looks_at_regions and pair.seek == SEEK_OVERLAP
        if may_probe and pair.judge(found_pairs[0], are_all=False) == CUTTING and _is_overlap_near(pair, *found):
            return found.pairs[:1], True
    pairs, kinds = np.concatenate(found_pairs), np.concatenate(found_kinds)
    faces = [pair.meshes[own].faces[pairs[:, own]] for own in (0, 1)]
    order = np.lexsort((pairs[:, 1], pairs[:, 0], faces[1], faces[0]))  # the caller's faces, then triangles
    return _settled(pair, pairs[order], kinds[order])


def _settled(pair: MeshPair, pairs: IntArray, kinds: Int8Array) -> tuple[IntArray, bool]:
    """Find the classes that kernels left open; return the pairs with a common point, or the one that settles all."""
    open_ones = np.flatnonzero(kinds == UNDECIDED)
    pair.work.n_beyond_filter += len(pairs)
    pair.work.n_rational += len(open_ones)
    for index in open_ones:
        pair.work.budget.check()
        i, j = int(pairs[index, 0]), int(pairs[index, 1])
        a, b = pair.exact
        kinds[index] = classify_exact(a.corners(i), b.corners(j), a.plane(i), b.plane(j))
        if kinds[index] != APART and _is_settled_by(pair, int(kinds[index]), i, j):
            return pairs[index : index + 1], True
    meet = np.concatenate([np.flatnonzero(kinds == COPLANAR), np.flatnonzero((kinds != APART) & (kinds != COPLANAR))])
    return pairs[meet], False


def _is_overlap_near(pair: MeshPair, pairs: IntArray, kinds: Int8Array) -> bool:
    """Tell whether the regions of a few faces in contact prove overlapping; such a pair is put first."""
    sure = np.flatnonzero(kinds != UNDECIDED)
    for index in sure[:: max(1, len(sure) // _PROBED)].tolist():
        if look_at_regions(pair, 0, int(pairs[index, 0]), None)[0]:
            pairs[0] = pairs[index]
            return True
    return False


def _is_settled_by(pair: MeshPair, kind: int, i: int, j: int) -> bool:
    """The rule of `dual_traversal.settles` for a class found exactly."""
    if pair.seek == SEEK_CONTACT:
        return True
    if kind != CROSSING:
        return False
    first, second = pair.state(0, i), pair.state(1, j)
    if pair.seek == SEEK_PIERCING_BY_FIRST:
        return second == STATE_CLEAN
    if pair.seek == SEEK_PIERCING_BY_SECOND:
        return first == STATE_CLEAN
    return max(first, second) <= STATE_CROSSED and min(first, second) == STATE_CLEAN


class _WorkSpace(threading.local):
    """What one call of a kernel fills; calls of one thread take turns."""

    def __init__(self) -> None:
        self.descent, self.found, self.rows = new_descent(), new_found(ROOM_AT_ONCE), np.empty((1, N_COLUMNS), np.int64)


SPACE = _WorkSpace()


def mesh_mesh(first: Solid, second: Solid, first_pose: Pose | None, second_pose: Pose | None, work: Work) -> Collision:
    """Return the relation of two polyhedra, surfaces or 3D boxes."""
    a, b = mesh_body_of(first), mesh_body_of(second)
    if first_pose is not None or second_pose is not None:
        a, first_pose, b, second_pose = simplest(a, first_pose, b, second_pose)
    seek, rows, n_named = what_to_seek(a, b, work), SPACE.rows, N_NAMED if work.witness else 0
    entry_of(relate_poses)(
        a.arrays, b.arrays, a.posed(first_pose), b.posed(second_pose), seek, n_named,
        SPACE.descent, SPACE.found, rows, work.budget.flag,
    )  # fmt: skip
    row: list[int] = rows[0].tolist()
    if row[RELATION] != UNSETTLED:
        work.n_beyond_filter += row[N_CONTACTS]
        if row[RELATION] == DISJOINT or not work.witness:
            return UNNAMED[row[RELATION]]
        return Collision(RELATIONS[row[RELATION]], witness_of(row, a, b, seek))
    work.budget.check()
    with np.errstate(all="ignore"):  # kernels, where they run uncompiled
        return _relation(MeshPair(a, first_pose, b, second_pose, work))


def witness_of(row: list[int], first: MeshBody, second: MeshBody, seek: int) -> Witness:
    """Return the witness that a row of `relate_poses` holds, of two bodies that are not disjoint."""
    relation, kind, first_face, second_face, n_contacts = row
    if kind != UNSETTLED:
        pierces = n_contacts == 0 and seek in (SEEK_PIERCING_BY_FIRST, SEEK_PIERCING_BY_SECOND)
        return Witness(STRENGTH[kind], first_face, second_face, "", pierces)
    if relation == Relation.FIRST_INSIDE_SECOND:
        return Witness("containment", first.arrays.first_face, -1, "second")
    return Witness("containment", -1, second.arrays.first_face, "first")


def _relation(pair: MeshPair) -> Collision:
    """Return the answer: by contacts, by patches, by regions."""
    contacts, is_settled = find_all_contacts(pair)
    if is_settled:
        relation = Relation.OVERLAPPING if pair.seek == SEEK_OVERLAP else Relation.TOUCHING
        pierces = pair.seek in (SEEK_PIERCING_BY_FIRST, SEEK_PIERCING_BY_SECOND)
        return Collision(relation, pair.named(contacts, piercing=pierces))
    if len(contacts) and pair.judge(contacts, are_all=True) == ONLY_TOUCHING:
        return Collision(Relation.TOUCHING, pair.named(contacts))
    patches = [pair.patches(own, contacts[:, own], INSIDE) for own in (0, 1)]
    if not len(contacts):
        n_inside = [sum(map(len, found)) for found in patches]
        if n_inside == [0, 0]:
            return NO_CONTACT
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
