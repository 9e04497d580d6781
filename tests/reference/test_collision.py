"""The relation reference against answers by hand."""

from __future__ import annotations

import pytest

from tests.reference.collision import (
    DISJOINT,
    FIRST_INSIDE_SECOND,
    OVERLAPPING,
    SECOND_INSIDE_FIRST,
    SWAPPED,
    TOUCHING,
    relation,
)
from tests.reference.shapes import (
    Solid,
    aabb,
    box,
    half_space,
    polygon,
    rectangle,
    reversed_faces,
    sphere,
    tetrahedron,
    union_of,
)

TINY = 5e-324
UNIT = box((0, 0, 0), (1, 1, 1))
SQUARE = rectangle((0, 0), (4, 4))
FRAME = polygon([[0, 0], [6, 0], [6, 6], [0, 6]], [[2, 2], [4, 2], [4, 4], [2, 4]])
SHELL = union_of(box((0, 0, 0), (6, 6, 6)), reversed_faces(box((2, 2, 2), (4, 4, 4))))
DOUBLED = union_of(UNIT, reversed_faces(UNIT))
SURFACE = {"type": "surface", "vertices": [[0.25, 0.25, -1], [0.75, 0.25, -1], [0.5, 0.5, 3]], "faces": [[0, 1, 2]]}
SMALL_SURFACE = {**SURFACE, "vertices": [[0.25, 0.25, 0.5], [0.75, 0.25, 0.5], [0.5, 0.5, 0.75]]}


