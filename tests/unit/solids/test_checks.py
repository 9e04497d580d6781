"""What is taken for numbers, and how a refusal names the element."""

from __future__ import annotations

import itertools
import math
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.errors import EngineError, InvalidArrayError, NotFiniteError, WrongDimensionError
from engine.solids.checks import as_number, as_point_groups, as_points, as_vector, digits, frozen, shown, spell


def refused(error: type[EngineError], function: Any, *arguments: Any) -> EngineError:
    with pytest.raises(error) as info:
        function(*arguments)
    assert spell(info.value.where) in str(info.value)
    return info.value


def test_spelling() -> None:
    assert spell(("points", 3, 1)) == "points[3][1]"
    assert spell(("operands", 0, "faces")) == "operands[0].faces"
    assert spell(()) == "the argument"
    assert digits([0.1, -2.0]) == "[0.1, -2.0]"


@pytest.mark.parametrize(
    "points",
    [
        [[1, 2], [3, 4]],
        ((1.0, 2.0), [3, 4.0]),
        np.array([[1, 2], [3, 4]], np.uint8),
        np.array([[1, 2], [3, 4]], ">f4"),
        np.array([[1, 3], [2, 4]], np.float16).T,
        [np.array([1.0, 2.0]), np.array([3, 4])],
        [[np.float32(1), np.int8(2)], [3, 4]],
        np.array([[1, 2], [3, 4]], np.longdouble),
        pytest.param(memoryview(np.array([[1.0, 2.0], [3.0, 4.0]])), id="memoryview"),
    ],
    ids=str,
)
def test_arrays_and_lists_of_numbers_are_taken(points: object) -> None:
    array = as_points(points, 2)
    assert array.dtype == np.float64
    assert array.dtype.isnative
    assert array.flags.c_contiguous
    assert array.tolist() == [[1.0, 2.0], [3.0, 4.0]]


def test_a_good_array_is_borrowed() -> None:
    array = np.zeros((5, 3))
    for dimension in (3, None):
        borrowed = as_points(array, dimension)
        assert np.shares_memory(borrowed, array)
        assert not borrowed.flags.writeable
    assert array.flags.writeable


@pytest.mark.parametrize("points", [[], (), np.zeros((0, 3)), np.zeros((0, 0)), np.array([])], ids=repr)
def test_no_points_are_welcome(points: object) -> None:
    assert as_points(points, 3).shape == (0, 3)
    assert as_point_groups([], 2, 3, ("segments",)).shape == (0, 2, 3)
    assert as_point_groups(np.zeros((0, 2, 3)), 2, 3, ("segments",)).shape == (0, 2, 3)


BAD_ITEMS = [True, np.True_, "1.5", None, 1j, [1.0], Decimal(1), Fraction(1, 2), b"1", {}, object()]


@pytest.mark.parametrize("item", BAD_ITEMS, ids=lambda item: type(item).__name__)
def test_what_is_no_number_is_refused_by_name(item: object) -> None:
    error = refused(InvalidArrayError, as_points, [[0.0, 0.0], [0.0, item]], 2)
    assert error.where == ("points", 1, 1)
    assert type(item).__name__ in str(error)
    refused(InvalidArrayError, as_number, item, ("radius",))


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((2, 2), bool),
        np.zeros((2, 2), complex),
        np.zeros((2, 2), object),
        np.full((2, 2), "1"),
        np.zeros((2, 2), "datetime64[s]"),
        np.ma.masked_array(np.zeros((2, 2)), True),
        "text",
        None,
        {"a": 1},
        {1.0, 2.0},
        (x for x in [[1.0, 2.0]]),
        5.0,
        np.zeros(2),
        np.zeros((2, 2, 2)),
        [1.0, 2.0],
        [[[1.0, 2.0]]],
    ],
    ids=lambda array: type(array).__name__,
)
def test_what_is_no_array_of_points_is_refused(array: object) -> None:
    assert refused(InvalidArrayError, as_points, array, 2).where[0] == "points"


