"""Batches of poses: the same answers as one by one, whatever the chunks and threads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import engine
from engine import Aabb, Polyhedron, Pose, Relation, Solid, Sphere, Surface, collide, collide_poses
from engine.collision.result import Work
from engine.collision.simple.against_ball import _by_distances


def rotations(n_poses: int, seed: int) -> np.ndarray:
    q = np.random.default_rng(seed).normal(size=(n_poses, 4))
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    ).transpose(2, 0, 1)


def sphere_like(n: int, radius: float) -> Polyhedron:
    """Return a closed mesh of 4 n triangles around the origin."""
    t = np.linspace(0, 2 * np.pi, n, endpoint=False)
    ring = np.stack([np.cos(t), np.sin(t), 0.3 * np.cos(5 * t)], axis=1)
    vertices = radius * np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]])
    faces = [[i, (i + 1) % n, n] for i in range(n)] + [[(i + 1) % n, i, n + 1] for i in range(n)]
    return Polyhedron(vertices, faces)


PAIRS = [
    (sphere_like(40, 1.0), sphere_like(30, 0.7)),
    (sphere_like(12, 1.0), Aabb([-0.2, -0.2, -0.2], [0.2, 0.2, 0.2])),
    (Aabb([-2, -2, -2], [2, 2, 2]), sphere_like(30, 0.7)),
    (sphere_like(20, 1.0), Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])),
]


@pytest.mark.parametrize("index", range(len(PAIRS)))
def test_equals_one_by_one(index: int) -> None:
    first, second = PAIRS[index]
    turns = rotations(60, index)
    moves = np.random.default_rng(index).uniform(-2, 2, (60, 3))
    turns[-4:] = np.eye(3)
    moves[-4:] = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [4, 0, 0]]
    found, witnesses = collide_poses(first, second, turns, moves, witnesses=True)
    for item in range(60):
        pose = Pose(turns[item], moves[item])
        one, listed = collide(first, second, second_pose=pose), collide_poses(first, second, [pose], witnesses=True)
        assert one.relation == found[item] == listed[0][0]
        assert one.witness == witnesses[item] == listed[1][0]
    assert len(set(found.tolist())) >= 2
    assert np.array_equal(found, collide_poses(first, second, turns, moves, workers=1))
    assert np.array_equal(found[7:29], collide_poses(first, second, turns[7:29], moves[7:29], workers=2))
    boolean = collide_poses(first, second, turns, moves, boolean=True)
    assert np.array_equal(boolean == Relation.DISJOINT, found == Relation.DISJOINT)


def test_report_progress_and_empty() -> None:
    first, second = PAIRS[0]
    seen: list[int] = []
    found, accuracy = collide_poses(
        first, second, rotations(20, 3), np.zeros((20, 3)), report=True, progress=seen.append
    )
    assert (sum(seen), accuracy.n_items, accuracy.decisions) == (20, 20, "exact")
    assert found.dtype == np.int8
    assert collide_poses(first, second, [], []).shape == (0,)


def test_errors() -> None:
    first, second = PAIRS[0]
    with pytest.raises(engine.NotRigidError) as caught:
        collide_poses(first, second, [np.eye(3), 2 * np.eye(3)], np.zeros((2, 3)))
    assert caught.value.where[:2] == ("rotations", 1)
    with pytest.raises(engine.InvalidArrayError, match="equally many"):
        collide_poses(first, second, [np.eye(3)], np.zeros((2, 3)))
    with pytest.raises(engine.WrongDimensionError, match="rotations"):
        collide_poses(first, second, [np.eye(2)], np.zeros((1, 3)))
    with pytest.raises(engine.WrongDimensionError, match="translations"):
        collide_poses(first, second, [np.eye(3)], np.zeros((1, 2)))
    with pytest.raises(engine.NotFiniteError):
        collide_poses(first, second, [np.eye(3)], [[0, 0, np.nan]])
    with pytest.raises(engine.DeadlineExceededError):
        collide_poses(first, second, rotations(5, 1), np.zeros((5, 3)), deadline=0.0)


@pytest.mark.data
def test_two_posed_bunnies(data: Path) -> None:
    mesh = np.load(data / "meshes" / "igl_bunny.npz")
    bunny = Polyhedron(mesh["vertices"], mesh["faces"])
    size = np.ptp(mesh["vertices"], axis=0).max()
    turns = rotations(40, 11)
    middle = (mesh["vertices"].min(axis=0) + mesh["vertices"].max(axis=0)) / 2
    moves = middle - turns @ middle + np.random.default_rng(5).uniform(-0.8, 0.8, (40, 3)) * size
    found = collide_poses(bunny, bunny, turns, moves)
    assert {Relation.DISJOINT, Relation.OVERLAPPING} <= set(found.tolist())
    swapped = [
        collide(bunny, bunny, first_pose=Pose(r, t)).relation for r, t in zip(turns[:10], moves[:10], strict=True)
    ]
    assert swapped == found[:10].tolist()
    still = collide_poses(bunny, bunny, [np.eye(3)], [[0, 0, 0]])
    assert still.tolist() == [Relation.OVERLAPPING]
    common = Pose(turns[0], moves[0])
    assert collide(bunny, bunny, first_pose=common, second_pose=common).relation == Relation.OVERLAPPING


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


@pytest.mark.some(3)
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
