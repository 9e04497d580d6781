"""Half-spaces against bodies given by vertices: the reference, and parts known by hand."""

from __future__ import annotations

import pytest

from engine import Aabb, HalfSpace, Polygon
from engine.collision.result import Parts, Work
from engine.collision.simple.against_half_space import half_space_body_parts
from tests.unit.collision.lattices import (
    COUNTS,
    Maker,
    aabb,
    check_pairs,
    half_space,
    polygon,
    polyhedron,
    surface,
    triangle,
)


@pytest.mark.parametrize(
    ("d", "first", "second"),
    [
        (2, half_space, aabb),
        (2, half_space, triangle),
        (2, half_space, polygon),
        (3, half_space, aabb),
        (3, half_space, polyhedron),
        (3, half_space, surface),
    ],
)
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


SQUARE = [[0, 0], [2, 0], [2, 2], [0, 2]]


@pytest.mark.parametrize(("offset", "expected"), [(1, (False, False)), (0, (False, True)), (-1, (True, True))])
def test_known_parts(offset: float, expected: tuple[bool, bool]) -> None:
    space, plane = HalfSpace([1, 0, 0], offset), HalfSpace([1, 0], offset)
    assert half_space_body_parts(space, Aabb([0, 0, 0], [2, 2, 2]), (None, None), Work()) == Parts(True, *expected)
    assert half_space_body_parts(plane, Polygon([SQUARE]), (None, None), Work()) == Parts(True, *expected)


def test_walls_that_cancel_do_not_stick_out() -> None:
    walled = Polygon([SQUARE, [[-3, 1], [-1, 1], [-2, 1]]])
    assert half_space_body_parts(HalfSpace([1, 0], 0), walled, (None, None), Work()) == Parts(True, False, True)
