"""Many poses of one mesh against another in one kernel call; poses left UNSETTLED are settled one by one."""

from __future__ import annotations

from engine.collision.codes import (
    DISJOINT,
    FIRST_FACE,
    FIRST_INSIDE_SECOND,
    KIND,
    N_CONTACTS,
    OVERLAPPING,
    RELATION,
    SECOND_FACE,
    SECOND_INSIDE_FIRST,
    TOUCHING,
    UNSETTLED,
)
from engine.collision.meshes import contact_kinds as contact
from engine.collision.meshes import dual_traversal as dual
from engine.collision.meshes.mesh_arrays import MeshArrays
from engine.collision.meshes.parity import INSIDE, OUTSIDE, locate_point, to_local_frame
from engine.collision.meshes.placement import Placement, PoseArrays, defect_of
from engine.collision.meshes.separated import FEW, N_FACES, kind_of_pair, touches_apart
from engine.collision.meshes.touching import flush, relate_by_contacts
from engine.collision.meshes.triangle_triangle import COMMON_AREA, COPLANAR, CORNER, CROSSING
from engine.compiling.jit import called, inline, kernel
from engine.predicates.vectors import as_point3
from engine.types import UNDECIDED, FlagArray, Int8Array, IntArray

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
    first n_named. Sorts the contacts. If a class is UNDECIDED the row stays as it is."""
    pairs, kinds, _ = s.contacts
    first, second = s.first, s.second
    has_crossing = False
    for item in range(n):
        if kinds[item] == UNDECIDED:
            return
        has_crossing |= kinds[item] == CROSSING
    sort_named_first(first.faces, second.faces, pairs, kinds, n)
    best, face, their_face = contact.VERTEX_VERTEX + 1, 0, 0
    for item in range(min(n, n_named)):
        i, j = pairs[item, 0], pairs[item, 1]
        kind = contact.VERTEX_VERTEX
        if kinds[item] < CORNER:
            kind = contact.FACE_FACE if kinds[item] == COMMON_AREA else kind_of_pair(s, i, j)[0]
        f, g = first.faces[i], second.faces[j]
        if kind < best or (kind == best and (f < face or (f == face and g < their_face))):
            best, face, their_face = kind, f, g
        if s.flag[0] != 0:
            return
        if best <= contact.EDGE_FACE:  # none later is stronger
            break
    if n_named > 0 and best != UNSETTLED:
        row[KIND], row[FIRST_FACE], row[SECOND_FACE] = best, face, their_face
    row[RELATION] = relate_by_contacts(s, n, has_crossing)


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
            how, shares = flush(s, i, j, t, u, axis)
            if shares:
                kinds[item] = SAME_SIDE if how == OVERLAPPING else OPPOSITE
        if s.flag[0] != 0:
            return


@inline
def _rank_of(kind: int) -> int:
    return 0 if kind == COMMON_AREA else (1 if kind == COPLANAR else 2)


@inline
def sort_named_first(faces: IntArray, their_faces: IntArray, pairs: IntArray, kinds: Int8Array, n: int) -> None:
    """Move the first N_NAMED of n pairs of faces, with their classes, to the front, sorted: COMMON_AREA first, then
    COPLANAR, then the others; each by the caller's face numbers (`faces`, `their_faces`), then by index."""
    for item in range(1, n):
        i, j, kind = pairs[item, 0], pairs[item, 1], kinds[item]
        key, place = (_rank_of(kind), faces[i], their_faces[j], i, j), item
        while place > 0:
            before = min(place, contact.N_NAMED) - 1
            p, q, other = pairs[before, 0], pairs[before, 1], kinds[before]
            if key > (_rank_of(other), faces[p], their_faces[q], p, q):
                break
            pairs[place, 0], pairs[place, 1], kinds[place] = p, q, other
            place = before
        pairs[place, 0], pairs[place, 1], kinds[place] = i, j, kind


@kernel
def relate_poses(
    first: MeshArrays, second: MeshArrays, still: PoseArrays, poses: PoseArrays, seek: int, n_named: int,
    descent: dual.Descent, contacts: dual.Contacts, n_known: int, rows: IntArray, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill rows (n, N_COLUMNS) int64 (columns above) for n poses of the second body; still: n, or one, of the first.

    seek: goal that ends a search early (SEEK_...). n_named: number of contacts from which the witness is chosen; 0:
    only relations are written; DETAIL: only the details of the contacts. descent, contacts: work space; pairs with more
    contacts than fit, or without proof, are UNSETTLED. The contacts of the last pose stay there. n_known: number of
    contacts of one pose that `contacts` holds already, so that no search runs; 0: search. Stops early when the flag is
    set."""
    first_stage = 0 if len(contacts.met) == 0 and n_named >= 0 and seek != dual.SEEK_CONTACT else 2
    are_few = first.faces.shape[0] * second.faces.shape[0] <= FEW
    for item in range(rows.shape[0]):
        row = rows[item]
        row[RELATION] = row[KIND] = row[FIRST_FACE] = row[SECOND_FACE] = UNSETTLED
        place, is_apart = dual.place_bodies(
            first, still, min(item, len(still.rotations) - 1), second, poses, item, descent
        )
        s = dual.Search(first, second, place, descent, seek, contacts, flag)
        how, n_pairs, at = dual.PAUSED, n_known, dual.START
        if n_known > 0 or is_apart:
            how = dual.DONE
        is_parted, stage = False, first_stage
        while how == dual.PAUSED and not is_parted:  # bound: 3; a plane at one contact, then at a few, may separate
            pause = 1 if stage == 0 else (N_FACES if stage == 1 and not are_few else -1)
            how, n_pairs, at = dual.search(s, at, n_pairs, pause)
            if how == dual.PAUSED and contacts.kinds[0] != CROSSING:
                is_parted = touches_apart(s, n_pairs, n_named > 0, row)
            stage += 1
        row[N_CONTACTS] = 1 if is_parted else n_pairs
        if how == dual.INTERRUPTED:
            return
        if is_parted:
            continue
        if how == dual.SETTLED:
            i, j, is_overlap = (
                contacts.pairs[0, 0],
                contacts.pairs[0, 1],
                seek in (dual.SEEK_OVERLAP, dual.SEEK_CROSSING),
            )
            row[RELATION] = OVERLAPPING if is_overlap else TOUCHING
            row[N_CONTACTS] = 1 if is_overlap and contacts.kinds[0] != CROSSING else ONE_SETTLES
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
