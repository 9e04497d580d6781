"""coal: `coal.collide` called once a pose from Python, as its users must; surfaces, yes or no, the first contact ends.

`BVHModelOBBRSS`, the model its documentation recommends, `Convex` for convex polyhedra; request and result are made
once and reused.
"""

from __future__ import annotations

import coal
import numpy as np

from benchmarks.contenders import Prepared
from benchmarks.poses import Pair
from benchmarks.workloads import Mesh

NAME, PACKAGE = "coal", "coal"


def model(mesh: Mesh) -> coal.BVHModelOBBRSS:
    """Return coal's tree of a mesh."""
    made = coal.BVHModelOBBRSS()
    made.beginModel(len(mesh.faces), len(mesh.vertices))
    made.addVertices(mesh.vertices)
    made.addTriangles(mesh.faces.astype(np.int64))
    made.endModel()
    return made


def convex(mesh: Mesh) -> coal.Convex:
    """Return coal's own type for a convex polyhedron."""
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for point in mesh.vertices:
        points.append(point)
    for a, b, c in mesh.faces.tolist():
        triangles.append(coal.Triangle(a, b, c))
    return coal.Convex(points, triangles)


def _mesh_pair(pair: Pair, threads: int) -> Prepared:
    return _calls(model(pair.first), model(pair.second), pair)


def _convex_pair(pair: Pair, threads: int) -> Prepared:
    return _calls(convex(pair.first), convex(pair.second), pair)


def _calls(first: coal.CollisionGeometry, second: coal.CollisionGeometry, pair: Pair) -> Prepared:
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    request.enable_contact = False
    request.num_max_contacts = 1
    still = coal.Transform3s()

    def ask(poses: list[coal.Transform3s]) -> list[bool]:
        found = []
        for pose in poses:
            result.clear()
            found.append(coal.collide(first, still, second, pose, request, result) > 0)
        return found

    def native(rows: np.ndarray) -> list[coal.Transform3s]:
        return [coal.Transform3s(pair.rotations[row], pair.translations[row]) for row in rows]

    return Prepared(native, ask, np.array)


MAKERS = {"mesh_pair": _mesh_pair, "convex_pair": _convex_pair}
