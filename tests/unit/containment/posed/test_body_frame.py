"""Points in a body's frame: the exact preimage is within half of the blur."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Pose
from engine.arrays import read_only
from engine.containment.posed.body_frame import move_to_body_frame
from engine.containment.posed.frames import frames_of
from engine.containment.rational_locate import to_body_frame


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
