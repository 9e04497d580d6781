"""Boxes: comparisons alone."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, locate


def test_flat_box_has_only_boundary() -> None:
    assert locate([[0.5, 0.5, 1.0], [0.5, 0.5, 1.1]], Aabb([0, 0, 1], [1, 1, 1])).tolist() == [0, -1]


@pytest.mark.parametrize("dimension", [2, 3])
def test_comparisons_are_the_definition(dimension: int) -> None:
    low, high = np.arange(dimension) - 2.0, np.arange(dimension) + 0.0
    points = np.random.default_rng(0).integers(-4, 5, (2000, dimension)) / 2.0
    distance = np.minimum(points - low, high - points).min(axis=1)  # exact: halves of small integers
    assert locate(points, Aabb(low, high)).tolist() == np.sign(distance).astype(int).tolist()
