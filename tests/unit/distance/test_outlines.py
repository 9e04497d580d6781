"""Small bodies of the plane: what doubles decide is what rationals decide, and ties fall to the least edges."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from engine import Polygon, Pose, Relation, Sphere, clearance, clearance_poses, collide
from engine.collision.result import Clearance, Feature
from engine.distance.forms import between_forms
from engine.distance.spreads import spread_pair
from engine.running.budget import UNLIMITED
from tests.unit.collision.lattices import solid
from tests.unit.distance.makers import Json, distance, is_nearest


def flush(rng: random.Random, scale: float) -> tuple[Json, Json]:
    """Two squares turned together, whose sides are an ulp apart, or some ulps, or more."""
    angle = rng.choice([0.0, math.pi / 4, rng.uniform(0.0, 7.0), rng.uniform(0.0, 7.0)])
    cos, sin = math.cos(angle), math.sin(angle)
    across, along = 1.0 + 10.0 ** rng.uniform(-17, -3), rng.choice([0.0, 0.25, rng.uniform(-1.2, 1.2)])
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    first, second = (
        [[(cos * x - sin * y) * scale, (sin * x + cos * y) * scale] for x, y in ring]
        for ring in (corners, [(x + across, y + along) for x, y in corners])
    )
    return {"type": "polygon", "rings": [first]}, {"type": "polygon", "rings": [second]}


@pytest.mark.parametrize("n", [40, pytest.param(2000, marks=pytest.mark.full)])
@pytest.mark.parametrize("is_posed", [False, True])
def test_squares_that_nearly_touch_are_told_as_rationals_do(is_posed: bool, n: int) -> None:
    rng, n_told = random.Random(7), 0
    for _ in range(n):
        a, b = flush(rng, rng.choice([1.0, 1.0, 1.0, 1e6, 2.0**-60, 1e-200, 1e300]))
        angle = rng.uniform(0.0, 7.0)
        pose = {"rotation": [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]],
                "translation": [3.0, 0.1]} if is_posed else None  # fmt: skip
        placed = None if pose is None else Pose(pose["rotation"], pose["translation"])
        found = between_forms(solid(a), solid(b), (placed, None), None)
        if found is None:
            continue
        n_told += 1
        exact = distance(a, b, pose, None)
        assert isinstance(found, Clearance)
        if exact is None:
            assert found.distance == 0.0
        else:
            assert is_nearest(found.distance, exact), (a, b, pose)
    assert n_told > n // 2


def test_ties_of_parallel_edges_fall_to_the_least_edges_and_other_ties_are_left_open() -> None:
    square = Polygon([[(0, 0), (2, 0), (2, 2), (0, 2)]])
    beside = Polygon([[(3, -1), (5, -1), (5, 3), (3, 3)]])
    told = between_forms(square, beside, (None, None), None)
    assert isinstance(told, Clearance)
    assert told.features is not None
    assert told.points is not None
    assert (told.distance, told.features[0], told.points.tolist()) == (
        1.0,
        Feature("vertex", (1,)),
        [[2.0, 0.0], [3.0, 0.0]],
    )
    turned = Polygon([[(0, 0), (1, -1), (2, 0), (1, 1)]])
    opposite = Polygon([[(2, 2), (3, 1), (4, 2), (3, 3)]])  # a side each, all along 45 degrees
    told = between_forms(turned, opposite, (None, None), None)
    assert isinstance(told, Clearance)
    assert told.points is not None
    assert (told.distance, told.points.tolist()) == (math.sqrt(2), [[2.0, 0.0], [3.0, 1.0]])
    assert told.features == (Feature("vertex", (2,)), Feature("vertex", (1,)))
    arrow, wall = Polygon([[(0, 0), (2, 1), (0, 2)]]), Polygon([[(3, 4), (3, 2), (5, 1), (3, 0), (3, -2), (9, 0)]])
    assert between_forms(arrow, wall, (None, None), None) is None  # as far from both sides of a notch
    assert between_forms(arrow, wall, (None, None), 0.5) is True
    assert clearance(arrow, wall).distance == math.sqrt(2)  # type: ignore[union-attr]


def test_a_ball_within_a_ring_is_as_far_as_its_sides_and_one_inside_meets() -> None:
    frame = Polygon([[(0, 0), (10, 0), (10, 10), (0, 10)], [(2, 2), (8, 2), (8, 8), (2, 8)]])
    within = between_forms(frame, Sphere([5, 4], 1), (None, None), None)
    assert isinstance(within, Clearance)
    assert within.points is not None
    assert (within.distance, within.points.tolist()) == (1.0, [[5.0, 2.0], [5.0, 3.0]])
    for center, radius in [((1, 1), 0.25), ((5, 4), 2.5)]:
        met = between_forms(frame, Sphere(center, radius), (None, None), None)
        assert isinstance(met, Clearance)
        assert met.distance == 0.0
    touching = between_forms(frame, Sphere([5, 4], 2), (None, None), None)
    assert touching is None  # a contact is for rationals


def test_many_edges_under_many_poses_are_as_far_as_the_search_over_trees_says() -> None:
    draw, count = np.random.default_rng(3), 20
    angles, turns = np.linspace(0.0, 2 * math.pi, 100, endpoint=False), draw.uniform(0.0, 7.0, count)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1) * draw.uniform(0.7, 1.0, (100, 1))
    star, frame = Polygon([ring]), Polygon([4.0 * ring, 2.5 * ring])
    cos, sin = np.cos(turns), np.sin(turns)
    rotations, moves = np.stack([cos, -sin, sin, cos], axis=1).reshape(-1, 2, 2), draw.uniform(-3.0, 3.0, (count, 2))
    for first, second in ((star, star), (frame, star)):
        poses = [Pose(turn, move) for turn, move in zip(rotations, moves)]
        expected = [
            spread_pair(first, second, (None, pose), UNLIMITED).clearance(0).distance
            if collide(first, second, second_pose=pose).relation == Relation.DISJOINT
            else 0.0
            for pose in poses
        ]
        assert np.array_equal(clearance_poses(first, second, rotations, moves), expected)  # type: ignore[arg-type]
        assert [clearance(first, second, second_pose=pose).distance for pose in poses] == expected  # type: ignore[union-attr]
