"""Two faces on exact integer coordinates: their class, whatever their shape, and the kind of their contact.

Slow and complete: settles what the kernel leaves UNDECIDED (posed faces near contact, faces without area, exponents
out of range) and names the kind of a witness. A face without area is its longest segment, or a point.

Corners, edges and faces are simplices, and one question serves all: have two of them a common point, of their relative
interiors or at all? They have if weights of the corners of one and of the other, positive or not negative, give one
point. All weights that do, of equal sums, form a space of at most five dimensions, and Fourier and Motzkin tell whether
some of its points have the signs wanted.
"""

from __future__ import annotations

from itertools import combinations

from engine.collision.meshes.exact_body import Corners, Plane, Vector, plane_through
from engine.collision.meshes.triangle_triangle import APART, CONTACT, COPLANAR, CROSSING
from engine.collision.result import Kind
from engine.predicates.rational import cross, minus, sign_of

Flat = tuple[int, int]


def value_at(plane: Plane, p: Vector) -> int:
    """Return a x + b y + c z + d."""
    return plane[0] * p[0] + plane[1] * p[1] + plane[2] * p[2] + plane[3]


def without_axis(p: Vector, axis: int) -> Flat:
    """Return the two other coordinates in cyclic order."""
    return p[(axis + 1) % 3], p[(axis + 2) % 3]


def as_simplex(t: Corners) -> tuple[Vector, ...]:
    """Return the three corners, or the two ends of a face without area, or its one point."""
    p, q, r = t
    if any(cross(minus(q, p), minus(r, p))):
        return t
    ends = min(t), max(t)  # order: along a line the lexicographic order is the order along it
    return ends if ends[0] != ends[1] else ends[:1]


def _weights(s: tuple[Vector, ...], t: tuple[Vector, ...]) -> list[Vector]:
    """Return for each corner of s, then of t, its weights in a basis of all that give both simplices the same point."""
    origin, n = s[0], len(s) - 1  # its own weight is what the others of s lack
    vectors = [*(minus(p, origin) for p in s[1:]), *(minus(origin, p) for p in t)]
    rows = [(*vector, *(int(k == i) for k in range(len(vectors)))) for i, vector in enumerate(vectors)]
    for column in range(3):
        pivot = next((row for row in rows if row[column]), None)
        if pivot is not None:
            rows.remove(pivot)
            f = pivot[column]
            rows = [tuple(f * x - row[column] * y for x, y in zip(row, pivot)) if row[column] else row for row in rows]
    return list(zip(*((sum(row[3 + n :]) - sum(row[3 : 3 + n]), *row[3:]) for row in rows)))


def _has_point(positive: list[Vector], not_negative: list[Vector]) -> bool:
    """Tell whether at some z all of some linear functions are positive, and none of some others negative."""
    n = len(positive[0])
    rows = {(*row, True) for row in positive} | {(*row, False) for row in not_negative}
    for k in range(n):  # of rows that grow and fall with z[k], a sum without it
        up, down = [row for row in rows if row[k] > 0], [row for row in rows if row[k] < 0]
        rows = {row for row in rows if row[k] == 0}
        rows |= {(*(p[k] * y - q[k] * x for x, y in zip(p[:n], q)), p[n] or q[n]) for p in up for q in down}
    return not any(row[n] for row in rows)  # 0 > 0


def _meet(s: tuple[Vector, ...], t: tuple[Vector, ...], *, within: bool) -> bool:
    """Tell whether two simplices have a common point, within: one that lies in the relative interior of both."""
    weights = _weights(s, t)
    if not weights:
        return False
    if len(weights[0]) == 1:  # order: nearly always
        signs = {sign_of(weight) for (weight,) in weights}
        return len(signs) == 1 if within else len(signs - {0}) == 1
    return _has_point(weights, []) if within else _has_point([tuple(map(sum, zip(*weights[: len(s)])))], weights)


def classify_exact(t1: Corners, t2: Corners) -> int:
    """Return APART, CROSSING, CONTACT or COPLANAR for any two faces; never undecided."""
    plane1, plane2 = plane_through(t1), plane_through(t2)
    sides1, sides2 = [sign_of(value_at(plane2, p)) for p in t1], [sign_of(value_at(plane1, p)) for p in t2]
    s1, s2 = as_simplex(t1), as_simplex(t2)
    if abs(sum(sides1)) == 3 or abs(sum(sides2)) == 3 or not _meet(s1, s2, within=False):
        return APART
    if len(s1) < 3 or len(s2) < 3:
        return CONTACT
    if not any(sides2):
        return COPLANAR
    both_straddle = {1, -1} <= set(sides1) and {1, -1} <= set(sides2)
    return CROSSING if both_straddle and _meet(s1, s2, within=True) else CONTACT


def kind_of_contact(t1: Corners, t2: Corners) -> Kind:
    """Return the kind of the contact of two faces that meet: the one of highest dimension."""
    first, second = _features(as_simplex(t1)), _features(as_simplex(t2))

    def meet(d: int, e: int) -> bool:
        return any(_meet(f, g, within=True) for f in first[d] for g in second[e])

    if meet(2, 2) and not any(value_at(plane_through(t1), p) for p in t2):
        return "face_face"
    if meet(1, 2) or meet(2, 1):
        return "edge_face"
    if meet(0, 2) or meet(2, 0):
        return "vertex_face"
    return "edge_edge" if meet(1, 1) else ("vertex_vertex" if meet(0, 0) else "vertex_edge")


def _features(s: tuple[Vector, ...]) -> tuple[list[tuple[Vector, ...]], ...]:
    """Return the corners, the edges and the faces of a simplex."""
    return tuple(list(combinations(s, n)) for n in (1, 2, 3))
