"""Do two triangles in space have a common point, and do they cross: by orientation signs alone.

                    p1                 T1 meets the plane of T2 in an interval of the line L of both planes, and so does
        L __i1____ / \\ _____j1__      T2. p1 (p2) stands alone on its side. The intervals have a common point unless
          i2______/___\\______j2       one ends before the other begins: two orientation signs.
                 q1    r1

A `CROSSING` is more than a contact: each triangle has vertices strictly on both sides of the other's plane, and the two
intervals share more than a point, so a segment of positive length lies in the relative interior of both.

Coplanar triangles are compared in the projection along `axis`: closed triangles are disjoint exactly if one of the six
edge lines has the other triangle strictly outside. Triangles without area are left UNDECIDED here, as is everything
that a predicate leaves so; `exact_triangles.py` settles them.

Source: P. Guigue, O. Devillers, Fast and robust triangle-triangle overlap test using orientation predicates, 2003.
Changed: the permutations are replaced by a rule that names the lone vertex; strict and weak contacts are told apart.
"""

from __future__ import annotations

from typing import NamedTuple

from engine.collision.placement import orient2d_near, orient3d_near
from engine.jit import inline
from engine.types import UNDECIDED, Point2, Point3

APART = 0
CROSSING = 1
CONTACT = 3
COPLANAR = 4
"""Classes of a pair beside UNDECIDED (2): no common point; crossing strictly; a weaker contact; a contact in one
plane."""


class Triangle3(NamedTuple):
    """Three points; compiled code passes triangles by value."""

    p: Point3
    q: Point3
    r: Point3


@inline
def lone_vertex(p: int, q: int, r: int) -> tuple[int, int]:
    """Return the vertex (0, 1, 2) that has one closed side of a plane for itself, and that side (1 or -1).

    p, q, r: sides of the vertices, not all zero, not all on one strict side. The other two lie on the opposite closed
    side, and not both of them on the plane unless the lone one is off it.
    """
    n_above = (p > 0) + (q > 0) + (r > 0)
    n_below = (p < 0) + (q < 0) + (r < 0)
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
def turned(t: Triangle3, lone: int) -> Triangle3:
    """Return the triangle with vertex `lone` first, orientation kept."""
    if lone == 0:
        return t
    if lone == 1:
        return Triangle3(t.q, t.r, t.p)
    return Triangle3(t.r, t.p, t.q)


@inline
def is_one_side(p: int, q: int, r: int) -> bool:
    """Tell whether three signs are all 1 or all -1."""
    return (p == 1 and q == 1 and r == 1) or (p == -1 and q == -1 and r == -1)


@inline
def is_straddling(p: int, q: int, r: int) -> bool:
    """Tell whether vertices lie strictly on both sides."""
    return (p == 1 or q == 1 or r == 1) and (p == -1 or q == -1 or r == -1)


@inline
def classify_pair(t1: Triangle3, t2: Triangle3, axis: int, error: float) -> int:
    """Return the class of two triangles that both have an area.

    axis: a coordinate axis along which the projection of t1 has an area. error: of the rounded coordinates, 0.0 if
    exact.
    """
    p2 = orient3d_near(t1.p, t1.q, t1.r, t2.p, error)
    q2 = orient3d_near(t1.p, t1.q, t1.r, t2.q, error)
    r2 = orient3d_near(t1.p, t1.q, t1.r, t2.r, error)
    if is_one_side(p2, q2, r2):
        return APART
    p1 = orient3d_near(t2.p, t2.q, t2.r, t1.p, error)
    q1 = orient3d_near(t2.p, t2.q, t2.r, t1.q, error)
    r1 = orient3d_near(t2.p, t2.q, t2.r, t1.r, error)
    if is_one_side(p1, q1, r1):
        return APART
    if p1 == UNDECIDED or q1 == UNDECIDED or r1 == UNDECIDED:
        return UNDECIDED
    if p2 == UNDECIDED or q2 == UNDECIDED or r2 == UNDECIDED:
        return UNDECIDED
    if p2 == 0 and q2 == 0 and r2 == 0:
        return classify_coplanar(t1, t2, axis)
    lone1, side1 = lone_vertex(p1, q1, r1)
    lone2, side2 = lone_vertex(p2, q2, r2)
    a, b = turned(t1, lone1), turned(t2, lone2)
    if side1 < 0:  # turn b over: now a.p is above b
        b = Triangle3(b.p, b.r, b.q)
    if side2 < 0:
        a = Triangle3(a.p, a.r, a.q)
    first = orient3d_near(a.q, b.p, a.p, b.q, error)
    if first == 1:
        return APART
    second = orient3d_near(a.p, b.p, a.r, b.r, error)
    if second == 1:
        return APART
    if first == UNDECIDED or second == UNDECIDED:
        return UNDECIDED
    if first < 0 and second < 0 and is_straddling(p1, q1, r1) and is_straddling(p2, q2, r2):
        return CROSSING
    return CONTACT


@inline
def projected(p: Point3, axis: int) -> Point2:
    """Return the point without one coordinate, the two others in cyclic order."""
    if axis == 0:
        return Point2(p.y, p.z)
    if axis == 1:
        return Point2(p.z, p.x)
    return Point2(p.x, p.y)


@inline
def outside_an_edge(a: Point2, b: Point2, c: Point2, d: Point2, e: Point2, f: Point2) -> int:
    """Return how an edge of the triangle a b c, counter-clockwise, separates it from d e f.

    1: some edge has all of d e f strictly outside; 0: outside or on it; -1: no edge separates; UNDECIDED.
    """
    best = -1
    unsure = False
    for edge in range(3):
        if edge == 0:
            s, t = a, b
        elif edge == 1:
            s, t = b, c
        else:
            s, t = c, a
        d_side = orient2d_near(s, t, d, 0.0)
        e_side = orient2d_near(s, t, e, 0.0)
        f_side = orient2d_near(s, t, f, 0.0)
        if d_side == UNDECIDED or e_side == UNDECIDED or f_side == UNDECIDED:
            unsure = True
        elif d_side < 0 and e_side < 0 and f_side < 0:
            return 1
        elif d_side <= 0 and e_side <= 0 and f_side <= 0:
            best = 0
    return UNDECIDED if unsure else best


@inline
def separation(t1: Triangle3, t2: Triangle3, axis: int) -> int:
    """Return how two coplanar triangles with area lie: 1 apart, 0 only their borders meet, -1 interiors meet."""
    a, b, c = projected(t1.p, axis), projected(t1.q, axis), projected(t1.r, axis)
    d, e, f = projected(t2.p, axis), projected(t2.q, axis), projected(t2.r, axis)
    turn1, turn2 = orient2d_near(a, b, c, 0.0), orient2d_near(d, e, f, 0.0)
    if turn1 == UNDECIDED or turn2 == UNDECIDED:
        return UNDECIDED
    if turn1 < 0:
        b, c = c, b
    if turn2 < 0:
        e, f = f, e
    first = outside_an_edge(a, b, c, d, e, f)
    if first == 1:
        return 1
    second = outside_an_edge(d, e, f, a, b, c)
    if second == 1:
        return 1
    if first == UNDECIDED or second == UNDECIDED:
        return UNDECIDED
    return max(first, second)


@inline
def classify_coplanar(t1: Triangle3, t2: Triangle3, axis: int) -> int:
    """Return APART, COPLANAR or UNDECIDED for triangles of one plane."""
    how = separation(t1, t2, axis)
    if how == UNDECIDED:
        return UNDECIDED
    return APART if how == 1 else COPLANAR
