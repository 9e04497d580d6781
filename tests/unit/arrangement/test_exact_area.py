"""Area of exact rings, as a fraction and rounded once, where the plain sum of doubles would not do."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.arrangement.exact_area import ExactRings
from engine.arrangement.nodes import nearest_quotient, reduced
from engine.errors import NotRepresentableError


def slow_area(rings: ExactRings) -> Fraction:
    total = Fraction(0)
    for ring in rings.rings:
        points = [(Fraction(x, w), Fraction(y, w)) for x, y, w in ring]
        total += sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(points, points[1:] + points[:1], strict=True))
    return total / 2 * Fraction(4) ** rings.exponent


@pytest.mark.parametrize("exponent", [-700, -53, 0, 40])
@pytest.mark.parametrize("seed", range(5))
def test_equals_plain_fractions(seed: int, exponent: int) -> None:
    random = np.random.default_rng(seed)
    ring = tuple(reduced(*map(int, row)) for row in random.integers(1, 1 << 40, (17, 3)))
    rings = ExactRings((ring, ring[::-1][:9]), exponent)
    expected = slow_area(rings)
    assert rings.area() == expected
    assert rings.nearest_area() == nearest_quotient(expected.numerator, expected.denominator)


def test_area_that_nearly_cancels() -> None:
    big, third = 10**300, reduced(1, 1, 3)
    sliver = ((0, 0, 1), (big, 0, 1), third)
    rings = ExactRings((sliver, (third, (big, 0, 1), (0, 0, 1)), ((0, 0, 1), (1, 0, 1), (0, 1, 7))), 0)
    assert rings.area() == Fraction(1, 14)
    assert rings.nearest_area() == 1 / 14


def test_nothing_and_too_much() -> None:
    assert ExactRings((), 0).area() == 0
    for exponent in (0, 900, -900):
        assert str(ExactRings((), exponent).nearest_area()) == "0.0"
    with pytest.raises(NotRepresentableError):
        ExactRings((((0, 0, 1), (1, 0, 1), (0, 1, 1)),), 600).nearest_area()


def test_bounds_may_be_too_much_where_the_area_is_not() -> None:
    far, third = 1 << 1500, reduced(1, 1, 3)
    there, back = ((0, 0, 1), (far, 0, 1), third), (third, (far, 0, 1), (0, 0, 1))
    rings = ExactRings((there, back, ((0, 0, 1), (1, 0, 1), (0, 1, 1))), 400)
    assert rings.nearest_area() == 2.0**799
