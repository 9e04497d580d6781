"""What compiled functions hand over to each other, and return, arrives; and so do exceptions."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba import config as numba_config

from engine.jit import called, inline, kernel, merged

pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the compiler is disabled")


class Table(NamedTuple):
    numbers: np.ndarray
    flags: np.ndarray
    size: int


class Both(NamedTuple):
    first: Table
    second: Table
    is_known: bool


def probe(table, k):
    return table.numbers[k, 1] + table.flags[-1] + table.size + table.numbers.strides[0] + table.numbers.itemsize


def many(both, k):
    return both.first.numbers[k, 0] > 2.0, (both.second.size, both.is_known, np.int32(7)), both.first.numbers.shape[0]


probe_inline, probe_called, probe_merged = inline(probe), called(probe), merged(probe)
many_inline, many_called = inline(many), called(many)


@kernel
def ask(numbers, flags, k):
    table = Table(numbers, flags, 40)
    both = Both(table, Table(numbers, flags, k), k > 1)
    inner = (probe_inline(table, k), probe_called(both.first, k), probe_merged(both.second, k))
    return inner, many_inline(both, k), many_called(both, k)


@inline
def checked(value):
    if value < 0:
        raise ValueError("below zero")
    return value + 1


@called
def checked_twice(value):
    return checked(checked(value) - 3)


@kernel
def ask_checked(value):
    total = 0
    for k in range(3):
        total += checked_twice(value - k)
    return total


@inline
def divided(a, b):
    return a // b, a % b


@kernel
def ask_divided(a, b):
    return divided(a, b)


@numba.njit
def outside(numbers, flags, k):
    return probe_inline(Table(numbers, flags, 40), k) + checked(k)


@pytest.mark.parametrize("kind", [np.float64, np.int32])
@pytest.mark.parametrize("is_plain", [True, False])
def test_tables_and_tuples_arrive_whole(kind: type, is_plain: bool) -> None:
    numbers = np.arange(12).astype(kind).reshape(4, 3)
    numbers = numbers if is_plain else np.asfortranarray(numbers)
    flags = np.array([False, True])
    for k in range(-4, 4):
        table = Table(numbers, flags, 40)
        both = Both(table, Table(numbers, flags, k), k > 1)
        inner = (probe(table, k), probe(both.first, k), probe(both.second, k))
        assert ask(numbers, flags, k) == (inner, many(both, k), many(both, k))


def test_an_exception_passes_all_that_were_called() -> None:
    assert ask_checked(5) == 4 + 3 + 2
    for value in (-1, 1, 2, 3):
        with pytest.raises(ValueError, match="below zero"):
            ask_checked(value)


def test_whole_numbers_divide_as_in_numpy() -> None:
    for a, b in ((7, 2), (-7, 2), (7, -2), (-7, -2), (7, 0)):
        expected = (a // b, a % b) if b else (0, 0)
        assert ask_divided(a, b) == expected


def test_what_others_compile_may_call_ours() -> None:
    numbers, flags = np.arange(12.0).reshape(4, 3), np.array([True])
    assert outside(numbers, flags, 2) == probe(Table(numbers, flags, 40), 2) + 3
    with pytest.raises(ValueError, match="below zero"):
        outside(numbers, flags, -1)
