"""Distances under many poses, against those of one pair at a time."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest

from engine import Cancel, CancelledError, NotRigidError, Pose, clearance, clearance_poses
from tests.unit.collision.clearance.makers import KINDS, Scale, body, turn
from tests.unit.collision.lattices import solid


@pytest.mark.parametrize("d", [2, 3])
def test_is_what_one_pair_at_a_time_says(d: int) -> None:
    rng = random.Random(d)
    for first in KINDS[d]:
        second = rng.choice(KINDS[d])
        scale = Scale(rng)
        one = solid(body(rng, scale, first, [0.0] * d))
        other = solid(body(rng, scale, second, [4.0 * scale.size] * d))
        turns = [turn(rng, d) for _ in range(8)]
        moves = [[2.0 * scale.number() for _ in range(d)] for _ in turns]
        poses = [Pose(r, t) for r, t in zip(turns, moves)]
        singly: list[Any] = [clearance(one, other, second_pose=pose) for pose in poses]
        found, report = clearance_poses(one, other, turns, moves, report=True)
        assert found.tolist() == [answer.distance for answer in singly], (first, second)
        assert (report.n_items, report.decisions) == (8, "exact")
        least = sorted(answer.distance for answer in singly)[4]
        bools = [clearance(one, other, second_pose=pose, at_least=least) for pose in poses]
        for workers in (1, 2):
            assert clearance_poses(one, other, turns, moves, at_least=least, workers=workers).tolist() == bools


def test_empty_and_wrong_input() -> None:
    box = solid({"type": "aabb", "min": [0, 0, 0], "max": [1, 1, 1]})
    assert clearance_poses(box, box, np.empty((0, 3, 3)), np.empty((0, 3))).tolist() == []
    assert clearance_poses(box, box, [np.eye(3)], [[0.5, 0, 0]], at_least=0.0).tolist() == [True]
    with pytest.raises(NotRigidError, match=r"rotations\[1\]"):
        clearance_poses(box, box, [np.eye(3), 2.0 * np.eye(3)], np.zeros((2, 3)))
    cancel = Cancel()
    cancel.set()
    with pytest.raises(CancelledError):
        clearance_poses(box, box, [np.eye(3)], [[3, 0, 0]], cancel=cancel)
