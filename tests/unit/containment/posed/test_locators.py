"""Posed solids one by one: every kind equals the exact image, on images of its lattice and beside them."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Implicit, Pose
from engine.arrays import read_only
from engine.budget import Budget
from engine.containment.posed.locators import posed_center, posed_locator
from engine.containment.rational_locate import rational_location, to_world_frame
from engine.solids.sphere import Sphere
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
