"""What everything stands on: direct calls, errors, the budget of a call."""

from __future__ import annotations

import itertools
import pickle
import re
import time
from typing import Any

import numpy as np
import pytest

from engine import errors
from engine.compiling.jit import entry_of, kernel
from engine.errors import CancelledError, InvalidInputError
from engine.running import budget
from engine.running.budget import Budget, Cancel, polled


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


# --- The exception tree is what its docstring draws, codes are unique, errors survive pickling ---


CLASSES = [value for value in vars(errors).values() if isinstance(value, type) and issubclass(value, Exception)]
LEAVES = [cls for cls in CLASSES if cls not in (errors.EngineError, errors.InvalidInputError)]


def test_the_docstring_lists_every_error_with_its_code() -> None:
    drawn = dict(re.findall(r"(\w+Error) +([a-z_]+)", errors.__doc__ or ""))
    assert drawn == {cls.__name__: cls.code for cls in LEAVES}


def test_codes_are_unique() -> None:
    codes = [cls.code for cls in CLASSES]
    assert len(set(codes)) == len(codes)


@pytest.mark.parametrize("cls", CLASSES)
def test_errors_survive_pickling(cls: type[errors.EngineError]) -> None:
    error = pickle.loads(pickle.dumps(cls("what broke", ("faces", 3))))
    assert (type(error), error.message, error.where) == (cls, "what broke", ("faces", 3))


def test_the_caller_can_put_the_outer_name_before_the_path() -> None:
    assert errors.NotClosedError("open", ("faces", 3)).at("solid").where == ("solid", "faces", 3)


# --- Deadlines pass at their time, whatever else waits, and leave nothing behind ---


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
