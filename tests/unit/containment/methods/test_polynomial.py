"""Implicit solids: the sign of the polynomial is that of rational arithmetic, at its zeros and one ulp off."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from engine import Implicit, locate


def test_signs_are_those_of_rationals() -> None:
    terms = [([0, 0], 25.0), ([2, 0], -1.0), ([0, 2], -1.0), ([3, 1], 0.5)]
    solid = Implicit([{"powers": powers, "coefficient": coefficient} for powers, coefficient in terms])
    points = np.random.default_rng(0).integers(-6, 7, (500, 2)).astype(float)
    points = np.concatenate([points, np.nextafter(points, 9.0), [[3.0, 4.0], [0.0, 5.0]]])
    values = [sum(Fraction(c) * Fraction(x) ** i * Fraction(y) ** j for (i, j), c in terms) for x, y in points.tolist()]
    assert locate(points, solid).tolist() == [(value > 0) - (value < 0) for value in values]
