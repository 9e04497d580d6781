"""coal: `coal.collide` called once a pose from Python, as its users must; surfaces, yes or no, the first contact ends.

`BVHModelOBBRSS`, the model its documentation recommends, `Convex` for convex polyhedra; request and result are made
once and reused.
"""

from __future__ import annotations

from typing import Any

import coal
import numpy as np

from benchmarks.bodies import Pair
from benchmarks.contenders import Couple, Placed, Prepared, box_of, each_alone
from benchmarks.workloads import Mesh


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

    return Prepared(ask, native, np.array)


def _shape(body: Placed) -> tuple[Any, Any]:
    place = coal.Transform3s() if body.pose is None else coal.Transform3s(*body.pose)
    if isinstance(body.shape, Mesh):
        return model(body.shape), place
    if box := box_of(body):
        place.setTranslation((box[0] + box[1]) / 2)
        return coal.Box(*(box[1] - box[0])), place
    place.setTranslation(body.shape.center)
    return coal.Sphere(body.shape.radius), place


def _pair(pair: Couple, threads: int, margin: float = 0.0) -> Prepared:
    first, second = (_shape(body) for body in pair)
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    request.num_max_contacts, request.security_margin = 1, margin

    def ask(_: object) -> bool:
        result.clear()
        return coal.collide(*first, *second, request, result) > 0

    return Prepared(ask)


def _apart(first: tuple[Any, Any], second: tuple[Any, Any]) -> float:
    return max(0.0, coal.distance(*first, *second, coal.DistanceRequest(), coal.DistanceResult()))


def _clearance(pair: Pair, threads: int) -> Prepared:
    first, second = (model(pair.first), coal.Transform3s()), model(pair.second)
    return Prepared(
        lambda poses: np.array([_apart(first, (second, pose)) for pose in poses]),
        lambda rows: [coal.Transform3s(pair.rotations[row], pair.translations[row]) for row in rows],
    )


MAKERS = {
    "clearance poses": _clearance,
    "clearance pairs": lambda _, threads: each_alone(
        lambda pair: [_shape(body) for body in pair], lambda p: _apart(*p)
    ),
    "poses": lambda pair, threads: _calls(model(pair.first), model(pair.second), pair),
    "convex poses": lambda pair, threads: _calls(convex(pair.first), convex(pair.second), pair),
    "pair": _pair,
    "tree": lambda mesh, threads: Prepared(lambda _: model(mesh), answer=lambda _: None),
}
