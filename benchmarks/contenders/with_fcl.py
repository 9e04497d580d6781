"""python-fcl: `fcl.collide` called once a pose from Python, as its users must; surfaces, yes or no, one contact.

The pose of the second object is set before each call: that is part of a question, and so it is timed.
"""

from __future__ import annotations

from typing import Any

import fcl
import numpy as np

from benchmarks.bodies import Crowd
from benchmarks.contenders import Library, Placed, Prepared, box_of, makers_of
from benchmarks.workloads import Mesh

PACKAGE = "python-fcl"
NAMES = {"crowd": "fcl's manager"}

_MEET = fcl.CollisionRequest(num_max_contacts=1, enable_contact=False)


def _model(mesh: Mesh) -> fcl.BVHModel:
    made = fcl.BVHModel()
    made.beginModel(len(mesh.faces), len(mesh.vertices))
    made.addSubModel(mesh.vertices, mesh.faces)
    made.endModel()
    return made


def _convex(mesh: Mesh) -> fcl.Convex:
    polygons = np.column_stack([np.full(len(mesh.faces), 3), mesh.faces]).ravel()
    return fcl.Convex(mesh.vertices, len(mesh.faces), polygons)


def _meet(first: fcl.CollisionObject, second: fcl.CollisionObject) -> bool:
    return fcl.collide(first, second, _MEET, fcl.CollisionResult()) > 0


def _apart(first: fcl.CollisionObject, second: fcl.CollisionObject) -> float:
    return max(0.0, fcl.distance(first, second, fcl.DistanceRequest(), fcl.DistanceResult()))


def _at(body: fcl.CollisionObject, place: fcl.Transform) -> fcl.CollisionObject:
    body.setTransform(place)
    return body


def _shape(body: Placed) -> fcl.CollisionObject:
    if isinstance(body.shape, Mesh):
        return fcl.CollisionObject(_model(body.shape), fcl.Transform(*body.pose) if body.pose else fcl.Transform())
    if box := box_of(body):
        return fcl.CollisionObject(fcl.Box(*(box[1] - box[0])), fcl.Transform((box[0] + box[1]) / 2))
    return fcl.CollisionObject(fcl.Sphere(body.shape.radius), fcl.Transform(body.shape.center))


def _transforms(crowd: Crowd) -> list[fcl.Transform]:
    return [fcl.Transform(turn, move) for turn, move in zip(crowd.rotations, crowd.translations, strict=True)]


def _crowd(crowd: Crowd, threads: int) -> Prepared:
    """The dynamic tree of boxes; each pair it finds calls back into Python, which asks for that pair and notes it.

    One question about the crowd as it stands; with frames every body first gets a new pose, and the tree is updated.
    """
    shapes = list(map(_convex, crowd.meshes))
    objects = [fcl.CollisionObject(shapes[kind], pose) for kind, pose in zip(crowd.kinds, _transforms(crowd))]
    tree = fcl.DynamicAABBTreeCollisionManager()
    tree.registerObjects(objects)
    tree.setup()
    numbers = {tuple(place): number for number, place in enumerate(crowd.translations.tolist())}

    def pairs() -> list[tuple[fcl.CollisionObject, fcl.CollisionObject]]:
        result = []

        def note(first: fcl.CollisionObject, second: fcl.CollisionObject, data: object) -> bool:
            if _meet(first, second):
                result.append((first, second))
            return False

        tree.collide(None, note)
        return result

    def ask(frames: list[list[fcl.Transform]]) -> list[tuple[fcl.CollisionObject, fcl.CollisionObject]]:
        for poses in frames:
            for item, pose in zip(objects, poses, strict=True):
                item.setTransform(pose)
            tree.update()
            result = pairs()
        return result if frames else pairs()

    def answer(result: list[tuple[fcl.CollisionObject, fcl.CollisionObject]]) -> np.ndarray:
        named = [[numbers[tuple(item.getTranslation())] for item in pair] for pair in result]
        rows = np.sort(np.array(named, np.int64).reshape(-1, 2), axis=1)
        return np.sort(rows[:, 0] * len(objects) + rows[:, 1])

    return Prepared(ask, lambda frames: [_transforms(frame) for frame in frames], answer)


LIBRARY = Library(
    model=_model, convex=_convex, place=fcl.Transform, body=lambda model: fcl.CollisionObject(model, fcl.Transform()),
    shape=_shape, at=_at, meet=_meet, apart=_apart,
)  # fmt: skip
MAKERS: dict[str, Any] = makers_of(LIBRARY) | {"crowd": _crowd}
