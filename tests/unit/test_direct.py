"""What calls a kernel directly calls that kernel."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.direct import entry_of
from engine.jit import kernel


@kernel
def doubled(values: Any, out: Any) -> None:
    for i in range(values.size):
        out[i] = 2.0 * values[i]


def test_the_same_answers_before_and_after_the_first_call_and_for_other_types() -> None:
    values, out = np.array([1.0, 1e308]), np.empty(2)
    for _ in range(3):
        entry_of(doubled)(values, out)
        assert out.tolist() == [2.0, np.inf]
    doubled(np.arange(2), out)
    assert out.tolist() == [0.0, 2.0]
