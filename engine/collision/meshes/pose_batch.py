"""Many poses of one mesh against another in one kernel call; poses left UNSETTLED are settled one by one."""

from __future__ import annotations

from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING, UNSETTLED
from engine.collision.meshes import contact_kinds as contact
from engine.collision.meshes import dual_traversal as dual
from engine.collision.meshes.mesh_arrays import MeshArrays
from engine.collision.meshes.parity import INSIDE, OUTSIDE, locate_point, to_local_frame
from engine.collision.meshes.placement import Placement, PoseArrays, defect_of
from engine.collision.meshes.touching import DECIDED, flush, relate_by_contacts
from engine.collision.meshes.triangle_triangle import COPLANAR, CORNER, CROSSING, off_plane_point
from engine.compiling.jit import called, inline, kernel, merged
from engine.predicates.vectors import as_point3
from engine.types import UNDECIDED, FlagArray, Int8Array, IntArray

RELATION, KIND, FIRST_FACE, SECOND_FACE, N_CONTACTS = range(5)
N_COLUMNS = 5
"""| column | meaning |
|---|---|
| RELATION | the relation, or UNSETTLED |
| KIND, FIRST_FACE, SECOND_FACE | the witness, if requested and decided; the least face of a body that is inside |
| N_CONTACTS | number of contacts, ONE_SETTLES if one decides |
"""
ONE_SETTLES = -1

DETAIL = -1
NO_SHARED_AREA, SAME_SIDE, OPPOSITE = 16, 20, 21
"""In place of the class of a contact, see `classify_in_detail`."""


@inline
def n_components_inside(source: MeshArrays, source_place: Placement, mesh: MeshArrays, place: Placement) -> int:
    """Return how many components (faces connected through vertices) of `source` lie inside `mesh`, each under its
    placement, given that no faces meet; UNSETTLED if a location is undecided."""
    n_inside, defect = 0, defect_of(place)
    for item in range(source.components.shape[0] if mesh.has_inside else 0):
        p = as_point3(source.vertices, source.triangles[source.components[item], 0])
        where = locate_point(to_local_frame(p, source_place, place, defect), mesh)
        if where == INSIDE:
            n_inside += 1
        elif where != OUTSIDE:
            return UNSETTLED
    return n_inside


@inline
def relation_apart(first: MeshArrays, second: MeshArrays, place: dual.Place) -> int:
    """Return the relation code of two bodies without contact: disjoint or one inside the other; UNSETTLED if only some
    components of a body lie inside the other."""
    in_second = n_components_inside(first, place.a, second, place.b)
    in_first = n_components_inside(second, place.b, first, place.a)
    if in_second == 0 and in_first == 0:
        return DISJOINT
    if in_second == first.components.shape[0] and in_first == 0:
        return FIRST_INSIDE_SECOND
    return SECOND_INSIDE_FIRST if in_second == 0 and in_first == second.components.shape[0] else UNSETTLED


@called
def write_contact_row(s: dual.Search, n: int, n_named: int, row: IntArray) -> None:
    """Fill the row (N_COLUMNS,) of a pair from all its n contacts in ``s.contacts``, choosing the witness among the
    first n_named. Sorts the contacts. If a class is UNDECIDED the row stays as it is; else the class of each contact
    examined becomes DECIDED + bits, 3 a face, of the corners in the other face's plane."""
    pairs, kinds, _ = s.contacts
    first, second = s.first, s.second
    has_crossing = False
    for item in range(n):
        if kinds[item] == UNDECIDED:
            return
        has_crossing |= kinds[item] == CROSSING
    sort_named_first(first.faces, second.faces, pairs, kinds, n)
    is_free, is_named, best, face, their_face = True, n_named > 0, contact.VERTEX_VERTEX + 1, 0, 0
    for item in range(n):
        i, j = pairs[item, 0], pairs[item, 1]
        if kinds[item] >= CORNER:
            kind, may_cut, common = contact.VERTEX_VERTEX, 0, kinds[item] - CORNER
            s.descent.signs[contact.FLUSH] = 1 << common // 3 | 8 << common % 3
        else:
            kind, may_cut = kind_of_pair(s, i, j)
        kinds[item] = DECIDED | s.descent.signs[contact.FLUSH]
        f, g = first.faces[i], second.faces[j]
        if item < n_named and (kind < best or (kind == best and (f < face or (f == face and g < their_face)))):
            best, face, their_face = kind, f, g
        is_free, is_named = is_free and may_cut == 0, is_named and best != UNSETTLED
        if s.flag[0] != 0:
            return
        if kind == contact.FACE_FACE or not (
            is_free or (item + 1 < n_named and best > contact.EDGE_FACE)
        ):  # none later is stronger
            break
    if is_named:
        row[KIND], row[FIRST_FACE], row[SECOND_FACE] = best, face, their_face
    row[RELATION] = relate_by_contacts(s, n, is_free, has_crossing)


