"""Runs of numbers are copied to their place and nowhere else; asking for a line changes nothing, beyond the end too."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.jit import kernel
from engine.lanes.lanes import move, prefetch


@kernel
def copy(target: Any, at: int, source: Any, first: int, n: int) -> None:
    prefetch(source, first)
    prefetch(source, 10**6)
    move(target, at, source, first, n)


def test_runs_are_copied() -> None:
    source = np.array([np.nan, -0.0, 5e-324, np.inf, 1.0, 2.0])
    for at, first, n in ((0, 0, 6), (2, 1, 3), (5, 5, 0), (4, 4, 2)):
        target = np.full(6, 7.0)
        copy(target, at, source, first, n)
        expected = np.full(6, 7.0)
        expected[at : at + n] = source[first : first + n]
        assert target.tobytes() == expected.tobytes()
