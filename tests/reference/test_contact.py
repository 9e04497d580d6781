"""The parts the collision reference stands on, against answers by hand and against each other."""

from __future__ import annotations

import random

import pytest

from tests.reference.contact import (
    part_in_triangle,
    planar_overlap,
    segments_meet,
    squared_distance_to_triangle,
    triangles_meet,
)
from tests.reference.exact import Q, along, square, sub, vector


def points(*rows: tuple[float, ...]) -> tuple:
    return tuple(vector(row) for row in rows)


BASE = points((0, 0, 0), (4, 0, 0), (0, 4, 0))


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (points((0, 0), (2, 2)), points((0, 2), (2, 0)), True),
        (points((0, 0), (2, 2)), points((2, 2), (3, 0)), True),
        (points((0, 0), (2, 2)), points((3, 3), (4, 4)), False),
        (points((0, 0), (2, 2)), points((1, 1), (4, 4)), True),
        (points((0, 0), (2, 2)), points((1, 1), (1, 1)), True),
        (points((0, 0), (2, 2)), points((1, 1 + 2**-52), (1, 1 + 2**-52)), False),
        (points((0, 0, 0), (2, 2, 0)), points((0, 2, 5e-324), (2, 0, 5e-324)), False),
    ],
)
def test_segments(first: tuple, second: tuple, expected: bool) -> None:
    assert segments_meet(first, second) == segments_meet(second, first) == expected


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (points((1, 1, -1), (1, 1, 1), (5, 5, 5)), True),  # a side pierces the face
        (points((1, 1, 0), (1, 1, 1), (2, 2, 1)), True),  # a vertex on the face
        (points((2, 2, 0), (5, 5, 0), (5, 4, 0)), True),  # coplanar, touching the long side
        (points((1, 1, 0), (2, 1, 0), (1, 2, 0)), True),  # coplanar, one within the other
        (points((3, 3, 0), (5, 5, 0), (5, 4, 0)), False),
        (points((1, 1, 5e-324), (2, 1, 1), (1, 2, 1)), False),
        (points((-1, -1, -1), (-1, -1, 1), (1, 1, 0)), True),
        (points((1, 1, 0), (1, 1, 0), (1, 1, 0)), True),  # a point
        (points((2, 0, -1), (2, 0, 1), (2, 0, 0)), True),  # a segment through a side
        (points((0, 0, 1), (4, 0, 1), (0, 4, 1)), False),
    ],
)
def test_triangles(other: tuple, expected: bool) -> None:
    for turn in range(3):
        turned = other[turn:] + other[:turn]
        assert triangles_meet(BASE, turned) == triangles_meet(turned, BASE) == expected


def test_part_of_a_segment_in_a_triangle() -> None:
    assert part_in_triangle(points((1, 1, -1), (1, 1, 3)), BASE) == (Q(1, 4), Q(1, 4))
    assert part_in_triangle(points((-4, 1, 0), (4, 1, 0)), BASE) == (Q(1, 2), Q(7, 8))
    assert part_in_triangle(points((0, 5, 0), (5, 0, 0)), BASE) is None


def test_planar_overlap() -> None:
    assert planar_overlap(BASE, points((1, 1, 0), (9, 1, 0), (1, 9, 0)))
    assert not planar_overlap(BASE, points((4, 0, 0), (0, 4, 0), (4, 4, 0)))
    assert not planar_overlap(BASE, points((0, 0, 0), (4, 0, 0), (0, 0, 4)))


def test_distance_agrees_with_samples() -> None:
    source = random.Random(5)
    for _ in range(30):
        triangle = tuple(tuple(Q(source.randint(-4, 4)) for _ in range(3)) for _ in range(3))
        p = tuple(Q(source.randint(-6, 6)) for _ in range(3))
        distance = squared_distance_to_triangle(p, triangle)
        samples = [
            square(sub(p, along(along(triangle[0], triangle[1], Q(i, 12)), triangle[2], Q(j, 12))))
            for i in range(13)
            for j in range(13)
        ]
        assert distance <= min(samples)
        assert min(samples) - distance <= 64  # the grid is coarse: this only catches gross errors
    assert squared_distance_to_triangle(vector((1, 1, 3)), BASE) == 9
    assert squared_distance_to_triangle(vector((3, 3, 1)), BASE) == 3
    assert squared_distance_to_triangle(vector((-3, -4, 0)), BASE) == 25
