"""python-fcl: `fcl.collide` called once a pose from Python, as its users must; surfaces, yes or no, one contact.

The pose of the second object is set before each call: that is part of a question, and so it is timed.
"""

from __future__ import annotations

import fcl
import numpy as np

from benchmarks.collision_scenes import Crowd
from benchmarks.contenders import Prepared
from benchmarks.poses import Pair
from benchmarks.workloads import Mesh

NAME, PACKAGE = "fcl", "python-fcl"


def model(mesh: Mesh) -> fcl.BVHModel:
    """Return fcl's tree of a mesh."""
    made = fcl.BVHModel()
    made.beginModel(len(mesh.faces), len(mesh.vertices))
    made.addSubModel(mesh.vertices, mesh.faces)
    made.endModel()
    return made


def _mesh_pair(pair: Pair, threads: int) -> Prepared:
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

    return Prepared(native, ask, np.array)


def _crowd(crowd: Crowd, threads: int) -> Prepared:
    """The dynamic tree of boxes; each pair it finds calls back into Python, which asks for that pair and notes it."""
    n = len(crowd.kinds)
    shapes = []
    for mesh in crowd.meshes:
        polygons = np.column_stack([np.full(len(mesh.faces), 3), mesh.faces]).ravel()
        shapes.append(fcl.Convex(mesh.vertices, len(mesh.faces), polygons))
    objects = [
        fcl.CollisionObject(shapes[kind], fcl.Transform(turn, move))
        for kind, turn, move in zip(crowd.kinds, crowd.rotations, crowd.translations, strict=True)
    ]
    manager = fcl.DynamicAABBTreeCollisionManager()
    manager.registerObjects(objects)
    manager.setup()
    request = fcl.CollisionRequest(num_max_contacts=1, enable_contact=False)

    def ask(_: object) -> list[tuple[fcl.CollisionObject, fcl.CollisionObject]]:
        found = []

        def note(first: fcl.CollisionObject, second: fcl.CollisionObject, data: object) -> bool:
            if fcl.collide(first, second, request, fcl.CollisionResult()) > 0:
                found.append((first, second))
            return False

        manager.collide(None, note)
        return found

    def answer(found: list[tuple[fcl.CollisionObject, fcl.CollisionObject]]) -> np.ndarray:
        numbers = {tuple(place): number for number, place in enumerate(crowd.translations.tolist())}
        named = [[numbers[tuple(item.getTranslation())] for item in pair] for pair in found]
        pairs = np.sort(np.array(named, np.int64).reshape(-1, 2), axis=1)
        return np.sort(pairs[:, 0] * n + pairs[:, 1])

    return Prepared(lambda rows: rows, ask, answer)


MAKERS = {"mesh_pair": _mesh_pair, "crowd": _crowd}
