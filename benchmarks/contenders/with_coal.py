"""coal: `coal.collide` called once a pose from Python, as its users must; surfaces, yes or no, the first contact ends.

`BVHModelOBBRSS`, the model its documentation recommends, `Convex` for convex polyhedra; requests and results are made
once and reused.
"""

from __future__ import annotations

from typing import Any

import coal
import numpy as np

from benchmarks.contenders import Library, Placed, box_of, makers_of
from benchmarks.workloads import Mesh

PACKAGE = "coal"

Body = tuple[Any, coal.Transform3s]
_MEET, _FOUND = coal.CollisionRequest(), coal.CollisionResult()
_MEET.enable_contact = False
_MEET.num_max_contacts = 1


def _model(mesh: Mesh) -> coal.BVHModelOBBRSS:
    made = coal.BVHModelOBBRSS()
    made.beginModel(len(mesh.faces), len(mesh.vertices))
    made.addVertices(mesh.vertices)
    made.addTriangles(mesh.faces.astype(np.int64))
    made.endModel()
    return made


def _convex(mesh: Mesh) -> coal.Convex:
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for point in mesh.vertices:
        points.append(point)
    for a, b, c in mesh.faces.tolist():
        triangles.append(coal.Triangle(a, b, c))
    return coal.Convex(points, triangles)


def _meet(first: Body, second: Body) -> bool:
    _FOUND.clear()
    return coal.collide(*first, *second, _MEET, _FOUND) > 0


def _apart(first: Body, second: Body) -> float:
    return max(0.0, coal.distance(*first, *second, coal.DistanceRequest(), coal.DistanceResult()))


def _shape(body: Placed) -> Body:
    place = coal.Transform3s() if body.pose is None else coal.Transform3s(*body.pose)
    if isinstance(body.shape, Mesh):
        return _model(body.shape), place
    if box := box_of(body):
        place.setTranslation((box[0] + box[1]) / 2)
        return coal.Box(*(box[1] - box[0])), place
    place.setTranslation(body.shape.center)
    return coal.Sphere(body.shape.radius), place


LIBRARY = Library(
    model=_model, convex=_convex, place=coal.Transform3s, body=lambda model: (model, coal.Transform3s()), shape=_shape,
    at=lambda body, place: (body[0], place), meet=_meet, apart=_apart,
)  # fmt: skip
MAKERS = makers_of(LIBRARY)
