"""Exact points: union of equals, order, nearest doubles, extremes of the exponent range."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.arrangement.nodes import NodeTable, float_nodes, nearest_quotient, rational_nodes, reduced
from engine.errors import NotRepresentableError

TINY, HUGE = 5e-324, 1.7976931348623157e308


@pytest.mark.parametrize(
    "rows", [[(0.1, -0.2), (3.0, 4.5)], [(1e300, TINY), (-HUGE, 1.0)], [(2.0**80, 2.0**90)], [(0, 0)]]
)
def test_float_nodes_hold_the_floats_exactly(rows: list[tuple[float, float]]) -> None:
    nodes, numbers = float_nodes(np.array(rows, float))
    for row, number in zip(rows, numbers, strict=True):
        assert nodes.exact(number) == (Fraction(row[0]), Fraction(row[1]))
        assert (nodes.xs[number], nodes.ys[number]) == row
        assert nodes.displacement(number) == 0.0
    assert nodes.all_floats


def test_equal_points_are_one_node() -> None:
    nodes, numbers = float_nodes(np.array([(0.0, 1.0), (-0.0, 1.0), (1.0, 0.0)]))
    assert numbers == [0, 0, 1]
    nodes, numbers = rational_nodes([(Fraction(1, 3), 2), (Fraction(2, 6), 2.0)])
    assert numbers == [0, 0]
    assert not nodes.all_floats
    assert 0.0 < nodes.displacement(0) <= 2.0**-55


def test_order_is_exact_where_the_doubles_tie() -> None:
    third, other = Fraction(1, 3), Fraction(1, 3) + Fraction(1, 10**40)
    nodes, (a, b, c) = rational_nodes([(third, 0), (other, -5), (third, Fraction(-1, 10**400))])
    assert nodes.xs[a] == nodes.xs[b]
    assert nodes.compare(a, b) == -1
    assert nodes.compare(b, a) == 1
    assert nodes.compare(c, a) == -1
    assert nodes.compare(a, a) == 0


def test_points_stay_within_their_table_at_any_exponent() -> None:
    for exponent in (-1074, 0, 900):
        nodes = NodeTable(exponent)
        number = nodes.add(reduced(-6, 3, -9))
        assert nodes.points[number] == (2, -1, 3)
        assert nodes.exact(number) == (
            Fraction(2, 3) * Fraction(2) ** exponent,
            Fraction(-1, 3) * Fraction(2) ** exponent,
        )


def test_displacement_is_a_tight_bound() -> None:
    nodes, (third, tiny, whole) = rational_nodes([(Fraction(1, 3), 1), (Fraction(1, 10**400), 0), (2, 3)])
    error = abs(Fraction(1, 3) - Fraction(1 / 3))
    assert error <= nodes.displacement(third) <= error * (1 + Fraction(1, 2**50))
    assert 0.0 < nodes.displacement(tiny) <= 4 * TINY
    assert nodes.displacement(whole) == 0.0


def test_nearest_quotient_rounds_once_and_refuses_overflow() -> None:
    assert nearest_quotient(1, 3) == 1 / 3
    assert nearest_quotient(1, 2**1075) == 0.0  # tie to even
    assert nearest_quotient(3, 2**1076) == TINY
    assert str(nearest_quotient(-1, 10**400)) == "0.0"
    with pytest.raises(NotRepresentableError, match="beyond the largest"):
        nearest_quotient(2**1024, 1)
