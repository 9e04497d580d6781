"""Operations that are written our way give what Python gives."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numba import config as numba_config

from engine.jit import inline, kernel

pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the compiler is disabled")
KINDS = (np.float64, np.float32, np.int64, np.int32, np.int8, np.uint8, np.uint64, np.bool_)


@kernel
def item(values, index):
    return values[index]


@kernel
def item_of_two(values, row, column):
    return values[row, column]


@kernel
def item_of_three(values, plane, row, column):
    return values[plane, row, column]


@kernel
def take(values, places, found):
    for k in range(len(places)):
        found[k] = values[places[k]]


@kernel
def ends(values):
    return values[0], values[-1], values[len(values) - 1], values.size, values.shape[0]


@inline
def total_of(row):
    found = 0.0
    for index in range(len(row)):
        found += row[index]
    return found


@kernel
def sums(values, found):
    for index in range(len(values)):
        found[index] = total_of(values[index])


@kernel
def sums_of_planes(values, found):
    for plane in range(len(values)):
        for row in range(values.shape[1]):
            found[plane, row] = total_of(values[plane][row]) + total_of(values[plane, row])


@kernel
def put(values, index, value):
    values[index] = value


@kernel
def put_two(values, row, column, value):
    values[row, column] = value


@kernel
def ascend(stop, found):
    count = 0
    for k in range(stop):
        found[count] = k
        count += 1
    return count


@kernel
def between(start, stop, found):
    count = 0
    for k in range(start, stop):
        found[count] = k
        count += 1
    return count


@kernel
def by_three(start, stop, found):
    count = 0
    for k in range(start, stop, 3):
        found[count] = k
        count += 1
    return count


@kernel
def back_by_two(start, stop, found):
    count = 0
    for k in range(start, stop, -2):
        found[count] = k
        count += 1
    return count


@kernel
def by_any(start, stop, step, found):
    count = 0
    for k in range(start, stop, step):
        found[count] = k
        count += 1
    return count


@kernel
def nested(count, found):
    at = 0
    for i in range(count):
        for j in range(i, count):
            if j == 3:
                continue
            if j == 6:
                break
            found[at] = 10 * i + j
            at += 1
    return at


@kernel
def least_and_most(a, b, c):
    return min(a, b), max(a, b), min(a, b, c), max(c, b, a)


@pytest.mark.parametrize("kind", KINDS)
def test_items_are_what_numpy_says(kind: type) -> None:
    values = np.arange(60).astype(kind)
    cube, square = values.reshape(3, 4, 5), values.reshape(12, 5)
    assert [item(values, k) for k in range(-60, 60)] == [values[k] for k in range(-60, 60)]
    for row, column in itertools.product(range(-12, 12), range(-5, 5)):
        assert item_of_two(square, row, column) == square[row, column]
    for index in itertools.product(range(-3, 3), range(-4, 4), range(-5, 5)):
        assert item_of_three(cube, *index) == cube[index]
    assert ends(values) == (values[0], values[-1], values[-1], 60, 60)


@pytest.mark.parametrize("view", [lambda square: square[::2], lambda square: square.T, lambda square: square[:, 1:3]])
def test_items_of_views_are_what_numpy_says(view) -> None:
    values = view(np.arange(60.0).reshape(12, 5))
    for row, column in itertools.product(range(-len(values), len(values)), range(-2, 2)):
        assert item_of_two(values, row, column) == values[row, column]


def test_rows_are_arrays() -> None:
    values, found = np.random.default_rng(0).integers(-99, 99, (7, 3)).astype(float), np.zeros(7)
    sums(values, found)
    assert found.tolist() == values.sum(axis=1).tolist()
    cube, planes = np.random.default_rng(1).integers(-99, 99, (4, 7, 3)).astype(float), np.zeros((4, 7))
    sums_of_planes(cube, planes)
    assert planes.tolist() == (2 * cube.sum(axis=2)).tolist()


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_put_is_found_where_numpy_puts_it(kind: type) -> None:
    for index in range(-6, 6):
        ours, theirs = np.zeros(6, kind), np.zeros(6, kind)
        put(ours, index, kind(1))
        theirs[index] = 1
        assert ours.tolist() == theirs.tolist()
    for row, column in itertools.product(range(-2, 2), range(-3, 3)):
        ours, theirs = np.zeros((2, 3), kind), np.zeros((2, 3), kind)
        put_two(ours, row, column, kind(1))
        theirs[row, column] = 1
        assert ours.tolist() == theirs.tolist()


def test_numbers_are_cut_to_the_kind_of_the_array() -> None:
    small, single = np.zeros(1, np.int32), np.zeros(1, np.float32)
    put(small, 0, 2**40 + 5)
    put(single, 0, 0.1)
    assert small[0] == 5
    assert single[0] == np.float32(0.1)


def test_loops_go_where_ranges_go() -> None:
    found = np.zeros(100, np.int64)
    for start, stop in itertools.product(range(-9, 10), repeat=2):
        for loop, expected in (
            (between, range(start, stop)),
            (by_three, range(start, stop, 3)),
            (back_by_two, range(start, stop, -2)),
        ):
            assert found[: loop(start, stop, found)].tolist() == list(expected)
        assert found[: ascend(stop, found)].tolist() == list(range(stop))
        for step in (-7, -2, -1, 1, 2, 7):
            assert found[: by_any(start, stop, step, found)].tolist() == list(range(start, stop, step))
    expected = [10 * i + j for i in range(9) for j in range(i, min(9, 6) if i <= 6 else 9) if j != 3]
    assert found[: nested(9, found)].tolist() == expected


def test_a_step_of_zero_is_refused() -> None:
    with pytest.raises(ValueError, match="must not be zero"):
        by_any(0, 3, 0, np.zeros(3, np.int64))


def test_the_least_and_the_most_are_those_of_python() -> None:
    numbers = [0.0, -0.0, 1.0, -1.5, math.inf, -math.inf, math.nan, 5e-324]
    for a, b, c in itertools.product(numbers, repeat=3):
        expected = (min(a, b), max(a, b), min(a, b, c), max(c, b, a))
        assert np.array(least_and_most(a, b, c)).tobytes() == np.array(expected).tobytes()
    for a, b, c in itertools.product([0, 1, -1, 2**62, -(2**63)], repeat=3):
        assert least_and_most(a, b, c) == (min(a, b), max(a, b), min(a, b, c), max(c, b, a))
    assert least_and_most(1, 2.5, -1) == (1, 2.5, -1, 2.5)
    assert least_and_most(np.uint64(2**63), np.uint64(1), np.uint64(0)) == (1, 2**63, 0, 2**63)


@pytest.mark.parametrize("kind", [np.int8, np.int32, np.uint8, np.uint32, np.int64])
def test_an_index_of_any_kind(kind: type) -> None:
    values = np.arange(12.0)
    places = np.array([0, 3, 11] if np.iinfo(kind).min == 0 else [0, 3, 11, -1, -12], kind)
    found = np.empty(len(places))
    take(values, places, found)
    assert found.tolist() == values[places].tolist()
