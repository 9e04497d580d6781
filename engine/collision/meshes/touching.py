"""Decide touching or overlapping from contacts without a proven crossing; compiled.

**Separating planes.** Two convex bodies that touch are separated by a plane through a face in contact, unless only
edges cross; so are many other bodies.

**Flush faces.** A clean face (`parity.py`) has its body on one side only. Two clean faces that share an area prove
overlapping if both bodies are on the same side, else neither body is on the other's inner side there. A face with an
edge across an open clean face, continuing to its inner side, has points in the open interior: overlapping. If there are
no such contacts, all of the inner side of each face lies inside or outside the other body: outside, if they share an
area; else any point of the face off the other body decides.

**By locations.** If the open interiors intersect, the border of their intersection has a piece with area on some face
of either body: on one with a point in the other's open interior, or on one flush with a face of the other. If no
contact is flush or cuts an open face (`classify_contact`), each open face in contact meets the other body in single
points only, so all of it lies on one side, and any of its corners off the other body decides which. A patch of faces
without contact has such a corner too, or is a component by itself. So if all these are outside, no piece of a face lies
inside. One that is inside proves that the interiors intersect, if its own body is inside next to it.
"""

from __future__ import annotations

import numpy as np

from engine.bounding.bvh import STACK
from engine.collision.codes import OVERLAPPING, TOUCHING, UNSETTLED
from engine.collision.meshes import parity
from engine.collision.meshes.dual_traversal import Search, exact_error, exact_faces, relation_of_flush
from engine.collision.meshes.mesh_arrays import STATE_STACKED, MeshArrays, in_tree, triangle_of
from engine.collision.meshes.placement import Placement, defect_of
from engine.collision.meshes.separated import N_FACES, separating_contact
from engine.collision.meshes.triangle_triangle import (
    CORNER,
    Facet,
    Signs,
    corner,
    is_on_face,
    off_plane_point,
    passes_within,
    separation,
    sides_of,
)
from engine.compiling.jit import allocating, called, inline
from engine.predicates.posed import UNPOSED, PosedPoint3
from engine.predicates.vectors import as_point3, largest_of, minus
from engine.types import UNDECIDED, BoolArray, FloatArray, IntArray


@called
def _edge_enters_interior(
    s: Search, t: Facet, sides: Signs, u: Facet, off: PosedPoint3, axis: int, mesh: MeshArrays, face: int
) -> int:
    """Return OVERLAPPING if an edge of t lies in the plane of u and passes through the open face u, and the rest of t
    is on the inner side of u's body; else TOUCHING, or UNSETTLED if a sign or the inner side is unknown. sides: of t's
    corners at the plane of u; mesh, face: u's mesh and its number there; off, axis: as in `turn_in_plane`."""
    for k in range(3):
        a, b, apex = sides[k], sides[(k + 1) % 3], sides[(k + 2) % 3]
        if a == 0 and b == 0:
            how = passes_within(s.descent.poses, corner(t, k), corner(t, k + 1), u, off, axis, exact_error(s))
            if how == 1:
                inner = parity.inner_side(mesh, face, s.descent.poses)
                how = UNDECIDED if inner == parity.SIDE_UNKNOWN else int(inner == apex)
            return UNSETTLED if how == UNDECIDED else (OVERLAPPING if how == 1 else TOUCHING)
    return TOUCHING


@called
def flush(s: Search, i: int, j: int, t: Facet, u: Facet, axis: int) -> tuple[int, bool]:
    """Return (relation, shares) of coplanar faces i and j with corners t and u. OVERLAPPING: they share an area and
    both bodies lie on the same side; TOUCHING: not so; UNSETTLED: undecided. shares: whether they share an area. axis:
    along it t has an area; off: a point off the plane."""
    how = separation(s.descent.poses, t, u, axis, exact_error(s))
    if how == UNDECIDED or how >= 0:
        return (UNSETTLED if how == UNDECIDED else TOUCHING), False
    how = relation_of_flush(s, i, j)
    return how, how != UNSETTLED


@called
def _corners_on_face(
    poses: FloatArray, t: Facet, sides: Signs, u: Facet, off: PosedPoint3, axis: int, error: float
) -> int:
    """Return bits of the corners of t (1, 2, 4) that lie on the closed face u, -1 if undecided. sides: of the corners
    at the plane of u; off, axis: as in `turn_in_plane`."""
    corners = 0
    for k in range(3):
        how = is_on_face(poses, corner(t, k), u, off, axis, error) if sides[k] == 0 else 0
        if how == UNDECIDED:
            return -1
        corners |= how << k
    return corners