def test_ragged_lists_are_refused_at_the_row() -> None:
    assert refused(WrongDimensionError, as_points, [[0, 0], [0, 0, 0]], None).where == ("points", 1)
    assert refused(InvalidArrayError, as_points, [[0, 0], [0, 0], [0]], 2).where == ("points", 2)
    assert refused(InvalidArrayError, as_points, [[0, 0], 5], 2).where == ("points", 1)
    assert refused(InvalidArrayError, as_point_groups, [[[0, 0], [1, 1]], [[0, 0]]], 2, 2, ("s",)).where == ("s", 1)
    error = refused(WrongDimensionError, as_point_groups, [[[0, 0], [1, 1]], [[0, 0], [0, 0, 0]]], 2, 2, ("s",))
    assert error.where == ("s", 1, 1)


def test_wrong_dimensions_are_refused() -> None:
    assert "2 numbers each, got 3" in str(refused(WrongDimensionError, as_points, np.zeros((4, 3)), 2))
    for n_columns in (0, 1, 4):
        refused(WrongDimensionError, as_points, np.zeros((2, n_columns)), None)
    refused(WrongDimensionError, as_points, np.zeros((0, 3)), 2)
    refused(WrongDimensionError, as_vector, [1.0], None, ("center",))
    refused(InvalidArrayError, as_point_groups, np.zeros((4, 3, 2)), 2, 2, ("segments",))
    refused(WrongDimensionError, as_point_groups, np.zeros((4, 2, 2)), 2, 3, ("segments",))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_not_finite_is_refused_at_the_element(value: float) -> None:
    for points in ([[0.0, 0.0], [value, 0.0]], np.array([[0.0, 0.0], [value, 0.0]]), np.float32([[0, 0], [value, 0]])):
        error = refused(NotFiniteError, as_points, points, 2)
        assert error.where == ("points", 1, 0)
        assert repr(value) in str(error)
    refused(NotFiniteError, as_number, value, ("offset",))
    if np.finfo(np.longdouble).max > 1e400 * np.longdouble(1):
        refused(NotFiniteError, as_points, np.array([[0, 0], [np.longdouble("1e400"), 0]]), 2)


@pytest.mark.parametrize("value", [2**53 + 1, -(2**53) - 1, 2**63 - 1, 10**400, -(10**23)])
def test_integers_that_no_float_equals_are_refused(value: int) -> None:
    error = refused(InvalidArrayError, as_points, [[0, 0], [1.5, value]], 2)
    assert error.where == ("points", 1, 1)
    assert "no float64 equals" in str(error)
    if abs(value) < 2**63:
        assert refused(InvalidArrayError, as_points, np.array([[0, 0], [0, value]]), 2).where == ("points", 1, 1)
    refused(InvalidArrayError, as_number, value, ("offset",))
    refused(InvalidArrayError, as_points, np.array([[2**64 - 1, 0]], np.uint64), 2)


def test_wide_integers_that_a_float_equals_are_taken() -> None:
    assert as_points([[2**53, -(2**60)], [10**22, 0]], 2).tolist() == [[2.0**53, -(2.0**60)], [1e22, 0.0]]
    assert as_points(np.array([[2**63]] * 2, np.uint64).reshape(1, 2), 2).tolist() == [[2.0**63] * 2]
    assert as_number(np.array(3), ("x",)) == 3.0


@pytest.mark.skipif(np.finfo(np.longdouble).nmant == 52, reason="long double is double here")
def test_wider_floats_must_be_doubles() -> None:
    third = np.longdouble(1) / 3
    assert refused(InvalidArrayError, as_points, np.array([[0, third]]), 2).where == ("points", 0, 1)
    refused(InvalidArrayError, as_number, third, ("x",))


def test_frozen_copies_and_drops_minus_zero() -> None:
    array = np.array([[-0.0, 1.0], [5e-324, -1.0]])
    copy = frozen(array)
    assert not np.signbit(copy[0, 0])
    assert copy[1, 0] == 5e-324
    assert not copy.flags.writeable
    assert not np.shares_memory(array, copy)
    for axis, order in itertools.product((0, 1), "CF"):
        assert frozen(np.asarray(np.flip(array, axis), order=order)).flags.c_contiguous


def test_what_cannot_be_printed_is_still_refused_by_name() -> None:
    deep: list[object] = []
    for _ in range(5000):
        deep = [deep]
    for item in (deep, 10**6000, [10**6000], np.zeros(3, object)):
        refused(InvalidArrayError, as_points, [[item, 0.0]], 2)
        assert len(shown(item)) <= 60
    assert shown([0.5, "a"]) == "[0.5, 'a']"
    assert len(shown([1.5] * 10**6)) <= 60
