"""Compiled: where the faces of two bodies that are in contact lie, by their points off the other body.

If the open interiors meet, the border of their intersection has a piece with area on some face of either body: on one
with a point in the other's open interior, or on one flush with a face of the other. Where no contact is flush or cuts
an open face (`kind_of`), each open face in contact keeps clear of the other body but for single points, so all of it
lies on one side, and any of its corners off the other body tells which. A patch of faces without contact has such a
corner too, or is a component by itself. So where all these are outside, no piece of a face lies inside. One that is
inside proves that the interiors meet, if an inside of its own body lies beside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.bounding.bvh import STACK
from engine.collision.codes import OVERLAPPING, TOUCHING, UNSETTLED
from engine.collision.meshes.dual_traversal import Search
from engine.collision.meshes.face_state import point_within, state_of
from engine.collision.meshes.mesh_arrays import STATE_STACKED, MeshArrays, in_tree, triangle_of
from engine.collision.meshes.parity import (
    INSIDE,
    OUTSIDE,
    SLACK,
    OwnPoint,
    box_between,
    brought_back,
    locate_point,
    next_face,
)
from engine.collision.meshes.placement import Placement, defect_of
from engine.jit import allocating, called, inline
from engine.predicates.vectors import as_point3, largest_of, minus
from engine.types import UNDECIDED

JUDGED = 64
"""Beside three bits for each face, of corners, in place of the class of a contact."""


@inline
def place_of(known: Any, vertex: int) -> int:
    """Return where a vertex stands in a table of a power of two of places, or the free place where it may."""
    last = known.shape[0] - 1
    place = vertex & last
    while known[place] >= 0 and known[place] != vertex:  # bound: half the places are free
        place = (place + 1) & last
    return place


@allocating
def may_be_corner(own: OwnPoint, mesh: MeshArrays) -> bool:
    """Tell whether a point may be a vertex of a mesh: of faces that meet there not all are listed as contacts."""
    local, slack, stack = in_tree(mesh, own.point), SLACK + own.error / mesh.scale, np.empty(STACK, np.int32)
    box = box_between(local, local, slack)
    stack[0] = 0
    face, n = next_face(mesh, stack, 1, box)
    while face >= 0:  # bound: the faces of the body
        t = triangle_of(mesh, face)
        if min(largest_of(minus(t.p, own.point)), largest_of(minus(t.q, own.point))) <= 2.0 * own.error:
            return True
        if not largest_of(minus(t.r, own.point)) > 2.0 * own.error:
            return True
        face, n = next_face(mesh, stack, n, box)
    return False


@called
def where_faces_are(s: Search, own: int, n: int, shares: Any, known: Any, is_flush: Any, told: Any) -> int:
    """Return OUTSIDE where every face of a body in contact has a point that surely lies outside the other body, and no
    corner off it does not, nor any component without contact; INSIDE where one surely lies inside and has an inside of
    its own beside it; else UNDECIDED.

    own: the column of the body in contacts (n, 2); their classes: of each the corners that lie on the other face, and
    maybe others of its plane (`kind_of`, `judge`). shares (n,), or none: whether the two faces share an area. known,
    is_flush, told: tables (`place_of`) of vertices and of faces that share an area.
    """
    contacts, flush, met = s.found
    source, mesh = (s.first, s.second) if own == 0 else (s.second, s.first)
    place, target = (s.place.a, s.place.b) if own == 0 else (s.place.b, s.place.a)
    known[:] = told[:] = -1
    for item in range(n):
        for k in range(3):
            if flush[item] >> (3 * own + k) & 1:
                at = place_of(known, source.triangles[contacts[item, own], k])
                known[at], is_flush[at] = source.triangles[contacts[item, own], k], True
        if len(shares) > 0 and shares[item]:
            told[place_of(told, contacts[item, own])] = contacts[item, own]
    defect, before = defect_of(target), -1
    for item in range(n + source.components.shape[0]):
        face = contacts[item, own] if item < n else source.components[item - n]
        if face == before:
            continue
        before, n_outside = face, 0
        for k in range(3):
            vertex, where = source.triangles[face, k], OUTSIDE
            at = place_of(known, vertex)
            if known[at] < 0:
                point = brought_back(as_point3(source.vertices, vertex), place, target, defect)
                where = UNDECIDED if len(met) > 0 and may_be_corner(point, mesh) else locate_point(point, mesh)
                if where != OUTSIDE:
                    return INSIDE if where == INSIDE and has_inside_beside(s, source, face) else UNDECIDED
                if item < n:
                    known[at], is_flush[at] = vertex, False
            n_outside += known[at] < 0 or not is_flush[at]
        if n_outside == 0 and told[place_of(told, face)] != face:
            where = _where_within(source, face, place, mesh, target, defect)
            if where != OUTSIDE:
                return INSIDE if where == INSIDE and has_inside_beside(s, source, face) else UNDECIDED
    return OUTSIDE


@called
def _where_within(
    source: MeshArrays, face: int, place: Placement, mesh: MeshArrays, target: Placement, defect: float
) -> int:
    """Return where a point within a face lies that is off the other body, UNDECIDED where none tried tells.

    Placing rounds such a point even where it rounds no vertex: each of two sums by 2^-53 of what it adds to.
    """
    for item in range(3):
        p = point_within(source, face, item)
        q = brought_back(p.point, place, target, defect)
        moved = largest_of(p.point) + largest_of(place.shift) + largest_of(target.shift)
        where = locate_point(OwnPoint(q.point, q.error + 2.0 * p.error + 2.0**-50 * moved), mesh)
        if where in (INSIDE, OUTSIDE):
            return where
    return UNDECIDED


@inline
def has_inside_beside(s: Search, source: MeshArrays, face: int) -> bool:
    """Tell whether a face has an inside of its body beside it, all along but for single points."""
    return bool(source.axis[face] >= 0 and state_of(source, face, s.descent.poses) != STATE_STACKED)


@allocating
def by_places(s: Search, n: int, shares: Any) -> int:
    """Return OVERLAPPING or TOUCHING where the faces of both bodies that are in contact tell it, else UNSETTLED."""
    n_places = 16
    while n_places < 6 * n:
        n_places *= 2
    known, is_flush, told = np.empty(n_places, np.int64), np.empty(n_places, np.bool_), np.empty(n_places, np.int64)
    for own in range(2):
        where = where_faces_are(s, own, n, shares, known, is_flush, told)
        if where != OUTSIDE:
            return OVERLAPPING if where == INSIDE else UNSETTLED
    return TOUCHING
