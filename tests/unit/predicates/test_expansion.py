"""Expansions hold exact values, without overlap and without zeros."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import pytest

from engine.predicates.expansion import add, add_product, add_scaled, compress, grow, grow_product, scale, sign

N_ROOM = 512


def workspace() -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.full(N_ROOM, np.nan)  # what was not written is not read


def value(e: Sequence[float], n: int) -> Fraction:
    return sum((Fraction(float(component)) for component in e[:n]), Fraction(0))


def check_form(e: Sequence[float], n: int) -> None:
    """Assert increasing magnitudes, no zeros, no common bit positions."""
    for low, high in itertools.pairwise(e[:n]):
        mantissa = Fraction(float(high)).numerator
        lowest_bit = Fraction(mantissa & -mantissa, Fraction(float(high)).denominator)
        assert low != 0.0
        assert abs(Fraction(float(low))) < lowest_bit
    assert n == 0 or e[n - 1] != 0.0


def numbers(draw: random.Random, n: int) -> list[float]:
    """Return doubles of few and of many bits, some that cancel earlier ones."""
    found: list[float] = []
    for _ in range(n):
        kind = draw.randrange(4)
        if kind == 0 and found:
            found.append(-draw.choice(found))
        elif kind == 1:
            found.append(float(draw.randint(-5, 5)))
        else:
            found.append(math.ldexp(draw.uniform(-1, 1), draw.randint(-120, 60)))
    return found


@pytest.mark.parametrize("seed", range(25))
def test_every_operation_is_exact(seed: int) -> None:
    draw = random.Random(seed)
    e, f, g, h = workspace(), workspace(), workspace(), workspace()
    n, m, expected = 0, 0, Fraction(0)
    for b in numbers(draw, 12):
        n = grow(e, n, b)
        expected += Fraction(b)
        check_form(e, n)
        assert value(e, n) == expected
    for a, b in zip(numbers(draw, 6), numbers(draw, 6)):
        m = grow_product(f, m, a, b)
    check_form(f, m)
    expected_f = value(f, m)
    n = add(e, n, f, m)
    expected += expected_f
    assert value(e, n) == expected
    factor = draw.uniform(-9, 9)
    k = scale(f, m, factor, g)
    check_form(g, k)
    assert value(g, k) == expected_f * Fraction(factor)
    n = add_scaled(e, n, f, m, factor)
    expected += expected_f * Fraction(factor)
    check_form(e, n)
    assert value(e, n) == expected
    length = add_product(h, 0, f, m, g, k)
    check_form(h, length)
    assert value(h, length) == expected_f**2 * Fraction(factor)
    shorter = compress(e, n)
    assert shorter <= n
    check_form(e, shorter)
    assert value(e, shorter) == expected
    assert sign(e, shorter) == (expected > 0) - (expected < 0)
    if shorter:
        assert abs(expected - Fraction(float(e[shorter - 1]))) <= Fraction(math.ulp(float(e[shorter - 1])))


def test_what_cancels_is_empty() -> None:
    e = workspace()
    n = grow(e, grow(e, grow(e, 0, 1e30), 1.0), 1e-30)
    n = grow(e, grow(e, grow(e, n, -1.0), -1e-30), -1e30)
    assert n == 0
    assert sign(e, n) == 0
    assert compress(e, n) == 0
    assert scale(e, 0, 2.0, workspace()) == 0
    assert grow_product(e, 0, 0.0, 3.0) == 0