@called
def decide_contact(s: Search, item: int) -> tuple[int, bool]:
    """Return (relation, shares) for contact number ``item``. OVERLAPPING: it proves that the open interiors intersect;
    TOUCHING: it does not; UNSETTLED: undecided. shares: whether its faces share an area. Its class becomes DECIDED +
    bits, 3 a face, of the corners that lie on the other closed face."""
    i, j, kinds = s.contacts.pairs[item, 0], s.contacts.pairs[item, 1], s.contacts.kinds
    if kinds[item] >= CORNER:
        common = kinds[item] - CORNER
        kinds[item] = DECIDED | 1 << common // 3 | 8 << common % 3
        return TOUCHING, False
    t, u, axis, their_axis = exact_faces(s, i, j)
    if axis < 0 or their_axis < 0:
        return UNSETTLED, False
    poses, error, are_unposed = s.descent.poses, exact_error(s), t.p.pose == UNPOSED and u.p.pose == UNPOSED
    sides, their_sides = sides_of(poses, u, t, error), sides_of(poses, t, u, error)
    if UNDECIDED in sides or UNDECIDED in their_sides:
        return UNSETTLED, False
    off, their_off = off_plane_point(t, axis), off_plane_point(u, their_axis)
    if not np.isfinite(off.x + off.y + off.z + their_off.x + their_off.y + their_off.z):
        return UNSETTLED, False
    flat, their_flat = (axis, their_axis) if are_unposed else (-1, -1)
    on = _corners_on_face(poses, t, sides, u, their_off, their_flat, error)
    theirs_on = _corners_on_face(poses, u, their_sides, t, off, flat, error)
    if on < 0 or theirs_on < 0:
        return UNSETTLED, False
    kinds[item] = DECIDED | on | theirs_on << 3
    if sides[0] == 0 and sides[1] == 0 and sides[2] == 0:
        return flush(s, i, j, t, u, axis)
    by_own = _edge_enters_interior(s, t, sides, u, their_off, their_flat, s.second, j)
    if by_own == OVERLAPPING and parity.state_of(s.first, i, poses) == STATE_STACKED:
        by_own = UNSETTLED
    by_theirs = _edge_enters_interior(s, u, their_sides, t, off, flat, s.first, i)
    if by_theirs == OVERLAPPING and parity.state_of(s.second, j, poses) == STATE_STACKED:
        by_theirs = UNSETTLED
    if by_own == OVERLAPPING or by_theirs == OVERLAPPING:
        return OVERLAPPING, False
    return (UNSETTLED if by_own == UNSETTLED or by_theirs == UNSETTLED else TOUCHING), False


@allocating
def relate_clean(s: Search, n: int) -> int:
    """Return OVERLAPPING or TOUCHING from n contacts, none a crossing, if the faces that matter are STATE_CLEAN; else
    UNSETTLED."""
    shares = np.zeros(n, np.bool_)
    for item in range(n):
        how, shares[item] = decide_contact(s, item)
        if how != TOUCHING or s.flag[0] != 0:
            return how if how == OVERLAPPING else UNSETTLED
    return relate_by_locations(s, n, shares)


@allocating
def relate_by_contacts(s: Search, n: int, has_crossing: bool) -> int:
    """Return OVERLAPPING or TOUCHING if the n contacts of two placed bodies decide it, else UNSETTLED. has_crossing:
    some contact is a crossing, though none proves overlapping."""
    if separating_contact(s, min(N_FACES, n)) >= 0:
        return TOUCHING
    return relate_clean(s, n) if s.first.has_inside and s.second.has_inside and not has_crossing else UNSETTLED


DECIDED = 64
"""Class of a contact after `decide_contact`; its low bits, three a face, name the corners on the other face."""


@inline
def hash_slot(known: IntArray, vertex: int) -> int:
    """Return the slot of key ``vertex`` in an open-addressing hash table (n,), n a power of two, -1 in free slots; the
    free slot for it if it is not there."""
    last = known.shape[0] - 1
    place = vertex & last
    while known[place] >= 0 and known[place] != vertex:  # bound: half the places are free
        place = (place + 1) & last
    return place


@allocating
def may_be_corner(own: parity.OwnPoint, mesh: MeshArrays) -> bool:
    """Return whether a point coincides, within its error, with a vertex of a mesh. Faces without a listed contact are
    tested too."""
    local, slack, stack = in_tree(mesh, own.point), parity.SLACK + own.error / mesh.scale, np.empty(STACK, np.int32)
    box = parity.box_between(local, local, slack)
    stack[0] = 0
    face, n = parity.next_face(mesh, stack, 1, box)
    while face >= 0:  # bound: the faces of the body
        t = triangle_of(mesh, face)
        if min(largest_of(minus(t.p, own.point)), largest_of(minus(t.q, own.point))) <= 2.0 * own.error:
            return True
        if not largest_of(minus(t.r, own.point)) > 2.0 * own.error:
            return True
        face, n = parity.next_face(mesh, stack, n, box)
    return False


