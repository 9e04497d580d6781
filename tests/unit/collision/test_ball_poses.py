"""Many places of a ball beside a mesh, or of a mesh beside a ball: what rationals say of each, witnesses as alone."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polyhedron, Pose, Solid, Sphere, Surface, collide, collide_poses
from engine.collision.result import Work
from engine.collision.simple.against_ball import _by_distances

FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
CORNERS = np.array([[0, 0, 0], [8, 0, 0], [0, 8, 0], [0, 0, 8.0]])


def _moves(n: int, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Return turns, a third of them none and a third quarter turns, and moves on a lattice."""
    draw = np.random.default_rng(n)
    turns = np.broadcast_to(np.eye(3), (n, 3, 3)).copy()
    turns[1::3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    turns[2::3] = np.array([[1, 4, 8], [4, 7, -4], [-8, 4, -1]])[[0, 2, 1]] * [1, 1, -1] / 9 * [[1], [1], [-1]]
    if np.linalg.det(turns[2]) < 0:
        turns[2::3] = turns[2] @ np.diag([1, 1, -1.0])
    return turns, draw.integers(-12, 13, (n, 3)) * scale


@pytest.mark.parametrize("scale", [1.0, 2.0**-500, 2.0**400, 2.0**1010])
@pytest.mark.parametrize("solid", [Polyhedron, Surface])
def test_agrees_with_rationals(solid: type[Solid], scale: float) -> None:
    body = solid(CORNERS * scale, FACES)
    turns, moves = _moves(240, scale)
    for ball in (Sphere([0.5 * scale, 0, 0], 2 * scale), Sphere([scale, scale, 0], 13 * scale), Sphere([0, 0, 0], 0)):
        for first, second in ((body, ball), (ball, body)):
            relations, witnesses = collide_poses(first, second, turns, moves, witnesses=True)
            for turn, move, relation, witness in zip(turns, moves, relations.tolist(), witnesses):
                pose = Pose(turn, move)
                exact = _by_distances(body, ball, (None, pose) if first is body else (pose, None), Work())
                assert relation == (exact if first is body else exact.swapped()).relation
                assert witness == collide(first, second, second_pose=pose).witness


def test_walls_that_cancel_bound_nothing() -> None:
    walled = Polyhedron(np.concatenate([CORNERS, CORNERS[:3] - [20, 0, 0]]), [*FACES, [4, 5, 6], [4, 6, 5]])
    ball, turns = Sphere([0, 0, 0], 1), np.broadcast_to(np.eye(3), (2, 3, 3))
    relations = collide_poses(walled, ball, turns, [[-19.0, 1, 0], [1.0, 1, 0]])
    details = collide_poses(walled, ball, turns, [[-19.0, 1, 0], [1.0, 1, 0]], detail=True)[1]
    assert relations.tolist() == [4, 3]
    assert details.tolist() == [collide(walled, ball, second_pose=Pose(np.eye(3), m), detail=True).detail
                                for m in ([-19.0, 1, 0], [1.0, 1, 0])]  # fmt: skip
