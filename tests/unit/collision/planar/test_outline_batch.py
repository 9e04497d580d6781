"""Batches of planar bodies: what single pairs say, on a lattice and at any place; what is not simple is left alone."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Polygon, Pose, Solid, Triangle, collide
from engine.budget import Budget
from engine.collision.codes import UNSETTLED
from engine.collision.planar.outline import collide_outline_outline
from engine.collision.planar.outline_batch import collide_outlines, outline_pool
from engine.collision.result import Work
from engine.collision.scenes.batches import SceneBatches
from engine.collision.scenes.bodies import scene_bodies

SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]


@pytest.mark.parametrize(
    ("rings", "is_taken"),
    [
        ([SQUARE], True),
        ([SQUARE, [[1, 1], [2, 1], [2, 2]]], True),
        ([SQUARE, [[0, 0], [2, 1], [2, 2]]], False),  # rings that touch
        ([[[0, 0], [4, 0], [0, 4], [4, 4]]], False),  # crosses itself
        ([[[0, 0], [4, 0], [2, 0], [2, 4]]], False),  # runs back
        ([[[0, 0], [4, 0], [4, 0], [2, 4]]], False),  # an edge without length
        ([[[0, 0], [2, 0], [4, 0], [2, 4]]], True),  # a straight corner
    ],
)
def test_takes_rings_whose_edges_meet_only_in_their_vertices(rings: list[list[list[float]]], is_taken: bool) -> None:
    for turned in (rings, [ring[::-1] for ring in rings], [ring[1:] + ring[:1] for ring in rings]):
        assert (outline_pool([Aabb([0, 0], [1, 1]), Polygon(turned)])[1] >= 0).tolist() == [True, is_taken]


@pytest.mark.parametrize("size", [1.0, 2.0**400, 2.0**-400])
@pytest.mark.parametrize("is_posed", [False, True])
def test_agrees_with_single_pairs_where_it_answers(is_posed: bool, size: float) -> None:
    rng = np.random.default_rng(3)
    solids: list[Solid] = [
        Polygon([np.array(SQUARE) * size, np.array([[1, 1], [3, 1], [3, 3], [1, 3]]) * size]),
        Triangle(np.array([[0, 0], [0.5, 0.2], [0.3, 0.6]]) * size),
        Polygon([np.array([[0, 0], [6, 1], [3, 2], [5, 5], [1, 4]]) * size]),
        Aabb([0, 0], [9 * size, 8 * size]),
        Polygon([np.array([[0, 0], [1, 0], [2, 1], [0, 1]]) * size]),
    ]
    scene = [solids[k % 5] for k in range(30)]
    angles = rng.uniform(0, 7, 30)
    poses = [
        Pose([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]], rng.integers(-4, 5, 2) * size) if is_posed else None
        for t in angles
    ]
    pairs = np.array([(i, j) for i in range(30) for j in range(i + 1, 30)])
    with Budget(None, None) as budget:
        found = SceneBatches(scene_bodies(scene, poses)).relations(pairs, False, False, budget, None)
    for (i, j), how in zip(pairs.tolist(), found.tolist()):
        if how != UNSETTLED:
            assert how == collide(scene[i], scene[j], first_pose=poses[i], second_pose=poses[j]).relation
    if is_posed and size == 1.0:
        assert (found != UNSETTLED).mean() > 0.9
        assert set(found.tolist()) >= {0, 1, 2, 3}


def test_single_pairs_are_what_the_arrangement_says_witnesses_too() -> None:
    rng = np.random.default_rng(5)
    shapes = [[SQUARE], [[[0, 0], [6, 1], [3, 2], [5, 5], [1, 4]]], [SQUARE, [[1, 1], [3, 1], [3, 3]]],
              [[[0, 0], [4, 0], [0, 4], [4, 4]]]]  # fmt: skip
    for _ in range(200):
        first, second = (
            Polygon([np.array(ring) * rng.choice([0.2, 1.0]) + rng.integers(-3, 4, 2) for ring in shapes[k]])
            for k in rng.integers(0, 4, 2)
        )
        angle = rng.choice([0.0, rng.uniform(0, 7)])
        pose = Pose([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]], rng.uniform(-1, 1, 2))
        for placed in (None, pose):
            work = Work(Budget(None, None))
            assert collide_outlines(first, second, (None, placed), work) == collide_outline_outline(
                first, second, (None, placed), work
            )


def test_collinear_edges_that_are_apart_are_no_contact() -> None:
    tilted = np.array([[0.0, 0.0], [3.0, 4.0], [-1.0, 7.0], [-4.0, 3.0]])
    first, second = Polygon([tilted]), Polygon([tilted + np.array([3.75, 5.0])])  # their sides lie on one line
    assert collide(first, second).relation.label == "disjoint"
    assert SceneBatches(scene_bodies([first, second], [None, None])).relations(
        np.array([[0, 1]]), False, False, Budget(None, None), None
    ).tolist() == [0]
