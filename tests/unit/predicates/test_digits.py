"""Whole numbers of many digits against Python's integers."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import numpy as np

from engine.compiling.jit import kernel
from engine.predicates.digits import (
    BITS,
    MOST_OF_ROW,
    SLOT,
    nearest_quotient,
    negate,
    packed_numbers,
    sign_of,
    store_double,
    sum_products,
)

ONE, FREE, SUM, BELOW, ROWS = 8 * SLOT, 9 * SLOT, 12 * SLOT, 13 * SLOT, 14 * SLOT


@kernel
def put_all(heap: Any, numbers: Any) -> None:
    for i in range(numbers.size):
        store_double(heap, i * SLOT, numbers[i])


@kernel
def sum_signed(heap: Any, terms: Any, n_terms: int, c: int) -> tuple[bool, int]:
    is_made = sum_products(heap, terms, n_terms, c)
    return is_made, sign_of(heap, c) if is_made else 0


@kernel
def quotient(heap: Any, terms: Any, x: int, w: int) -> tuple[float, bool]:
    if sign_of(heap, w) < 0:
        negate(heap, w)
    return nearest_quotient(heap, terms, x, w, ONE, FREE)


def value(heap: Any, a: int) -> Fraction:
    digits = [int(heap[a + 2 + i]) for i in range(heap[a])]
    return sum((digit * Fraction(2) ** (BITS * (int(heap[a + 1]) + i)) for i, digit in enumerate(digits)), Fraction(0))


def fresh() -> tuple[Any, Any]:
    heap = np.zeros(24 * SLOT, np.int64)
    put_all(heap[ONE:], np.ones(1))
    return heap, np.zeros((4, 3), np.int64)


def test_sums_of_products_and_their_quotients_are_exact() -> None:
    rng = random.Random(1)
    for _ in range(400):
        heap, terms = fresh()
        kinds = [
            rng.uniform(-2, 2) * 2.0 ** rng.randint(-99, 99),
            rng.randint(-5, 5),
            0.0,
            -(2.0 ** rng.randint(-60, 60)),
        ]
        numbers = [float(rng.choice(kinds)) for _ in range(8)]
        put_all(heap, np.array(numbers))
        exact = [Fraction(x) for x in numbers]
        assert [value(heap, i * SLOT) for i in range(8)] == exact
        terms[:] = [[2 * i * SLOT, (2 * i + 1) * SLOT, (-1) ** i] for i in range(4)]
        total = sum((-1) ** i * exact[2 * i] * exact[2 * i + 1] for i in range(4))
        assert sum_signed(heap, terms, 4, SUM) == (True, (total > 0) - (total < 0))
        assert value(heap, SUM) == total
        terms[:2] = [[0, 2 * SLOT, 1], [SLOT, 3 * SLOT, 1]]
        sum_signed(heap, terms, 2, BELOW)
        below = abs(value(heap, BELOW))
        if below:
            found, is_known = quotient(heap, terms, SUM, BELOW)
            expected = total / value(heap, BELOW)
            assert value(heap, BELOW) == below
            assert (found, is_known) == (expected.numerator / expected.denominator, True)


def test_ties_go_to_even() -> None:
    rng = random.Random(2)
    for _ in range(400):
        heap, terms = fresh()
        w = rng.getrandbits(40) * 2 + 1
        x = rng.choice([-1, 1]) * (((1 << 53 | rng.getrandbits(53)) << 1) + rng.choice([0, 1, 1])) * w
        packed = packed_numbers([[x << rng.choice([0, 5, 40, 300]), w << rng.choice([0, 3, 500])]])
        assert packed is not None
        heap[ROWS : ROWS + packed[0].size] = packed[0]
        x_place, w_place = (packed[1] + ROWS)[0].tolist()
        expected = value(heap, x_place) / value(heap, w_place)
        assert quotient(heap, terms, x_place, w_place) == (expected.numerator / expected.denominator, True)


def test_what_is_too_long_is_refused() -> None:
    assert packed_numbers([[1, (1 << BITS * MOST_OF_ROW) - 1]]) is not None
    assert packed_numbers([[1, 1 << BITS * MOST_OF_ROW * 9]]) is not None  # one digit and zeros below it
    assert packed_numbers([[1, (1 << BITS * MOST_OF_ROW) + 1]]) is None
    heap, terms = fresh()
    put_all(heap, np.array([1e300, 1e300, 1e-300, 1e-300]))
    terms[:2] = [[0, SLOT, 1], [2 * SLOT, 3 * SLOT, 1]]
    assert [sum_signed(heap, terms, n, SUM)[0] for n in (1, 2)] == [True, False]


def test_numbers_of_python_are_packed() -> None:
    numbers = [0, 1, -1, -(1 << BITS), -(1 << 2 * BITS) + 1, (1 << 90) - 7, -(3 << 200)]
    packed = packed_numbers([numbers])
    assert packed is not None
    assert [value(packed[0], place) for place in packed[1][0]] == numbers