@called
def classify_in_detail(s: dual.Search, n: int) -> None:
    """Replace the class of each of the n contacts in ``s.contacts`` by its detail; if one class is UNDECIDED, all stay.

    | detail | meaning |
    |---|---|
    | NO_SHARED_AREA + bits | no common area; the open faces that may be cut: 1 the first body's, 2 the second's |
    | SAME_SIDE, OPPOSITE | STATE_CLEAN faces that share an area, bodies on the same or on opposite sides |
    """
    pairs, kinds, _ = s.contacts
    for item in range(n):
        if kinds[item] == UNDECIDED:
            return
    for item in range(n):
        i, j = pairs[item, 0], pairs[item, 1]
        kind, may_cut = (contact.VERTEX_VERTEX, 0) if kinds[item] >= CORNER else kind_of_pair(s, i, j)
        kinds[item] = NO_SHARED_AREA | may_cut
        if kind == contact.FACE_FACE:
            t, u, axis, _ = dual.exact_faces(s, i, j)
            how, shares = flush(s, i, j, t, u, axis, off_plane_point(t, axis))
            if shares:
                kinds[item] = SAME_SIDE if how == OVERLAPPING else OPPOSITE
        if s.flag[0] != 0:
            return


@merged
def kind_of_pair(s: dual.Search, i: int, j: int) -> tuple[int, int]:
    """Return what `classify_contact` gives for faces i and j: the kind of contact, and bits of the open faces that may
    be cut; UNSETTLED and BOTH if one has no area."""
    t, u, axis, their_axis = dual.exact_faces(s, i, j)
    if axis < 0 or their_axis < 0:
        s.descent.signs[contact.FLUSH] = 0
        return UNSETTLED, contact.BOTH
    return contact.classify_contact(s.descent.poses, t, axis, u, their_axis, dual.exact_error(s), s.descent.signs)


@inline
def sort_named_first(faces: IntArray, their_faces: IntArray, pairs: IntArray, kinds: Int8Array, n: int) -> None:
    """Move the first N_NAMED of n pairs of faces, with their classes, to the front, sorted: COPLANAR pairs first, then
    by the caller's face numbers (`faces`, `their_faces`), then by index."""
    for item in range(1, n):
        i, j, kind = pairs[item, 0], pairs[item, 1], kinds[item]
        key, place = (kind != COPLANAR, faces[i], their_faces[j], i, j), item
        while place > 0:
            before = min(place, contact.N_NAMED) - 1
            p, q, other = pairs[before, 0], pairs[before, 1], kinds[before]
            if key > (other != COPLANAR, faces[p], their_faces[q], p, q):
                break
            pairs[place, 0], pairs[place, 1], kinds[place] = p, q, other
            place = before
        pairs[place, 0], pairs[place, 1], kinds[place] = i, j, kind


@kernel
def relate_poses(
    first: MeshArrays, second: MeshArrays, still: PoseArrays, poses: PoseArrays, seek: int, n_named: int,
    descent: dual.Descent, contacts: dual.Contacts, n_known: int, rows: IntArray, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill rows (n, N_COLUMNS) int64 (columns above) for n poses of the second body; still: the only pose of the first.

    seek: goal that ends a search early (SEEK_...). n_named: number of contacts from which the witness is chosen; 0:
    only relations are written; DETAIL: only the details of the contacts. descent, contacts: work space; pairs with more
    contacts than fit, or without proof, are UNSETTLED. The contacts of the last pose stay there. n_known: number of
    contacts of one pose that `contacts` holds already, so that no search runs; 0: search. Stops early when the flag is
    set."""
    for item in range(rows.shape[0]):
        row = rows[item]
        row[RELATION] = row[KIND] = row[FIRST_FACE] = row[SECOND_FACE] = UNSETTLED
        place, is_apart = dual.place_bodies(first, still, 0, second, poses, item, descent)
        s = dual.Search(first, second, place, descent, seek, contacts, flag)
        how, n_pairs = (dual.DONE, n_known) if is_apart or n_known > 0 else dual.search(s)
        row[N_CONTACTS] = n_pairs
        if how == dual.INTERRUPTED:
            return
        if how == dual.SETTLED:
            row[RELATION], row[N_CONTACTS] = OVERLAPPING if seek == dual.SEEK_OVERLAP else TOUCHING, ONE_SETTLES
            i, j = contacts.pairs[0, 0], contacts.pairs[0, 1]
            if n_named > 0:
                row[KIND], _ = kind_of_pair(s, i, j)
                row[FIRST_FACE], row[SECOND_FACE] = first.faces[i], second.faces[j]
        elif n_pairs == 0:
            row[RELATION] = relation_apart(first, second, place)
            row[KIND] = contact.CONTAINED
            row[FIRST_FACE] = first.first_face if row[RELATION] == FIRST_INSIDE_SECOND else -1
            row[SECOND_FACE] = second.first_face if row[RELATION] == SECOND_INSIDE_FIRST else -1
        elif n_known > 0 or n_pairs <= dual.capacity_of(contacts):
            if n_named == DETAIL:
                classify_in_detail(s, n_pairs)
            else:
                write_contact_row(s, n_pairs, n_named, row)
