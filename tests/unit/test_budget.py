"""Deadlines pass at their time, whatever else waits, and leave nothing behind."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest

from engine import budget
from engine.budget import Budget, Cancel, concatenated, polled
from engine.errors import CancelledError, InvalidInputError


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


def test_a_loop_ends_within_a_thousand_turns() -> None:
    cancel, taken = Cancel(), []
    with Budget(cancel=cancel):
        items = polled(range(10_000))
        taken += itertools.islice(items, 1_500)
        cancel.set()
        with pytest.raises(CancelledError):
            taken.extend(items)
    assert taken == list(range(2_048))
    assert list(polled("abc")) == ["a", "b", "c"]


@pytest.mark.parametrize("axis", [0, 1])
def test_arrays_are_put_one_after_another_by_parts(axis: int, monkeypatch: pytest.MonkeyPatch) -> None:
    draw = np.random.default_rng(axis)
    shapes = [(3, n, 2) if axis else (n, 3) for n in (5, 0, 1, 40, 7)]
    parts = [draw.random(shape) for shape in shapes]
    whole = np.concatenate(parts, axis)
    assert np.array_equal(concatenated(parts, axis), whole)
    monkeypatch.setattr(budget, "_AT_ONCE", 200)
    assert np.array_equal(concatenated(parts, axis), whole)
    cancel = Cancel()
    cancel.set()
    with pytest.raises(CancelledError), Budget(cancel=cancel):
        concatenated(parts, axis)
