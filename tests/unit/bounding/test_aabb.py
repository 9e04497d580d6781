"""Boxes of points."""

from __future__ import annotations

import numpy as np

from engine.bounding.aabb import box_of_points, corners_of_box


def test_box_of_points() -> None:
    low, high = box_of_points(np.array([[0.0, 5.0, -1.0], [3.0, 1.0, 1e300], [1.0, 1.0, 5e-324]]))
    assert low.tolist() == [0.0, 1.0, -1.0]
    assert high.tolist() == [3.0, 5.0, 1e300]


def test_corners_of_box_are_all_choices_of_low_and_high() -> None:
    corners = corners_of_box(np.array([0.0, 1.0]), np.array([2.0, 3.0]))
    assert corners.tolist() == [[0.0, 1.0], [2.0, 1.0], [0.0, 3.0], [2.0, 3.0]]
    assert len({tuple(row) for row in corners_of_box(np.zeros(3), np.ones(3)).tolist()}) == 8
