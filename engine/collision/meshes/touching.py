"""Compiled: what contacts tell of two bodies where none proves an overlap by crossing.

Two convex bodies that touch are separated by a plane through a face in contact, unless only edges cross; many bodies
that are not convex too. Of others the faces in contact may tell (`free_faces.py`), clean ones (`face_state.py`) above
all, of which the body lies on one side only. Two of these that share an area overlap if that is the same side of both,
else neither has the other body on its own inner side there. A face with an edge across an open clean one, going to its
inner side from there, has points in the open interior beside it: they overlap. Where no contact is of these kinds, all
of the inner side of each face lies in or out of the other body: out, where they share an area; else any point of the
face off the other body tells. Where no proof is found, nothing is said.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.collision.codes import OVERLAPPING, TOUCHING, UNSETTLED
from engine.collision.meshes.dual_traversal import Search, exact_error, exact_faces
from engine.collision.meshes.face_state import UNTOLD, inner_side, state_of
from engine.collision.meshes.free_faces import JUDGED, by_places
from engine.collision.meshes.mesh_arrays import STATE_STACKED, MeshArrays
from engine.collision.meshes.placement import Placement, placed
from engine.collision.meshes.triangle_triangle import (
    CORNER,
    Facet,
    Signs,
    beside,
    corner,
    is_on_face,
    passes_within,
    separation,
    sides_of,
    sign_of_four,
)
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


@called
def _enters(
    s: Search, t: Facet, sides: Signs, u: Facet, off: PosedPoint3, axis: int, mesh: MeshArrays, face: int
) -> int:
    """Return OVERLAPPING where an edge of t passes the open face u, number `face` of its mesh, and t goes on to its
    inner side; TOUCHING where not; UNSETTLED. sides: of the corners of t at the plane of u."""
    for k in range(3):
        a, b, apex = sides[k], sides[(k + 1) % 3], sides[(k + 2) % 3]
        if a == 0 and b == 0:
            how = passes_within(s.descent.poses, corner(t, k), corner(t, k + 1), u, off, axis, exact_error(s))
            if how == 1:
                inner = inner_side(mesh, face, s.descent.poses)
                how = UNDECIDED if inner == UNTOLD else int(inner == apex)
            return UNSETTLED if how == UNDECIDED else (OVERLAPPING if how == 1 else TOUCHING)
    return TOUCHING


@called
def flush(s: Search, i: int, j: int, t: Facet, u: Facet, axis: int, off: PosedPoint3) -> tuple[int, bool]:
    """Return OVERLAPPING where two faces of one plane share an area and their bodies lie on one side of both, TOUCHING
    where not, or UNSETTLED; and whether they share an area. off: a point off the plane."""
    poses, error = s.descent.poses, exact_error(s)
    how = separation(poses, t, u, axis, error)
    if how == UNDECIDED or how >= 0:
        return (UNSETTLED if how == UNDECIDED else TOUCHING), False
    by_t, by_u = sign_of_four(poses, t.p, t.q, t.r, off, error), sign_of_four(poses, u.p, u.q, u.r, off, error)
    inner, theirs = inner_side(s.first, i, poses), inner_side(s.second, j, poses)
    if by_t == UNDECIDED or by_u == UNDECIDED or inner == UNTOLD or theirs == UNTOLD:
        return UNSETTLED, False
    return (OVERLAPPING if inner * by_t == theirs * by_u else TOUCHING), True


@called
def _corners_on(poses: Any, t: Facet, sides: Signs, u: Facet, off: PosedPoint3, axis: int, error: float) -> int:
    """Return a bit for each corner of t that lies on the closed face u, -1 where that is not known."""
    found = 0
    for k in range(3):
        how = is_on_face(poses, corner(t, k), u, off, axis, error) if sides[k] == 0 else 0
        if how == UNDECIDED:
            return -1
        found |= how << k
    return found


@called
def judge(s: Search, item: int) -> tuple[int, bool]:
    """Return OVERLAPPING where a contact proves that, TOUCHING where not, UNSETTLED where that is open; and whether its
    faces share an area. Its class becomes JUDGED with the corners on the other face."""
    i, j, kinds = s.found.pairs[item, 0], s.found.pairs[item, 1], s.found.kinds
    if CORNER <= kinds[item] < JUDGED:
        common = kinds[item] - CORNER
        kinds[item] = JUDGED | 1 << common // 3 | 8 << common % 3
        return TOUCHING, False
    t, u, axis, their_axis = exact_faces(s, i, j)
    if axis < 0 or their_axis < 0:
        return UNSETTLED, False
    poses, error, are_unposed = s.descent.poses, exact_error(s), t.p.pose == UNPOSED and u.p.pose == UNPOSED
    sides, their_sides = sides_of(poses, u, t, error), sides_of(poses, t, u, error)
    if UNDECIDED in sides or UNDECIDED in their_sides:
        return UNSETTLED, False
    off, their_off = beside(t, axis), beside(u, their_axis)
    if not np.isfinite(off.x + off.y + off.z + their_off.x + their_off.y + their_off.z):
        return UNSETTLED, False
    flat, their_flat = (axis, their_axis) if are_unposed else (-1, -1)
    on = _corners_on(poses, t, sides, u, their_off, their_flat, error)
    theirs_on = _corners_on(poses, u, their_sides, t, off, flat, error)
    if on < 0 or theirs_on < 0:
        return UNSETTLED, False
    kinds[item] = JUDGED | on | theirs_on << 3
    if sides[0] == 0 and sides[1] == 0 and sides[2] == 0:
        return flush(s, i, j, t, u, axis, off)
    by_own = _enters(s, t, sides, u, their_off, their_flat, s.second, j)
    if by_own == OVERLAPPING and state_of(s.first, i, poses) == STATE_STACKED:
        by_own = UNSETTLED
    by_theirs = _enters(s, u, their_sides, t, off, flat, s.first, i)
    if by_theirs == OVERLAPPING and state_of(s.second, j, poses) == STATE_STACKED:
        by_theirs = UNSETTLED
    if by_own == OVERLAPPING or by_theirs == OVERLAPPING:
        return OVERLAPPING, False
    return (UNSETTLED if by_own == UNSETTLED or by_theirs == UNSETTLED else TOUCHING), False


@allocating
def relate_clean(s: Search, n: int) -> int:
    """Return OVERLAPPING or TOUCHING where n contacts of two bodies with an inside, all there are and none a crossing,
    tell it by clean faces; else UNSETTLED."""
    shares = np.zeros(n, np.bool_)
    for item in range(n):
        how, shares[item] = judge(s, item)
        if how != TOUCHING or s.flag[0] != 0:
            return how if how == OVERLAPPING else UNSETTLED
    return by_places(s, n, shares)


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
