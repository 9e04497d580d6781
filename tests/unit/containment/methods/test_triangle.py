"""Triangles of the plane."""

from __future__ import annotations

import numpy as np

from engine import Triangle, locate


def test_plane_triangle_without_area_is_its_segment() -> None:
    flat = Triangle([[0, 0], [2, 2], [1, 1]])
    assert locate([[0.5, 0.5], [2, 2], [3, 3], [1, 1.5]], flat).tolist() == [0, 0, -1, -1]


def test_lattice_points_equal_integers() -> None:
    random = np.random.default_rng(0)
    for _ in range(50):
        corners = random.integers(-3, 4, (3, 2))
        points = random.integers(-4, 5, (100, 2))
        expected = []
        for q in points:
            sides = [
                int(np.linalg.det(np.stack([b - a, q - a])).round()) for a, b in zip(corners, np.roll(corners, -1, 0))
            ]
            is_boxed = (q >= corners.min(axis=0)).all() and (q <= corners.max(axis=0)).all()
            is_astride = min(sides) < 0 < max(sides)
            expected.append(-1 if is_astride or not is_boxed else 0 if 0 in sides else 1)
        assert locate(points, Triangle(corners)).tolist() == expected
