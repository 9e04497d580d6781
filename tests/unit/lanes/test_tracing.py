"""Functions on lanes, written once: what they are handed, in Python and by compiled code."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import config as numba_config
from numba.core.errors import TypingError

from engine.jit import kernel
from engine.lanes.lanes import load, store
from engine.lanes.tracing import Number, Rows, Triple, traced


@traced
def turned(rows: Rows, item: int, angle: Number, middle: Triple) -> None:
    """Set row `item` to itself times a number plus the sum of three."""
    store(rows, item, load(rows, item) * angle + (middle[0] + middle[1] + middle[2]))


@kernel
def turn(rows: Any, item: Any, angle: Any, middle: Any) -> None:
    turned(rows, item, angle, (middle[0], middle[1], middle[2]))


def test_numbers_are_rounded_to_float32_on_the_way_in() -> None:
    start = np.arange(24, dtype=np.float32).reshape(3, 8)
    compiled, plain = start.copy(), start.copy()
    turn(compiled, 1, 0.1, np.array([0.1, 0.2, 0.3]))
    turned(plain, 1, 0.1, (0.1, 0.2, 0.3))
    total = np.float32(0.1) + np.float32(0.2) + np.float32(0.3)
    assert plain[1].tolist() == (start[1] * np.float32(0.1) + total).tolist()
    assert compiled.tolist() == plain.tolist()
    assert (plain[::2] == start[::2]).all()


@pytest.mark.skipif(numba_config.DISABLE_JIT, reason="types are looked at by the compiler")
@pytest.mark.parametrize("rows", [np.zeros((3, 8)), np.zeros((3, 16), np.float32)[:, ::2], 1.0])
def test_rows_are_contiguous_float32(rows: Any) -> None:
    with pytest.raises(TypingError):
        turn(rows, 0, 1.0, np.zeros(3))
