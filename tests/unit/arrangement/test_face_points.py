"""A point inside each face, exactly, also where faces are thinner than any float."""

from __future__ import annotations

from fractions import Fraction

from engine.arrangement.arrange import arrange_segments
from engine.arrangement.face_points import face_points
from engine.arrangement.subdivision import subdivide


def test_sliver_far_below_float_resolution() -> None:
    thin = Fraction(1, 10**60)
    corners = [(Fraction(1), Fraction(0)), (Fraction(2), thin), (Fraction(2), -thin)]
    subdivision = subdivide(arrange_segments(list(zip(corners, corners[1:] + corners[:1], strict=True))))
    (x, y) = face_points(subdivision)[1]
    assert 1 < x < 2
    assert abs(y) < thin * (x - 1)


def test_left_side_vertical_and_hole_in_the_slab() -> None:
    def square(x: int, y: int, size: int) -> list[tuple[tuple[int, int], tuple[int, int]]]:
        ring = [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]
        return list(zip(ring, ring[1:] + ring[:1], strict=True))

    subdivision = subdivide(arrange_segments(square(0, 0, 9) + square(1, 1, 7)))
    points = face_points(subdivision)
    assert subdivision.n_faces == 3
    inside = [all(1 < value < 8 for value in point) for point in points[1:]]
    assert sorted(inside) == [False, True]
    assert all(all(0 < value < 9 for value in point) for point in points[1:])
