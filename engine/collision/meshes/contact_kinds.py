"""Compiled: how faces in contact meet (the kind of a witness), and pairs that meet in a common corner and nowhere else.

As `exact_body.kind_of_contact`. An edge of t passes the open face u where its ends lie on two sides of u's plane
and u's edges turn one way about it, or where it lies in that plane with corners of u on both sides. Open edges cross
where they are coplanar and each has the other's ends on two sides, in a plane told by a third corner.

Where many faces of either body share one point, each meets each of the other's there: the square of their number says
no more than that they are in contact. Such a pair names no other witness than a vertex on a vertex, cuts no face and
proves nothing, so a search kept for many contacts lists it only while one of its faces is not known to be in contact,
and keeps aside those that stand first among all, which name the witness.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.collision.codes import UNSETTLED
from engine.collision.meshes.triangle_triangle import (
    Facet,
    Signs,
    beside,
    bound_near,
    corner,
    is_same,
    is_straddling,
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
"""Of several contacts the witness is the one of the kind that stands first here; at most `N_NAMED` are looked at."""
FACE_FACE, EDGE_FACE, VERTEX_FACE, EDGE_EDGE, VERTEX_EDGE, VERTEX_VERTEX, CONTAINED = range(7)
N_NAMED = 32
BOTH = 3

_BAD, FLUSH, N_SIGNS = 9, 10, 11
"""Places in the work space, after nine turns: is a sign open; corners in the plane of the other face, 3 bits each."""


@called
def _side(
    poses: FloatArray, a: PosedPoint3, b: PosedPoint3, c: PosedPoint3, d: PosedPoint3, error: float, work: Int8Array
) -> int:
    """Return orient3d; 0, and note it, where it is open."""
    side = sign_of_four(poses, a, b, c, d, error)
    if side == UNDECIDED:
        work[_BAD], side = 1, 0
    return side


@called
def _turn(
    poses: FloatArray, a: PosedPoint3, b: PosedPoint3, c: PosedPoint3, off: PosedPoint3, axis: int, error: float,
    work: Int8Array,
) -> int:  # fmt: skip
    """Return how three points of one plane turn; 0, and note it, where that is open."""
    turn = turn_in_plane(poses, a, b, c, off, axis, error)
    if turn == UNDECIDED:
        work[_BAD], turn = 1, 0
    return turn


@called
def _against_face(poses: FloatArray, t: Facet, sides: Signs, u: Facet, axis: int, error: float, work: Int8Array) -> int:
    """Return how t, at these sides of u's plane, meets the open face u: EDGE_FACE, VERTEX_FACE; or by corners."""
    off, flat = beside(u, axis), axis if (t.p.pose == UNPOSED and u.p.pose == UNPOSED) else -1
    if not np.isfinite(off.x + off.y + off.z):
        work[_BAD] = 1
        return VERTEX_EDGE
    turn = _turn(poses, u.p, u.q, u.r, off, flat, error, work)
    found = VERTEX_EDGE
    for k in range(3):
        if sides[k] != 0:
            continue
        n_on, n_out = 0, 0
        for edge in range(3):
            value = turn * _turn(poses, corner(u, edge), corner(u, edge + 1), corner(t, k), off, flat, error, work)
            work[3 * k + edge] = value
            n_on += value == 0
            n_out += value < 0
        if n_out == 0 and n_on == 0:
            found = VERTEX_FACE
        elif n_out == 0 and n_on == 2 and found != VERTEX_FACE:
            found = VERTEX_VERTEX
    for k in range(3):
        end = (k + 1) % 3
        a, b = corner(t, k), corner(t, end)
        n_left, n_right, is_outside = 0, 0, False
        for edge in range(3):
            value = 0
            if sides[k] * sides[end] < 0:
                value = _side(poses, a, b, corner(u, edge), corner(u, edge + 1), error, work)
            elif sides[k] == 0 and sides[end] == 0:
                is_outside |= work[3 * k + edge] <= 0 and work[3 * end + edge] <= 0
                value = _turn(poses, a, b, corner(u, edge), off, flat, error, work)
            n_left += value > 0
            n_right += value < 0
        if sides[k] * sides[end] < 0:
            if n_left == 3 or n_right == 3:
                return EDGE_FACE
        elif n_left > 0 and n_right > 0 and not is_outside:
            return EDGE_FACE
    return found


