"""Error-free sums and products hold to the last bit; fma and its twin round alike, for every exponent."""

from __future__ import annotations

import math
import random
import struct
from fractions import Fraction

import numpy as np
from numba import njit

from engine.predicates.error_free import fast_two_sum, fma, plain_fma, two_diff, two_prod, two_sum, workspace


def floats(seed: int, n: int, low: int, high: int) -> list[float]:
    """Return n doubles with random signs, significands and exponents in low .. high."""
    draw = random.Random(seed)
    return [math.ldexp(draw.choice((-1, 1)) * (0.5 + draw.random() / 2), draw.randint(low, high)) for _ in range(n)]


def test_sums_are_exact_at_every_exponent() -> None:
    for a, b in zip(floats(1, 2000, -1074, 1022), floats(2, 2000, -1074, 1022)):
        for first, second in ((a, b), (a, a * 1.5), (a, -a), (a, 0.0)):
            s, e = two_sum(first, second)
            assert Fraction(s) + Fraction(e) == Fraction(first) + Fraction(second)
            assert s == first + second
            s, e = two_diff(first, second)
            assert Fraction(s) + Fraction(e) == Fraction(first) - Fraction(second)
            larger, smaller = max(first, second, key=abs), min(first, second, key=abs)
            s, e = fast_two_sum(larger, smaller)
            assert Fraction(s) + Fraction(e) == Fraction(larger) + Fraction(smaller)


def test_products_are_exact_down_to_the_stated_bound() -> None:
    n_checked = 0
    for a, b in zip(floats(3, 6000, -1074, 1022), floats(4, 6000, -1074, 1022)):
        if 2.0**-967 <= abs(a * b) < math.inf:
            p, e = two_prod(a, b)
            assert p == a * b
            assert Fraction(p) + Fraction(e) == Fraction(a) * Fraction(b)
            n_checked += 1
    assert n_checked > 1000
    assert two_prod(0.0, 5e-324) == (0.0, 0.0)


def test_fma_equals_its_plain_twin() -> None:
    @njit
    def fused(a: float, b: float, c: float) -> float:
        result: float = fma(a, b, c)
        return result

    draw = random.Random(5)
    special = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        5e-324,
        -5e-324,
        1.7976931348623157e308,
        -1.7976931348623157e308,
        math.inf,
        -math.inf,
        math.nan,
    ]
    triples = [(a, b, c) for a in special for b in special for c in special]
    triples += list(zip(floats(6, 3000, -1074, 1022), floats(7, 3000, -1074, 1022), floats(8, 3000, -1074, 1022)))
    for a, b in zip(floats(9, 2000, -560, 500), floats(10, 2000, -560, 500)):
        triples += [(a, b, -a * b), (a, b, draw.choice((-1, 1)) * math.ulp(a * b) / 2)]
    for a, b, c in triples:
        compiled, plain = fused(a, b, c), plain_fma(a, b, c)
        if math.isnan(compiled):
            assert math.isnan(plain), (a, b, c)
        else:
            assert struct.pack("<d", compiled) == struct.pack("<d", plain), (a.hex(), b.hex(), c.hex())


def test_workspace_is_private_to_its_function() -> None:
    @njit
    def inner(seed: float) -> float:
        e = workspace(8)
        for i in range(8):
            e[i] = seed + i
        return e[7]

    @njit
    def outer(n: int) -> float:
        e = workspace(4)
        total = 0.0
        for i in range(n):
            e[i % 4] = 1.0
            total += inner(float(i)) + e[i % 4]
        return total

    assert outer(100000) == sum(i + 7.0 + 1.0 for i in range(100000))
    assert np.isfinite(outer(10))
