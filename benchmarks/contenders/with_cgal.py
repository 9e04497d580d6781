"""CGAL: the exact side of closed manifold meshes, one call a point."""

from __future__ import annotations

from typing import Any

import numpy as np
from CGAL.CGAL_Kernel import Point_3
from CGAL.CGAL_Polygon_mesh_processing import Side_of_triangle_mesh
from CGAL.CGAL_Polyhedron_3 import Polyhedron_3, Polyhedron_modifier

from benchmarks.contenders import NotApplicable, Prepared
from benchmarks.workloads import Mesh

PACKAGE = "cgal"
NAMES = {"": "CGAL", "points": "CGAL side of mesh"}


def _points(mesh: Mesh, threads: int) -> Prepared:
    modifier = Polyhedron_modifier()
    modifier.begin_surface(len(mesh.vertices), len(mesh.faces))
    for vertex in mesh.vertices.tolist():
        modifier.add_vertex(Point_3(*vertex))
    for face in mesh.faces.tolist():
        modifier.begin_facet()
        for corner in face:
            modifier.add_vertex_to_facet(corner)
        modifier.end_facet()
    body = Polyhedron_3()
    body.delegate(modifier)
    if body.size_of_facets() != len(mesh.faces) or not body.is_closed():
        raise NotApplicable("closed manifolds only")
    side = Side_of_triangle_mesh(body)

    def ask(points: np.ndarray, remaining: Any = body) -> np.ndarray:  # `side` borrows the body
        return np.array([side.bounded_side(Point_3(*point)) >= 0 for point in points.tolist()])

    return Prepared(ask)


MAKERS = {"points": _points}
