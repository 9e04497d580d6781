"""Compiled: what contacts tell of two bodies where none proves an overlap by crossing.

Two convex bodies that touch are separated by a plane through a face in contact, unless only edges cross; many bodies
that are not convex too. Of others the faces in contact may tell, clean ones (`parity.py`) above all, of which the
body lies on one side only. Two of these that share an area overlap if that is the same side of both, else neither has
the other body on its own inner side there. A face with an edge across an open clean one, going to its inner side from
there, has points in the open interior beside it: they overlap. Where no contact is of these kinds, all of the inner
side of each face lies in or out of the other body: out, where they share an area; else any point of the face off the
other body tells. Where no proof is found, nothing is said.

**By places.** If the open interiors meet, the border of their intersection has a piece with area on some face of either
body: on one with a point in the other's open interior, or on one flush with a face of the other. Where no contact is
flush or cuts an open face (`kind_of`), each open face in contact keeps clear of the other body but for single points,
so all of it lies on one side, and any of its corners off the other body tells which. A patch of faces without contact
has such a corner too, or is a component by itself. So where all these are outside, no piece of a face lies inside. One
that is inside proves that the interiors meet, if an inside of its own body lies beside it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.bounding.bvh import STACK
from engine.collision.codes import OVERLAPPING, TOUCHING, UNSETTLED
from engine.collision.meshes import parity
from engine.collision.meshes.dual_traversal import Search, exact_error, exact_faces
from engine.collision.meshes.mesh_arrays import STATE_STACKED, MeshArrays, in_tree, triangle_of
from engine.collision.meshes.placement import Placement, defect_of, placed
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
from engine.compiling.jit import allocating, called, inline
from engine.predicates.posed import UNPOSED, PosedPoint3
from engine.predicates.vectors import as_point3, largest_of, minus
from engine.types import UNDECIDED, BoolArray, FloatArray, IntArray

N_FIRST = 2
N_FACES = 32
"""So many contacts give the planes of their faces, the first of them at once."""
_SAMPLED = 16


class Vertices(NamedTuple):
    """The vertices (n, 3) of a body for exact signs, its placement and pose (UNPOSED where placing is exact)."""

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
def side_of_all(poses: FloatArray, plane: Facet, v: Vertices, error: float, n_samples: int) -> int:
    """Return the closed side (1, -1) of a plane that holds about n_samples vertices, 0 on it; UNDECIDED otherwise."""
    found, n = 0, v.points.shape[0]
    for vertex in range(0, n, max(1, n // n_samples)):
        side = sign_of_four(poses, plane.p, plane.q, plane.r, vertex_at(v, vertex), error)
        if side == UNDECIDED or side * found < 0:
            return UNDECIDED
        found = side if found == 0 else found
    return found


@called
def separates(poses: FloatArray, plane: Facet, u: Vertices, v: Vertices, error: float) -> bool:
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
                inner = parity.inner_side(mesh, face, s.descent.poses)
                how = UNDECIDED if inner == parity.UNTOLD else int(inner == apex)
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
    inner, theirs = parity.inner_side(s.first, i, poses), parity.inner_side(s.second, j, poses)
    if by_t == UNDECIDED or by_u == UNDECIDED or inner == parity.UNTOLD or theirs == parity.UNTOLD:
        return UNSETTLED, False
    return (OVERLAPPING if inner * by_t == theirs * by_u else TOUCHING), True


@called
def _corners_on(poses: FloatArray, t: Facet, sides: Signs, u: Facet, off: PosedPoint3, axis: int, error: float) -> int:
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
    if by_own == OVERLAPPING and parity.state_of(s.first, i, poses) == STATE_STACKED:
        by_own = UNSETTLED
    by_theirs = _enters(s, u, their_sides, t, off, flat, s.first, i)
    if by_theirs == OVERLAPPING and parity.state_of(s.second, j, poses) == STATE_STACKED:
        by_theirs = UNSETTLED
    if by_own == OVERLAPPING or by_theirs == OVERLAPPING:
        return OVERLAPPING, False
    return (UNSETTLED if by_own == UNSETTLED or by_theirs == UNSETTLED else TOUCHING), False


@allocating
def relate_clean(s: Search, n: int) -> int:
    """Return OVERLAPPING or TOUCHING where clean faces tell it of n contacts without a crossing; else UNSETTLED."""
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


JUDGED = 64
"""Beside three bits for each face, of corners, in place of the class of a contact."""


@inline
def place_of(known: IntArray, vertex: int) -> int:
    """Return where a vertex stands in a table of a power of two of places, or the free place where it may."""
    last = known.shape[0] - 1
    place = vertex & last
    while known[place] >= 0 and known[place] != vertex:  # bound: half the places are free
        place = (place + 1) & last
    return place


@allocating
def may_be_corner(own: parity.OwnPoint, mesh: MeshArrays) -> bool:
    """Tell whether a point may be a vertex of a mesh: of faces that meet there not all are listed as contacts."""
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
    s: Search, own: int, n: int, shares: BoolArray, known: IntArray, is_flush: BoolArray, told: IntArray
) -> int:
    """Return OUTSIDE where every face of a body in contact has a point that surely lies outside the other body, and no
    corner off it does not, nor any component without contact; INSIDE where one surely is, with an inside; UNDECIDED.

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
            vertex, where = source.triangles[face, k], parity.OUTSIDE
            at = place_of(known, vertex)
            if known[at] < 0:
                point = parity.brought_back(as_point3(source.vertices, vertex), place, target, defect)
                where = UNDECIDED if len(met) > 0 and may_be_corner(point, mesh) else parity.locate_point(point, mesh)
                if where != parity.OUTSIDE:
                    return parity.INSIDE if where == parity.INSIDE and has_inside_beside(s, source, face) else UNDECIDED
                if item < n:
                    known[at], is_flush[at] = vertex, False
            n_outside += known[at] < 0 or not is_flush[at]
        if n_outside == 0 and told[place_of(told, face)] != face:
            where = _where_within(source, face, place, mesh, target, defect)
            if where != parity.OUTSIDE:
                return parity.INSIDE if where == parity.INSIDE and has_inside_beside(s, source, face) else UNDECIDED
    return parity.OUTSIDE


