"""Squared distances: exact ones against the reference, bounds around them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine.collision.simple.boundary import box_distance_bounds, segment_distance, simplex_distance
from tests.reference.contact import squared_distance_to_segment, squared_distance_to_triangle
from tests.reference.exact import vector


def test_agrees_with_the_reference_and_the_bounds_hold() -> None:
    rng = np.random.default_rng(2)
    for rows in rng.integers(0, 4, (200, 4, 3)).tolist():
        p, a, b, c = (tuple(map(Fraction, row)) for row in rows)
        q = [vector(row) for row in rows]
        if a != b:
            assert segment_distance(p, a, b) == squared_distance_to_segment(q[0], q[1], q[2])
        near, far = box_distance_bounds(
            np.array(rows[0], float),
            np.array([rows[1:]]).min(1).astype(float),
            np.array([rows[1:]]).max(1).astype(float),
        )
        assert near[0] <= simplex_distance(p, (a, b, c)) <= far[0]
        if np.cross(np.subtract(rows[2], rows[1]), np.subtract(rows[3], rows[1])).any():
            assert simplex_distance(p, (a, b, c)) == squared_distance_to_triangle(q[0], (q[1], q[2], q[3]))


def test_bounds_survive_overflow() -> None:
    low, high = np.array([[-1e200, 0.0]]), np.array([[np.inf, 1.0]])
    near, far = box_distance_bounds(np.array([1e200, 0.5]), low, high)
    assert near[0] <= 0.0
    assert far[0] == np.inf
