"""Posed solids: frames and locators."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine import Implicit, Pose
from engine.containment.methods.filters import frames_of, move_to_body_frame
from engine.containment.methods.rational_locate import adjugate, rational_location, to_body_frame, to_world_frame
from engine.containment.posed_locators import posed_center, posed_locator
from engine.running.budget import Budget
from engine.solids.primitives import Sphere
from engine.types import read_only
from tests.unit.containment.scenes import lattice_points, lattice_solids, made

POSES = {
    2: [Pose([[0.6, -0.8], [0.8, 0.6]], [0.1, 2.0]), Pose([[0, -1], [1, 0]], [0.5, 3.0])],
    3: [Pose([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]], [0.1, 0, 1]),
        Pose([[0, -1, 0], [0, 0, -1], [1, 0, 0]], [0.5, 1, 2])],
}  # fmt: skip


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("which", [0, 1])
def test_every_kind_equals_the_exact_image(dimension: int, which: int) -> None:
    pose = POSES[dimension][which]
    lattice = lattice_points(dimension)[:: 3 if dimension == 2 else 31]
    points = read_only(lattice @ pose.rotation.T + pose.translation)
    for solid in (made(each) for each in lattice_solids(dimension, 6)):
        locator, found = posed_locator(solid, pose), np.empty(len(points), np.int8)
        with Budget() as budget:
            counts = locator.chosen(len(points), budget).fill(points, found, budget)
        assert found.tolist() == [rational_location(point, solid, pose) for point in points.tolist()], solid
        assert counts.rational <= counts.beyond or which == 1


def test_a_pose_that_moves_nothing_is_none() -> None:
    solid = Sphere([0, 0], 1)
    assert posed_locator(solid, Pose.identity(2)).method == posed_locator(solid, None).method


def test_a_callable_is_asked_in_its_own_frame() -> None:
    solid = Implicit.from_callable(lambda points: points[:, 0], dimension=2)
    locator, found = posed_locator(solid, POSES[2][1]), np.empty(2, np.int8)
    with Budget() as budget:
        locator.fill(read_only(np.array([[0.0, 4.0], [0.0, 2.0]])), found, budget)
    assert (locator.decisions, found.tolist()) == ("float64", [1, -1])


def test_the_centre_is_the_nearest_double_and_its_blur_a_bound() -> None:
    solid, pose = Sphere([0.1, 0.2, 0.3], 1), POSES[3][0]
    center, blur = posed_center(solid, pose)
    exact = to_world_frame(solid.center.tolist(), pose)
    assert center.tolist() == [float(value) for value in exact]
    assert all(abs(near - true) <= blur for near, true in zip(center.tolist(), exact))
    assert posed_center(Sphere([1.7e308, 1.7e308], 1), Pose([[0.6, -0.8], [0.8, 0.6]], [0, 1.7e308]))[1] == np.inf


# --- Poses side by side: their inverses within their bound, and points moved into a body's frame within theirs ---


@pytest.mark.parametrize("dimension", [2, 3])
def test_inverses_are_within_their_bound(dimension: int) -> None:
    random = np.random.default_rng(dimension)
    turns = [np.linalg.qr(random.normal(size=(dimension, dimension)))[0] for _ in range(20)]
    poses = [Pose(turn * np.linalg.det(turn) ** (dimension % 2), random.normal(size=dimension)) for turn in turns
             if dimension == 3 or np.linalg.det(turn) > 0]  # fmt: skip
    frames = frames_of([None, *poses, Pose.identity(dimension)], dimension)
    assert frames.rows.tolist() == [-1, *range(len(poses)), -1]
    assert not frames.is_turn.any()
    for pose, inverse in zip(poses, frames.inverses):
        rows, determinant = adjugate([[Fraction(entry) for entry in row] for row in pose.rotation.tolist()])
        for exact, found in zip(rows, inverse.tolist()):
            assert all(abs(Fraction(near) - true / determinant) < 32 * 2.0**-53 for near, true in zip(found, exact))


def test_quarter_turns_are_known() -> None:
    frames = frames_of([Pose([[0, -1], [1, 0]], [0, 0])], 2)
    assert frames.is_turn.tolist() == [True]
    assert frames.inverses[0].tolist() == [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]


@pytest.mark.parametrize("angle", [0.0, 0.5, 1e-9])
def test_the_blur_bounds_the_error(angle: float) -> None:
    turn = [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    pose = Pose(turn, [0.1, 1e6, -3.0])
    points = read_only(np.random.default_rng(0).normal(size=(100, 3)) * [1.0, 1e6, 1e-6])
    moved, blurs = np.empty_like(points), np.empty(len(points))
    move_to_body_frame(points, frames_of([pose], 3), moved, blurs)
    for point, found, blur in zip(points.tolist(), moved.tolist(), blurs.tolist()):
        exact = to_body_frame(point, pose)
        assert all(2 * abs(near - true) <= blur for near, true in zip(found, exact))


def test_quarter_turns_by_exact_differences_have_no_blur() -> None:
    pose = Pose([[0.0, -1.0], [1.0, 0.0]], [1.0, 1e6])
    moved, blurs = np.empty((2, 2)), np.empty(2)
    move_to_body_frame(read_only(np.array([[3.0, 1.0], [0.1, 1.0]])), frames_of([pose], 2), moved, blurs)
    assert moved[0].tolist() == [1.0 - 1e6, -2.0]
    assert (blurs == 0.0).tolist() == [True, False]
