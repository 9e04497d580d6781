"""Compiled: what contacts none of which proves an overlap by crossing tell of two bodies, and a plane between them.

Two convex bodies that touch are separated by a plane through a face in contact, unless only edges cross; many bodies
that are not convex too. Of others the faces in contact may tell (`free_faces.py`, `clean_faces.py`). Where no proof is
found, nothing is said.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.collision.codes import TOUCHING, UNSETTLED
from engine.collision.meshes.clean_faces import relate_clean
from engine.collision.meshes.dual_traversal import Search, exact_error, exact_faces
from engine.collision.meshes.free_faces import by_places
from engine.collision.meshes.placement import Placement, placed
from engine.collision.meshes.triangle_triangle import Facet, sign_of_four
from engine.jit import allocating, called, inline
from engine.predicates.posed import UNPOSED, PosedPoint3
from engine.predicates.vectors import as_point3
from engine.types import UNDECIDED

N_FIRST = 2
N_FACES = 32
"""So many contacts give the planes of their faces, the first of them at once."""
_SAMPLED = 16


class Vertices(NamedTuple):
    """The vertices (n, 3) of a body for exact signs: how they are placed, and the pose, UNPOSED where placing rounds
    nothing."""

    points: Any
    place: Placement
    pose: int


@inline
def vertex_at(v: Vertices, vertex: int) -> PosedPoint3:
    """Return a vertex for exact signs."""
    p = as_point3(v.points, vertex)
    if v.pose == UNPOSED:
        p = placed(p, v.place)
    return PosedPoint3(p.x, p.y, p.z, v.pose)


@called
def side_of_all(poses: Any, plane: Facet, v: Vertices, error: float, n_samples: int) -> int:
    """Return the closed side (1, -1) of a plane on which about so many vertices lie, 0 if they lie on it; UNDECIDED if
    they lie on both sides, or where a sign is open."""
    found, n = 0, v.points.shape[0]
    for vertex in range(0, n, max(1, n // n_samples)):
        side = sign_of_four(poses, plane.p, plane.q, plane.r, vertex_at(v, vertex), error)
        if side == UNDECIDED or side * found < 0:
            return UNDECIDED
        found = side if found == 0 else found
    return found


@called
def separates(poses: Any, plane: Facet, u: Vertices, v: Vertices, error: float) -> bool:
    """Tell whether a plane has the vertices of two bodies on different closed sides, not all of them in it."""
    for n_samples in (_SAMPLED, max(len(u.points), len(v.points))):  # most planes cut the bodies in the middle
        side = side_of_all(poses, plane, u, error, n_samples)
        if side == UNDECIDED:
            return False
        their_side = side_of_all(poses, plane, v, error, n_samples)
        if their_side == UNDECIDED or side * their_side > 0:
            return False
    return side != their_side


@called
def are_separated(s: Search, first: int, n_faces: int) -> bool:
    """Tell whether a plane through faces of the contacts from `first` to n_faces is known to separate the bodies."""
    poses, error, is_exact = s.descent.poses, exact_error(s), s.place.error == 0.0
    u = Vertices(s.first.vertices, s.place.a, UNPOSED if is_exact or not s.place.a.is_posed else 0)
    v = Vertices(s.second.vertices, s.place.b, UNPOSED if is_exact or not s.place.b.is_posed else 1)
    for item in range(first, n_faces):
        t, w, _, _ = exact_faces(s, s.found.pairs[item, 0], s.found.pairs[item, 1])
        if separates(poses, t, u, v, error) or separates(poses, w, u, v, error):
            return True
        if s.flag[0] != 0:
            return False
    return False


@allocating
def relate_by_contacts(s: Search, n: int, is_free: bool, has_crossing: bool) -> int:
    """Return the relation of two placed bodies as far as it is known by their n contacts, or UNSETTLED.

    is_free: none is flush or cuts an open face; the classes then hold the corners in the plane of the other face.
    has_crossing: one is a crossing, though none that proves overlapping.
    """
    both = s.first.has_inside and s.second.has_inside
    if both and is_free:
        found = by_places(s, n, np.empty(0, np.bool_))
        if found != UNSETTLED:
            return found
    if are_separated(s, 0, min(N_FIRST, n)):
        return TOUCHING
    if both and not is_free and not has_crossing:
        found = relate_clean(s, n)
        if found != UNSETTLED:
            return found
    return TOUCHING if are_separated(s, N_FIRST, min(N_FACES, n)) else UNSETTLED
