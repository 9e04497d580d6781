"""Vertices for the lanes: in units that none exceeds, or none where the numbers do not fit."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb
from engine.collision.convex.body import ASIDE, CENTER, ConvexBody, convex_body_of
from engine.collision.convex.poses import MOST_VERTICES, lane_arrays
from tests.unit.collision.convex.test_pair import ball_of_belts


def body(low: float, high: float) -> ConvexBody:
    found = convex_body_of(Aabb([low] * 3, [high] * 3))
    assert found is not None
    return found


@pytest.mark.parametrize("size", [2.0**-80, 3.0, 2.0**200])
def test_no_coordinate_exceeds_the_unit(size: float) -> None:
    first, second = body(0.0, size), body(size, 2.5 * size)
    lanes = lane_arrays(first, second)
    assert lanes is not None
    assert np.frexp(lanes.scale)[0] == 0.5
    for one, points, place in ((first, lanes.first, CENTER), (second, lanes.second, ASIDE)):
        exact = one.points - one.numbers[place : place + 3, None]
        assert points.dtype == np.float32
        assert (np.abs(points.astype(np.float64) * lanes.scale - exact) <= 2.0**-24 * lanes.scale).all()
        assert np.abs(points).max() <= 1.0


def test_none_beyond_the_range_and_for_many_vertices() -> None:
    assert lane_arrays(body(0, 2.0**300), body(0, 1)) is None
    many = convex_body_of(ball_of_belts(30, MOST_VERTICES // 30))
    assert many is not None
    assert lane_arrays(many, body(0, 1)) is None
