"""Rows as boxes: joined, exchanged and filled, compiled and in Python alike."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.jit import kernel
from engine.lanes.rows import exchange, fill, join


@kernel
def _work(rows: Any, others: Any) -> None:
    join(rows, 0, others, 1)
    exchange(rows, 1, 2)
    exchange(rows, 3, 3)
    fill(rows, 4, np.float32(np.inf))
    join(rows, 4, others, 0)


def test_rows_are_joined_exchanged_and_filled() -> None:
    random = np.random.default_rng(0)
    before, others = (random.normal(size=(n, 8)).astype(np.float32) for n in (5, 2))
    wanted = np.array([np.minimum(before[0], others[1]), before[2], before[1], before[3], others[0]])
    for work in (_work, getattr(_work, "py_func", _work)):
        rows = before.copy()
        work(rows, others)
        assert (rows == wanted).all()
