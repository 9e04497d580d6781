"""python-fcl: `fcl.collide` called once a pose from Python, as its users must; surfaces, yes or no, one contact.

The pose of the second object is set before each call: that is part of a question, and so it is timed.
"""

from __future__ import annotations

import fcl
import numpy as np

from benchmarks.bodies import Crowd, Pair
from benchmarks.contenders import Couple, Placed, Prepared, box_of, each_alone
from benchmarks.workloads import Mesh


def model(mesh: Mesh) -> fcl.BVHModel:
    """Return fcl's tree of a mesh."""
    made = fcl.BVHModel()
    made.beginModel(len(mesh.faces), len(mesh.vertices))
    made.addSubModel(mesh.vertices, mesh.faces)
    made.endModel()
    return made


def _poses(pair: Pair, threads: int) -> Prepared:
    first = fcl.CollisionObject(model(pair.first), fcl.Transform())
    second = fcl.CollisionObject(model(pair.second), fcl.Transform())
    request = fcl.CollisionRequest(num_max_contacts=1, enable_contact=False)

    def ask(poses: list[fcl.Transform]) -> list[bool]:
        found = []
        for pose in poses:
            second.setTransform(pose)
            found.append(fcl.collide(first, second, request, fcl.CollisionResult()) > 0)
        return found

    def native(rows: np.ndarray) -> list[fcl.Transform]:
        return [fcl.Transform(pair.rotations[row], pair.translations[row]) for row in rows]

    return Prepared(ask, native, np.array)


def _transforms(crowd: Crowd) -> list[fcl.Transform]:
    return [fcl.Transform(turn, move) for turn, move in zip(crowd.rotations, crowd.translations, strict=True)]


def _crowd(crowd: Crowd, threads: int) -> Prepared:
    """The dynamic tree of boxes; each pair it finds calls back into Python, which asks for that pair and notes it.

    Asked as the crowd stands; where frames are given, every body gets a new pose before, and the tree is updated.
    """
    shapes = []
    for mesh in crowd.meshes:
        polygons = np.column_stack([np.full(len(mesh.faces), 3), mesh.faces]).ravel()
        shapes.append(fcl.Convex(mesh.vertices, len(mesh.faces), polygons))
    objects = [fcl.CollisionObject(shapes[kind], pose) for kind, pose in zip(crowd.kinds, _transforms(crowd))]
    tree, request = fcl.DynamicAABBTreeCollisionManager(), fcl.CollisionRequest(num_max_contacts=1)
    tree.registerObjects(objects)
    tree.setup()
    numbers = {tuple(place): number for number, place in enumerate(crowd.translations.tolist())}

    def pairs() -> list[tuple[fcl.CollisionObject, fcl.CollisionObject]]:
        found = []

        def note(first: fcl.CollisionObject, second: fcl.CollisionObject, data: object) -> bool:
            if fcl.collide(first, second, request, fcl.CollisionResult()) > 0:
                found.append((first, second))
            return False

        tree.collide(None, note)
        return found

    def ask(frames: list[list[fcl.Transform]]) -> list[tuple[fcl.CollisionObject, fcl.CollisionObject]]:
        for poses in frames:
            for item, pose in zip(objects, poses, strict=True):
                item.setTransform(pose)
            tree.update()
            found = pairs()
        return found if frames else pairs()

    def answer(found: list[tuple[fcl.CollisionObject, fcl.CollisionObject]]) -> np.ndarray:
        named = [[numbers[tuple(item.getTranslation())] for item in pair] for pair in found]
        rows = np.sort(np.array(named, np.int64).reshape(-1, 2), axis=1)
        return np.sort(rows[:, 0] * len(objects) + rows[:, 1])

    return Prepared(ask, lambda frames: [_transforms(frame) for frame in frames], answer)


def _object(body: Placed) -> fcl.CollisionObject:
    if isinstance(body.shape, Mesh):
        return fcl.CollisionObject(model(body.shape), fcl.Transform(*body.pose) if body.pose else fcl.Transform())
    if box := box_of(body):
        return fcl.CollisionObject(fcl.Box(*(box[1] - box[0])), fcl.Transform((box[0] + box[1]) / 2))
    return fcl.CollisionObject(fcl.Sphere(body.shape.radius), fcl.Transform(body.shape.center))


def _pair(pair: Couple, threads: int) -> Prepared:
    first, second = (_object(body) for body in pair)
    request = fcl.CollisionRequest(num_max_contacts=1)
    return Prepared(lambda _: fcl.collide(first, second, request, fcl.CollisionResult()) > 0)


def _apart(first: fcl.CollisionObject, second: fcl.CollisionObject) -> float:
    return max(0.0, fcl.distance(first, second, fcl.DistanceRequest(), fcl.DistanceResult()))


def _clearance(pair: Pair, threads: int) -> Prepared:
    first, mesh = fcl.CollisionObject(model(pair.first), fcl.Transform()), model(pair.second)

    def native(rows: np.ndarray) -> list[fcl.CollisionObject]:
        turns, moves = pair.rotations[rows], pair.translations[rows]
        return [fcl.CollisionObject(mesh, fcl.Transform(turn, move)) for turn, move in zip(turns, moves)]

    return Prepared(lambda objects: np.array([_apart(first, other) for other in objects]), native)


MAKERS = {
    "clearance poses": _clearance,
    "clearance pairs": lambda _, threads: each_alone(
        lambda pair: [_object(body) for body in pair], lambda p: _apart(*p)
    ),
    "poses": _poses,
    "crowd": _crowd,
    "pair": _pair,
    "tree": lambda mesh, threads: Prepared(lambda _: model(mesh), answer=lambda _: None),
}
