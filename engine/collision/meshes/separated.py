"""Two bodies that touch, separated by planes of faces: the strongest contact, without a list of all; compiled.

All common points lie in each plane that separates. So of either body only faces with live corners count, those that lie
in all these planes, and their number bounds the kind of contact: 3, the face lies in the planes; 2, an edge of it; 1, a
corner. A face in the planes and another with an edge there have an EDGE_FACE contact at best. The strongest contact is
searched from the strongest kind on, and a weaker one no longer once one is found.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.collision.codes import FIRST_FACE, KIND, RELATION, SECOND_FACE, TOUCHING, UNSETTLED
from engine.collision.meshes import contact_kinds as contact
from engine.collision.meshes import dual_traversal as dual
from engine.collision.meshes.mesh_arrays import MeshArrays
from engine.collision.meshes.separating_planes import Vertices, facet_of, separates, vertex_at
from engine.collision.meshes.triangle_triangle import APART, COMMON_AREA, Facet, sign_of_four
from engine.compiling.jit import allocating, called, inline, merged
from engine.types import UNDECIDED, BoolArray, FloatArray, IntArray

FEW = 4096
"""Product of the numbers of faces up to which bodies are related so; of larger ones the trees list fewer pairs."""


class Live(NamedTuple):
    """The vertices of one body that lie in all separating planes so far. vertices (n,) bool: which do; faces: the
    numbers of faces with such a corner, ascending; counts: how many such corners each of these has."""

    vertices: Any
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
    n, vertices = mesh.faces.shape[0], np.empty(mesh.vertices.shape[0], np.bool_)
    vertices[:] = True
    return Live(vertices, np.empty(n, np.int64), np.empty(n, np.int64))


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
    poses, error, is_parted = s.descent.poses, dual.exact_error(s), False
    u = Vertices(s.first.vertices, s.place.a, dual.pose_number(s, s.place.a, 0))
    v = Vertices(s.second.vertices, s.place.b, dual.pose_number(s, s.place.b, 1))
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
def _list_faces(mesh: MeshArrays, live: Live) -> int:
    """Fill ``live.faces`` and ``live.counts`` from ``live.vertices``; return the number of faces listed."""
    n = 0
    for face in range(mesh.faces.shape[0]):
        count = _n_live(mesh, face, live)
        if count > 0:
            live.faces[n], live.counts[n] = face, count
            n += 1
    return n


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


@allocating
def touches_in_planes(s: dual.Search, is_named: bool, row: IntArray) -> bool:
    """Fill the row (N_COLUMNS,) of a pair that touches, if the plane of a face in the contact in row 0 of
    ``s.contacts`` separates the bodies; return whether it is filled, the witness included if is_named."""
    return _touches_in_planes(s, is_named, row, _new_live(s.first), _new_live(s.second))


@called
def _touches_in_planes(s: dual.Search, is_named: bool, row: IntArray, own: Live, their: Live) -> bool:
    """Decide a pair for `touches_in_planes`, with its arguments and its result. own, their: scratch, one `Live` a body,
    on entry with all vertices live."""
    if not _keep_in_planes(s, s.contacts.pairs[0, 0], s.contacts.pairs[0, 1], own, their):
        return False
    if not is_named:
        row[RELATION] = TOUCHING
        return True
    n_own, n_their = _list_faces(s.first, own), _list_faces(s.second, their)
    best, face, their_face = contact.VERTEX_VERTEX + 1, 0, 0
    for kind in range(contact.VERTEX_VERTEX + 1):
        if best < kind:
            break
        if kind == contact.EDGE_FACE and _keep_in_planes(s, -1, -1, own, their):  # more planes leave less to search
            n_own, n_their = _list_faces(s.first, own), _list_faces(s.second, their)
        for a in range(n_own):
            for b in range(n_their):
                f, g = s.first.faces[own.faces[a]], s.second.faces[their.faces[b]]
                if _strongest_kind(own.counts[a], their.counts[b]) != kind or (best, face, their_face) < (kind, f, g):
                    continue
                how = _kind_of_faces(s, own.faces[a], their.faces[b])
                if how == UNSETTLED or s.flag[0] != 0:
                    return False
                if how < best or (how == best and (f, g) < (face, their_face)):
                    best, face, their_face = how, f, g
    if best > contact.VERTEX_VERTEX:
        return False
    row[RELATION], row[KIND], row[FIRST_FACE], row[SECOND_FACE] = TOUCHING, best, face, their_face
    return True
