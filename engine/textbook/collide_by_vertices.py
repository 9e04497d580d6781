"""Two polyhedra collide when a vertex of one is in the other: all vertices are tested, both ways.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics (figure 22.25, left).
What goes wrong: it misses bodies that meet with edges only (figure 22.25, right: see `collide_by_edges.py`), and each
test inherits what goes wrong with a half-line.
"""

from __future__ import annotations

from typing import Any

from engine.arrays import FloatArray, IntArray
from engine.jit import inline, kernel
from engine.predicates.loading import as_point3
from engine.textbook.polyhedron_ray_parity import is_inside
from engine.types import Point3


@inline
def has_vertex_inside(vertices: Any, others: Any, triangles: Any) -> bool:
    """Tell whether one of `vertices` is in the polyhedron (others, triangles)."""
    ahead = Point3(0.6180339887498949, 0.4142135623730951, 0.6695263146546152)  # no direction that occurs in a mesh
    found = False
    for i in range(len(vertices)):
        found = found or is_inside(as_point3(vertices, i), ahead, others, triangles)
    return found


@kernel
def collide(vertices: FloatArray, triangles: IntArray, other_vertices: FloatArray, other_triangles: IntArray) -> bool:
    """Tell whether a vertex of one polyhedron is in the other."""
    return has_vertex_inside(vertices, other_vertices, other_triangles) or has_vertex_inside(
        other_vertices, vertices, triangles
    )
