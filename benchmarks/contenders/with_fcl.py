"""python-fcl: `fcl.collide` called once a pose from Python, as its users must; surfaces, yes or no, one contact.

The pose of the second object is set before each call: that is part of a question, and so it is timed.
"""

from __future__ import annotations

import fcl
import numpy as np

import engine
from benchmarks.contenders import Couple, NotApplicable, Placed, Prepared
from benchmarks.crowds import Crowd
from benchmarks.poses import Pair
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


class _Manager:
    """The dynamic tree of boxes; each pair it finds calls back into Python, which asks for that pair and notes it."""

    def __init__(self, crowd: Crowd) -> None:
        shapes = []
        for mesh in crowd.meshes:
            polygons = np.column_stack([np.full(len(mesh.faces), 3), mesh.faces]).ravel()
            shapes.append(fcl.Convex(mesh.vertices, len(mesh.faces), polygons))
        self.objects = [
            fcl.CollisionObject(shapes[kind], pose) for kind, pose in zip(crowd.kinds, _transforms(crowd), strict=True)
        ]
        self.tree = fcl.DynamicAABBTreeCollisionManager()
        self.tree.registerObjects(self.objects)
        self.tree.setup()
        self._request = fcl.CollisionRequest(num_max_contacts=1, enable_contact=False)
        self._numbers = {tuple(place): number for number, place in enumerate(crowd.translations.tolist())}

    def pairs(self) -> list[tuple[fcl.CollisionObject, fcl.CollisionObject]]:
        """Return the colliding pairs."""
        found = []

        def note(first: fcl.CollisionObject, second: fcl.CollisionObject, data: object) -> bool:
            if fcl.collide(first, second, self._request, fcl.CollisionResult()) > 0:
                found.append((first, second))
            return False

        self.tree.collide(None, note)
        return found

    def answer(self, found: list[tuple[fcl.CollisionObject, fcl.CollisionObject]]) -> np.ndarray:
        """Return first * n + second of pairs found where the crowd stands."""
        named = [[self._numbers[tuple(item.getTranslation())] for item in pair] for pair in found]
        pairs = np.sort(np.array(named, np.int64).reshape(-1, 2), axis=1)
        return np.sort(pairs[:, 0] * len(self.objects) + pairs[:, 1])


def _transforms(crowd: Crowd) -> list[fcl.Transform]:
    return [fcl.Transform(turn, move) for turn, move in zip(crowd.rotations, crowd.translations, strict=True)]


def _crowd(crowd: Crowd, threads: int) -> Prepared:
    """Asked as the crowd stands; where frames are given, every body gets a new pose before, and the tree is updated."""
    manager = _Manager(crowd)

    def ask(frames: list[list[fcl.Transform]]) -> list[tuple[fcl.CollisionObject, fcl.CollisionObject]]:
        if not frames:
            return manager.pairs()
        for poses in frames:
            for item, pose in zip(manager.objects, poses, strict=True):
                item.setTransform(pose)
            manager.tree.update()
            found = manager.pairs()
        return found

    return Prepared(ask, lambda frames: [_transforms(frame) for frame in frames], manager.answer)


def _object(body: Placed) -> fcl.CollisionObject:
    match body.shape:
        case Mesh():
            return fcl.CollisionObject(model(body.shape), fcl.Transform(*body.pose) if body.pose else fcl.Transform())
        case engine.Aabb() | engine.Sphere() if body.pose is not None or body.shape.dimension == 2:
            raise NotApplicable("poses of meshes only, and space only")
        case engine.Aabb(min=low, max=high):
            return fcl.CollisionObject(fcl.Box(*(high - low)), fcl.Transform((low + high) / 2))
        case engine.Sphere(center=center, radius=radius):
            return fcl.CollisionObject(fcl.Sphere(radius), fcl.Transform(center))
    raise NotApplicable(type(body.shape).__name__)


def _pair(pair: Couple, threads: int) -> Prepared:
    first, second = (_object(body) for body in pair)
    request = fcl.CollisionRequest(num_max_contacts=1)
    return Prepared(lambda _: fcl.collide(first, second, request, fcl.CollisionResult()) > 0)


MAKERS = {
    "poses": _poses,
    "crowd": _crowd,
    "pair": _pair,
    "tree": lambda mesh, threads: Prepared(lambda _: model(mesh)),
}
