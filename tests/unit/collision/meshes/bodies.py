"""Bodies for the tests of this folder."""

from __future__ import annotations

import numpy as np

from engine import Polyhedron, Pose
from engine.collision.meshes.mesh_arrays import MeshBody, mesh_body_of

TURN = Pose([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], [0.1, 0.2, 0.3])


def brick(n: int, at: tuple[float, float, float] = (0, 0, 0)) -> Polyhedron:
    """A box of n units on every axis, each face cut into 2 n n triangles."""
    quads = []
    for axis in range(3):
        u, v = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
        for level in (0, n):
            for i in range(n):
                for j in range(n):
                    a = level * np.eye(3, dtype=int)[axis] + i * u + j * v
                    quad = [a, a + u, a + u + v, a + v]
                    quads.append(quad if level else quad[::-1])
    corners, numbers = np.unique(np.array(quads).reshape(-1, 3), axis=0, return_inverse=True)
    q = numbers.reshape(-1, 4)
    return Polyhedron(corners + np.array(at, float), np.concatenate([q[:, :3], q[:, [0, 2, 3]]]))


def with_far_shell(body: Polyhedron, at: tuple[float, float, float] = (50, 50, 50)) -> Polyhedron:
    """The body and a box far away, so that no plane of a contact separates it from another body."""
    far = brick(1, at)
    return Polyhedron(
        np.concatenate([body.vertices, far.vertices]),
        np.concatenate([body.triangles, far.triangles + len(body.vertices)]),
    )


def mesh(n: int, at: tuple[float, float, float] = (0, 0, 0)) -> MeshBody:
    return mesh_body_of(brick(n, at))