@called
def where_faces_are(
    s: Search, own: int, n: int, shares: BoolArray, known: IntArray, is_flush: BoolArray, sharing: IntArray
) -> int:
    """Locate the faces of body `own` (0, 1) in its n contacts, and its components, in the other body.

    | result | meaning |
    |---|---|
    | OUTSIDE | every such face and component has a point proven outside, or shares an area with a face of the other |
    | INSIDE | a point of one is proven inside, and its own body has an interior next to the face |
    | UNDECIDED | else |

    ``s.contacts``: column `own` of pairs (n, 2) has the faces; kinds (n,) are DECIDED + bits, 3 a face, of the corners
    on the other face. shares (n,): whether the faces of a contact share an area.
    Scratch, 6 n slots or more: hash tables (`hash_slot`) of vertices, known, with is_flush, whether one touches the
    other body, and of the faces that share an area, sharing."""
    contacts, flush, met = s.contacts
    source, mesh = (s.first, s.second) if own == 0 else (s.second, s.first)
    place, target = (s.place.a, s.place.b) if own == 0 else (s.place.b, s.place.a)
    known[:] = sharing[:] = -1
    for item in range(n):
        for k in range(3):
            if flush[item] >> (3 * own + k) & 1:
                at = hash_slot(known, source.triangles[contacts[item, own], k])
                known[at], is_flush[at] = source.triangles[contacts[item, own], k], True
        if shares[item]:
            sharing[hash_slot(sharing, contacts[item, own])] = contacts[item, own]
    defect, before = defect_of(target), -1
    for item in range(n + source.components.shape[0]):
        face = contacts[item, own] if item < n else source.components[item - n]
        if face == before:
            continue
        before, n_outside = face, 0
        for k in range(3):
            vertex, where = source.triangles[face, k], parity.OUTSIDE
            at = hash_slot(known, vertex)
            if known[at] < 0:
                point = parity.to_local_frame(as_point3(source.vertices, vertex), place, target, defect)
                where = UNDECIDED if len(met) > 0 and may_be_corner(point, mesh) else parity.locate_point(point, mesh)
                if where != parity.OUTSIDE:
                    return (
                        parity.INSIDE if where == parity.INSIDE and has_interior_beside(s, source, face) else UNDECIDED
                    )
                if item < n:
                    known[at], is_flush[at] = vertex, False
            n_outside += known[at] < 0 or not is_flush[at]
        if n_outside == 0 and sharing[hash_slot(sharing, face)] != face:
            where = _where_within(source, face, place, mesh, target, defect)
            if where != parity.OUTSIDE:
                return parity.INSIDE if where == parity.INSIDE and has_interior_beside(s, source, face) else UNDECIDED
    return parity.OUTSIDE


@called
def _where_within(
    source: MeshArrays, face: int, place: Placement, mesh: MeshArrays, target: Placement, defect: float
) -> int:
    """Return the location, INSIDE or OUTSIDE, of a sampled point within a face of `source`, placed by `place`, in
    `mesh`, placed by `target`; UNDECIDED if no sample decides. defect: `defect_of` target. Placing rounds such a point
    even where it rounds no vertex: each of two sums by 2^-53 of its terms."""
    for item in range(3):
        p = parity.point_within(source, face, item)
        q = parity.to_local_frame(p.point, place, target, defect)
        moved = largest_of(p.point) + largest_of(place.shift) + largest_of(target.shift)
        where = parity.locate_point(parity.OwnPoint(q.point, q.error + 2.0 * p.error + 2.0**-50 * moved), mesh)
        if where in (parity.INSIDE, parity.OUTSIDE):
            return where
    return UNDECIDED


@inline
def has_interior_beside(s: Search, source: MeshArrays, face: int) -> bool:
    """Return whether a body has an interior next to a face of it: the face has an area and is not STATE_STACKED."""
    return bool(source.axis[face] >= 0 and parity.state_of(source, face, s.descent.poses) != STATE_STACKED)


@allocating
def relate_by_locations(s: Search, n: int, shares: BoolArray) -> int:
    """Return OVERLAPPING or TOUCHING if the locations of the faces in the n contacts decide it, else UNSETTLED. shares
    (n,): whether the two faces of a contact share an area."""
    n_places = 16
    while n_places < 6 * n:
        n_places *= 2
    known, is_flush, sharing = np.empty(n_places, np.int64), np.empty(n_places, np.bool_), np.empty(n_places, np.int64)
    for own in range(2):
        where = where_faces_are(s, own, n, shares, known, is_flush, sharing)
        if where != parity.OUTSIDE:
            return OVERLAPPING if where == parity.INSIDE else UNSETTLED
    return TOUCHING
