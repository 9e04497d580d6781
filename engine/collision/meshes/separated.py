"""Two bodies that touch, separated by a plane: the strongest contact, without a list of all; compiled.

**Planes of faces.** All common points lie in each plane that separates. So of either body only faces with live corners
count, those that lie in all these planes, and their number bounds the kind of contact: 3, the face lies in the planes;
2, an edge of it; 1, a corner. A face in the planes and another with an edge there have an EDGE_FACE contact at best. Of
the faces with no live corner but one that they share, each has the contacts of the others: that with the lowest number
is tried. The strongest contact is searched from the strongest kind on, and a weaker one no longer once one is found;
of large bodies in the tree of the second.

**A common corner.** Where all other vertices lie strictly on two sides of some plane through a vertex of both bodies,
one body on each, that vertex is their only common point. The direction across is that of a perceptron.

Source of the perceptron: F. Rosenblatt, The perceptron: a probabilistic model for information storage and organization
in the brain, 1958.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.bounding.bvh import STACK
from engine.collision.codes import FIRST_FACE, KIND, RELATION, SECOND_FACE, TOUCHING, UNSETTLED
from engine.collision.meshes import contact_kinds as contact
from engine.collision.meshes import dual_traversal as dual
from engine.collision.meshes.mesh_arrays import MeshArrays, in_tree
from engine.collision.meshes.parity import SLACK, box_between, next_face, to_local_frame
from engine.collision.meshes.placement import defect_of, placed
from engine.collision.meshes.separating_planes import Vertices, facet_of, separates, vertex_at
from engine.collision.meshes.triangle_triangle import APART, COMMON_AREA, Facet, corner, sign_of_four
from engine.compiling.jit import allocating, called, inline, merged
from engine.predicates.posed import are_equal_exact
from engine.predicates.vectors import as_point3, dot, largest_of, length, minus, negative
from engine.types import UNDECIDED, BoolArray, FloatArray, Int32Array, IntArray, Point3

FEW = 4096
"""Product of the numbers of faces up to which all pairs of live faces are tried; a tree lists fewer of larger ones."""
_MOST_TRIED = 1 << 14
"""Most pairs of faces of which the kind of contact is computed."""
_TURNS = 24
"""Most passes of the perceptron over all vertices."""


class Live(NamedTuple):
    """The vertices of one body that lie in all separating planes so far. vertices (n,) bool: which do; lowest (n,): of
    the faces that have no such corner but this, the one with the lowest number, -1 for none; faces: the numbers of
    faces with such corners, ascending, of those with one only the lowest; counts: how many each of these has."""

    vertices: Any
    lowest: Any
    faces: Any
    counts: Any


@merged
def kind_of_pair(s: dual.Search, i: int, j: int) -> tuple[int, int]:
    """Return what `classify_contact` gives for faces i and j: the kind of contact, and bits of the open faces that may
    be cut; UNSETTLED and BOTH if one has no area."""
    t, u, axis, their_axis = dual.exact_faces(s, i, j)
    if axis < 0 or their_axis < 0:
        return UNSETTLED, contact.BOTH
    return contact.classify_contact(s.descent.poses, t, axis, u, their_axis, dual.exact_error(s), s.descent.signs)


@allocating
def _new_live(mesh: MeshArrays) -> Live:
    n, n_vertices = mesh.faces.shape[0], mesh.vertices.shape[0]
    vertices = np.empty(n_vertices, np.bool_)
    vertices[:] = True
    return Live(vertices, np.empty(n_vertices, np.int64), np.empty(n, np.int64), np.empty(n, np.int64))


@inline
def _keep_in_plane(poses: FloatArray, plane: Facet, v: Vertices, is_live: BoolArray, error: float) -> int:
    """Clear is_live (n,) at vertices off the plane through the corners of `plane`; return how many are live."""
    n = 0
    for vertex in range(is_live.shape[0]):
        if is_live[vertex]:
            is_live[vertex] = sign_of_four(poses, plane.p, plane.q, plane.r, vertex_at(v, vertex), error) == 0
            n += is_live[vertex]
    return n


@called
def _keep_in_planes(s: dual.Search, i: int, j: int, own: Live, their: Live) -> bool:
    """Clear the vertices that lie off a plane that separates the bodies from ``own.vertices`` and ``their.vertices``;
    return whether there is such a plane. Planes tried: those of face i of the first and face j of the second body; if i
    is negative, those of all faces with a live corner."""
    poses, error, is_parted, (u, v) = s.descent.poses, dual.exact_error(s), False, dual.vertices_of(s)
    n_first = s.first.faces.shape[0]
    for item in range(2 if i >= 0 else n_first + s.second.faces.shape[0]):
        is_own = item == 0 if i >= 0 else item < n_first
        face = (i if is_own else j) if i >= 0 else (item if is_own else item - n_first)
        if (s.first.axis[face] if is_own else s.second.axis[face]) < 0:
            continue
        n = _n_live(s.first, face, own) if is_own else _n_live(s.second, face, their)
        if i < 0 and (n == 0 or n == 3):  # no contact there, or a plane that was tried
            continue
        plane = facet_of(s.first, u, face) if is_own else facet_of(s.second, v, face)
        # most planes cut the other body
        if separates(poses, plane, v, u, error) if is_own else separates(poses, plane, u, v, error):
            n_live = _keep_in_plane(poses, plane, u, own.vertices, error)
            their_n = _keep_in_plane(poses, plane, v, their.vertices, error)
            is_parted = True
            if i >= 0 or n_live == 1 or their_n == 1:
                break
    return is_parted


@inline
def _n_live(mesh: MeshArrays, face: int, live: Live) -> int:
    """Return how many corners of a face are live."""
    t, is_live = mesh.triangles, live.vertices
    return int(is_live[t[face, 0]]) + int(is_live[t[face, 1]]) + int(is_live[t[face, 2]])


@inline
def _only_live(mesh: MeshArrays, face: int, live: Live) -> int:
    """Return a live corner of a face: the only one, if there is one."""
    t = mesh.triangles
    return t[face, 0] if live.vertices[t[face, 0]] else (t[face, 1] if live.vertices[t[face, 1]] else t[face, 2])


@inline
def _list_faces(mesh: MeshArrays, live: Live) -> int:
    """Fill ``live.lowest``, ``live.faces`` and ``live.counts`` from ``live.vertices``; return the number of faces
    listed."""
    live.lowest[:] = -1
    for face in range(mesh.faces.shape[0]):
        if _n_live(mesh, face, live) == 1:
            at = _only_live(mesh, face, live)
            if live.lowest[at] < 0 or mesh.faces[face] < mesh.faces[live.lowest[at]]:
                live.lowest[at] = face
    n = 0
    for face in range(mesh.faces.shape[0]):
        count = _n_listed(mesh, face, live)
        if count > 0:
            live.faces[n], live.counts[n] = face, count
            n += 1
    return n


@inline
def _n_listed(mesh: MeshArrays, face: int, live: Live) -> int:
    """Return how many corners of a face are live, 0 if it is not to be listed."""
    count = _n_live(mesh, face, live)
    return 0 if count == 1 and live.lowest[_only_live(mesh, face, live)] != face else count


@inline
def _box_of_live(s: dual.Search, face: int, own: Live, defect: float) -> tuple[Any, Any]:
    """Return a box around the live corners of a face of the first body, in tree coordinates of the second (as
    `box_between`). defect: `defect_of` the second's placement."""
    low, high, slack = Point3(np.inf, np.inf, np.inf), Point3(-np.inf, -np.inf, -np.inf), SLACK
    for k in range(3):
        vertex = s.first.triangles[face, k]
        if own.vertices[vertex]:
            there = to_local_frame(as_point3(s.first.vertices, vertex), s.place.a, s.place.b, defect)
            p, slack = in_tree(s.second, there.point), max(slack, SLACK + there.error / s.second.scale)
            low = Point3(min(low.x, p.x), min(low.y, p.y), min(low.z, p.z))
            high = Point3(max(high.x, p.x), max(high.y, p.y), max(high.z, p.z))
    return box_between(low, high, slack)


