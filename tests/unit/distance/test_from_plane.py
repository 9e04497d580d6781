"""Vertices of bodies from a half-space: what double-doubles prove is what rationals say, also of ties."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine import (
    Aabb,
    HalfSpace,
    Polygon,
    Polyhedron,
    Pose,
    Sphere,
    Surface,
    clearance,
    clearance_poses,
    collide_scene,
)
from engine.distance.closed_forms import UNSURE
from engine.distance.forms import between_body_and_plane, gap_of_planes
from engine.distance.from_plane import corners_of, gaps_from_plane
from engine.running.budget import UNLIMITED, Budget
from engine.types import read_only
from tests.unit.distance.makers import CORNERS, QUADS, turn

TETRAHEDRON = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]


def number(rng: random.Random, size: float) -> float:
    return rng.choice([float(rng.randint(-3, 3)), rng.uniform(-3.0, 3.0), 0.3]) * size


def body(rng: random.Random, d: int, size: float) -> Any:
    points = [[number(rng, size) for _ in range(d)] for _ in range(4)]
    if d == 2:
        return Polygon([points])
    return rng.choice([Surface(points, TETRAHEDRON[:2]), Polyhedron(points, TETRAHEDRON),
                       Polyhedron(np.array(CORNERS) * size, QUADS)])  # fmt: skip


def plane(rng: random.Random, d: int, size: float) -> HalfSpace:
    normal = [rng.choice([0.0, 0.0, 1.0, -2.0, 3.0, rng.uniform(-1.0, 1.0)]) for _ in range(d)]
    return HalfSpace(normal if any(normal) else [1.0, *normal[1:]], number(rng, size) - 9.0 * size)


def motions(rng: random.Random, d: int, size: float, n: int) -> tuple[np.ndarray, np.ndarray]:
    turns = [rng.choice([np.eye(d), np.eye(d)[::-1] * [[-1.0], [1.0], [1.0]][:d], turn(rng, d)]) for _ in range(n)]
    return read_only(np.array(turns)), read_only(np.array([[number(rng, size) for _ in range(d)] for _ in range(n)]))


@pytest.mark.parametrize("size", [1.0, 1e-9, 1e100, 1e-140])
def test_distances_and_vertices_are_what_rationals_say(size: float) -> None:
    rng, n_sure = random.Random(int(np.log2(size))), 0
    for _ in range(60):
        d = rng.choice([2, 3])
        space, solid, (turns, moves) = plane(rng, d, size), body(rng, d, size), motions(rng, d, size, 4)
        distances, extremes = gaps_from_plane(space, solid, (turns, moves), UNLIMITED.flag)
        numbers = corners_of(solid)[1]
        for item in np.flatnonzero(distances > 0.0).tolist():
            poses = None, Pose(turns[item], moves[item])
            with Budget() as budget:
                gap, (_, feature) = gap_of_planes(space, solid, poses, budget)
            assert distances[item] == gap.distance()
            assert extremes[item] < 0 or (int(numbers[extremes[item]]),) == feature.indices
            n_sure += 1
            found: Any = between_body_and_plane(space, solid, poses, None)
            assert found is None or found.points.tolist() == gap.clearance((feature, feature), d).points.tolist()
        asked = clearance_poses(space, solid, turns, moves).tolist()
        assert [x for x, y in zip(asked, distances.tolist()) if y != UNSURE] == distances[distances != UNSURE].tolist()
    assert n_sure > 100


def test_a_flat_side_along_the_plane_names_its_first_vertex() -> None:
    """A plate of 2 x 10,000 vertices took 7 s: each vertex of its side was looked for among all faces."""
    n = 100
    at = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), axis=-1).reshape(-1, 2) / n
    corner = np.arange(n * n).reshape(n, n)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    plate = Surface(np.c_[at, np.zeros(n * n)], np.stack([a, b, c, d], axis=-1).reshape(-1, 4))
    for pose in (None, Pose(np.eye(3), [0.1, 0.2, 0.3]), Pose(np.diag([-1.0, 1.0, -1.0]), [0.0, 0.0, 0.3])):
        found: Any = clearance(plate, HalfSpace([0.0, 0.0, -2.0], -1.0), first_pose=pose)
        assert found.distance == (0.5 if pose is None else 0.5 + 0.3)  # the sum is the middle of two doubles
        assert found.features[0].indices == (0,)
        assert found.points[1].tolist() == [*found.points[0][:2].tolist(), -0.5]


def test_a_sum_of_three_doubles_in_the_middle_of_two_is_rounded_to_the_even_one() -> None:
    ground, cube = HalfSpace([0.0, 0.0, -1.0], -1.0), Polyhedron(CORNERS, QUADS)
    for z in (2.0**-53, 3.0 * 2.0**-53, 5.0 * 2.0**-53):
        move = [0.0, 0.0, z]
        expected = float(1 + Fraction(z))
        assert clearance_poses(ground, cube, [Pose(np.eye(3), move)]).tolist() == [expected]
        for solid in (cube, Aabb([0, 0, 0], [1, 1, 1]), Sphere([0, 0, 0], 0.0)):
            found: Any = clearance(solid, ground, first_pose=Pose(np.eye(3), move))
            assert (found.distance, found.points[0][2], found.points[1][2]) == (expected, z, -1.0)


@pytest.mark.parametrize(
    ("n", "unit"), [(0.5, 5e-324), (0.25, 5e-324), (2.0**-100, 2.0**-1000), (2.0**-199, 2.0**-900)]
)
def test_products_that_underflow_are_not_taken_as_exact(n: float, unit: float) -> None:
    """They were: bodies apart were 0.0 or four units apart, and lower vertices as near."""
    ground = HalfSpace([0.0, 0.0, n], 0.0)
    sheet, box = Surface([[0, 0, -5 * unit], [1, 0, -3 * unit], [0, 1, -5 * unit]], [[0, 1, 2]]), [1.0, 1.0, -3 * unit]
    for solid in (sheet, Aabb([0, 0, -1], box), Sphere(box, 0.0)):
        found: Any = clearance(ground, solid)
        assert (found.distance, found.points[1][2]) == (3 * unit, -3 * unit)
        assert clearance_poses(ground, solid, [Pose(np.eye(3), [0, 0, 0])]).tolist() == [3 * unit]
    found = clearance(HalfSpace([0.0, 0.0, n], -1.0), sheet)
    assert found.features[1].indices == (1,)


def test_vertices_that_double_doubles_do_not_tell_apart_are_told_by_their_coordinates() -> None:
    move = [0.0, 0.0, -(2.0**-60)]
    for low, high in ((0, 1), (1, 0)):
        heights = [-(2.0**-200), -(2.0**-300)] if low == 0 else [-(2.0**-300), -(2.0**-200)]
        sheet = Surface([[0, 0, heights[0]], [1, 0, heights[1]], [0, 1, -1]], [[0, 1, 2]])
        found: Any = clearance(HalfSpace([0.0, 0.0, 1.0], -1.0), sheet, second_pose=Pose(np.eye(3), move))
        assert found.features[1].indices == (high,)


def test_balls_boxes_and_gaps_of_scenes_take_the_same_way() -> None:
    rng = random.Random(5)
    for _ in range(20):
        ground, move = plane(rng, 3, 1.0), [number(rng, 1.0) for _ in range(3)]
        pose = Pose(turn(rng, 3), move)
        boxes = Aabb([0, 0, 0], [1, 2, 3]), Aabb([0, 0, 0], [1, 2, 0])
        for solid in (Sphere([1.0, 0.5, 0.25], 0.3), *boxes, body(rng, 3, 1.0)):
            expected: Any = clearance(ground, solid, second_pose=pose)
            assert clearance_poses(ground, solid, [pose]).tolist() == [expected.distance]
            pairs: Any = collide_scene([ground, solid], [None, pose], gap=9.0)
            assert [0.0, *pairs.distance.tolist()][-1] == (expected.distance if expected.distance < 9.0 else 0.0)
