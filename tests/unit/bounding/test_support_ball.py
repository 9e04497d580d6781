"""The smallest ball of a handful of integer points."""

from __future__ import annotations

from fractions import Fraction

import pytest

from engine.bounding.support_ball import smallest_ball


def test_ball_of_two_and_of_three_points() -> None:
    ball = smallest_ball([(4, 0), (0, 0), (2, 1)], 0)
    assert ball.support == (0, 1)
    assert [Fraction(x, ball.scale) for x in ball.center] == [2, 0]
    ball = smallest_ball([(4, 0), (0, 0), (2, 3)], 2)
    assert sorted(ball.support) == [0, 1, 2]
    assert Fraction(ball.square, ball.scale**2) == Fraction(13, 6) ** 2


def test_dependent_points_need_a_smaller_support() -> None:
    ball = smallest_ball([(0, 0, 0), (1, 1, 1), (2, 2, 2), (3, 3, 3)], 3)
    assert sorted(ball.support) == [0, 3]


def test_a_point_that_is_not_on_the_surface_is_noticed() -> None:
    with pytest.raises(AssertionError):
        smallest_ball([(0, 0), (4, 0), (2, 0)], 2)
