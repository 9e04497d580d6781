"""Triangle-triangle intersection in space, by orientation signs only.

Each triangle is compared with the plane of the other. Where both straddle, each plane cuts the other triangle in an
interval of the common line, and two more signs decide whether the intervals have a common point, strictly or not. Two
stages:

- `classify_near`: float64 with one bound for all signs; answers APART or CROSSING, UNDECIDED where any sign is near 0.
- `classify`: every sign exact, of points under their poses; UNDECIDED out of exponent range only.

Caller guarantees that both triangles have an area (`exact_body.py` takes those without).

Source: P. Guigue, O. Devillers, Fast and robust triangle-triangle overlap test using orientation predicates, 2003.
Changed: the permutations are replaced by a rule that names the lone vertex; strict and weak contacts are distinguished.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np

from engine.compiling.jit import called, inline, merged
from engine.predicates.orientation import orient2d
from engine.predicates.posed import UNPOSED, PosedPoint3, orient3d_posed, posed_point
from engine.predicates.vectors import as_point3, cross, dot, largest_of, minus
from engine.types import UNDECIDED, FloatArray, Point2, Point3

APART = 0
CROSSING = 1
CONTACT = 3
COPLANAR = 4
COMMON_AREA = 5
CORNER = 8
"""| class of a pair | meaning |
|---|---|
| APART | no common point |
| CROSSING | strict crossing |
| UNDECIDED (2) | |
| CONTACT | weaker contact |
| COPLANAR | contact in one plane, of their borders |
| COMMON_AREA | in one plane, and their interiors meet |
| CORNER + 3 k + m | corner k of the first is corner m of the second, the only common point |
"""


Signs = tuple[int, int, int]
Facet = namedtuple("Facet", "p q r")
"""Three points of one kind; compiled code passes triangles by value."""


@inline
def facet_at(points: FloatArray, i: int, j: int, k: int) -> Facet:
    """Return the triangle of rows i, j, k of points (n, 3)."""
    return Facet(as_point3(points, i), as_point3(points, j), as_point3(points, k))


@inline
def with_pose(t: Facet, pose: int = UNPOSED) -> Facet:
    """Return the triangle with its corners tagged with a pose number, the row of `poses` by which exact signs move
    them; UNPOSED: none."""
    return Facet(
        PosedPoint3(t.p.x, t.p.y, t.p.z, pose),
        PosedPoint3(t.q.x, t.q.y, t.q.z, pose),
        PosedPoint3(t.r.x, t.r.y, t.r.z, pose),
    )


@inline
def lone_vertex(p: int, q: int, r: int) -> tuple[int, int]:
    """Return the vertex (0, 1, 2) of a triangle that is alone on one closed side of a plane, and that side (1 or -1).
    p, q, r: signs of the vertices at the plane, not all zero, not all on one strict side. The other two lie on the
    opposite closed side, and not both of them on the plane unless the lone one is off it."""
    n_above, n_below = (p > 0) + (q > 0) + (r > 0), (p < 0) + (q < 0) + (r < 0)
    if n_above == 1:
        side, wanted = 1, 1
    elif n_below == 1:
        side, wanted = -1, -1
    else:  # case: two on one strict side and one on the plane
        side, wanted = (-1, 0) if n_above == 2 else (1, 0)
    if p == wanted:
        return 0, side
    if q == wanted:
        return 1, side
    return 2, side


@inline
def is_one_side(p: int, q: int, r: int) -> bool:
    """Return whether three signs are all 1 or all -1."""
    return (p == 1 and q == 1 and r == 1) or (p == -1 and q == -1 and r == -1)


@inline
def is_straddling(p: int, q: int, r: int) -> bool:
    """Return whether some of three signs is 1 and some is -1: vertices lie strictly on both sides of a plane."""
    return (p == 1 or q == 1 or r == 1) and (p == -1 or q == -1 or r == -1)


@inline
def rotate_vertices(t: Facet, lone: int) -> Facet:
    """Return the triangle with vertex `lone` first, orientation preserved."""
    return t if lone == 0 else (Facet(t.q, t.r, t.p) if lone == 1 else Facet(t.r, t.p, t.q))


@inline
def lone_first(t1: Facet, t2: Facet, sides: Signs, their_sides: Signs) -> tuple[Facet, Facet]:
    """Return two triangles, each rotated so that its first vertex is alone on one side of the other's plane, and turned
    over where needed so that it is above that plane. sides: of t1's vertices at the plane of t2; their_sides: of t2's
    vertices at the plane of t1."""
    lone1, side1 = lone_vertex(sides[0], sides[1], sides[2])
    lone2, side2 = lone_vertex(their_sides[0], their_sides[1], their_sides[2])
    a, b = rotate_vertices(t1, lone1), rotate_vertices(t2, lone2)
    if side1 < 0:  # turn b over: now a.p is above b
        b = Facet(b.p, b.r, b.q)
    if side2 < 0:
        a = Facet(a.p, a.r, a.q)
    return a, b


@merged
def corner(t: Facet, index: int) -> Any:
    """Return corner ``index`` modulo 3 of a triangle, index at most 6."""
    return t.q if index == 1 or index == 4 else (t.r if index == 2 or index == 5 else t.p)


# ---- near: one bound for all signs ----------------------------------------------------------------------------------


@merged
def bound_near(u: Point3, v: Point3, p: Point3, q: Point3, r: Point3, error: float) -> float:
    """Return an error bound for orientation determinants of six points: u, v, p, q, r are five of them minus the sixth.

    M = 2 m bounds differences of two points, m the largest given; e: twice the error of a coordinate, known to +-
    `error`: ``|det - exact| <= 11 u 6 M^3 + 18 e (M + e)^2`` (7 u as in `orient3d_filter`; some differences are rounded
    twice), plus underflow (`placement.py`)."""
    m = 2.0 * max(max(largest_of(u), largest_of(v)), max(largest_of(p), largest_of(q), largest_of(r)))
    e = 2.0 * error
    return 2.0**-46 * (m * m * m) + 18.5 * e * ((m + e) * (m + e)) + 2.0**-1068 * (1.0 + m)


@inline
def classify_near(t1: Facet, t2: Facet, error: float) -> int:
    """Return APART, CROSSING or UNDECIDED for two triangles, each coordinate known to +- `error`; float64 only."""
    u, v = minus(t1.q, t1.p), minus(t1.r, t1.p)
    p2, q2, r2 = minus(t2.p, t1.p), minus(t2.q, t1.p), minus(t2.r, t1.p)
    bound = bound_near(u, v, p2, q2, r2, error)
    n1 = cross(u, v)
    a, b, c = dot(n1, p2), dot(n1, q2), dot(n1, r2)
    if (a > bound and b > bound and c > bound) or (a < -bound and b < -bound and c < -bound):
        return APART
    x, y = minus(q2, p2), minus(r2, p2)
    n2 = cross(x, y)
    # from t2.p: t1.p - t2.p = -p2
    d, f, g = -dot(n2, p2), dot(n2, minus(u, p2)), dot(n2, minus(v, p2))
    if (d > bound and f > bound and g > bound) or (d < -bound and f < -bound and g < -bound):
        return APART
    if not (min(abs(a), abs(b), abs(c)) > bound and min(abs(d), abs(f), abs(g)) > bound):
        return UNDECIDED
    theirs = 1 if a > 0.0 else -1, 1 if b > 0.0 else -1, 1 if c > 0.0 else -1
    s, t = lone_first(t1, t2, (1 if d > 0.0 else -1, 1 if f > 0.0 else -1, 1 if g > 0.0 else -1), theirs)
    from_p = minus(t.p, s.p)
    first = dot(cross(minus(s.q, s.p), from_p), minus(t.q, s.p))  # orient3d(s.q, t.p, s.p, t.q)
    second = dot(cross(from_p, minus(s.r, s.p)), minus(t.r, s.p))  # orient3d(s.p, t.p, s.r, t.r)
    return APART if first > bound or second > bound else (CROSSING if first < -bound and second < -bound else UNDECIDED)


# ---- exact ----------------------------------------------------------------------------------------------------------


@inline
def is_same(p: PosedPoint3, q: PosedPoint3) -> bool:
    """Return whether two points have equal coordinates and the same pose number."""
    return p.x == q.x and p.y == q.y and p.z == q.z and p.pose == q.pose


@inline
def sign_of_four(
    poses: FloatArray, a: PosedPoint3, b: PosedPoint3, c: PosedPoint3, d: PosedPoint3, error: float
) -> int:
    """Return the exact sign of orient3d of four posed points (`orient3d_posed`), or UNDECIDED. 0 without arithmetic if
    two points coincide, or all share a coordinate, under one pose. error: bound on the rounding of a posed coordinate.
    """
    if is_same(a, d) or is_same(b, d) or is_same(c, d) or is_same(a, b) or is_same(a, c) or is_same(b, c):
        return 0
    if a.pose == d.pose and b.pose == d.pose and c.pose == d.pose:
        if (a.x == d.x and b.x == d.x and c.x == d.x) or (a.y == d.y and b.y == d.y and c.y == d.y):
            return 0
        if a.z == d.z and b.z == d.z and c.z == d.z:
            return 0
    return orient3d_posed(poses, a, b, c, d, error)


@called
def sides_of(poses: FloatArray, t: Facet, u: Facet, error: float) -> Signs:
    """Return the exact signs of the three corners of u at the plane of t: 1, 0, -1 or UNDECIDED each. error: bound on
    the rounding of a posed coordinate."""
    a = posed_point(poses, t.p)
    v, w = minus(posed_point(poses, t.q), a), minus(posed_point(poses, t.r), a)
    p, q, r = minus(posed_point(poses, u.p), a), minus(posed_point(poses, u.q), a), minus(posed_point(poses, u.r), a)
    n, bound = cross(v, w), bound_near(v, w, p, q, r, error)
    by_p, by_q, by_r = dot(n, p), dot(n, q), dot(n, r)
    return (
        sign_of_four(poses, t.p, t.q, t.r, u.p, error) if not abs(by_p) > bound else (1 if by_p > 0.0 else -1),
        sign_of_four(poses, t.p, t.q, t.r, u.q, error) if not abs(by_q) > bound else (1 if by_q > 0.0 else -1),
        sign_of_four(poses, t.p, t.q, t.r, u.r, error) if not abs(by_r) > bound else (1 if by_r > 0.0 else -1),
    )


@called
def classify(poses: FloatArray, t1: Facet, t2: Facet, axis: int, error: float) -> int:
    """Return the class of two triangles with area by exact signs; UNDECIDED only if exponents are out of range. poses
    (n, 12): R by rows, then t. error: the largest `posed_error` of the corners.
    axis: along it the projection of t1, before its pose, has an area."""
    p2, q2, r2 = sides_of(poses, t1, t2, error)
    if is_one_side(p2, q2, r2):
        return APART
    p1, q1, r1 = sides_of(poses, t2, t1, error)
    if is_one_side(p1, q1, r1):
        return APART
    if p1 == UNDECIDED or q1 == UNDECIDED or r1 == UNDECIDED:
        return UNDECIDED
    if p2 == UNDECIDED or q2 == UNDECIDED or r2 == UNDECIDED:
        return UNDECIDED
    if p2 == 0 and q2 == 0 and r2 == 0:
        how = separation(poses, t1, t2, axis, error)
        return UNDECIDED if how == UNDECIDED else (APART if how == 1 else (COPLANAR if how == 0 else COMMON_AREA))
    a, b = lone_first(t1, t2, (p1, q1, r1), (p2, q2, r2))
    first = sign_of_four(poses, a.q, b.p, a.p, b.q, error)
    if first == 1:
        return APART
    second = sign_of_four(poses, a.p, b.p, a.r, b.r, error)
    if second == 1:
        return APART
    if first == UNDECIDED or second == UNDECIDED:
        return UNDECIDED
    return CROSSING if first < 0 and second < 0 and is_straddling(p1, q1, r1) and is_straddling(p2, q2, r2) else CONTACT


@inline
def projected(p: Point3, axis: int) -> Point2:
    """Return the point without coordinate ``axis``, the other two in cyclic order."""
    return Point2(p.y, p.z) if axis == 0 else (Point2(p.z, p.x) if axis == 1 else Point2(p.x, p.y))


@inline
def off_plane_point(t: Facet, axis: int) -> PosedPoint3:
    """Return a point off the plane of t, before its pose: its first corner moved along ``axis``, along which the
    projection of t has an area. Maybe infinite."""
    p, size = t.p, max(largest_of(minus(t.q, t.p)), largest_of(minus(t.r, t.p)))
    value = p.x if axis == 0 else (p.y if axis == 1 else p.z)
    value = 0.5 * value if abs(value) > size else value + size  # either differs from `value`
    return PosedPoint3(value if axis == 0 else p.x, value if axis == 1 else p.y, value if axis == 2 else p.z, p.pose)


@inline
def turn_in_plane(
    poses: FloatArray, a: PosedPoint3, b: PosedPoint3, c: PosedPoint3, off: PosedPoint3, axis: int, error: float
) -> int:
    """Return the orientation sign of a, b, c within their common plane, or UNDECIDED. axis >= 0: of the projection
    along it, of unposed points. -1: seen from ``off``, a point off the plane, which fixes the sign."""
    if axis >= 0:
        return orient2d(projected(a, axis), projected(b, axis), projected(c, axis))
    return sign_of_four(poses, a, b, off, c, error)


@inline
def outside_an_edge(poses: FloatArray, t: Facet, u: Facet, off: PosedPoint3, axis: int, error: float) -> int:
    """Return whether the line of an edge of t separates t from u, both in one plane; off, axis: as in `turn_in_plane`.

    | result | meaning |
    |---|---|
    | 1 | some edge has all of u strictly outside |
    | 0 | some edge has all of u outside or on it |
    | -1 | no edge separates |
    | UNDECIDED | a sign is |
    """
    turn = turn_in_plane(poses, t.p, t.q, t.r, off, axis, error)
    if turn == UNDECIDED:
        return UNDECIDED
    best, unsure = -1, False
    s, e, third = t
    for edge in range(3):
        if edge > 0:
            s, e, third = e, third, s
        p_side = turn_in_plane(poses, s, e, u.p, off, axis, error)
        if p_side == turn:
            continue
        q_side = turn_in_plane(poses, s, e, u.q, off, axis, error)
        if q_side == turn:
            continue
        r_side = turn_in_plane(poses, s, e, u.r, off, axis, error)
        if p_side == UNDECIDED or q_side == UNDECIDED or r_side == UNDECIDED:
            unsure = True
        elif p_side == -turn and q_side == -turn and r_side == -turn:
            return 1
        elif r_side != turn:
            best = 0
    return UNDECIDED if unsure else best


@called
def passes_within(
    poses: FloatArray, a: PosedPoint3, b: PosedPoint3, t: Facet, off: PosedPoint3, axis: int, error: float
) -> int:
    """Return 1 if the segment a b, in the plane of t, intersects the open face t, 0 if not, or UNDECIDED. off, axis: as
    in `turn_in_plane`."""
    turn = turn_in_plane(poses, t.p, t.q, t.r, off, axis, error)
    if turn == UNDECIDED:
        return UNDECIDED
    unsure = False
    for edge in range(3):
        s, e = corner(t, edge), corner(t, edge + 1)
        by_a, by_b = turn_in_plane(poses, s, e, a, off, axis, error), turn_in_plane(poses, s, e, b, off, axis, error)
        if by_a == UNDECIDED or by_b == UNDECIDED:
            unsure = True
        elif by_a != turn and by_b != turn:  # the edge has the segment outside or on it
            return 0
    p, q = turn_in_plane(poses, a, b, t.p, off, axis, error), turn_in_plane(poses, a, b, t.q, off, axis, error)
    r = turn_in_plane(poses, a, b, t.r, off, axis, error)
    if unsure or p == UNDECIDED or q == UNDECIDED or r == UNDECIDED:
        return UNDECIDED
    return int(is_straddling(p, q, r))


@called
def is_on_face(poses: FloatArray, p: PosedPoint3, t: Facet, off: PosedPoint3, axis: int, error: float) -> int:
    """Return 1 if p, in the plane of t, lies on the closed face t, 0 if not, or UNDECIDED. off, axis: as in
    `turn_in_plane`."""
    result, turn = 1, turn_in_plane(poses, t.p, t.q, t.r, off, axis, error)
    for edge in range(3):
        side = turn_in_plane(poses, corner(t, edge), corner(t, edge + 1), p, off, axis, error)
        if turn == UNDECIDED or side == UNDECIDED:
            result = UNDECIDED
        elif side == -turn:
            return 0
    return result


@inline
def separation(poses: FloatArray, t1: Facet, t2: Facet, axis: int, error: float) -> int:
    """Return 1 if two coplanar triangles with area are disjoint, 0 if only their borders meet, -1 if their interiors
    do; UNDECIDED if a sign is. axis: along it the projection of t1, before its pose, has an area."""
    off = off_plane_point(t1, axis)
    if not np.isfinite(off.x + off.y + off.z):
        return UNDECIDED
    flat = axis if (t1.p.pose == UNPOSED and t2.p.pose == UNPOSED) else -1
    first = outside_an_edge(poses, t1, t2, off, flat, error)
    if first == 1:
        return 1
    second = outside_an_edge(poses, t2, t1, off, flat, error)
    return 1 if second == 1 else (UNDECIDED if first == UNDECIDED or second == UNDECIDED else max(first, second))
