"""Distances from the bodies of a scene: the least of those from each body, with its point and feature."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import engine
from engine import Aabb, Polyhedron, Pose, Scene, Sphere
from engine.errors import InvalidInputError, NotFiniteError, UnsupportedSolidError
from tests.unit.scenes.scenes import FACES, OCTAHEDRON, pose_of, scene_of

CUBE = [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def check(scene: Scene, solids: Any, poses: Any, points: Any) -> None:
    """Assert that answers are those of the first body among the nearest, each asked alone."""
    answer, body = scene.distances(points), np.arange(len(points))
    each = [engine.distances(points, solid, pose=pose, nearest=True) for solid, pose in zip(solids, poses)]
    every = np.array([one.distance for one in each])
    assert np.array_equal(answer.distance, every.min(axis=0))
    assert np.array_equal(answer.body, every.argmin(axis=0))
    for name in ("point", "face", "kind", "index"):
        column = np.array([getattr(one, name) for one in each])
        assert np.array_equal(getattr(answer, name), column[answer.body, body]), name
    for limit in (float(np.median(answer.distance)), float(np.nextafter(answer.distance.max(), 0))):
        within = [engine.distances(points, solid, pose=pose, within=limit) for solid, pose in zip(solids, poses)]
        assert np.array_equal(scene.distances(points, within=limit), np.any(within, axis=0))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("n", "spread"), [(1, 1.0), (5, 3.0), (60, 20.0), (60, 1e-9)])
def test_bodies_of_all_types_some_moved(dimension: int, n: int, spread: float) -> None:
    rng = np.random.default_rng(n)
    solids, poses = scene_of(rng, dimension, n, for_pairs=True)
    some = [k for k, solid in enumerate(solids) if solid.type != "half_space" or k % 7 == 0]
    solids = [solids[k] for k in some]
    poses = [pose_of(rng, dimension, span=spread) for _ in some]
    points = np.concatenate([rng.normal(size=(20, dimension)) * spread, np.round(rng.normal(size=(20, dimension)) * 3),
                             rng.normal(size=(4, dimension)) * 1e12])  # fmt: skip
    points = np.concatenate([points, [pose.translation for pose in poses if pose is not None][:8]])
    scene = Scene(solids, poses)
    check(scene, solids, poses, points)
    moved = {k: pose_of(rng, dimension, span=spread) for k in range(0, len(solids), 3)}
    check(scene.moved(moved), solids, [moved.get(k, pose) for k, pose in enumerate(poses)], points)


def test_the_first_of_bodies_that_share_a_wall_an_edge_or_a_corner() -> None:
    boxes = [Aabb([x, y, 0], [x + 1, y + 1, 1]) for x in range(4) for y in range(4)]
    cubes = [Polyhedron(np.add(CUBE, [x, y, 2]), QUADS) for x in range(4) for y in range(4)]
    points = np.array([[x, y, z] for x in np.arange(-1, 6) / 2 for y in np.arange(-1, 6) / 2 for z in (0, 1.5, 2, 4)])
    check(Scene(boxes + cubes), boxes + cubes, [None] * 32, points)


def test_a_thousand_small_bodies_far_from_their_own_origin() -> None:
    rng = np.random.default_rng(7)
    far = np.array([1e7, -1e6, 3e5])
    solid, ball = Polyhedron(np.array(OCTAHEDRON) * 1e-3 + far, FACES), Sphere(far, 1e-3)
    turns = [np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(200)]
    turns = [turn * np.linalg.det(turn) for turn in turns]
    poses = [Pose(turn, rng.normal(size=3) - turn @ far) for turn in turns]
    solids: Any = [solid if k % 2 else ball for k in range(200)]
    check(Scene(solids, poses), solids, poses, rng.normal(size=(40, 3)))


def test_corners_halfway_between_two_doubles_are_rounded_in_the_kernel() -> None:
    turn, shift = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1.0]]), np.array([20.0, 40.0, 9.0])
    pose = Pose(turn, shift, tolerance=1e-9)
    corners = np.array([[sum(Fraction(r) * int(x) for r, x in zip(row, corner)) + Fraction(t)
                         for row, t in zip(turn.tolist(), shift.tolist())] for corner in CUBE])  # fmt: skip
    points = corners.astype(float) + 3.0 * (np.array(CUBE) @ turn.T - turn.sum(axis=1) / 2)
    answer, accuracy = Scene([Polyhedron(CUBE, QUADS)], [pose]).distances(points, report=True)
    assert answer.point.tolist() == corners.astype(float).tolist()
    assert accuracy.n_rational == 0


def test_options_and_bodies_that_are_refused() -> None:
    box = Aabb([0, 0], [1, 1])
    assert Scene([box]).distances([[3, 0.5]], within=2).tolist() == [True]
    with pytest.raises(InvalidInputError):
        Scene([box]).distances([[3, 0]], within=-1)
    with pytest.raises(NotFiniteError):
        Scene([box]).distances([[3, np.nan]])
    with pytest.raises(UnsupportedSolidError, match="distances are not measured") as error:
        Scene([box, engine.Csg("union", [box])]).distances([[3, 0]])
    assert error.value.where == ("solids", 1)


@pytest.mark.parametrize("size", [1e-160, 1e-163, 1e-181, 1e-300])
def test_tiny_scenes_have_the_nearest_body_from_near_and_from_very_far(size: float) -> None:
    """Squares underflowed, and a point without a direction in the tree ended the process."""
    corners = [np.array([k * size * 1e-5, 0, 0]) for k in range(5)]
    bodies = [engine.Aabb(low, low + size * 1e-6) for low in corners]
    for point in ([3 * size, 0, 0], [1e250, 0, 0], [-1e299, 0, 0]):
        alone = [float(engine.distances([point], body)[0]) for body in bodies]
        found = engine.Scene(bodies).distances([point])
        assert (found.distance[0], found.body[0]) == (min(alone), alone.index(min(alone)))
        for limit in (min(alone), np.nextafter(min(alone), 0), np.nextafter(min(alone), np.inf)):
            each = [bool(engine.distances([point], body, within=float(limit))[0]) for body in bodies]
            assert engine.Scene(bodies).distances([point], within=float(limit)).tolist() == [any(each)]


def test_a_body_beyond_doubles_is_not_measured_where_another_is_nearer() -> None:
    near, far = engine.Aabb([1e308] * 3, [1e308] * 3), engine.Aabb([-1e308] * 3, [-1e308] * 3)
    alone = engine.distances([[1.7e308] * 3], near)[0]
    assert [engine.Scene(some).distances([[1.7e308] * 3]).distance[0] for some in ([near, far], [far, near])] == [
        alone
    ] * 2
