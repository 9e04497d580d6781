"""Poses of one mesh against another, one or many, in one kernel call; what it leaves open is settled pose by pose."""

from __future__ import annotations

from typing import Any

from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING, UNSETTLED
from engine.collision.meshes.contact_kinds import FACE_FACE, FLUSH, VERTEX_VERTEX, kind_of
from engine.collision.meshes.dual_traversal import (
    DONE,
    FULL,
    INTERRUPTED,
    SEEK_OVERLAP,
    SETTLED,
    Descent,
    Found,
    Place,
    Search,
    begin,
    place_bodies,
    search,
)
from engine.collision.meshes.mesh_arrays import MeshArrays, triangle_of
from engine.collision.meshes.parity import INSIDE, OUTSIDE, brought_back, locate_point
from engine.collision.meshes.placement import Placement, PoseArrays, defect_of
from engine.collision.meshes.touching import only_touch
from engine.collision.meshes.triangle_triangle import COPLANAR, with_pose
from engine.jit import bare_kernel, called, inline
from engine.predicates.loading import as_point3
from engine.predicates.posed import UNPOSED
from engine.types import UNDECIDED

_ROUNDS = 16
"""So often contacts fill the room for them before a pair is left to be looked at whole."""

RELATION, KIND, FIRST_FACE, SECOND_FACE, N_CONTACTS = range(5)
N_COLUMNS = 5
"""Of a row that says how a pair lies: its relation, or UNSETTLED; the kind of the contact that is the witness and its
faces, the caller's, where one was asked for and there is one; how many contacts decided, 0 where one settles all."""


@inline
def n_components_inside(source: MeshArrays, source_place: Placement, mesh: MeshArrays, place: Placement) -> int:
    """Return how many components lie inside a mesh that none of them meets, or UNSETTLED."""
    n_inside, defect = 0, defect_of(place)
    for item in range(source.components.shape[0] if mesh.has_inside else 0):
        p = as_point3(source.vertices, source.triangles[source.components[item], 0])
        where = locate_point(brought_back(p, source_place, place, defect), mesh)
        if where == INSIDE:
            n_inside += 1
        elif where != OUTSIDE:
            return UNSETTLED
    return n_inside


@inline
def relation_apart(first: MeshArrays, second: MeshArrays, place: Place) -> int:
    """Return the relation of two bodies without contact, or UNSETTLED: none or all of one lies inside the other."""
    in_second = n_components_inside(first, place.a, second, place.b)
    in_first = n_components_inside(second, place.b, first, place.a)
    if in_second == 0 and in_first == 0:
        return DISJOINT
    if in_second == first.components.shape[0] and in_first == 0:
        return FIRST_INSIDE_SECOND
    if in_second == 0 and in_first == second.components.shape[0]:
        return SECOND_INSIDE_FIRST
    return UNSETTLED


@called
def in_contact(s: Search, n: int, n_named: int, row: Any) -> None:
    """Fill the row of a pair by its n contacts, all there are, of which the first name the witness."""
    pairs, kinds = s.found
    poses, first, second = s.descent.poses, s.first, s.second
    for item in range(n):
        if kinds[item] == UNDECIDED:
            return
    put_in_order(first.faces, second.faces, pairs, kinds, n)
    own, their = 0 if s.place.a.is_posed else UNPOSED, 1 if s.place.b.is_posed else UNPOSED
    is_free, best, face, their_face = True, VERTEX_VERTEX + 1, 0, 0
    for item in range(n):
        i, j = pairs[item, 0], pairs[item, 1]
        t, u = with_pose(triangle_of(first, i), own), with_pose(triangle_of(second, j), their)
        axes = int(first.axis[i]), int(second.axis[j])
        kind, may_cut = kind_of(poses, t, axes[0], u, axes[1], s.place.posed_error, s.descent.signs)
        if kind == UNSETTLED:
            return
        f, g = first.faces[i], second.faces[j]
        if item < n_named and (kind < best or (kind == best and (f < face or (f == face and g < their_face)))):
            best, face, their_face = kind, f, g
        is_free, kinds[item] = is_free and not may_cut, s.descent.signs[FLUSH]  # the class is not asked any more
        if kind == FACE_FACE or not (is_free or item + 1 < n_named):
            break
    if only_touch(first, s.place.a, second, s.place.b, poses, pairs[:n], kinds[:n], is_free, s.flag):
        row[RELATION] = TOUCHING
        row[KIND], row[FIRST_FACE], row[SECOND_FACE] = best, face, their_face


