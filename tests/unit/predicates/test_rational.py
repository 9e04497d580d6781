"""The slow exact predicates, against hand-made cases and gmpy2; correct rounding against gmpy2's."""

from __future__ import annotations

import math
import random
import struct
from fractions import Fraction

import gmpy2
import pytest

from engine.errors import NotRepresentableError
from engine.predicates.rational import (
    cross,
    dot,
    largest_axis,
    minus,
    nearest_float,
    orient2d_rational,
    orient3d_rational,
    polynomial_sign_rational,
    scaled_integers,
    side_rational,
    squared_length,
)

TINY, HUGE = 5e-324, 1.7976931348623157e308


def any_float(draw: random.Random) -> float:
    """Return a finite double, every bit pattern alike."""
    while True:
        value: float = struct.unpack("<d", draw.randbytes(8))[0]
        if math.isfinite(value):
            return value


def test_signs_of_conventions() -> None:
    assert orient2d_rational((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)) == 1
    assert orient3d_rational((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)) == 1
    assert side_rational((1.0, 0.0, -2.0), (3.0, 0.0)) == 1
    assert polynomial_sign_rational([(2, 0), (0, 2), (0, 0)], [-1.0, -1.0, 25.0], (3.0, 4.0)) == 0


def test_extremes_of_the_range() -> None:
    assert orient2d_rational((-HUGE, 0.0), (HUGE, 0.0), (0.0, TINY)) == 1
    assert orient2d_rational((-HUGE, -TINY), (HUGE, TINY), (0.0, 0.0)) == 0
    assert side_rational((HUGE, TINY, -HUGE), (1.0, HUGE)) == 1
    assert polynomial_sign_rational([(16, 0), (0, 16)], [TINY, -TINY], (HUGE, HUGE)) == 0


def test_fractions_are_taken_as_they_are() -> None:
    third = Fraction(1, 3)
    assert orient2d_rational((0, 0), (third, third), (2 * third, 2 * third)) == 0
    assert side_rational((3, -1), (third,)) == 0
    assert polynomial_sign_rational([(3,), (0,)], [27, -1], (third,)) == 0
    assert scaled_integers((0.75, third)) == [9, 4]


def test_nearest_float_rounds_as_gmpy2_does() -> None:
    draw = random.Random(1)
    context = gmpy2.context(precision=53, emin=-1073, emax=1024, subnormalize=True)
    for _ in range(3000):
        a, b = Fraction(any_float(draw)), Fraction(any_float(draw))
        value = a / b if b and draw.random() < 0.5 else a * Fraction(draw.random())
        with gmpy2.context(context):
            expected = float(gmpy2.mpfr(gmpy2.mpq(value)))
        if math.isinf(expected):
            with pytest.raises(NotRepresentableError):
                nearest_float(value)
        else:
            assert nearest_float(value) == expected


def test_nearest_float_at_the_edges() -> None:
    half = Fraction(TINY) / 2
    assert math.copysign(1.0, nearest_float(-half)) == 1.0  # the tie goes to even, and zero is +0.0
    assert nearest_float(-half * Fraction(1000001, 1000000)) == -TINY
    assert nearest_float(3 * half) == 2 * TINY
    assert nearest_float(Fraction(HUGE)) == HUGE
    step = Fraction(HUGE) - Fraction(math.nextafter(HUGE, 0.0))
    assert nearest_float(Fraction(HUGE) + step / 2 - 1) == HUGE
    with pytest.raises(NotRepresentableError, match=r"1\.7976931348623158e\+308"):
        nearest_float(Fraction(HUGE) + step / 2)


def test_identities_in_integers_and_fractions() -> None:
    rng = random.Random(1)
    for _ in range(50):
        u, v = (tuple(rng.randint(-9, 9) for _ in range(3)) for _ in range(2))
        assert dot(cross(u, v), u) == dot(cross(u, v), v) == 0
        assert squared_length(cross(u, v)) == squared_length(u) * squared_length(v) - dot(u, v) ** 2
        for n in (2, 3):
            p, q = (tuple(Fraction(x, 7) for x in w[:n]) for w in (u, v))
            assert squared_length(minus(p, q)) == squared_length(p) - 2 * dot(p, q) + squared_length(q)


def test_largest_axis_is_the_first_of_equals() -> None:
    assert [largest_axis(u) for u in ((0, 0, 0), (1, -1, 0), (0, -3, 2), (0, 0, 5))] == [-1, 0, 1, 2]
