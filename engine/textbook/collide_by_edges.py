"""Two polyhedra collide when an edge of one meets a face of the other: edge penetration.

The end points of the edge must be on opposite sides of the face's plane; then the intersection with the plane is
calculated, and finally it is decided whether the face contains it.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics (figure 22.25, right), with
inequality (22.9) for the sides and the prism test for the face.
What goes wrong: the intersection is rounded before it is tested, so an edge that passes close to the rim of two faces
may miss both; flush contact is decided by rounding; a body within the other has no edge that meets a face.
"""

from __future__ import annotations

from typing import Any

from engine.arrays import FloatArray, IntArray
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3
from engine.predicates.vectors import along, cross, dot, minus
from engine.textbook.triangle_cross_dot import is_in_prism
from engine.types import Point3


@inline
def meets(p: Point3, q: Point3, a: Point3, b: Point3, c: Point3) -> bool:
    """Tell whether the edge pq meets the face abc."""
    normal = cross(minus(b, a), minus(c, a))
    at_p, at_q = dot(normal, minus(p, a)), dot(normal, minus(q, a))
    if (at_p > 0.0 and at_q > 0.0) or (at_p < 0.0 and at_q < 0.0) or at_p == at_q:
        return False
    return is_in_prism(along(p, q, at_p / (at_p - at_q)), a, b, c)


@inline
def has_edge_through_face(vertices: Any, triangles: Any, others: Any, faces: Any) -> bool:
    """Tell whether an edge of the first mesh meets a face of the second; every edge is met twice, from both sides."""
    for i in range(len(triangles)):
        for k in range(3):
            p, q = as_point3(vertices, triangles[i, k]), as_point3(vertices, triangles[i, (k + 1) % 3])
            for j in range(len(faces)):
                a, b, c = as_point3(others, faces[j, 0]), as_point3(others, faces[j, 1]), as_point3(others, faces[j, 2])
                if meets(p, q, a, b, c):
                    return True
    return False


@kernel
def collide(vertices: FloatArray, triangles: IntArray, other_vertices: FloatArray, other_triangles: IntArray) -> bool:
    """Tell whether an edge of one polyhedron meets a face of the other, both ways; quadratic."""
    return has_edge_through_face(vertices, triangles, other_vertices, other_triangles) or has_edge_through_face(
        other_vertices, other_triangles, vertices, triangles
    )
