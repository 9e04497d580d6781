"""Whether two polyhedra collide: a vertex of one in the other, an edge through a face, bounding volumes first.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics (figure 22.25); bounding volumes
are exercise 22.4-4, two triangles in the plane exercise 22.4-5, solved with the section's own side test. The bounding
sphere is that of J. Ritter, An efficient bounding sphere, Graphics Gems, 1990: the farthest of the farthest span a
first sphere, which grows for every vertex still outside.
Meshes are vertices (n, 3) and triangles (m, 3) each.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from engine.bounding.aabb import box_of_points, corners_of_box
from engine.compiling.jit import allocating_kernel, inline, kernel
from engine.predicates.vectors import along, as_point3, cross, dot, minus
from engine.textbook.polyhedra import IN, parity_of
from engine.textbook.solids import is_in_prism
from engine.types import BoolArray, FloatArray, IntArray, Point3

BOX_TRIANGLES: IntArray = np.array(
    [
        triangle
        for a, b, c, d in ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
        for triangle in ((a, b, c), (a, c, d))
    ],
    np.int64,
)


@inline
def has_vertex_inside(vertices: FloatArray, others: FloatArray, triangles: IntArray) -> bool:
    """Return whether one of `vertices` is in the polyhedron (others, triangles), by the parity of a half-line."""
    ahead = Point3(0.6180339887498949, 0.4142135623730951, 0.6695263146546152)  # no direction that occurs in a mesh
    found = False
    for i in range(len(vertices)):
        found = found or parity_of(as_point3(vertices, i), ahead, others, triangles, 0.0) == IN
    return found


@kernel
def by_vertices(
    vertices: FloatArray, triangles: IntArray, other_vertices: FloatArray, other_triangles: IntArray
) -> bool:
    """Return whether a vertex of one polyhedron is in the other: all vertices are tested, both ways. What goes wrong:
    bodies of which only edges meet are missed; each test inherits what goes wrong with a half-line.
    """
    return has_vertex_inside(vertices, other_vertices, other_triangles) or has_vertex_inside(
        other_vertices, vertices, triangles
    )


@inline
def meets(p: Point3, q: Point3, a: Point3, b: Point3, c: Point3) -> bool:
    """Return whether edge pq meets face abc: its ends are on opposite sides of the plane, inequality (22.9), and its
    intersection with the plane is in the face."""
    normal = cross(minus(b, a), minus(c, a))
    at_p, at_q = dot(normal, minus(p, a)), dot(normal, minus(q, a))
    if (at_p > 0.0 and at_q > 0.0) or (at_p < 0.0 and at_q < 0.0) or at_p == at_q:
        return False
    return is_in_prism(along(p, q, at_p / (at_p - at_q)), a, b, c)


@inline
def has_edge_through_face(vertices: FloatArray, triangles: IntArray, others: FloatArray, faces: IntArray) -> bool:
    """Return whether an edge of the first mesh (vertices, triangles) meets a face of the second (others, faces); an
    edge is tested once for each of its two faces."""
    for i in range(len(triangles)):
        for k in range(3):
            p, q = as_point3(vertices, triangles[i, k]), as_point3(vertices, triangles[i, (k + 1) % 3])
            for j in range(len(faces)):
                a, b, c = as_point3(others, faces[j, 0]), as_point3(others, faces[j, 1]), as_point3(others, faces[j, 2])
                if meets(p, q, a, b, c):
                    return True
    return False


@kernel
def by_edges(vertices: FloatArray, triangles: IntArray, other_vertices: FloatArray, other_triangles: IntArray) -> bool:
    """Return whether an edge of one polyhedron meets a face of the other, both ways: edge penetration; quadratic. What
    goes wrong: the intersection is rounded before it is tested, so an edge that passes close to the rim of two faces
    may miss both; flush contact is decided by rounding; a body within the other has no edge that meets a face."""
    return has_edge_through_face(vertices, triangles, other_vertices, other_triangles) or has_edge_through_face(
        other_vertices, other_triangles, vertices, triangles
    )


def meet(vertices: FloatArray, triangles: IntArray, other_vertices: FloatArray, other_triangles: IntArray) -> bool:
    """Return whether two polyhedra collide: a vertex in the other, or an edge through a face."""
    arguments = (vertices, triangles, other_vertices, other_triangles)
    return bool(by_vertices(*arguments) or by_edges(*arguments))


def by_volumes(
    vertices: FloatArray, triangles: IntArray, other_vertices: FloatArray, other_triangles: IntArray
) -> bool:
    """Return whether two polyhedra collide, by boxes first, which only save time, then by `meet`.

    "First their bounding volumes are examined. If the two bounding volumes do not collide, then neither can the
    contained polyhedra collide. If the bounding volumes penetrate each other, then one polyhedra is tested against the
    other bounding volume. If this test is also positive, then finally the two polyhedra are tested." The volume is the
    box; the box as a polyhedron of twelve triangles is tested like any other.
    """
    low, high = box_of_points(other_vertices)
    if not boxes_meet(*box_of_points(vertices), low, high):
        return False
    if not meet(vertices, triangles, corners_of_box(low, high), BOX_TRIANGLES):
        return False
    return meet(vertices, triangles, other_vertices, other_triangles)


def boxes_meet(low: FloatArray, high: FloatArray, other_low: FloatArray, other_high: FloatArray) -> bool:
    """Return whether two closed boxes have a common point."""
    return bool((low <= other_high).all() and (other_low <= high).all())


@inline
def distance(a: Point3, b: Point3) -> float:
    """Return |a - b|."""
    return sqrt(dot(minus(a, b), minus(a, b)))


@inline
def farthest(vertices: FloatArray, start: Point3) -> Point3:
    """Return the vertex farthest from `start`."""
    best, at = -1.0, start
    for i in range(len(vertices)):
        d = distance(as_point3(vertices, i), start)
        if d > best:
            best, at = d, as_point3(vertices, i)
    return at


@allocating_kernel
def bounding_sphere(vertices: FloatArray) -> tuple[FloatArray, float]:
    """Return centre (3,) and radius of Ritter's sphere around vertices (n, 3). What goes wrong: it is some 5 to 20 %
    too large, and rounding may leave a vertex just outside."""
    p = farthest(vertices, as_point3(vertices, 0))
    q = farthest(vertices, p)
    center, radius = along(p, q, 0.5), 0.5 * distance(p, q)
    for i in range(len(vertices)):
        v = as_point3(vertices, i)
        d = distance(center, v)
        if d > radius:
            center = along(center, v, 0.5 * (d - radius) / d)
            radius = 0.5 * (d + radius)
    return np.array([center.x, center.y, center.z]), radius


@inline
def side(a: FloatArray, b: FloatArray, p: FloatArray) -> float:
    """Return a number > 0 where p is left of the line from a to b, < 0 right of it."""
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])


@inline
def holds(triangle: FloatArray, p: FloatArray) -> bool:
    """Return whether a triangle (3, 2) of either orientation contains p, edges included."""
    a, b, c = triangle[0], triangle[1], triangle[2]
    s0, s1, s2 = side(a, b, p), side(b, c, p), side(c, a, p)
    return (s0 >= 0.0 and s1 >= 0.0 and s2 >= 0.0) or (s0 <= 0.0 and s1 <= 0.0 and s2 <= 0.0)


@inline
def edges_cross(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> bool:
    """Return whether each of the segments ab and cd has its ends on opposite sides of the other (or on its line)."""
    return side(a, b, c) * side(a, b, d) <= 0.0 and side(c, d, a) * side(c, d, b) <= 0.0


@inline
def pair_collides(first: FloatArray, second: FloatArray) -> bool:
    """Return whether two triangles (3, 2) have a common point: an edge crosses an edge, or one contains a vertex."""
    if holds(first, second[0]) or holds(second, first[0]):
        return True
    for i in range(3):
        for j in range(3):
            if edges_cross(first[i - 1], first[i], second[j - 1], second[j]):
                return True
    return False


@allocating_kernel
def of_triangles(first: FloatArray, second: FloatArray) -> BoolArray:
    """Return (n,) bool: whether the closed triangles first[i] and second[i], both (n, 3, 2), have a common point. What
    goes wrong: triangles that touch in a point or along an edge get either answer where coordinates are not exact."""
    found = np.zeros(len(first), np.bool_)
    for i in range(len(first)):
        found[i] = pair_collides(first[i], second[i])
    return found
