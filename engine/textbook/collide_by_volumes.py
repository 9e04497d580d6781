"""Collision of two polyhedra: their bounding volumes first, then one polyhedron against the other's volume, then both.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics: "first their bounding volumes
are examined. If the two bounding volumes do not collide, then neither can the contained polyhedra collide. If the
bounding volumes penetrate each other, then one polyhedra is tested against the other bounding volume. If this test is
also positive, then finally the two polyhedra are tested."
The volume is the box; the box as a polyhedron of twelve triangles is tested like any other.
What goes wrong: all that goes wrong with vertices and edges; the volumes themselves only save time.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.bounding.aabb import box_of_points, corners_of_box
from engine.textbook import collide_by_edges, collide_by_vertices
from engine.textbook.bounding_volumes import boxes_meet

BOX_TRIANGLES: IntArray = np.array(
    [
        triangle
        for a, b, c, d in ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
        for triangle in ((a, b, c), (a, c, d))
    ],
    np.int64,
)


def meet(vertices: FloatArray, triangles: IntArray, other_vertices: FloatArray, other_triangles: IntArray) -> bool:
    """Tell whether two polyhedra collide: a vertex in the other, or an edge through a face."""
    arguments = (vertices, triangles, other_vertices, other_triangles)
    return bool(collide_by_vertices.collide(*arguments) or collide_by_edges.collide(*arguments))


def collide(vertices: FloatArray, triangles: IntArray, other_vertices: FloatArray, other_triangles: IntArray) -> bool:
    """Tell whether two polyhedra collide, the cheapest test first."""
    low, high = box_of_points(other_vertices)
    if not boxes_meet(*box_of_points(vertices), low, high):
        return False
    if not meet(vertices, triangles, corners_of_box(low, high), BOX_TRIANGLES):
        return False
    return meet(vertices, triangles, other_vertices, other_triangles)
