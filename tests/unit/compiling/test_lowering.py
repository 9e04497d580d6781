"""Variables, branches and loops mean what they mean in Python."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numba import config as numba_config

from engine.jit import inline, kernel

pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the compiler is disabled")


@inline
def pair(a, b):
    return b, (a, a + b)


def exchange(count):
    a, b = 0, 1
    for _ in range(count):
        a, b = b, a + b
    return a, b


def set_late(values):
    """Set in one turn of a loop what the next one reads."""
    last, sums, seen = -1, 0, 0
    for k in range(len(values)):
        if k > 0 and values[k] > values[last]:
            seen += last
        last = k
        twice = 2 * values[k]
        if twice > 6:
            sums += twice
    return last, sums, seen


def branch(a, b):
    found = a
    if a > b:
        high, low = a, b
        found = high - low
    elif a == b:
        return 100, (a, b)
    else:
        high, low = b, a
    outcome = (high, low) if found > 1 else (low, high)
    while found < 9:
        found += high + 1
        if found == 7:
            break
    return found, outcome


def nested(a, b):
    whole = pair(a, b)
    inner = whole[1]
    for _ in range(2):
        inner = (inner[1], inner[0] + whole[0])
        whole = (inner[0], inner)
    return whole[0], whole[1][1], inner[0]


def walk(values):
    """Go round as long as something changes, with an else that is reached where nothing breaks."""
    rounds = 0
    while True:
        for k in range(len(values) - 1):
            if values[k] > values[k + 1]:
                values[k], values[k + 1] = values[k + 1], values[k]
                break
        else:
            break
        rounds += 1
    return rounds


COMPILED = {function: kernel(function) for function in (exchange, set_late, branch, nested, walk)}


@inline
def steps(values, factor):
    both = (values[0], factor)
    for k in range(len(values)):
        yield both[0] + both[1] * values[k]


@kernel
def sum_of_steps(values, factor):
    found = 0.0
    for value in steps(values, factor):
        found += value
    return found


def python_pair(a, b):
    return b, (a, a + b)


def test_values_that_change_places() -> None:
    for count in range(12):
        assert COMPILED[exchange](count) == exchange(count)


def test_what_one_turn_sets_and_the_next_reads() -> None:
    for values in itertools.product(range(5), repeat=4):
        assert COMPILED[set_late](np.array(values)) == set_late(values)
    assert COMPILED[set_late](np.zeros(0, np.int64)) == (-1, 0, 0)


def test_variables_set_on_some_ways() -> None:
    for a, b in itertools.product(range(6), repeat=2):
        assert COMPILED[branch](a, b) == branch(a, b)


def test_tuples_in_tuples(monkeypatch: pytest.MonkeyPatch) -> None:
    found = [COMPILED[nested](a, b) for a, b in itertools.product(range(-3, 4), repeat=2)]
    monkeypatch.setitem(globals(), "pair", python_pair)
    assert found == [nested(a, b) for a, b in itertools.product(range(-3, 4), repeat=2)]


def test_loops_that_end_in_the_middle() -> None:
    for values in itertools.permutations(range(5)):
        ours, theirs = np.array(values), list(values)
        assert COMPILED[walk](ours) == walk(theirs)
        assert ours.tolist() == theirs


def test_generators_remember_their_variables() -> None:
    assert sum_of_steps(np.array([1.0, 2.0, 3.0]), 10.0) == 11.0 + 21.0 + 31.0
