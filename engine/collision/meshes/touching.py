"""Compiled: two proofs that bodies in contact only touch, that their open interiors have no common point.

**A plane.** Two convex bodies that touch are always separated by a plane through a face in contact, or through two
edges that cross (a face of their Minkowski difference holds the origin); a plane through two crossing edges is the one
through the first and an end of the second. Many bodies that are not convex lie that way too.

**Free faces.** If the open interiors meet, the border of their intersection has a piece with area on some face of
either body: on one with a point in the other's open interior, or on one flush with a face of the other. Where no
contact is flush or cuts an open face (`kind_of`), each open face in contact keeps clear of the other body but for
single points, so all of it lies on one side, and any of its corners off the other body tells which. A patch of faces
without contact has such a corner too, or is a component by itself. So where all these are outside, no piece of a face
lies inside.

Where neither proves it, nothing is said.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.collision.meshes.dual_traversal import Search, before_poses
from engine.collision.meshes.mesh_arrays import MeshArrays
from engine.collision.meshes.parity import OUTSIDE, brought_back, locate_point
from engine.collision.meshes.placement import Placement, defect_of
from engine.collision.meshes.triangle_triangle import Facet, corner, sign_of_four
from engine.jit import allocating, called, inline
from engine.predicates.loading import as_point3
from engine.predicates.posed import UNPOSED, PosedPoint3
from engine.types import UNDECIDED

N_FACES = 32
N_EDGES = 8
"""So many contacts give the planes of their faces, so many those of their edges."""
_SAMPLED = 16


@called
def side_of_all(poses: Any, plane: Facet, vertices: Any, pose: int, error: float, n_samples: int) -> int:
    """Return the closed side (1, -1) of a plane on which about so many of vertices (n, 3) lie, 0 if they lie on it;
    UNDECIDED if they lie on both sides, or where a sign is open."""
    found = 0
    for vertex in range(0, vertices.shape[0], max(1, vertices.shape[0] // n_samples)):
        p = PosedPoint3(vertices[vertex, 0], vertices[vertex, 1], vertices[vertex, 2], pose)
        side = sign_of_four(poses, plane.p, plane.q, plane.r, p, error)
        if side == UNDECIDED or side * found < 0:
            return UNDECIDED
        found = side if found == 0 else found
    return found


@called
def separates(poses: Any, plane: Facet, u: Any, own: int, v: Any, their: int, error: float) -> bool:
    """Tell whether a plane has two bodies, of vertices u and v under poses `own` and `their`, on different closed
    sides, not both of them in it."""
    for n_samples in (_SAMPLED, max(len(u), len(v))):  # most planes cut the bodies in the middle
        side = side_of_all(poses, plane, u, own, error, n_samples)
        if side == UNDECIDED:
            return False
        their_side = side_of_all(poses, plane, v, their, error, n_samples)
        if their_side == UNDECIDED or side * their_side > 0:
            return False
    return side != their_side


@called
def are_separated(s: Search, contacts: Any) -> bool:
    """Tell whether a plane through faces or edges of contacts (n, 2) is known to separate the two bodies."""
    poses, first, second, error = s.descent.poses, s.first, s.second, s.place.posed_error
    own, their = 0 if s.place.a.is_posed else UNPOSED, 1 if s.place.b.is_posed else UNPOSED
    u, v = first.vertices, second.vertices
    for item in range(min(N_FACES, contacts.shape[0])):
        t, w = before_poses(s, contacts[item, 0], contacts[item, 1])
        if separates(poses, t, u, own, v, their, error) or separates(poses, w, u, own, v, their, error):
            return True
        if s.flag[0] != 0:
            return False
    for item in range(min(N_EDGES, contacts.shape[0])):  # order: a plane of a face is likelier, and tried with all
        t, w = before_poses(s, contacts[item, 0], contacts[item, 1])
        for edge in range(6):
            one, other = (t, w) if edge < 3 else (w, t)
            for end in range(3):
                plane = Facet(corner(one, edge), corner(one, edge + 1), corner(other, end))
                if separates(poses, plane, u, own, v, their, error):
                    return True
        if s.flag[0] != 0:
            return False
    return False


@inline
def place_of(known: Any, vertex: int) -> int:
    """Return where a vertex stands in a table of a power of two of places, or the free place where it may."""
    last = known.shape[0] - 1
    place = vertex & last
    while known[place] >= 0 and known[place] != vertex:  # bound: half the places are free
        place = (place + 1) & last
    return place


@allocating
def are_outside(
    source: MeshArrays, place: Placement, contacts: Any, flush: Any, own: int, mesh: MeshArrays, target: Placement
) -> bool:
    """Tell whether every face of a body in contact has a corner that surely lies outside the other body, and no corner
    off it that does not, nor any component without contact.

    own: the column of the body in contacts (n, 2); flush (n,): of each the corners in the plane of the other face
    (`kind_of`): what lies on the other body is among those.
    """
    n, n_places = contacts.shape[0], 16
    while n_places < 6 * n:
        n_places *= 2
    known, is_flush = np.full(n_places, -1, np.int64), np.empty(n_places, np.bool_)
    for item in range(n):
        for k in range(3):
            if flush[item] >> (3 * own + k) & 1:
                at = place_of(known, source.triangles[contacts[item, own], k])
                known[at], is_flush[at] = source.triangles[contacts[item, own], k], True
    defect, before = defect_of(target), -1
    for item in range(n + source.components.shape[0]):
        face = contacts[item, own] if item < n else source.components[item - n]
        if face == before:
            continue
        before, n_outside = face, 0
        for k in range(3):
            vertex = source.triangles[face, k]
            at = place_of(known, vertex)
            if known[at] < 0:
                point = brought_back(as_point3(source.vertices, vertex), place, target, defect)
                if locate_point(point, mesh) != OUTSIDE:
                    return False
                if item < n:
                    known[at], is_flush[at] = vertex, False
            n_outside += known[at] < 0 or not is_flush[at]
        if n_outside == 0:
            return False
    return True


@called
def only_touch(s: Search, n: int, is_free: bool) -> bool:
    """Tell whether two placed bodies are known only to touch, by their n contacts, or the first n of them.

    is_free: the n are all, and none is flush or cuts an open face; the classes then hold the corners in the plane of
    the other face, as for `are_outside`.
    """
    contacts, flush = s.found.pairs[:n], s.found.kinds[:n]
    if is_free and s.first.has_inside and s.second.has_inside:
        if are_outside(s.first, s.place.a, contacts, flush, 0, s.second, s.place.b) and are_outside(
            s.second, s.place.b, contacts, flush, 1, s.first, s.place.a
        ):
            return True
    return are_separated(s, contacts)
