"""Boxes, balls and half-spaces in closed form: what double-doubles are sure of is what the search and rationals say."""

from __future__ import annotations

import random
from math import nextafter
from typing import Any

import numpy as np
import pytest

from engine import Aabb, HalfSpace, Polyhedron, Pose, Sphere, clearance
from engine.collision.result import Clearance, Feature
from engine.distance.clearance import do_meet
from engine.distance.forms import MEETING, between_body_and_plane, between_forms, gap_of_planes
from engine.distance.spreads import spread_pair
from engine.running.budget import Budget
from tests.unit.distance.makers import CORNERS, QUADS, turn


def number(rng: random.Random, size: float) -> float:
    return rng.choice([float(rng.randint(-4, 4)), rng.uniform(-4.0, 4.0)]) * size


def body(rng: random.Random, d: int, size: float) -> Any:
    low = [number(rng, size) for _ in range(d)]
    if rng.random() < 0.5:
        return Sphere(low, abs(number(rng, size)) / 2.0)
    return Aabb(low, [x + rng.choice([1.0, 2.0, rng.uniform(0.1, 3.0)]) * size for x in low])


def pose(rng: random.Random, d: int, size: float) -> Pose | None:
    return rng.choice([
        None, Pose(np.eye(d), [number(rng, size) for _ in range(d)]), Pose(turn(rng, d), [number(rng, size)] * d),
    ])  # fmt: skip


def said(found: Clearance | bool | None) -> Any:
    if not isinstance(found, Clearance):
        return found
    return found.distance, None if found.points is None else found.points.tolist(), found.features


@pytest.mark.parametrize("size", [1.0, 1e-9, 1e150, 1e-150, 1e300, 5e-324 * 2**55])
def test_boxes_and_balls_are_what_the_search_says(size: float) -> None:
    rng, n_sure = random.Random(int(np.log2(size))), 0
    for _ in range(100):
        d = rng.choice([2, 3])
        first, second, poses = body(rng, d, size), body(rng, d, size), (pose(rng, d, size), pose(rng, d, size))
        found: Any = between_forms(first, second, poses, None)
        if found is None:
            continue
        n_sure += 1
        with Budget() as budget:
            if found is MEETING:
                assert do_meet(first, second, poses, budget), (first, second, poses)
                continue
            exact = spread_pair(first, second, poses, budget).clearance(0)
        assert found.distance == exact.distance, (first, second, poses)
        assert between_forms(first, second, poses, nextafter(found.distance, 0.0)) is True
        assert between_forms(first, second, poses, nextafter(found.distance, 1e308)) is False
    assert n_sure > 20 or not 1e-140 < size < 1e140


@pytest.mark.parametrize("size", [1.0, 1e-9, 1e100, 1e300])
def test_half_spaces_are_what_rationals_say(size: float) -> None:
    rng, n_sure = random.Random(int(np.log2(size))), 0
    for _ in range(200):
        d = rng.choice([2, 3])
        normal = [rng.choice([0.0, 0.0, 1.0, -1.0, rng.uniform(-1.0, 1.0)]) for _ in range(d)]
        plane = HalfSpace(normal if any(normal) else [1.0, *normal[1:]], number(rng, size) - 8.0 * size)
        other, other_pose = body(rng, d, size), pose(rng, d, size)
        found: Any = between_body_and_plane(plane, other, (None, other_pose), None)
        mirrored: Any = between_body_and_plane(other, plane, (other_pose, None), None)
        if found is None or found is MEETING:
            continue
        n_sure += 1
        with Budget() as budget:
            gap, features = gap_of_planes(plane, other, (None, other_pose), budget)
        assert said(found) == said(gap.clearance(features, d)), (plane, other, other_pose)
        assert (mirrored.distance, mirrored.features) == (found.distance, found.features[::-1])
        assert mirrored.points.tolist() == found.points.tolist()[::-1]
        assert between_body_and_plane(plane, other, (None, other_pose), nextafter(found.distance, 0.0)) is True
        assert between_body_and_plane(plane, other, (None, other_pose), nextafter(found.distance, 1e308)) is False
    assert n_sure > 50 or size > 1e150


def test_of_several_nearest_points_those_on_the_smallest_faces_then_where_the_first_face_begins() -> None:
    box = Aabb([0, 0, 0], [4, 4, 4])
    for other, points, features in [
        (Aabb([6, 1, 1], [7, 2, 2]), [[4, 1, 1], [6, 1, 1]], (Feature("face", (1,)), Feature("vertex", (0,)))),
        (Aabb([1, 1, 6], [5, 5, 7]), [[4, 1, 4], [4, 1, 6]], (Feature("edge", (5, 7)), Feature("edge", (0, 1)))),
        (Aabb([-3, 2, 6], [2, 3, 7]), [[0, 2, 4], [0, 2, 6]], (Feature("edge", (4, 6)), Feature("edge", (0, 1)))),
    ]:
        found: Any = clearance(box, other)
        assert (found.points.tolist(), found.features) == (points, features)
    flat: Any = clearance(Aabb([0, 0], [4, 4]), Aabb([1, 6], [2, 7]))  # the upper edge begins at its right end
    assert (flat.points.tolist(), flat.features[1]) == ([[2, 4], [2, 6]], Feature("vertex", (1,)))
    plane: Any = clearance(HalfSpace([0, 0, 1], -6), box)
    assert plane.features[1] == Feature("vertex", (4,))


def test_a_point_of_a_ball_just_beside_the_middle_of_two_doubles() -> None:
    """A second gap, 1e17 times smaller, makes the step shorter than the radius, and the middle is not reached."""
    ball = Sphere([1.0 + 2.0**-52, 1.0, 0.5], 0.5 + 2.0**-53)
    assert ball.center[0] + ball.radius == 1.5 + 2.0**-51  # the middle, rounded to even
    low, high = np.array([2.0**54 + 4.0, 1.0 + 2.0**-40, 0.0]), np.array([2.0**55, 2.0, 1.0])
    for box in (Aabb(low, high), Polyhedron(np.where(np.array(CORNERS) == 0.0, low, high), QUADS)):
        for first, second in ((ball, box), (box, ball)):
            found: Any = clearance(first, second)
            assert found.points[0 if first is ball else 1].tolist() == [1.5 + 2.0**-52, 1.0, 0.5]
