"""Segments in the coordinates of a tree: within their slack of where they are, however far they reach."""

from __future__ import annotations

import numpy as np

from engine.segment_clipping.on_boundary.mesh_contacts import LIMIT, local_segment
from engine.types import Point3


def test_middle_and_half_are_within_their_slack() -> None:
    rng = np.random.default_rng(1)
    origin, inverse = np.array([3.0, -1.0, 100.0]), 0.25
    for size in (1e-6, 1.0, 8.0, 1e4):
        for _ in range(20):
            p = origin + rng.uniform(-1, 1, 3)  # near the tree: what is cut off lies far from it
            q = p + rng.uniform(-size, size, 3)
            middle, half, _, slack, is_near = local_segment(Point3(*p), Point3(*q), origin, inverse, 0.0)
            local_p, local_q = (p - origin) * inverse, (q - origin) * inverse
            ends = np.array(middle, float) - np.array(half, float), np.array(middle, float) + np.array(half, float)
            assert is_near
            assert np.abs(ends[0] - local_p).max() <= slack
            if np.abs(local_q).max() <= LIMIT:
                assert np.abs(ends[1] - local_q).max() <= slack
            else:
                assert np.abs(ends[1]).max() >= LIMIT - slack


def test_segments_that_pass_far_away_are_not_near() -> None:
    assert not local_segment(Point3(10.0, -9.0, 0.0), Point3(10.0, 9.0, 0.0), np.zeros(3), 1.0, 0.0)[-1]
