"""Vertices for the lanes: in units that none exceeds, or none where the numbers do not fit."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb
from engine.collision.convex.body import ConvexBody, convex_body_of
from engine.collision.convex.poses import MOST_VERTICES, lane_points, lane_scale
from tests.unit.collision.convex.test_pair import ball_of_belts


def body(low: float, high: float) -> ConvexBody:
    found = convex_body_of(Aabb([low] * 3, [high] * 3))
    assert found is not None
    return found


@pytest.mark.parametrize("size", [2.0**-80, 3.0, 2.0**200])
def test_no_coordinate_exceeds_the_unit(size: float) -> None:
    first, second, middle = body(0.0, size), body(size, 2.5 * size), np.full(3, size)
    scale = lane_scale(first, middle, second, middle)
    assert np.frexp(scale)[0] == 0.5
    for one in (first, second):
        points = lane_points(one, middle, scale)
        assert points.dtype == np.float32
        assert (np.abs(points.astype(np.float64) * scale + size - one.points) <= 2.0**-24 * scale).all()
        assert np.abs(points).max() <= 1.0


def test_none_beyond_the_range_and_for_many_vertices() -> None:
    zero = np.zeros(3)
    assert lane_scale(body(0, 2.0**300), zero, body(0, 1), zero) == 0.0
    many = convex_body_of(ball_of_belts(30, MOST_VERTICES // 30))
    assert many is not None
    assert lane_scale(many, zero, body(0, 1), zero) == 0.0
