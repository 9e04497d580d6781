"""A scene with a gap is every pair: those that meet, and those whose clearance is below the gap."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest

from engine import Aabb, HalfSpace, InvalidInputError, Polyhedron, Pose, Relation, Sphere, Triangle, clearance, collide
from engine.scenes.collide_scene import collide_scene

TURN = [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]


def scene(dimension: int, rng: random.Random, n: int = 30) -> tuple[list[Any], list[Pose | None]]:
    solids: list[Any] = []
    for k in range(n):
        at = np.array([rng.randint(0, 12) for _ in range(dimension)], float)
        if k % 4 == 0:
            solids.append(Sphere(at, rng.choice([0.0, 1.0])))
        elif k % 4 == 1 and dimension == 2:
            solids.append(Triangle(at + np.array([[0, 0], [2, 0], [0, 2]])))
        elif k % 4 == 1:
            corners = at + np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
            solids.append(Polyhedron(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
        else:
            solids.append(Aabb(at, at + rng.randint(0, 2)))
    solids.append(HalfSpace([1.0, *[0.0] * (dimension - 1)], 2.0))
    turn = [row[:dimension] for row in TURN[:dimension]]
    return solids, [Pose(turn, [1.0] * dimension) if k % 5 == 4 else None for k in range(n + 1)]


def every_pair(solids: list[Any], poses: list[Pose | None], gap: float) -> list[tuple[int, int, int, float]]:
    found = []
    for i in range(len(solids)):
        for j in range(i + 1, len(solids)):
            placed: Any = {"first_pose": poses[i], "second_pose": poses[j]}
            relation = collide(solids[i], solids[j], **placed).relation
            if relation != Relation.DISJOINT:
                found.append((i, j, int(relation), 0.0))
            elif not clearance(solids[i], solids[j], at_least=gap, **placed):
                answer: Any = clearance(solids[i], solids[j], **placed)
                found.append((i, j, int(relation), answer.distance))
    return found


def as_list(pairs: Any) -> list[tuple[int, int, int, float]]:
    columns = (pairs.first, pairs.second, pairs.relation, pairs.distance)
    return list(zip(*(column.tolist() for column in columns)))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("gap", [0.0, 1.0, 5e-324, math.sqrt(2.0), 2.5])
def test_a_gap_is_every_pair(dimension: int, gap: float) -> None:
    solids, poses = scene(dimension, random.Random(dimension))
    found: Any = collide_scene(solids, poses, gap=gap)
    assert as_list(found) == every_pair(solids, poses, gap)
    boolean: Any = collide_scene(solids, poses, gap=gap, boolean=True, only=np.argwhere(np.ones((31, 31))))
    assert boolean.distance is None
    assert boolean.first.tolist() == found.first.tolist()
    assert ((boolean.relation == Relation.DISJOINT) == (found.relation == Relation.DISJOINT)).all()


def test_the_gap_itself_is_clear_and_one_ulp_less_is_not() -> None:
    """Boxes three and four apart on two axes, and one axis only; the last box is beyond a box's rounded distance."""
    solids = [Aabb([0, 0, 0], [1, 1, 1]), Aabb([4, 5, 0], [5, 6, 1]), Aabb([-6, 0, 0], [-5, 1, 1])]
    assert len(as_list(collide_scene(solids, gap=5.0))) == 0
    found = as_list(collide_scene(solids, gap=math.nextafter(5.0, 6.0), witnesses=True, detail=True))
    assert found == [(0, 1, int(Relation.DISJOINT), 5.0), (0, 2, int(Relation.DISJOINT), 5.0)]


def test_equal_poses_are_left_out_as_by_collide() -> None:
    """A matrix that is a rotation up to rounding does not stretch the gap of two bodies that share it."""
    pose = Pose(np.eye(3) * (1 + 4e-13), [0.1, 0, 0])
    solids = [Aabb([0, 0, 0], [1, 1, 1]), Aabb([2, 0, 0], [3, 1, 1])]
    assert as_list(collide_scene(solids, [pose, pose], gap=1 + 1e-13)) == [(0, 1, int(Relation.DISJOINT), 1.0)]
    assert as_list(collide_scene(solids, [pose, pose], gap=1.0)) == []


@pytest.mark.parametrize("gap", [-1.0, math.nan, math.inf, "1", True])
def test_a_gap_is_a_distance(gap: Any) -> None:
    with pytest.raises(InvalidInputError, match="gap must be a distance"):
        collide_scene([], gap=gap)
