"""The segment reference against answers by hand."""

from __future__ import annotations

from fractions import Fraction

import pytest

from tests.reference.segments import clip_segment
from tests.reference.shapes import Solid, aabb, box, half_space, polygon, reversed_faces, sphere, union_of

SHELL = union_of(box((0, 0, 0), (6, 6, 6)), reversed_faces(box((2, 2, 2), (4, 4, 4))))
COMB = polygon([[0, 0], [5, 0], [5, 4], [4, 4], [4, 2], [3, 2], [3, 4], [2, 4], [2, 2], [1, 2], [1, 4], [0, 4]])
OCTANT = {"type": "convex", "planes": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}


def spans(segment: tuple, region: Solid) -> list[tuple[Fraction, Fraction]]:
    return [(Fraction(p.t[0].a), Fraction(p.t[1].a)) for p in clip_segment(segment, region)]


def F(a: int, b: int = 1) -> Fraction:
    return Fraction(a, b)


@pytest.mark.parametrize(
    ("segment", "region", "expected"),
    [
        (((-1, 0.5), (3, 0.5)), aabb((0, 0), (1, 1)), [(F(1, 4), F(1, 2))]),
        (((-1, 1), (3, 1)), aabb((0, 0), (1, 1)), [(F(1, 4), F(1, 2))]),  # along a side
        (((-1, 1), (1, -1)), aabb((0, 0), (1, 1)), [(F(1, 2), F(1, 2))]),  # through a corner
        (((-1, 1 - 2**-53), (1, -1)), aabb((0, 0), (1, 1)), []),
        (((1, 1), (-1, -1)), aabb((1e-9, 1e-9), (3, 3)), [(F(0), (1 - Fraction(1e-9)) / 2)]),
        (((0.5, 0.5), (0.5, 0.5)), aabb((0, 0), (1, 1)), [(F(0), F(1))]),
        (((2, 0.5), (2, 0.5)), aabb((0, 0), (1, 1)), []),
        (((0, 0, -1), (0, 0, 1)), OCTANT, [(F(1, 2), F(1))]),
        (((0, 0, 0), (0, 0, -1)), half_space((0, 0, 1), 0), [(F(0), F(0))]),
        (((-1, 3), (6, 3)), COMB, [(F(1, 7), F(2, 7)), (F(3, 7), F(4, 7)), (F(5, 7), F(6, 7))]),
        (((-1, 4), (6, 4)), COMB, [(F(1, 7), F(2, 7)), (F(3, 7), F(4, 7)), (F(5, 7), F(6, 7))]),
        (((-1, 2), (6, 2)), COMB, [(F(1, 7), F(6, 7))]),
        (((-1, 3, 3), (7, 3, 3)), SHELL, [(F(1, 8), F(3, 8)), (F(5, 8), F(7, 8))]),
        (((-1, 2, 3), (7, 2, 3)), SHELL, [(F(1, 8), F(7, 8))]),  # along a face of the cavity
        (((3, 3, 3), (3, 3, 3.5)), SHELL, []),
        (((3, 3, 3), (3, 3, 4)), SHELL, [(F(1), F(1))]),
        (((-1, 0), (1, 0)), sphere((0, 1), 1), [(F(1, 2), F(1, 2))]),  # tangent
        (((-2, 0), (2, 0)), sphere((0, 0), 1), [(F(1, 2), F(1, 2))]),  # the rational part of the two roots
        (((1, 0), (2, 0)), sphere((0, 0), 1), [(F(0), F(0))]),
        (((2, 0), (1, 0)), sphere((0, 0), 1), [(F(1), F(1))]),
        (((2, 0), (3, 0)), sphere((0, 0), 1), []),
        (((0, 0), (0.5, 0)), sphere((0, 0), 1), [(F(0), F(1))]),
    ],
)
def test_by_hand(segment: tuple, region: Solid, expected: list) -> None:
    assert spans(segment, region) == expected
    back = [(1 - high, 1 - low) for low, high in spans(segment[::-1], region)]
    assert back[::-1] == expected or segment[0] == segment[1]


def test_sphere_roots_are_rounded_once() -> None:
    (piece,) = clip_segment(((-2.0, 0.0), (2.0, 0.0)), sphere((0, 0), 1))
    assert piece.rounded() == ([-1.0, 0.0], [1.0, 0.0], [0.25, 0.75])
    (piece,) = clip_segment(((0.0, 0.0), (1.0, 1.0)), sphere((0, 0), 1))
    assert piece.rounded() == ([0.0, 0.0], [0.5**0.5, 0.5**0.5], [0.0, 0.5**0.5])


def test_faces_at_the_ends() -> None:
    (piece,) = clip_segment(((-1, 0.5), (0.5, 0.5)), aabb((0, 0), (1, 1)))
    assert piece.faces == (0, -1)
    (piece,) = clip_segment(((-1, 1), (1, -1)), aabb((0, 0), (1, 1)))
    assert piece.faces == (0, 2)
    (piece,) = clip_segment(((-1, -1), (2, 2)), aabb((0, 0), (1, 1)))
    assert piece.faces == (0, 1)
