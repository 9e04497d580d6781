"""python-fcl: `fcl.collide` called once a pose from Python, as its users must; surfaces, yes or no, one contact.

The pose of the second object is set before each call: that is part of a question, and so it is timed.
"""

from __future__ import annotations

import fcl
import numpy as np

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


MAKERS = {"mesh_pair": _mesh_pair}