@called
def _overlap_on_line(
    poses: FloatArray, t: Facet, k: int, c: PosedPoint3, d: PosedPoint3, axis: int, error: float, work: Int8Array
) -> bool:
    """Tell whether edge k of t and c d, on one line, share a length, by planes through either end and off the line."""
    a, b, apex, off = corner(t, k), corner(t, k + 1), corner(t, k + 2), beside(t, axis)
    for end in range(2):
        p, q = (a, b) if end == 0 else (b, a)
        inner = _side(poses, p, apex, off, q, error, work)
        by_c, by_d = _side(poses, p, apex, off, c, error, work), _side(poses, p, apex, off, d, error, work)
        if inner * by_c <= 0 and inner * by_d <= 0:
            return False
    return True


@called
def _open_edges_meet(
    poses: FloatArray,
    t: Facet,
    sides: Signs,
    u: Facet,
    their_sides: Signs,
    axis: int,
    error: float,
    work: Int8Array,
) -> bool:
    """Tell whether two open edges of the faces have a common point."""
    is_flat = sides[0] == 0 and sides[1] == 0 and sides[2] == 0
    off, flat = beside(t, axis), axis if (t.p.pose == UNPOSED and u.p.pose == UNPOSED) else -1
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
                    by_c = _turn(poses, a, b, c, off, flat, error, work)
                    by_d = _turn(poses, a, b, d, off, flat, error, work)
                    by_a = _turn(poses, c, d, a, off, flat, error, work)
                    if by_c * by_d < 0 and by_a * _turn(poses, c, d, b, off, flat, error, work) < 0:
                        return True
                    if by_c != 0 or by_d != 0:
                        continue
                if _overlap_on_line(poses, t, k, c, d, axis, error, work):
                    return True
            elif _side(poses, a, b, c, d, error, work) == 0:
                p, q, x, y = (c, d, a, b) if their_across != 0 else (a, b, c, d)
                apex = corner(t, k + 2) if their_across != 0 else corner(u, m + 2)
                if _side(poses, p, q, apex, x, error, work) * _side(poses, p, q, apex, y, error, work) < 0:
                    return True
    return False


@inline
def lone_zero(sides: Signs) -> int:
    """Return the corner of a face that alone lies on a plane, the others strictly on one side of it; -1 for none."""
    for k in range(3):
        if sides[k] == 0 and sides[(k + 1) % 3] * sides[(k + 2) % 3] == 1:
            return k
    return -1


@called
def kind_of(
    poses: FloatArray, t: Facet, axis: int, u: Facet, their_axis: int, error: float, work: Int8Array
) -> tuple[int, int]:
    """Return the kind of the contact of two faces with area, UNSETTLED where a sign is open, and whether it may cut the
    open face t (1), u (2) or BOTH: not where all that they share is one point, or lies on its border. Sets FLUSH."""
    work[_BAD] = work[FLUSH] = 0
    sides, their_sides = sides_of(poses, u, t, error), sides_of(poses, t, u, error)
    for k in range(3):
        if sides[k] == UNDECIDED or their_sides[k] == UNDECIDED:
            return UNSETTLED, BOTH
        work[FLUSH] |= int(sides[k] == 0) << k | int(their_sides[k] == 0) << 3 + k
    own, their = lone_zero(sides), lone_zero(their_sides)
    for k in range(3):
        is_common = own >= 0 and is_same(corner(t, own), corner(u, k))
        if is_common or (their >= 0 and is_same(corner(u, their), corner(t, k))):
            return VERTEX_VERTEX, 0
    if sides[0] == 0 and sides[1] == 0 and sides[2] == 0:
        how = separation(poses, t, u, axis, error)
        if how == UNDECIDED or how < 0:
            return UNSETTLED if how == UNDECIDED else FACE_FACE, BOTH
    one = _against_face(poses, t, sides, u, their_axis, error, work)
    other = _against_face(poses, u, their_sides, t, axis, error, work)
    found = min(one, other)
    if found > VERTEX_FACE and _open_edges_meet(poses, t, sides, u, their_sides, axis, error, work):
        found = EDGE_EDGE
    elif found > VERTEX_FACE:
        found = max(one, other)  # a common corner, if there is one
    if work[_BAD] != 0:
        return UNSETTLED, BOTH
    if own >= 0 or their >= 0 or found == VERTEX_VERTEX:
        return found, 0
    # case: both straddle and are cut by the line of their planes in one and the same segment; no corner is common then
    are_across = is_straddling(sides[0], sides[1], sides[2])
    are_across = are_across and is_straddling(their_sides[0], their_sides[1], their_sides[2])
    return found, BOTH if are_across else int(other <= VERTEX_FACE) | int(one <= VERTEX_FACE) << 1