@inline
def _strongest_kind(count: int, their_count: int) -> int:
    """Return the strongest kind of contact that two faces can have of which so many corners lie in the separating
    plane: of 3 and 3 FACE_FACE, of 3 and 2 EDGE_FACE, ..."""
    more, less = max(count, their_count), min(count, their_count)
    if more == 3:
        return contact.FACE_FACE if less == 3 else (contact.EDGE_FACE if less == 2 else contact.VERTEX_FACE)
    return contact.VERTEX_VERTEX if more == 1 else (contact.EDGE_EDGE if less == 2 else contact.VERTEX_EDGE)


@inline
def _kind_of_faces(s: dual.Search, i: int, j: int) -> int:
    """Return the kind of contact of faces i and j, VERTEX_VERTEX + 1 if they have no common point, or UNSETTLED."""
    found = dual.settle_class(s, i, j)
    if found == APART:
        return contact.VERTEX_VERTEX + 1
    if found == COMMON_AREA:
        return contact.FACE_FACE
    return UNSETTLED if found == UNDECIDED else kind_of_pair(s, i, j)[0]


N_FACES = 32
"""Number of contacts whose face planes are tried as separating planes."""


@allocating
def touches_apart(s: dual.Search, n: int, is_named: bool, row: IntArray) -> bool:
    """Fill the row (N_COLUMNS,) of a pair that touches, if a plane separates the bodies: that of a face in the first n
    of ``s.contacts``, or of one contact alone, a plane through a common corner; return whether it is filled, the
    witness included if is_named."""
    if n == 1 and _touches_at_corner(s, s.contacts.pairs[0, 0], s.contacts.pairs[0, 1], is_named, row):
        return True
    at, is_proven = separating_contact(s, n), is_named  # with a witness contacts are classified below
    for item in range(n):
        is_proven |= s.contacts.kinds[item] != UNDECIDED  # as those of faces without area are
    if at < 0 or not is_proven:
        return False
    if not is_named:
        row[RELATION] = TOUCHING
        return True
    return _touches_in_planes(s, at, row, _new_live(s.first), _new_live(s.second), np.empty(STACK, np.int32))


