"""Kinds of contacts between two faces (of a witness), and faces that share one corner only; compiled.

The rules are those of `exact_body.kind_of_contact`. An edge of t passes through the open face u if its ends lie
strictly on two sides of u's plane and u's edges turn one way about it, or if it lies in that plane with corners of u on
both sides. Open edges cross if they are coplanar and each separates the other's ends, in a plane given by a third
corner.

Where many faces share one vertex, each pair of them is in contact; these pairs number the square of the faces and add
no information. Such a pair names no witness but a vertex on a vertex, cuts no face and proves nothing. A search for
many contacts lists it only if one of its faces has no listed contact yet, and stores the pairs that come first for the
witness.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.collision.codes import UNSETTLED
from engine.collision.meshes.triangle_triangle import (
    Facet,
    Signs,
    bound_near,
    corner,
    is_same,
    is_straddling,
    off_plane_point,
    separation,
    sides_of,
    sign_of_four,
    turn_in_plane,
)
from engine.collision.result import Kind
from engine.compiling.jit import called, inline, merged
from engine.predicates.posed import UNPOSED, PosedPoint3, are_equal_exact
from engine.predicates.vectors import cross, dot, largest_of, minus
from engine.types import UNDECIDED, FloatArray, Int8Array, Point3

_CONTACTS: tuple[Kind, ...] = "face_face", "edge_face", "vertex_face", "edge_edge", "vertex_edge", "vertex_vertex"
STRENGTH: tuple[Kind, ...] = (*_CONTACTS, "containment")
"""Kinds of contacts, strongest first; the witness is the strongest of at most `N_NAMED` contacts."""
FACE_FACE, EDGE_FACE, VERTEX_FACE, EDGE_EDGE, VERTEX_EDGE, VERTEX_VERTEX, CONTAINED = range(7)
N_NAMED = 32
BOTH = 3

_BAD, N_SIGNS = 9, 10
"""Slot of the work space after nine signs: 1 if a sign is undecided."""


@called
def _orient3d(
    poses: FloatArray, a: PosedPoint3, b: PosedPoint3, c: PosedPoint3, d: PosedPoint3, error: float, work: Int8Array
) -> int:
    """Return the exact sign of orient3d(a, b, c, d) of posed points; if it is undecided, return 0 and set
    ``work[_BAD]`` to 1. poses (n, 12): rotation by rows, then translation; error: bound on the rounding of a posed
    coordinate."""
    side = sign_of_four(poses, a, b, c, d, error)
    if side == UNDECIDED:
        work[_BAD], side = 1, 0
    return side


@called
def _orient_in_plane(
    poses: FloatArray, a: PosedPoint3, b: PosedPoint3, c: PosedPoint3, off: PosedPoint3, axis: int, error: float,
    work: Int8Array,
) -> int:  # fmt: skip
    """Return the orientation of a, b, c within their common plane: 1, 0, -1; if undecided, set ``work[_BAD]`` to 1 and
    return 0. axis >= 0: turn in the projection along it, of unposed points; -1: seen from the point ``off``, which is
    not in the plane."""
    turn = turn_in_plane(poses, a, b, c, off, axis, error)
    if turn == UNDECIDED:
        work[_BAD], turn = 1, 0
    return turn


@called
def _contact_with_face(
    poses: FloatArray, t: Facet, sides: Signs, u: Facet, axis: int, error: float, work: Int8Array
) -> int:
    """Return the strongest kind of contact of triangle t with the open face u: EDGE_FACE or VERTEX_FACE; if there is
    none, VERTEX_VERTEX where a corner of t is one of u, else VERTEX_EDGE. sides: of t's corners at the plane of u;
    axis: along it the projection of u has an area. Sets ``work[_BAD]`` to 1 if a sign is undecided."""
    off, flat = off_plane_point(u, axis), axis if (t.p.pose == UNPOSED and u.p.pose == UNPOSED) else -1
    if not np.isfinite(off.x + off.y + off.z):
        work[_BAD] = 1
        return VERTEX_EDGE
    turn = _orient_in_plane(poses, u.p, u.q, u.r, off, flat, error, work)
    kind = VERTEX_EDGE
    for k in range(3):
        if sides[k] != 0:
            continue
        n_on, n_out = 0, 0
        for edge in range(3):
            value = turn * _orient_in_plane(
                poses, corner(u, edge), corner(u, edge + 1), corner(t, k), off, flat, error, work
            )
            work[3 * k + edge] = value
            n_on += value == 0
            n_out += value < 0
        if n_out == 0 and n_on == 0:
            kind = VERTEX_FACE
        elif n_out == 0 and n_on == 2 and kind != VERTEX_FACE:
            kind = VERTEX_VERTEX
    for k in range(3):
        end = (k + 1) % 3
        a, b = corner(t, k), corner(t, end)
        n_left, n_right, is_outside = 0, 0, False
        for edge in range(3):
            value = 0
            if sides[k] * sides[end] < 0:
                value = _orient3d(poses, a, b, corner(u, edge), corner(u, edge + 1), error, work)
            elif sides[k] == 0 and sides[end] == 0:
                is_outside |= work[3 * k + edge] <= 0 and work[3 * end + edge] <= 0
                value = _orient_in_plane(poses, a, b, corner(u, edge), off, flat, error, work)
            n_left += value > 0
            n_right += value < 0
        if sides[k] * sides[end] < 0:
            if n_left == 3 or n_right == 3:
                return EDGE_FACE
        elif n_left > 0 and n_right > 0 and not is_outside:
            return EDGE_FACE
    return kind


@called
def _overlap_collinear(
    poses: FloatArray, t: Facet, k: int, c: PosedPoint3, d: PosedPoint3, axis: int, error: float, work: Int8Array
) -> bool:
    """Return whether edge k of t and the segment c d, on one line, share more than a point. axis: along it the
    projection of t has an area. Decided by orient3d against planes through either end of the edge and off its line."""
    a, b, apex, off = corner(t, k), corner(t, k + 1), corner(t, k + 2), off_plane_point(t, axis)
    for end in range(2):
        p, q = (a, b) if end == 0 else (b, a)
        inner = _orient3d(poses, p, apex, off, q, error, work)
        by_c, by_d = _orient3d(poses, p, apex, off, c, error, work), _orient3d(poses, p, apex, off, d, error, work)
        if inner * by_c <= 0 and inner * by_d <= 0:
            return False
    return True


@called
def _interiors_of_edges_intersect(
    poses: FloatArray, t: Facet, sides: Signs, u: Facet, their_sides: Signs, axis: int, error: float, work: Int8Array
) -> bool:
    """Return whether an open edge of t and an open edge of u have a common point. sides: of the corners of t at the
    plane of u; their_sides: vice versa; axis: along it the projection of t has an area. Sets ``work[_BAD]`` to 1 if a
    sign is undecided."""
    is_flat = sides[0] == 0 and sides[1] == 0 and sides[2] == 0
    off, flat = off_plane_point(t, axis), axis if (t.p.pose == UNPOSED and u.p.pose == UNPOSED) else -1
    for k in range(3):
        across = sides[k] * sides[(k + 1) % 3]
        if across > 0 or (across == 0 and (sides[k] != 0 or sides[(k + 1) % 3] != 0)):
            continue
        a, b = corner(t, k), corner(t, k + 1)
        for m in range(3):
            their_across = their_sides[m] * their_sides[(m + 1) % 3]
            if their_across > 0 or (their_across == 0 and (their_sides[m] != 0 or their_sides[(m + 1) % 3] != 0)):
                continue
            c, d = corner(u, m), corner(u, m + 1)
            if their_across == 0 and across == 0:
                if is_flat:
                    by_c = _orient_in_plane(poses, a, b, c, off, flat, error, work)
                    by_d = _orient_in_plane(poses, a, b, d, off, flat, error, work)
                    by_a = _orient_in_plane(poses, c, d, a, off, flat, error, work)
                    if by_c * by_d < 0 and by_a * _orient_in_plane(poses, c, d, b, off, flat, error, work) < 0:
                        return True
                    if by_c != 0 or by_d != 0:
                        continue
                if _overlap_collinear(poses, t, k, c, d, axis, error, work):
                    return True
            elif _orient3d(poses, a, b, c, d, error, work) == 0:
                p, q, x, y = (c, d, a, b) if their_across != 0 else (a, b, c, d)
                apex = corner(t, k + 2) if their_across != 0 else corner(u, m + 2)
                if _orient3d(poses, p, q, apex, x, error, work) * _orient3d(poses, p, q, apex, y, error, work) < 0:
                    return True
    return False


@inline
def single_coplanar_corner(sides: Signs) -> int:
    """Return the index of the only corner of a triangle that lies in a plane, if the other two lie strictly on one side
    of the plane, else -1. sides: signs of the three corners at the plane."""
    for k in range(3):
        if sides[k] == 0 and sides[(k + 1) % 3] * sides[(k + 2) % 3] == 1:
            return k
    return -1


@called
def classify_contact(
    poses: FloatArray, t: Facet, axis: int, u: Facet, their_axis: int, error: float, work: Int8Array
) -> tuple[int, int]:
    """Return (kind, bits) of the contact of two faces with area that have a common point. axis, their_axis: along them
    the projections of t and u have an area.

    | result | meaning |
    | --- | --- |
    | kind | FACE_FACE ... VERTEX_VERTEX; UNSETTLED if a sign is undecided |
    | bits | open faces that the other face may cut: 1 for t, 2 for u, 3 (BOTH) for both or if undecided |
    | | 0 if the faces share a single point, or a part of their borders only |
    """
    work[_BAD] = 0
    sides, their_sides = sides_of(poses, u, t, error), sides_of(poses, t, u, error)
    for k in range(3):
        if sides[k] == UNDECIDED or their_sides[k] == UNDECIDED:
            return UNSETTLED, BOTH
    own, their = single_coplanar_corner(sides), single_coplanar_corner(their_sides)
    for k in range(3):
        is_common = own >= 0 and is_same(corner(t, own), corner(u, k))
        if is_common or (their >= 0 and is_same(corner(u, their), corner(t, k))):
            return VERTEX_VERTEX, 0
    if sides[0] == 0 and sides[1] == 0 and sides[2] == 0:
        how = separation(poses, t, u, axis, error)
        if how == UNDECIDED or how < 0:
            return UNSETTLED if how == UNDECIDED else FACE_FACE, BOTH
    one = _contact_with_face(poses, t, sides, u, their_axis, error, work)
    other = _contact_with_face(poses, u, their_sides, t, axis, error, work)
    kind = min(one, other)
    if kind > VERTEX_FACE and _interiors_of_edges_intersect(poses, t, sides, u, their_sides, axis, error, work):
        kind = EDGE_EDGE
    elif kind > VERTEX_FACE:
        kind = max(one, other)  # a common corner, if there is one
    if work[_BAD] != 0:
        return UNSETTLED, BOTH
    if own >= 0 or their >= 0 or kind == VERTEX_VERTEX:
        return kind, 0
    # case: both straddle and are cut by the line of their planes in one and the same segment; no corner is common then
    are_across = is_straddling(sides[0], sides[1], sides[2])
    are_across = are_across and is_straddling(their_sides[0], their_sides[1], their_sides[2])
    return kind, BOTH if are_across else int(other <= VERTEX_FACE) | int(one <= VERTEX_FACE) << 1


@inline
def _plane_sides(a: Point3, b: Point3, c: Point3, d: Point3, error: float) -> tuple[int, int]:
    """Return the signs of the sides of c and d at the plane through the origin, a and b, each 0 where floats do not
    prove it. error: bound on each coordinate."""
    n, bound = cross(a, b), bound_near(a, b, c, d, d, error)
    one, other = dot(n, c), dot(n, d)
    return int(one > bound) - int(one < -bound), int(other > bound) - int(other < -bound)


_TURNS = 8


@called
def _are_parted(v: Point3, w: Point3, x: Point3, y: Point3, error: float) -> bool:
    """Return whether a plane through the origin is proven to part v and w from x and y strictly; its normal n is that
    of a perceptron (`separated.py`). error: bound on each coordinate; a product n . v is off by at most |n|_1 (2^-50
    |v| + error), of which twice is allowed."""
    n, are_parted = Point3(0.0, 0.0, 0.0), False
    for _ in range(_TURNS):
        are_parted = True
        for k in range(4):
            u, side = (v, 1.0) if k == 0 else (w, 1.0) if k == 1 else (x, -1.0) if k == 2 else (y, -1.0)
            size = largest_of(u)
            bound = (2.0**-49 * size + 2.0 * error) * (abs(n.x) + abs(n.y) + abs(n.z)) + 2.0**-1000
            if not side * dot(n, u) > bound:
                are_parted, side = False, side / size
                n = Point3(n.x + side * u.x, n.y + side * u.y, n.z + side * u.z)
        if are_parted:
            break
    return are_parted


@merged
def common_corner(poses: FloatArray, t: Facet, u: Facet, own: Facet, their: Facet, error: float) -> int:
    """Return 3 k + m if corner k of t and corner m of u are proven to be one point, and the only common point; else -1.

    t, u: rounded posed triangles, each coordinate within `error`. own, their: the same before their poses. Proof: the
    vectors v, w from the common corner to the other corners of t lie strictly on one side of the plane of u, or those
    of u, x and y, on one side of the plane of t; or both faces straddle, and leave the corner along the common line in
    opposite directions; or a plane parts v and w from x and y. With normals m of t and n of u the directions are (m x
    n) sign(n . v), and (n x m) sign(m . x)."""
    for k in range(3):
        for m in range(3):
            p, q = corner(t, k), corner(u, m)
            if not largest_of(minus(p, q)) <= 2.0 * error:
                continue
            v, w = minus(corner(t, k + 1), p), minus(corner(t, k + 2), p)
            x, y = minus(corner(u, m + 1), q), minus(corner(u, m + 2), q)
            by_x, by_y = _plane_sides(v, w, x, y, error)
            if by_x * by_y != 1:
                by_v, by_w = _plane_sides(x, y, v, w, error)
                is_open = by_v * by_w == 0 or (by_v * by_w < 0 and (by_x * by_y == 0 or by_v != by_x))
                if is_open and not _are_parted(v, w, x, y, 2.0 * error):
                    return -1
            return 3 * k + m if error == 0.0 or are_equal_exact(poses, corner(own, k), corner(their, m)) else -1
    return -1


@merged
def insert_sorted(
    faces: Any, their_faces: Any, pairs: Any, kinds: Any, i: int, j: int, kind: int
) -> tuple[int, int, int]:
    """Insert a pair of faces (i, j) and its kind into the last N_NAMED rows of pairs (n, 2) and kinds (n,), in the
    order of `_precedes`, empty rows (i = -1) last. faces, their_faces: the caller's number of each face. Returns the i,
    j and kind that no longer fit, the last in order, which may be the given ones; i = -1 if a row was free."""
    n = kinds.shape[0]
    for place in range(n - N_NAMED if _precedes(faces, their_faces, i, j, pairs, n - 1) else n, n):
        if _precedes(faces, their_faces, i, j, pairs, place):
            p, q, other = pairs[place, 0], pairs[place, 1], kinds[place]
            pairs[place, 0], pairs[place, 1], kinds[place] = i, j, kind
            i, j, kind = p, q, int(other)
            if i < 0:
                break
    return i, j, kind


@inline
def _precedes(faces: Any, their_faces: Any, i: int, j: int, pairs: Any, place: int) -> bool:
    """Return whether the pair (i, j) sorts before that of row ``place``: by the caller's face numbers `faces[i]` and
    `their_faces[j]`, then by i and j; an empty row (-1) is last."""
    p, q = pairs[place, 0], pairs[place, 1]
    return p < 0 or (faces[i], their_faces[j], i, j) < (faces[p], their_faces[q], p, q)
