"""Compiled: what contacts with clean faces tell, flush ones above all.

Of a clean face its body lies on one side only (`face_state.py`). Two that share an area overlap if that is the same
side of both, else neither has the other body on its own inner side there. A face with an edge across an open clean one,
going to its inner side from there, has points in the open interior beside it: they overlap. Where no contact is of
these kinds, all of the inner side of each face lies in or out of the other body: out, where they share an area; else
any point of the face off the other body tells (`free_faces.py`).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.collision.codes import OVERLAPPING, TOUCHING, UNSETTLED
from engine.collision.meshes.dual_traversal import Search, exact_error, exact_faces
from engine.collision.meshes.face_state import UNTOLD, inner_side, state_of
from engine.collision.meshes.free_faces import JUDGED, by_places
from engine.collision.meshes.mesh_arrays import STATE_STACKED, MeshArrays
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
from engine.jit import allocating, called
from engine.predicates.posed import UNPOSED, PosedPoint3
from engine.types import UNDECIDED


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
