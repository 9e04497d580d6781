"""Balls against balls: the reference, and a common pose that moves them together."""

from __future__ import annotations

import numpy as np
import pytest

import engine
from engine import Pose, Relation, collide
from tests.unit.collision.lattices import COUNTS, Maker, check_pairs, sphere


@pytest.mark.parametrize(("d", "first", "second"), [(2, sphere, sphere), (3, sphere, sphere)])
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


@pytest.mark.parametrize("other", [engine.Sphere([3, 0, 0], 2), engine.Aabb([1, -1, -1], [2, 1, 1])])
def test_a_ball_keeps_its_relation_under_a_common_pose(other: engine.Solid) -> None:
    ball, plane = engine.Sphere([0, 0, 0], 1), engine.HalfSpace([1, 0, 0], -1)
    random_ = np.random.default_rng(4)
    for _ in range(8):
        turn, _ = np.linalg.qr(random_.normal(size=(3, 3)))
        pose = Pose(turn * np.sign(np.linalg.det(turn)), random_.normal(size=3))
        for body in (other, plane):
            assert collide(ball, body, first_pose=pose, second_pose=pose).relation == Relation.TOUCHING
        pairs = engine.collide_scene([ball, other], [pose, pose])
        assert pairs.relation.tolist() == [Relation.TOUCHING]