@called
def separating_contact(s: dual.Search, n: int) -> int:
    """Return which of the first n contacts has a face whose plane is proven to separate the bodies, -1 for none. If
    faces share an area, only those are tried."""
    poses, error, (u, v), kinds = s.descent.poses, dual.exact_error(s), dual.vertices_of(s), s.contacts.kinds
    are_flush = False
    for item in range(n):
        are_flush |= kinds[item] == COMMON_AREA
    for item in range(n):
        if are_flush and kinds[item] != COMMON_AREA:
            continue
        i, j = s.contacts.pairs[item, 0], s.contacts.pairs[item, 1]  # most planes cut the other body
        if not _is_tried(s.contacts.pairs, item, 0) and separates(poses, facet_of(s.first, u, i), v, u, error):
            return item
        if not _is_tried(s.contacts.pairs, item, 1) and separates(poses, facet_of(s.second, v, j), u, v, error):
            return item
        if s.flag[0] != 0:
            break
    return -1


@inline
def _is_tried(pairs: IntArray, row: int, column: int) -> bool:
    """Return whether a row above has the same face in a column."""
    before = 0
    while before < row and pairs[before, column] != pairs[row, column]:  # bound: row
        before += 1
    return before < row


@called
def _touches_at_corner(s: dual.Search, i: int, j: int, is_named: bool, row: IntArray) -> bool:
    """Fill the row of a pair of which a corner that faces i and j share is proven to be the only common point; return
    whether it is filled."""
    own, their = dual.unposed_faces(s, i, j)
    for k in range(3):
        for m in range(3):
            p, q = s.first.triangles[i, k], s.second.triangles[j, m]
            a, b = placed(as_point3(s.first.vertices, p), s.place.a), placed(as_point3(s.second.vertices, q), s.place.b)
            if not largest_of(minus(a, b)) <= 2.0 * s.place.error:
                continue
            if s.place.error > 0.0 and not are_equal_exact(s.descent.poses, corner(own, k), corner(their, m)):
                continue
            if not _is_only_common_point(s, p, q, a):
                return False
            row[RELATION], row[KIND] = TOUCHING, contact.VERTEX_VERTEX
            if is_named:
                row[FIRST_FACE], row[SECOND_FACE] = _lowest_face_at(s.first, p), _lowest_face_at(s.second, q)
            return row[FIRST_FACE] >= 0 <= row[SECOND_FACE] or not is_named
    return False


