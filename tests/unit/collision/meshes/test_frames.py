"""The map from one tree to another, within its margin of the exact one."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine import Pose
from engine.collision.exact_images import image_point
from engine.collision.meshes.dual_traversal import new_descent, place_bodies
from engine.collision.meshes.placement import NEVER_APART
from engine.jit import kernel
from engine.predicates.rational import dot
from tests.unit.collision.meshes.bodies import TURN, mesh


@kernel
def place(first: Any, first_pose: Any, second: Any, second_pose: Any, descent: Any) -> bool:
    return bool(place_bodies(first, first_pose, 0, second, second_pose, 0, descent)[1])


@pytest.mark.parametrize("pose", [None, TURN])
def test_points_are_mapped_within_the_margin(pose: Pose | None) -> None:
    a, b, descent = mesh(2), mesh(1, (1.5, 0.25, 0.5)), new_descent()
    assert not place(a.arrays, a.posed(pose), b.arrays, b.posed(TURN), descent)
    frame = descent.frames[0, :, 0].astype(np.float64)
    for local in np.random.default_rng(3).uniform(-1, 1, (20, 3)):
        placed = image_point(b.arrays.origin + b.arrays.scale * local, TURN)
        if pose is not None:  # its transpose, off by far less than the margin
            away = [x - Fraction(t) for x, t in zip(placed, pose.translation.tolist())]
            placed = tuple(dot(tuple(map(Fraction, column)), away) for column in pose.rotation.T.tolist())
        exact = [(float(x) - o) / a.arrays.scale for x, o in zip(placed, a.arrays.origin)]
        mapped = frame[:9].reshape(3, 3) @ local + frame[18:21]
        assert np.abs(mapped - exact).max() <= frame[21]


def test_far_bodies_are_apart_and_unlike_scales_leave_the_frame_out() -> None:
    a, descent = mesh(1), new_descent()
    assert place(a.arrays, a.posed(None), mesh(1, (9, 0, 0)).arrays, a.posed(None), descent)
    far = Pose(np.eye(3), [1e300, 0, 0])
    place(a.arrays, a.posed(None), a.arrays, a.posed(far), descent)
    assert (descent.frames[0, 21] == np.float32(NEVER_APART)).all()
