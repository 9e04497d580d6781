"""Polygons, triangles and boxes of the plane against each other."""

from __future__ import annotations

import time

import numpy as np
import pytest

import engine
from engine import Pose, collide
from tests.unit.collision.lattices import COUNTS, Maker, aabb, check_pairs, polygon, triangle


@pytest.mark.parametrize(
    ("d", "first", "second"),
    [(2, aabb, triangle), (2, aabb, polygon), (2, triangle, triangle), (2, triangle, polygon), (2, polygon, polygon)],
)
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


def test_large_outlines_end_at_their_deadline() -> None:
    t = np.linspace(0, 2 * np.pi, 300_000, endpoint=False)
    ring = np.stack([np.cos(t), np.sin(t)], axis=1) * (1 + 0.1 * np.sin(9999 * t))[:, None]
    body, step = engine.Polygon([ring]), Pose(np.eye(2), [0.001, 0.0])  # without a deadline 18 s, posed 80 s
    small = engine.Polygon([ring[::30000]])
    for pose_ in (None, step):
        collide(small, small, second_pose=pose_)  # compiles
        before = time.process_time()  # a busy machine may keep the call waiting
        with pytest.raises(engine.DeadlineExceededError):
            collide(body, body, second_pose=pose_, deadline=0.05)
        assert time.process_time() - before < 5
