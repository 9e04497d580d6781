"""Implicit rings made exact: vertices as given, crossings as fractions, repeated points passed over."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine.polygon_overlay.compiled.loading import RingArrays
from engine.polygon_overlay.implicit_rings import ImplicitRings


def test_crossings_and_vertices() -> None:
    subject = RingArrays(np.array([[0.0, 0], [0, 0], [3, 1], [0, 3]]), np.array([0, 4]))
    clip = RingArrays(np.array([[1.0, -1], [1, 5], [-2, 5]]), np.array([0, 3]))
    sources = np.array([[2, -1], [0, 4], [3, -1]])
    rings = ImplicitRings(subject, clip, sources, np.array([0, 3])).exact_rings()
    assert rings.places() == [[(3, 1), (1, Fraction(1, 3)), (0, 3)]]
    assert rings.area() == -3
    again = ImplicitRings(subject, clip, sources[[0, 1, 2, 0, 1, 2]], np.array([0, 3, 6])).some([1])
    assert again.places() == rings.places()
