"""Rational arithmetic: integers, scaling, the point of a cut."""

from __future__ import annotations

import math
import random
import struct
from decimal import Decimal, localcontext
from fractions import Fraction

import gmpy2
import numpy as np
import pytest

from engine.errors import NotRepresentableError
from engine.predicates.cut_point import nearest as nearest_cut
from engine.predicates.cut_point import point_at
from engine.predicates.error_free import dd_add, dd_div
from engine.predicates.rational import (
    balanced_rows,
    common_integers,
    cross,
    dot,
    exponent_of,
    largest_axis,
    minus,
    nearest,
    nearest_float,
    nearest_with_root,
    orient2d_rational,
    orient3d_rational,
    polynomial_sign_rational,
    scaled_back,
    scaled_integers,
    shifted,
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


# --- Quotients and roots of integers as the nearest doubles ---


def test_numbers_keep_their_values_over_one_denominator() -> None:
    numbers = [0.5, -3.0, 2.0**-1074, 1e300, 0.0]
    integers, denominator = common_integers(numbers)
    assert [nearest(number, denominator) for number in integers] == numbers


def test_roots_are_the_nearest_doubles() -> None:
    rng = np.random.default_rng(1)
    with localcontext() as context:
        context.prec = 80
        for u, v, w, z in rng.integers(-(10**6), 10**6, (300, 4)).tolist():
            w, z = abs(w), abs(z) + 1
            assert nearest_with_root(u, v, w, z) == float((u + v * Decimal(w).sqrt()) / z)
    assert nearest_with_root(-4, 2, 4, 3) == 0.0


# --- Points on segments: nearest doubles, or said to be unsure ---


def test_points_are_the_nearest_doubles() -> None:
    """Also midpoints between doubles, zeros and subnormal numbers, where double-doubles leave it to signs."""
    rng = np.random.default_rng(1)
    n_sure, e = 0, np.empty(96)
    for turn in range(300):
        p, q = (rng.integers(-8, 9, 2) * (1.0, 2.0**-52 / 3, 2.0**-1070)[turn % 3]).tolist()
        wp, wq = (rng.integers(1, 9, 2) * 1.0).tolist()
        exact = float((Fraction(p) * Fraction(wq) + Fraction(q) * Fraction(wp)) / (Fraction(wp) + Fraction(wq)))
        total = dd_add(wp, 0.0, wq, 0.0)
        x, is_sure = nearest_cut(p, q, np.array([wp]), 1, np.array([wq]), 1, *total, e)
        assert is_sure
        assert x == exact
        if turn % 3 < 2:
            x, is_sure = point_at(p, q, *dd_div(wp, 0.0, *total), 0.0)
            n_sure += is_sure
            assert x == exact or not is_sure
    assert n_sure > 50


# --- Scenes times powers of two: exact, or not done ---


def test_scaling_is_exact_or_refused() -> None:
    points = np.array([[2.0**900, 3.0], [-1.0, 2.0**-100]])
    assert exponent_of(points) == 901
    assert exponent_of(np.ones((2, 2))) == 0
    small = shifted(points, -901)
    assert small is not None
    assert (np.ldexp(small, 901) == points).all()
    assert shifted(np.array([2.0**900, 2.0**-1000 / 3]), -901) is None


def test_rows_are_balanced_by_powers_of_two_of_their_own() -> None:
    rows = np.array([[2.0**300, 0.0, 3.0], [1.0, 1.0, 5.0]])
    balanced = balanced_rows(rows, 2)
    assert balanced is not None
    assert (balanced == [[2.0**300 / 2**301, 0.0, 0.75 / 2**301], [1.0, 1.0, 1.25]]).all()


def test_what_is_rounded_twice_is_told() -> None:
    points = np.array([[1.0 + 2.0**-52, 1.0], [1.0, 1.0]])
    found, is_doubtful = scaled_back(points, -1030)
    assert is_doubtful.tolist() == [True, False]
    assert found[1].tolist() == [2.0**-1030] * 2
