"""Hard pairs of every family: pair by pair, as poses and as a scene, all exact, or the test fails."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from engine import Polyhedron, Pose, collide, collide_poses, collide_scene
from tests.hard.pairs import FAMILIES, STORED, Body, box, exact_relation, hard_pairs

SWAPPED = (0, 2, 1, 3, 4)


def stored_pairs(family: str) -> tuple[list[tuple[Body, Body]], list[int]]:
    stored, key = np.load(STORED), family.replace(" ", "_")
    starts = np.cumsum(np.vstack([[0, 0], stored[f"{key}_sizes"]]), axis=0)
    vertices, faces = stored[f"{key}_vertices"], stored[f"{key}_faces"].astype(np.int64)
    bodies = [(vertices[a:c], faces[b:d]) for (a, b), (c, d) in pairwise(starts)]
    return list(zip(bodies[::2], bodies[1::2])), stored[f"{key}_relation"].tolist()


def check(pairs: list[tuple[Body, Body]], exact: list[int]) -> None:
    """Ask every pair in every way that the engine has; a common pose must change nothing."""
    random = np.random.default_rng(len(pairs))
    for (first, second), relation in zip(pairs, exact):
        a, b = Polyhedron(*first), Polyhedron(*second)
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        pose = Pose(turn * np.sign(np.linalg.det(turn)), random.normal(size=3))
        found = {
            "collide": int(collide(a, b).relation),
            "swapped": SWAPPED[collide(b, a).relation],
            "under one pose": int(collide(a, b, first_pose=pose, second_pose=pose).relation),
            "as poses": int(collide_poses(a, b, np.eye(3)[None], np.zeros((1, 3)))[0]),
            "as a scene": int((*collide_scene([a, b]).relation, 0)[0]),
            "as a scene under one pose": int((*collide_scene([a, b], [pose, pose]).relation, 0)[0]),
        }
        wrong = {how: answer for how, answer in found.items() if answer != relation}
        assert not wrong, (wrong, relation, first, second)


@pytest.mark.parametrize("family", FAMILIES)
def test_stored_pairs(family: str) -> None:
    pairs, exact = stored_pairs(family)
    assert [exact_relation(*pair) for pair in pairs[:1]] == exact[:1]
    check(pairs, exact)


@pytest.mark.full
@pytest.mark.parametrize("family", FAMILIES)
def test_ten_times_the_hard_set(family: str) -> None:
    pairs = hard_pairs(family, 820, "ten times")
    check(pairs, [exact_relation(*pair) for pair in pairs])


def test_flush_stacks_under_one_pose_touch() -> None:
    n_boxes = 300
    levels = [0.1 * k for k in range(n_boxes + 1)]
    bodies = [Polyhedron(*box([0, 0, low], [1, 1, high])) for low, high in pairwise(levels)]
    turn, _ = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))
    pose = Pose(turn * np.sign(np.linalg.det(turn)), [1e6, 0.1, -3.0])
    found = collide_scene(bodies, [pose] * n_boxes)
    assert found.first.tolist() == list(range(n_boxes - 1))
    assert (found.second == found.first + 1).all()
    assert (found.relation == 4).all()
