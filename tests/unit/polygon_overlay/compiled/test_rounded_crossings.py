"""Crossings rounded to the nearest doubles, as rational arithmetic has them, with a bound that holds."""

from __future__ import annotations

from fractions import Fraction

import pytest

from engine.polygon_overlay.compiled.rounded_crossings import round_crossing
from tests.unit.polygon_overlay.compiled.test_crossing_signs import cross, crossing, exact, sign, star


@pytest.mark.parametrize("seed", range(100))
def test_nearest_doubles(seed: int) -> None:
    edges = star(seed)
    for f in (2, 4):
        a, b, c, d = (exact(edges, v) for v in (0, 1, f, f + 1))
        if sign(cross(a, b, c)) * sign(cross(a, b, d)) < 0 and sign(cross(c, d, a)) * sign(cross(c, d, b)) < 0:
            place, _ = crossing(edges, 0, f)
            found = round_crossing(edges, 0, f)
            for value, near, error in zip(place, found[:2], found[2:], strict=True):
                assert float(value) == near
                assert abs(value - Fraction(near)) <= Fraction(error)
                assert (error == 0.0) == (value == Fraction(near))
