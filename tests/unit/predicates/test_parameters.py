"""Order of two plane crossings along a segment, against Fractions."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.compiling.jit import kernel
from engine.predicates.error_free import workspace
from engine.predicates.expansion import grow
from engine.predicates.parameters import (
    compare_differences,
    compare_products,
    compare_ratios_filter,
)
from engine.types import UNDECIDED


@kernel
def compare_all(rows: Any, exact: Any) -> None:
    """rows (n, 8): a0, a1, b0, b1, c0, c1, d0, d1; signs of (a0 - a1)(b0 - b1) - (c0 - c1)(d0 - d1)."""
    for i in range(rows.shape[0]):
        a0, a1, b0, b1, c0, c1, d0, d1 = rows[i]
        e = workspace(16)
        exact[i] = compare_differences(a0, a1, b0, b1, c0, c1, d0, d1, e)


@kernel
def compare_sums(rows: Any, exact: Any, rough: Any) -> None:
    """The same with |.| of each product, each factor a sum of two doubles given as an expansion or within a bound."""
    for i in range(rows.shape[0]):
        a0, a1, b0, b1, c0, c1, d0, d1 = rows[i]
        a, b, c, d, e = workspace(2), workspace(2), workspace(2), workspace(2), workspace(16)
        na, nb = grow(a, grow(a, 0, a0), -a1), grow(b, grow(b, 0, b0), -b1)
        nc, nd = grow(c, grow(c, 0, c0), -c1), grow(d, grow(d, 0, d0), -d1)
        exact[i] = compare_products(a, na, b, nb, c, nc, d, nd, e)
        u = 2.0**-52
        rough[i] = compare_ratios_filter(
            a0 - a1, u * abs(a0 - a1), b0 - b1, u * abs(b0 - b1), c0 - c1, u * abs(c0 - c1), d0 - d1, u * abs(d0 - d1)
        )


def rows_of(rng: np.random.Generator, n: int) -> Any:
    """Return lattice, random, proportional and nudged rows."""
    lattice = rng.integers(-4, 5, (n, 8)).astype(float)
    free = rng.uniform(-1, 1, (n, 8)) * 10.0 ** rng.integers(-20, 20, (n, 8))
    same = rng.uniform(-1, 1, (n, 8))
    same[:, 4:] = same[:, :4]
    swapped = same.copy()
    swapped[:, 4:] = same[:, [2, 3, 0, 1]]
    far = lattice / 3 + 1e9
    rows = np.concatenate([lattice, free, same, swapped, far])
    nudges = rng.integers(-2, 3, rows.shape) * (rng.random(rows.shape) < 0.2)
    return np.concatenate([rows, rows + np.where(rows == 0.0, 0.0, nudges * np.spacing(rows))])


def test_signs_are_exact(pytestconfig: pytest.Config) -> None:
    rng = np.random.default_rng(3)
    rows = rows_of(rng, 20_000 if pytestconfig.getoption("--full") else 400)
    signed, absolute, ratio = (np.empty(len(rows), np.int64) for _ in range(3))
    compare_all(rows, signed)
    compare_sums(rows, absolute, ratio)
    for i, row in enumerate(rows.tolist()):
        a, b, c, d = (Fraction(row[k]) - Fraction(row[k + 1]) for k in (0, 2, 4, 6))
        expected, of_sizes = a * b - c * d, abs(a * b) - abs(c * d)
        assert signed[i] == (expected > 0) - (expected < 0), row
        assert absolute[i] == (of_sizes > 0) - (of_sizes < 0), row
        assert ratio[i] in (UNDECIDED, absolute[i]), row
    assert (signed == 0).sum() > len(rows) // 20, "the sample holds ties"
    assert (ratio != UNDECIDED).sum() > len(rows) // 4, "the filter is of use"


@pytest.mark.parametrize("value", [1e300, 1e-300, 5e-324, np.inf, np.nan])
def test_filters_are_unsure_where_they_must_be(value: float) -> None:
    with np.errstate(all="ignore"):
        assert compare_ratios_filter(value, 0.0, value, 0.0, value, 0.0, value, 0.0) == UNDECIDED
        assert compare_ratios_filter(value, np.inf, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0) == UNDECIDED