@pytest.mark.some(24)
@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (UNIT, box((2, 0, 0), (3, 1, 1)), DISJOINT),
        (UNIT, box((1 + 2**-52, 0, 0), (3, 1, 1)), DISJOINT),
        (UNIT, box((1, 0, 0), (3, 1, 1)), TOUCHING),
        (UNIT, box((1, 1, 1), (2, 2, 2)), TOUCHING),
        (UNIT, box((1 - 2**-53, 0, 0), (3, 1, 1)), OVERLAPPING),
        (UNIT, UNIT, OVERLAPPING),
        (UNIT, box((-1, -1, -1), (2, 2, 2)), FIRST_INSIDE_SECOND),
        (UNIT, box((-1, -1, 0), (2, 2, 2)), OVERLAPPING),
        (UNIT, box((0.25, 0.25, -1), (0.75, 0.75, 2)), OVERLAPPING),  # only edges pierce faces
        (SHELL, box((2.5, 2.5, 2.5), (3, 3, 3)), DISJOINT),  # in the cavity
        (SHELL, box((2, 2, 2), (4, 4, 4)), TOUCHING),  # fills the cavity
        (SHELL, box((0.5, 0.5, 0.5), (1, 1, 1)), SECOND_INSIDE_FIRST),
        (SHELL, box((1, 1, 1), (5, 5, 5)), OVERLAPPING),  # around the cavity, no contact
        (DOUBLED, UNIT, TOUCHING),  # every face cancels: no interior
        (DOUBLED, box((-1, -1, -1), (2, 2, 2)), FIRST_INSIDE_SECOND),
        (SURFACE, UNIT, TOUCHING),
        (SMALL_SURFACE, UNIT, FIRST_INSIDE_SECOND),
        (SMALL_SURFACE, SURFACE, TOUCHING),
        (aabb((0, 0, 1), (1, 1, 1)), UNIT, TOUCHING),
        (aabb((0.25, 0.25, 0.5), (0.75, 0.75, 0.5)), UNIT, FIRST_INSIDE_SECOND),
        (aabb((0, 0, 0.5), (1, 1, 0.5)), UNIT, TOUCHING),
        (tetrahedron((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)), UNIT, OVERLAPPING),
        (tetrahedron((0, 0, 0), (-1, 0, 0), (0, -1, 0), (0, 0, -1)), UNIT, TOUCHING),
        (SQUARE, rectangle((4, 4), (5, 5)), TOUCHING),
        (SQUARE, rectangle((4 + 2**-50, 4), (5, 5)), DISJOINT),
        (FRAME, rectangle((2, 2), (4, 4)), TOUCHING),
        (FRAME, rectangle((2.5, 2.5), (3, 3)), DISJOINT),
        (FRAME, rectangle((1, 1), (5, 5)), OVERLAPPING),
        (FRAME, rectangle((0.5, 0.5), (1, 1)), SECOND_INSIDE_FIRST),
        (polygon([[0, 0], [4, 0], [0, 0], [0, 4]]), SQUARE, TOUCHING),  # a spike and no area
        (sphere((0, 0, 0), 1), sphere((3, 0, 0), 2), TOUCHING),
        (sphere((0, 0, 0), 1), sphere((3, 0, 0), 2 - 2**-51), DISJOINT),
        (sphere((0, 0, 0), 1), sphere((0.5, 0, 0), 0.25), SECOND_INSIDE_FIRST),
        (sphere((0, 0, 0), 1), sphere((0.5, 0, 0), 0.5), OVERLAPPING),  # inside, from within touching
        (sphere((0, 0, 0), 0), sphere((0, 0, 0), 0), TOUCHING),
        (sphere((0, 0, 0), 0), sphere((0, 0, 0), TINY), FIRST_INSIDE_SECOND),
        (sphere((2, 0.5, 0.5), 1), UNIT, TOUCHING),
        (sphere((1.5, 0.5, 0.5), 1), UNIT, OVERLAPPING),
        (sphere((0.5, 0.5, 0.5), 0.25), UNIT, FIRST_INSIDE_SECOND),
        (sphere((0.5, 0.5, 0.5), 0.5), UNIT, OVERLAPPING),
        (sphere((0.5, 0.5, 0.5), 1), UNIT, SECOND_INSIDE_FIRST),
        (sphere((4, 5, 1), 3), UNIT, DISJOINT),
        (sphere((4, 5, 1), 5), UNIT, TOUCHING),  # 3-4-5 to the edge
        (sphere((0.5, 0.5, 0), 0.5), SURFACE, TOUCHING),
        (sphere((1, 0), 1), SQUARE, OVERLAPPING),
        (sphere((-1, 2), 1), SQUARE, TOUCHING),
        (sphere((7, 8), 5), SQUARE, TOUCHING),
        (sphere((2, 2), 1), SQUARE, FIRST_INSIDE_SECOND),
        (half_space((0, 0, 1), 0), UNIT, OVERLAPPING),
        (half_space((0, 0, 1), TINY), UNIT, SECOND_INSIDE_FIRST),
        (half_space((0, 0, 1), -1), UNIT, TOUCHING),
        (half_space((0, 0, 1), -1), SURFACE, TOUCHING),
        (half_space((1, 1, 1), -3), UNIT, TOUCHING),
        (half_space((1, 1, 1), -2.9), UNIT, OVERLAPPING),
        (half_space((1, 1), -9), SQUARE, DISJOINT),
        (half_space((1, 1), -7), SQUARE, OVERLAPPING),
        (half_space((3, 4), -5), sphere((0, 0), 1), TOUCHING),
        (half_space((3, 4), 5), sphere((0, 0), 1), OVERLAPPING),
        (half_space((3, 4), 6), sphere((0, 0), 1), SECOND_INSIDE_FIRST),
        (half_space((1, 0), 0), half_space((-2, 0), 0), TOUCHING),
        (half_space((1, 0), 0), half_space((-2, 0), -1), DISJOINT),
        (half_space((1, 0), 0), half_space((-2, 1), -1), OVERLAPPING),
        (half_space((1, 0), 0), half_space((2, 0), 1), FIRST_INSIDE_SECOND),
        (half_space((1, 0), 3), half_space((2, 0), 6), OVERLAPPING),
    ],
)
def test_by_hand(first: Solid, second: Solid, expected: int) -> None:
    assert relation(first, second) == expected
    assert relation(second, first) == SWAPPED[expected]


def test_one_pose_for_both_changes_nothing() -> None:
    turn = {"rotation": [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], "translation": [0.1, 1e9, -3.3]}
    for other in (box((1, 0, 0), (3, 1, 1)), box((0.25, 0.25, -1), (0.75, 0.75, 2)), box((2, 2, 2), (3, 3, 3))):
        assert relation(UNIT, other, turn, turn) == relation(UNIT, other)
    assert relation(half_space((0, 0, 1), -1), UNIT, turn, turn) == TOUCHING


def test_a_pose_moves_the_second() -> None:
    shift = {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [1, 0, 0]}
    assert relation(UNIT, UNIT, None, shift) == TOUCHING
    assert relation(UNIT, sphere((0, 0.5, 0.5), 0.5), None, shift) == OVERLAPPING