@inline
def _lowest_face_at(mesh: MeshArrays, vertex: int) -> int:
    """Return the least number of the faces at a vertex; -1 if one of them has no area."""
    t, best = mesh.triangles, -1
    for face in range(t.shape[0]):
        if vertex == t[face, 0] or vertex == t[face, 1] or vertex == t[face, 2]:
            if mesh.axis[face] < 0:
                return -1
            best = int(mesh.faces[face]) if best < 0 else min(best, int(mesh.faces[face]))
    return best


@inline
def _is_only_common_point(s: dual.Search, p: int, q: int, common: Point3) -> bool:
    """Return whether some plane through a common vertex, p of the first and q of the second body, is found on two sides
    of which all their other vertices lie, strictly. common: the vertex, placed.

    A vector v between placed points is off by 2 `error` a coordinate, and by u of itself; n . v of three products by
    less than 4 u |n|_1 |v| more: 2^-50 |n|_1 |v| and 2 |n|_1 error in all, of which twice is allowed."""
    n, error, n_wrong = Point3(0.0, 0.0, 0.0), s.place.error, 0
    for turn in range(_TURNS):
        if turn > 1 and 8 * n_wrong > s.first.vertices.shape[0] + s.second.vertices.shape[0]:
            return False
        n_wrong = 0
        for own in range(2):
            mesh, place, apex = (s.first, s.place.a, p) if own == 0 else (s.second, s.place.b, q)
            for vertex in range(mesh.vertices.shape[0]):
                v = minus(placed(as_point3(mesh.vertices, vertex), place), common)
                v = negative(v) if own == 0 else v
                bound = (2.0**-49 * largest_of(v) + 4.0 * error) * (abs(n.x) + abs(n.y) + abs(n.z)) + 2.0**-1000
                if vertex == apex or dot(n, v) > bound:
                    continue
                n_wrong += 1
                size = length(v)
                if not 2.0**-500 < size < 2.0**500:
                    return False
                n = Point3(n.x + v.x / size, n.y + v.y / size, n.z + v.z / size)
        if n_wrong == 0:
            return True
    return False


@called
def _touches_in_planes(s: dual.Search, at: int, row: IntArray, own: Live, their: Live, stack: Int32Array) -> bool:
    """Fill the row of a pair that the plane of a face in row ``at`` of ``s.contacts`` separates, with the
    strongest contact; return whether it is filled. own, their: scratch, one `Live` a body, on entry with all vertices
    live; stack (STACK,): scratch."""
    _keep_in_planes(s, s.contacts.pairs[at, 0], s.contacts.pairs[at, 1], own, their)
    n_own, n_their, n_tried = _list_faces(s.first, own), _list_faces(s.second, their), 0
    are_few, defect = s.first.faces.shape[0] * s.second.faces.shape[0] <= FEW, defect_of(s.place.b)
    best, face, their_face = contact.VERTEX_VERTEX + 1, 0, 0
    for kind in range(contact.VERTEX_VERTEX + 1):
        if best < kind:
            break
        if (
            are_few and kind == contact.EDGE_FACE and _keep_in_planes(s, -1, -1, own, their)
        ):  # more planes leave less to search
            n_own, n_their = _list_faces(s.first, own), _list_faces(s.second, their)
        for a in range(n_own):
            i, count = own.faces[a], own.counts[a]
            f = s.first.faces[i]
            is_open = _strongest_kind(count, 3) <= kind <= _strongest_kind(count, 1) and (best, face) >= (kind, f)
            b, n, box = 0, 1, _box_of_live(s, i, own, defect)
            stack[0] = 0
            while is_open and (b < n_their if are_few else n > 0):  # bound: the faces of the second body
                j = their.faces[b]
                if not are_few:
                    j, n = next_face(s.second, stack, n, box)
                    if j < 0:
                        break
                b += 1
                g, their_count = s.second.faces[j], _n_listed(s.second, j, their)
                if their_count == 0 or _strongest_kind(count, their_count) != kind:
                    continue
                if (best, face, their_face) <= (kind, f, g):
                    continue
                how, n_tried = _kind_of_faces(s, i, j), n_tried + 1
                if how == UNSETTLED or n_tried > _MOST_TRIED or s.flag[0] != 0:
                    return False
                if how < best or (how == best and (f, g) < (face, their_face)):
                    best, face, their_face = how, f, g
    if best > contact.VERTEX_VERTEX:
        return False
    row[RELATION], row[KIND], row[FIRST_FACE], row[SECOND_FACE] = TOUCHING, best, face, their_face
    return True
