"""Poses side by side: their inverses within their bound, and points moved into a body's frame within theirs."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine import Pose
from engine.arrays import read_only
from engine.containment.posed.frames import frames_of, move_to_body_frame
from engine.containment.rational_locate import adjugate, to_body_frame


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
