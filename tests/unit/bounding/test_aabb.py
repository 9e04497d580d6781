"""Boxes of points."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.bounding.aabb import box_of_points, corners_of_box, place_boxes


def test_box_of_points() -> None:
    low, high = box_of_points(np.array([[0.0, 5.0, -1.0], [3.0, 1.0, 1e300], [1.0, 1.0, 5e-324]]))
    assert low.tolist() == [0.0, 1.0, -1.0]
    assert high.tolist() == [3.0, 5.0, 1e300]


def test_corners_of_box_are_all_choices_of_low_and_high() -> None:
    corners = corners_of_box(np.array([0.0, 1.0]), np.array([2.0, 3.0]))
    assert corners.tolist() == [[0.0, 1.0], [2.0, 1.0], [0.0, 3.0], [2.0, 3.0]]
    assert len({tuple(row) for row in corners_of_box(np.zeros(3), np.ones(3)).tolist()}) == 8


def _rotations(rng: np.random.Generator, n: int, dimension: int) -> np.ndarray:
    turns, _ = np.linalg.qr(rng.normal(size=(n, dimension, dimension)))
    return turns * np.sign(np.linalg.det(turns))[:, None, None] if dimension == 3 else turns


def _placed(low: object, high: object, reach: float, radius: float, turns: object, moves: object) -> tuple:
    n_bodies, dimension = np.shape(moves)
    boxes = np.array([[low, high]], np.float64)
    found = np.empty((n_bodies, dimension)), np.empty((n_bodies, dimension))
    rows = np.arange(n_bodies)
    with np.errstate(all="ignore"):
        place_boxes(
            boxes, np.array([reach]), np.array([radius]), np.zeros(n_bodies, np.int64), rows, turns, moves, *found
        )
    return found


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e200])
def test_exact_images_of_all_corners_lie_within(dimension: int, scale: float) -> None:
    rng = np.random.default_rng(5)
    turns = _rotations(rng, 40, dimension)
    moves = scale * rng.normal(size=(40, dimension)) * 10.0 ** rng.integers(-12, 12, (40, 1))
    corners = np.sort(scale * rng.normal(size=(2, dimension)), axis=0)
    for radius in (0.0, 0.75 * scale):
        low, high = _placed(corners[0], corners[1], np.inf, radius, turns, moves)
        for body in range(40):
            for which in range(1 << dimension):
                p = [Fraction(float(corners[which >> k & 1, k])) for k in range(dimension)]
                for axis in range(dimension):
                    row = [Fraction(float(value)) for value in turns[body, axis]]
                    x = sum((r * c for r, c in zip(row, p)), Fraction(float(moves[body, axis])))
                    assert Fraction(float(low[body, axis])) <= x - Fraction(radius)
                    assert x + Fraction(radius) <= Fraction(float(high[body, axis]))
        size = (2.0 * (corners[1] - corners[0]).sum() + 2.0 * radius) * (1.0 + 1e-9)
        assert (high - low <= size + 1e-14 * np.abs(moves).max(axis=1, keepdims=True)).all()


def test_a_known_reach_makes_boxes_smaller() -> None:
    turn = np.array([[[0.6, -0.8], [0.8, 0.6]]])
    wide = _placed([-1, -1], [1, 1], np.inf, 0.0, turn, np.zeros((1, 2)))
    narrow = _placed([-1, -1], [1, 1], 1.0, 0.0, turn, np.zeros((1, 2)))
    assert np.allclose(wide[1], 1.4)
    assert np.allclose(narrow[1], 1.0)
    assert (narrow[1] >= 1.0).all()


def test_no_pose_keeps_a_box_and_no_bounds_stay_none() -> None:
    boxes = np.array([[[0.1, 0.2], [0.3, 0.4]], [[-np.inf, -np.inf], [np.inf, np.inf]]])
    low, high = np.empty((3, 2)), np.empty((3, 2))
    turn, move = np.eye(2)[None], np.full((1, 2), 1e308)
    kinds, rows = np.array([0, 1, 1]), np.array([-1, -1, 0])
    with np.errstate(all="ignore"):
        place_boxes(boxes, np.full(2, np.inf), np.zeros(2), kinds, rows, turn, move, low, high)
    assert low[0].tolist() == [0.1, 0.2]
    assert high[0].tolist() == [0.3, 0.4]
    assert (low[1:] == -np.inf).all()
    assert (high[1:] == np.inf).all()
