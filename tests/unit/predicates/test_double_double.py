"""Double-double operations against Fractions: within their stated bounds; no rounding is accepted that is not sure."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.compiling.jit import kernel
from engine.predicates.error_free import (
    U2,
    dd_add,
    dd_div,
    dd_mul,
    dd_scale,
    dd_sub,
    is_correctly_rounded,
)


@kernel
def apply_all(a: Any, b: Any, out: Any) -> None:
    """Fill out[k] with (h, l) of operation k for each pair; rows of `a` and `b` are (h, l)."""
    for i in range(a.shape[0]):
        ah, al, bh, bl = a[i, 0], a[i, 1], b[i, 0], b[i, 1]
        out[0, i, 0], out[0, i, 1] = dd_add(ah, al, bh, bl)
        out[1, i, 0], out[1, i, 1] = dd_sub(ah, al, bh, bl)
        out[2, i, 0], out[2, i, 1] = dd_mul(ah, al, bh, bl)
        out[3, i, 0], out[3, i, 1] = dd_scale(ah, al, bh)
        out[4, i, 0], out[4, i, 1] = dd_div(ah, al, bh, bl)


EXACT: list[tuple[Callable[[Fraction, Fraction, Fraction], Fraction], int]] = [
    (lambda a, b, bh: a + b, 4),
    (lambda a, b, bh: a - b, 4),
    (lambda a, b, bh: a * b, 5),
    (lambda a, b, bh: a * bh, 2),
    (lambda a, b, bh: a / b, 16),
]


def pairs(rng: np.random.Generator, n: int) -> Any:
    """Return normalised pairs of many sizes; about a third have no low part, or a half ulp of it."""
    high = rng.uniform(1, 2, n) * 2.0 ** rng.integers(-30, 30, n) * rng.choice([-1, 1], n)
    low = np.spacing(high) * rng.choice([0.0, 0.5, 0.4999, 2.0**-20], n) * rng.uniform(-1, 1, n)
    return np.stack([high, np.where(high + low == high, low, 0.0)], axis=1)


def test_operations_keep_their_bounds(pytestconfig: pytest.Config) -> None:
    rng = np.random.default_rng(1)
    n = 50_000 if pytestconfig.getoption("--full") else 2_000
    a, b = pairs(rng, n), pairs(rng, n)
    b[: n // 4] = -a[: n // 4] * (1 + rng.integers(-2, 3, (n // 4, 1)) * 2.0**-52)  # sums that cancel
    b[:, 1] = np.where(b[:, 0] + b[:, 1] == b[:, 0], b[:, 1], 0.0)
    out = np.empty((5, n, 2))
    apply_all(a, b, out)
    assert (out[..., 0] + out[..., 1] == out[..., 0]).all(), "results are normalised"
    unit = Fraction(U2)
    for i in range(n):
        exact_a, exact_b = (Fraction(x[i, 0]) + Fraction(x[i, 1]) for x in (a, b))
        for k, (operation, bound) in enumerate(EXACT):
            exact = operation(exact_a, exact_b, Fraction(b[i, 0]))
            assert abs(Fraction(out[k, i, 0]) + Fraction(out[k, i, 1]) - exact) <= bound * unit * abs(exact), (k, i)


def test_rounding_is_sure_only_where_both_ends_round_alike() -> None:
    assert is_correctly_rounded(1.0, 0.0, 0.0)
    assert is_correctly_rounded(1.0, 1e-20, 1e-25)
    assert not is_correctly_rounded(1.0, 2.0**-53, 1e-25), "a tie"
    assert not is_correctly_rounded(0.0, 0.0, 1e-300), "zero is only sure without any bound"
    assert not is_correctly_rounded(math.nan, 0.0, 0.0)
    assert not is_correctly_rounded(1.0, 0.0, math.nan)


def test_sure_roundings_hold_for_every_number_within_the_bound() -> None:
    rng = np.random.default_rng(2)
    numbers = pairs(rng, 3_000)
    for h, low in numbers.tolist():
        bound = abs(h) * 2.0 ** -int(rng.integers(54, 100))
        if is_correctly_rounded(h, low, bound + 2 * U2 * abs(h)):
            value = Fraction(h) + Fraction(low)
            for number in (value - Fraction(bound), value + Fraction(bound)):
                assert number.numerator / number.denominator == h + low
