"""Poses side by side: their inverses within the bound that body_frame.py counts on."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine import Pose
from engine.containment.posed.frames import frames_of
from engine.containment.rational_locate import adjugate


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
