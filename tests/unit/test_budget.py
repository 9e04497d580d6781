"""Deadlines pass at their time, whatever else waits, and leave nothing behind."""

from __future__ import annotations

import time

import numpy as np
import pytest

from engine import budget
from engine.budget import Budget
from engine.errors import InvalidInputError


def test_each_deadline_passes_at_its_own_time() -> None:
    with Budget(deadline=1000) as long, Budget(deadline=0.01) as over:
        with Budget(deadline=0.05) as short:
            while not short.flag[0]:  # bound: the deadline
                time.sleep(0.001)
        assert over.flag[0] == 1
        assert long.flag[0] == 0
    with Budget(deadline=0.02) as over:
        pass
    time.sleep(0.1)
    assert over.flag[0] == 0


def test_deadlines_of_many_calls_take_no_memory() -> None:
    for _ in range(2000):
        with Budget(deadline=1000):
            pass
    assert len(budget._clock._heap) < 200


@pytest.mark.parametrize("deadline", [float("nan"), "1", True, [1.0], np.zeros(2)])
def test_a_deadline_that_is_no_time_is_refused(deadline: object) -> None:
    with pytest.raises(InvalidInputError, match="deadline must be a number of seconds"):
        Budget(deadline)  # type: ignore[arg-type] # the case


@pytest.mark.parametrize("deadline", [float("inf"), 1e300, None])
def test_a_deadline_beyond_all_clocks_is_none(deadline: float | None) -> None:
    with Budget(deadline) as budget:
        budget.check()
        assert budget.deadline is None
