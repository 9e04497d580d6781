"""Boxes of points: the smallest ``low <= p <= high``; comparisons of floats only, so exact."""

from __future__ import annotations

import numpy as np

from engine.arrays import FloatArray


def box_of_points(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return low and high ``(dimension,)`` of points ``(n, dimension)``, n at least 1.

    >>> low, high = box_of_points(np.array([[0.0, 5.0], [3.0, 1.0]]))
    >>> low.tolist(), high.tolist()
    ([0.0, 1.0], [3.0, 5.0])
    """
    return points.min(axis=0), points.max(axis=0)


def corners_of_box(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the ``(2 ** dimension, dimension)`` corners of a box; bit k of the row says low or high on axis k."""
    dimension = len(low)
    is_high = np.arange(2**dimension)[:, None] >> np.arange(dimension) & 1
    return np.where(is_high == 1, high, low)
