"""Quotients and roots of integers as the nearest doubles."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np

from engine.predicates.rational import common_integers, nearest, nearest_with_root


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
