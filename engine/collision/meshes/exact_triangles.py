"""Two faces on exact integer coordinates: their class, whatever their shape, and the kind of their contact.

Slow and complete: settles what the kernel leaves UNDECIDED (posed faces near contact, faces without area, exponents
out of range) and names the kind of a witness. A face without area is its longest segment, or a point.
"""

from __future__ import annotations

from collections.abc import Sequence

from engine.collision.meshes.exact_body import Corners, Plane, Vector, plane_through
from engine.collision.meshes.triangle_triangle import APART, CONTACT, COPLANAR, CROSSING
from engine.collision.result import Kind
from engine.predicates.exact_vectors import cross, dot, largest_axis, minus
from engine.predicates.rational import sign_of

Flat = tuple[int, int]


def value_at(plane: Plane, p: Vector) -> int:
    """Return a x + b y + c z + d."""
    return plane[0] * p[0] + plane[1] * p[1] + plane[2] * p[2] + plane[3]


def without_axis(p: Vector, axis: int) -> Flat:
    """Return the two other coordinates in cyclic order."""
    return p[(axis + 1) % 3], p[(axis + 2) % 3]


def turn(a: Flat, b: Flat, c: Flat) -> int:
    """Return the sign of orient2d."""
    return sign_of((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def side(a: Vector, b: Vector, c: Vector, d: Vector) -> int:
    """Return the sign of orient3d."""
    return sign_of(dot(cross(minus(b, a), minus(c, a)), minus(d, a)))


def as_simplex(t: Corners) -> tuple[Vector, ...]:
    """Return the three corners, or the two ends of a face without area, or its one point."""
    p, q, r = t
    if any(cross(minus(q, p), minus(r, p))):
        return t
    ends = min(t), max(t)  # order: along a line the lexicographic order is the order along it
    return ends if ends[0] != ends[1] else ends[:1]


def is_in_triangle(p: Vector, t: Corners, plane: Plane) -> bool:
    """Tell whether a point lies in a closed triangle with area."""
    if value_at(plane, p) != 0:
        return False
    axis = largest_axis(plane[:3])
    a, b, c = (without_axis(corner, axis) for corner in t)
    q = without_axis(p, axis)
    signs = {turn(a, b, q), turn(b, c, q), turn(c, a, q)}
    return not (1 in signs and -1 in signs)


def is_on_segment(p: Vector, a: Vector, b: Vector) -> bool:
    """Tell whether a point lies on a closed segment."""
    if any(cross(minus(b, a), minus(p, a))):
        return False
    return dot(minus(p, a), minus(p, b)) <= 0


def segments_meet(a: Vector, b: Vector, c: Vector, d: Vector) -> bool:
    """Tell whether two closed segments of positive length have a common point."""
    if side(a, b, c, d) != 0:
        return False
    return _has_end_on_other(a, b, c, d) or _cross_in_plane(a, b, c, d)


def _has_end_on_other(a: Vector, b: Vector, c: Vector, d: Vector) -> bool:
    return any((is_on_segment(a, c, d), is_on_segment(b, c, d), is_on_segment(c, a, b), is_on_segment(d, a, b)))


def _cross_in_plane(a: Vector, b: Vector, c: Vector, d: Vector) -> bool:
    """Tell whether two segments of one plane cross in a point that is no end of either."""
    axis = largest_axis(cross(minus(b, a), minus(d, c)))
    if axis < 0:
        return False
    k, m, s, t = (without_axis(p, axis) for p in (a, b, c, d))
    return turn(k, m, s) * turn(k, m, t) < 0 and turn(s, t, k) * turn(s, t, m) < 0


def segment_meets_triangle(a: Vector, b: Vector, t: Corners, plane: Plane) -> bool:
    """Tell whether a closed segment of positive length meets a closed triangle with area."""
    a_side, b_side = sign_of(value_at(plane, a)), sign_of(value_at(plane, b))
    if a_side * b_side > 0:
        return False
    if a_side == 0 and b_side == 0:
        if is_in_triangle(a, t, plane) or is_in_triangle(b, t, plane):
            return True
        return any(segments_meet(a, b, t[i], t[i - 2]) for i in range(3))
    signs = {side(a, b, t[i], t[(i + 1) % 3]) for i in range(3)}
    return not (1 in signs and -1 in signs)


def simplices_meet(s: tuple[Vector, ...], t: tuple[Vector, ...]) -> bool:
    """Tell whether two points, segments or triangles, at least one of them no triangle, have a common point."""
    if len(s) > len(t):
        s, t = t, s
    if len(t) < 3:
        if len(s) == 2:
            return segments_meet(s[0], s[1], t[0], t[1])
        return is_on_segment(s[0], t[0], t[1]) if len(t) == 2 else s == t
    corners = (t[0], t[1], t[2])
    if len(s) == 1:
        return is_in_triangle(s[0], corners, plane_through(corners))
    return segment_meets_triangle(s[0], s[1], corners, plane_through(corners))


def classify_exact(t1: Corners, t2: Corners, plane1: Plane | None = None, plane2: Plane | None = None) -> int:
    """Return APART, CROSSING, CONTACT or COPLANAR for any two faces; never undecided. Planes: theirs, if known."""
    plane1, plane2 = plane1 or plane_through(t1), plane2 or plane_through(t2)
    if not any(plane1) or not any(plane2):
        return CONTACT if simplices_meet(as_simplex(t1), as_simplex(t2)) else APART
    sides2 = [sign_of(value_at(plane1, p)) for p in t2]
    if abs(sum(sides2)) == 3:
        return APART
    sides1 = [sign_of(value_at(plane2, p)) for p in t1]
    if abs(sum(sides1)) == 3:
        return APART
    if not any(sides2):
        return APART if separation_exact(t1, t2, plane1) > 0 else COPLANAR
    (a, b, c), side1 = _lone_first(t1, sides1)
    (p, q, r), side2 = _lone_first(t2, sides2)
    if side1 < 0:
        q, r = r, q
    if side2 < 0:
        b, c = c, b
    ends = side(b, p, a, q), side(a, p, c, r)
    if max(ends) > 0:
        return APART
    both_straddle = {1, -1} <= set(sides1) and {1, -1} <= set(sides2)
    return CROSSING if both_straddle and max(ends) < 0 else CONTACT


def _lone_first(t: Corners, sides: list[int]) -> tuple[Corners, int]:
    """Return a triangle with its lone vertex first, and the side of that: see `triangle_triangle.lone_vertex`."""
    lone = next((one for one in (1, -1) if sides.count(one) == 1), 0)
    k = sides.index(lone)
    return (t[k], t[k - 2], t[k - 1]), lone or -sides[k - 1]


def separation_exact(t1: Corners, t2: Corners, plane: Plane) -> int:
    """Return how two coplanar triangles with area lie: 1 apart, 0 only their borders meet, -1 interiors meet."""
    axis = largest_axis(plane[:3])
    flat1 = [without_axis(p, axis) for p in t1]
    flat2 = [without_axis(p, axis) for p in t2]
    best = -1
    for one, other in ((flat1, flat2), (flat2, flat1)):
        orientation = turn(one[0], one[1], one[2])
        for i in range(3):
            sides = [orientation * turn(one[i], one[(i + 1) % 3], p) for p in other]
            if max(sides) < 0:
                return 1
            if max(sides) == 0:
                best = 0
    return best


def kind_of_contact(t1: Corners, t2: Corners, plane1: Plane, plane2: Plane) -> Kind:
    """Return the kind of the contact of two faces that meet, in these planes: the one of highest dimension."""
    s1, s2 = as_simplex(t1), as_simplex(t2)
    values1, values2 = [value_at(plane2, p) for p in s1], [value_at(plane1, p) for p in s2]
    if len(s1) == len(s2) == 3 and not any(values2) and separation_exact(t1, t2, plane1) < 0:
        return "face_face"
    if _edge_meets_open_face(s1, values1, s2, plane2) or _edge_meets_open_face(s2, values2, s1, plane1):
        return "edge_face"
    if any(value == 0 and _is_in_open_face(p, s2, plane2) for p, value in zip(s1, values1)):
        return "vertex_face"
    if any(value == 0 and _is_in_open_face(p, s1, plane1) for p, value in zip(s2, values2)):
        return "vertex_face"
    edges1, edges2 = _edges(s1), _edges(s2)
    if any(_open_edges_meet(e, f) for e in edges1 for f in edges2):
        return "edge_edge"
    if set(s1) & set(s2):
        return "vertex_vertex"
    return "vertex_edge"


def _edges(s: tuple[Vector, ...]) -> list[tuple[Vector, Vector]]:
    return [(s[i], s[i - 1]) for i in range(len(s))] if len(s) == 3 else ([(s[0], s[1])] if len(s) == 2 else [])


def _is_in_open_face(p: Vector, t: tuple[Vector, ...], plane: Plane) -> bool:
    """Tell whether p, in the plane of t, lies in the relative interior of a triangle with area."""
    if len(t) < 3:
        return False
    axis = largest_axis(plane[:3])
    a, b, c, q = (without_axis(corner, axis) for corner in (*t, p))
    first = turn(a, b, q)
    return first != 0 and turn(b, c, q) == first and turn(c, a, q) == first


def _edge_meets_open_face(s: tuple[Vector, ...], values: list[int], t: tuple[Vector, ...], plane: Plane) -> bool:
    """Tell whether an open edge of s, corners at these values of the plane, meets the open face t."""
    if len(t) < 3:
        return False
    for i in range(len(s) if len(s) == 3 else len(s) - 1):
        a, b = s[i], s[i - 1]
        a_side, b_side = sign_of(values[i]), sign_of(values[i - 1])
        if a_side * b_side < 0:
            if len({side(a, b, t[k], t[(k + 1) % 3]) for k in range(3)}) == 1:
                return True
        elif a_side == 0 and b_side == 0:
            axis = largest_axis(plane[:3])
            if meets_open_face([(*without_axis(p, axis), 1) for p in (a, b)], open_face((t[0], t[1], t[2]), axis)):
                return True
    return False


def open_face(t: Corners, axis: int) -> tuple[list[Vector], list[Vector]]:
    """Return the corners (x, y, 1) of a face with area along an axis, and the lines of its edges, positive inside."""
    flat: list[Vector] = [(*without_axis(p, axis), 1) for p in t]
    if dot(cross(flat[0], flat[1]), flat[2]) < 0:
        flat.reverse()
    return flat, [cross(flat[i], flat[(i + 1) % 3]) for i in range(3)]


def meets_open_face(ends: Sequence[Vector], face: tuple[list[Vector], list[Vector]]) -> bool:
    """Tell whether a segment or point (x, y, w), w > 0, meets an `open_face`: no line of an edge, nor its own line, has
    the two on different closed sides."""
    flat, lines = face
    if any(max(dot(line, end) for end in ends) <= 0 for line in lines):
        return False
    if len(ends) < 2:
        return True
    own = cross(ends[0], ends[1])
    values = [dot(own, p) for p in flat]
    return not any(own) or min(values) < 0 < max(values)


def _open_edges_meet(e: tuple[Vector, Vector], f: tuple[Vector, Vector]) -> bool:
    """Tell whether two segments have a point in common that is no end of either."""
    (a, b), (c, d) = e, f
    if side(a, b, c, d) != 0:
        return False
    if _cross_in_plane(a, b, c, d):
        return True
    if any(cross(minus(b, a), minus(d, c))) or not _has_end_on_other(a, b, c, d):
        return False
    low, high = max(min(a, b), min(c, d)), min(max(a, b), max(c, d))
    return low < high