@inline
def put_in_order(faces: Any, their_faces: Any, pairs: Any, kinds: Any, n: int) -> None:
    """Sort n pairs of triangles as `mesh_mesh.find_all_contacts` does: flush ones first, then by the callers' faces."""
    for item in range(1, n):
        i, j, kind = pairs[item, 0], pairs[item, 1], kinds[item]
        place = item
        while place > 0:
            p, q, other = pairs[place - 1, 0], pairs[place - 1, 1], kinds[place - 1]
            key, their_key = (faces[i], their_faces[j], i, j), (faces[p], their_faces[q], p, q)
            if (kind != COPLANAR and other == COPLANAR) or (
                (kind == COPLANAR) == (other == COPLANAR) and key > their_key
            ):
                break
            pairs[place, 0], pairs[place, 1], kinds[place] = p, q, other
            place -= 1
        pairs[place, 0], pairs[place, 1], kinds[place] = i, j, kind


@called
def settled_by(s: Search, is_named: bool, row: Any) -> None:
    """Fill the row of a pair by the one contact that settles it."""
    i, j = s.found.pairs[0, 0], s.found.pairs[0, 1]
    if is_named:
        own, their = 0 if s.place.a.is_posed else UNPOSED, 1 if s.place.b.is_posed else UNPOSED
        axis, their_axis = int(s.first.axis[i]), int(s.second.axis[j])
        if axis < 0 or their_axis < 0:
            return
        t, u = with_pose(triangle_of(s.first, i), own), with_pose(triangle_of(s.second, j), their)
        poses, error = s.descent.poses, s.place.posed_error
        row[KIND], _ = kind_of(poses, t, axis, u, their_axis, error, s.descent.signs)
        if row[KIND] == UNSETTLED:
            return
        row[FIRST_FACE], row[SECOND_FACE] = s.first.faces[i], s.second.faces[j]
    row[RELATION], row[N_CONTACTS] = OVERLAPPING if s.seek == SEEK_OVERLAP else TOUCHING, 0


@bare_kernel
def find_contacts(
    first: MeshArrays,
    first_pose: PoseArrays,
    second: MeshArrays,
    second_pose: PoseArrays,
    seek: int,
    is_start: bool,
    descent: Descent,
    found: Found,
    flag: Any,
) -> tuple[int, int]:
    """Run `search` for one pose of each body, from the start or from where it was left."""
    place, is_apart = place_bodies(first, first_pose, 0, second, second_pose, 0, descent)
    if is_start:
        begin(descent, is_apart)
    return search(Search(first, second, place, descent, seek, found, flag))


@bare_kernel
def relate_poses(
    first: MeshArrays,
    second: MeshArrays,
    still: PoseArrays,
    poses: PoseArrays,
    seek: int,
    n_named: int,
    descent: Descent,
    found: Found,
    rows: Any,
    flag: Any,
) -> None:
    """Fill rows (n, N_COLUMNS) int64 for the poses (n) of the second body; still: the one of the first.

    n_named: how many contacts name the witness; without any, relations are all that is told. `descent` and `found` are
    work space: pairs in contact at more faces than fit into `found`, and those no proof here settles, are UNSETTLED.
    """
    for item in range(rows.shape[0]):
        row = rows[item]
        row[RELATION] = row[KIND] = row[FIRST_FACE] = row[SECOND_FACE] = UNSETTLED
        place, is_apart = place_bodies(first, still, 0, second, poses, item, descent)
        begin(descent, is_apart)
        s = Search(first, second, place, descent, seek, found, flag)
        how, n_pairs = search(s)
        row[N_CONTACTS] = n_pairs
        if how == DONE and n_pairs == 0:
            row[RELATION] = relation_apart(first, second, place)
        elif how == DONE:
            in_contact(s, n_pairs, n_named, row)
        for _ in range(_ROUNDS):
            if how != FULL:
                break
            how, n_pairs = search(s)  # weak contacts so far: a later one may settle the question
        if how == INTERRUPTED:
            return
        if how == SETTLED:
            settled_by(s, n_named > 0, row)
