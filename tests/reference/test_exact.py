"""Rounding to the nearest double, with and without a root."""

from __future__ import annotations

import math
import random
from decimal import Decimal, localcontext

import pytest

from tests.reference.exact import (
    Q,
    nearest_double,
    nearest_double_with_root,
    q,
    sign_with_root,
    smallest_double_with_square_at_least,
    solve,
)


def test_nearest_double() -> None:
    assert nearest_double(Q(1, 3)) == 1 / 3
    assert nearest_double(q(5e-324) / 2) == 0.0
    assert nearest_double(q(5e-324) * 3 / 4) == 5e-324
    assert math.copysign(1.0, nearest_double(-q(5e-324) / 4)) == 1.0
    assert nearest_double(Q(2**53 + 1)) == 2.0**53
    with pytest.raises(OverflowError):
        nearest_double(Q(2**1024))


def test_roots_against_decimals() -> None:
    source = random.Random(3)
    with localcontext() as context:
        context.prec = 400
        for _ in range(200):
            a, b, c = (source.uniform(-1, 1) * 10.0 ** source.randint(-30, 30) for _ in range(3))
            expected = float(Decimal(a) + Decimal(b) * Decimal(abs(c)).sqrt())
            assert nearest_double_with_root(q(a), q(b), q(abs(c))) == expected
            assert sign_with_root(q(a), q(b), q(abs(c))) == (expected > 0) - (expected < 0)


def test_root_that_is_rational_ties_to_even() -> None:
    assert nearest_double_with_root(Q(2**53 - 2), Q(1), Q(9)) == 2.0**53


def test_root_at_the_end_of_the_range() -> None:
    largest = 1.7976931348623157e308
    assert nearest_double_with_root(q(largest), Q(1, 2), Q(2)) == largest
    assert nearest_double_with_root(-q(largest), Q(-1, 2), Q(2)) == -largest


def test_smallest_radius() -> None:
    assert smallest_double_with_square_at_least(Q(4)) == 2.0
    r = smallest_double_with_square_at_least(Q(2))
    assert q(r) ** 2 >= 2 > q(math.nextafter(r, 0.0)) ** 2
    assert smallest_double_with_square_at_least(q(5e-324)) ** 2 <= 5e-324


def test_solve() -> None:
    assert solve([(Q(2), Q(1)), (Q(0), Q(4))], (Q(5), Q(4))) == (2, 1)
    assert solve([(Q(1), Q(2)), (Q(2), Q(4))], (Q(1), Q(1))) is None