@inline
def _sides(a: Point3, b: Point3, c: Point3, d: Point3, error: float) -> tuple[int, int]:
    """Return on which sides of the plane of the origin, a and b the points c and d surely lie, 0 where unsure."""
    n, bound = cross(a, b), bound_near(a, b, c, d, d, error)
    one, other = dot(n, c), dot(n, d)
    return int(one > bound) - int(one < -bound), int(other > bound) - int(other < -bound)


@merged
def common_corner(poses: FloatArray, t: Facet, u: Facet, own: Facet, their: Facet, error: float) -> int:
    """Return 3 k + m where corner k of a face surely is corner m of another, and they have no other common point, else
    -1; t, u: the rounded posed triangles, each coordinate off by at most `error`; own, their: before their poses.

    The other corners v, w of one lie strictly on one side of the plane of the other, which it meets in the corner; or
    both straddle, and from the corner leave along the line of the planes in opposite directions. With normals m and n
    that is m x n times the sign of n . v, and n x m times that of m . x, x the corner of the other that stands for v.
    """
    for k in range(3):
        for m in range(3):
            p, q = corner(t, k), corner(u, m)
            if not largest_of(minus(p, q)) <= 2.0 * error:
                continue
            v, w = minus(corner(t, k + 1), p), minus(corner(t, k + 2), p)
            x, y = minus(corner(u, m + 1), q), minus(corner(u, m + 2), q)
            by_x, by_y = _sides(v, w, x, y, error)
            if by_x * by_y != 1:
                by_v, by_w = _sides(x, y, v, w, error)
                if by_v * by_w == 0 or (by_v * by_w < 0 and (by_x * by_y == 0 or by_v != by_x)):
                    return -1
            return 3 * k + m if error == 0.0 or are_equal_exact(poses, corner(own, k), corner(their, m)) else -1
    return -1


@merged
def keep_first(faces: Any, their_faces: Any, pairs: Any, kinds: Any, i: int, j: int, kind: int) -> tuple[int, int, int]:
    """Insert a pair into the sorted last N_NAMED rows; return the pair that drops out, -1 for none."""
    n = kinds.shape[0]
    for place in range(n - N_NAMED if _stands_before(faces, their_faces, i, j, pairs, n - 1) else n, n):
        if _stands_before(faces, their_faces, i, j, pairs, place):
            p, q, other = pairs[place, 0], pairs[place, 1], kinds[place]
            pairs[place, 0], pairs[place, 1], kinds[place] = i, j, kind
            i, j, kind = p, q, int(other)
            if i < 0:
                break
    return i, j, kind


@inline
def _stands_before(faces: Any, their_faces: Any, i: int, j: int, pairs: Any, place: int) -> bool:
    """Tell whether a pair is named before that of a row: by the callers' faces, then by the numbers."""
    p, q = pairs[place, 0], pairs[place, 1]
    return p < 0 or (faces[i], their_faces[j], i, j) < (faces[p], their_faces[q], p, q)