@called
def _where_within(
    source: MeshArrays, face: int, place: Placement, mesh: MeshArrays, target: Placement, defect: float
) -> int:
    """Return where a point within a face lies that is off the other body, UNDECIDED where none tried tells.

    Placing rounds such a point even where it rounds no vertex: each of two sums by 2^-53 of what it adds to.
    """
    for item in range(3):
        p = parity.point_within(source, face, item)
        q = parity.brought_back(p.point, place, target, defect)
        moved = largest_of(p.point) + largest_of(place.shift) + largest_of(target.shift)
        where = parity.locate_point(parity.OwnPoint(q.point, q.error + 2.0 * p.error + 2.0**-50 * moved), mesh)
        if where in (parity.INSIDE, parity.OUTSIDE):
            return where
    return UNDECIDED


@inline
def has_inside_beside(s: Search, source: MeshArrays, face: int) -> bool:
    """Tell whether a face has an inside of its body beside it, all along but for single points."""
    return bool(source.axis[face] >= 0 and parity.state_of(source, face, s.descent.poses) != STATE_STACKED)


@allocating
def by_places(s: Search, n: int, shares: BoolArray) -> int:
    """Return OVERLAPPING or TOUCHING where the faces of both bodies that are in contact tell it, else UNSETTLED."""
    n_places = 16
    while n_places < 6 * n:
        n_places *= 2
    known, is_flush, told = np.empty(n_places, np.int64), np.empty(n_places, np.bool_), np.empty(n_places, np.int64)
    for own in range(2):
        where = where_faces_are(s, own, n, shares, known, is_flush, told)
        if where != parity.OUTSIDE:
            return OVERLAPPING if where == parity.INSIDE else UNSETTLED
    return TOUCHING
