"""Scenes times powers of two: exact, or not done."""

from __future__ import annotations

import numpy as np

from engine.predicates.scaling import balanced_rows, exponent_of, scaled_back, shifted


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
