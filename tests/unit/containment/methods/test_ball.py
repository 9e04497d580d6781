"""Spheres: exact one ulp beside the surface."""

from __future__ import annotations

import numpy as np

from engine import Sphere, locate


def test_sphere_one_ulp_off() -> None:
    near = [[3.0, 4.0, 0.0], [3.0, np.nextafter(4.0, 9.0), 0.0], [3.0, np.nextafter(4.0, 0.0), 0.0], [0.0, 0.0, -5.0]]
    found, accuracy = locate(near, Sphere([0, 0, 0], 5), report=True)
    assert found.tolist() == [0, -1, 1, 0]
    assert accuracy.n_rational == 0
    assert accuracy.method == "squared_distance"


def test_sphere_of_radius_zero_is_its_centre() -> None:
    assert locate([[1, 1], [np.nextafter(1.0, 2.0), 1]], Sphere([1, 1], 0)).tolist() == [0, -1]
