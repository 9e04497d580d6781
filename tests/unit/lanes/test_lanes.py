"""Eight numbers as one value: compiled, lanes do what arrays of eight numbers do."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.jit import kernel
from engine.lanes.lanes import (
    N_LANES,
    bits_of,
    load,
    plain_bits,
    plain_load,
    plain_select,
    plain_spread,
    plain_store,
    select,
    spread,
    store,
)


@kernel
def compute(rows: Any, number: float) -> tuple[int, int]:
    a, b = load(rows, 0), load(rows, 1)
    is_greater = (a > b) & ~(a >= spread(number))
    is_less = (a < b) | (b <= spread(0.0))
    store(rows, 2, select(is_greater, a * b - spread(number), -a + abs(b)))
    return bits_of(is_greater), bits_of(is_less)


def expected(rows: Any, number: float) -> tuple[int, int]:
    a, b = plain_load(rows, 0), plain_load(rows, 1)
    is_greater = (a > b) & ~(a >= plain_spread(number))
    is_less = (a < b) | (b <= plain_spread(0.0))
    plain_store(rows, 2, plain_select(is_greater, a * b - plain_spread(number), -a + abs(b)))
    return plain_bits(is_greater), plain_bits(is_less)


def test_lanes_equal_their_twins() -> None:
    random = np.random.default_rng(1)
    special = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 1e-45, 3e38, 1.0], np.float32)
    for turn in range(40):
        rows = random.normal(size=(3, N_LANES)).astype(np.float32)
        rows[0] = special if turn % 4 == 0 else rows[0]
        rows[1] = random.permutation(special) if turn % 5 == 0 else rows[1]
        twin = rows.copy()
        with np.errstate(all="ignore"):
            assert compute(rows, 0.75) == expected(twin, 0.75)
        np.testing.assert_array_equal(rows, twin)
