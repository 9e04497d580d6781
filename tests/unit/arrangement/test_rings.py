"""Rings of cells and their exact areas."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.arrangement.arrange import arrange_rings
from engine.arrangement.nodes import nearest_quotient, reduced
from engine.arrangement.rings import ExactRings, trace_pieces
from engine.arrangement.subdivision import label_faces, subdivide
from engine.errors import NotRepresentableError

Ring = list[tuple[int, int]]


def traced(rings: list[Ring], evidence: bool = False) -> list[tuple[Ring, list[Ring]]]:
    """Return shells and holes of the even-odd region of `rings` as coordinates."""
    coordinates = np.array([vertex for ring in rings for vertex in ring], float)
    masks = [frozenset({k}) for k in range(len(rings))]
    subdivision = subdivide(arrange_rings(coordinates, np.cumsum([0, *map(len, rings)]).tolist(), masks))
    labels = label_faces(subdivision)
    pieces = trace_pieces(subdivision, [len(label) % 2 == 1 for label in labels], labels)
    nodes, origin = subdivision.arrangement.nodes, subdivision.arrangement.origin

    def points(ring: list[int]) -> Ring:
        exact = [nodes.exact(origin(half_edge)) for half_edge in ring]
        assert all(value.denominator == 1 for point in exact for value in point)
        return [(int(x), int(y)) for x, y in exact]

    if evidence:
        return [(piece.evidence, piece.hole_evidence) for piece in pieces]  # type: ignore[misc]
    return [(points(piece.shell), [points(hole) for hole in piece.holes]) for piece in pieces]


def square(x: int, y: int, size: int) -> Ring:
    return [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]


def test_orientation_start_and_order() -> None:
    outer, inner, apart = square(0, 0, 9), square(2, 2, 3), square(20, 0, 2)
    expected = [(outer, [[(2, 2), (2, 5), (5, 5), (5, 2)]]), (apart, [])]
    assert traced([apart[::-1], inner[2:] + inner[:2], outer[::-1]]) == expected


def test_parts_that_meet_in_a_point_are_separate() -> None:
    assert traced([square(0, 0, 2), square(2, 2, 2)]) == [(square(0, 0, 2), []), (square(2, 2, 2), [])]


def test_hole_touching_its_shell_stays_a_hole() -> None:
    notch = [(0, 4), (4, 2), (4, 6)]
    assert traced([square(0, 0, 8), notch]) == [
        ([(0, 0), (8, 0), (8, 8), (0, 8), (0, 4)], [[(0, 4), (4, 6), (4, 2)]]),
    ]


def test_three_holes_meeting_in_a_point() -> None:
    holes = [[(10, 10), (12, 8), (14, 10)], [(10, 10), (9, 13), (8, 11)], [(10, 10), (6, 9), (7, 7)]]
    (piece,) = traced([square(0, 0, 20), *holes])
    assert piece[0] == square(0, 0, 20)
    assert [set(hole) for hole in piece[1]] == [set(holes[2]), set(holes[1]), set(holes[0])]


def test_chain_of_holes_parts_the_region() -> None:
    pieces = traced([square(0, 0, 8), [(0, 4), (4, 3), (4, 5)], [(4, 5), (8, 4), (6, 6)]])
    assert [len(holes) for _, holes in pieces] == [0, 0]


def test_straight_nodes_are_left_out() -> None:
    ring = [(0, 0), (1, 0), (2, 0), (4, 0), (4, 2), (4, 4), (0, 4), (0, 3)]
    assert traced([ring]) == [(square(0, 0, 4), [])]
    assert traced([square(0, 0, 4), square(4, 0, 4)]) == [([(0, 0), (8, 0), (8, 4), (0, 4)], [])]


def test_evidence_is_gathered_over_regions() -> None:
    rings = [square(0, 0, 9), square(1, 1, 5), square(2, 2, 2)]
    assert traced(rings, evidence=True) == [({0}, [{0, 1}]), ({0, 1, 2}, [])]


@pytest.mark.parametrize("seed", range(10))
def test_tracing_again_changes_nothing(seed: int) -> None:
    """The traced rings, taken as input, make the same region."""
    random = np.random.default_rng(seed)
    rings = [[(int(x) * 5040, int(y) * 5040) for x, y in random.integers(0, 3, (n, 2))] for n in (6, 5, 4)]
    pieces = traced(rings)  # on a 3 x 3 lattice every crossing is a multiple of 1/5040 at most
    assert pieces
    assert traced([ring for shell, holes in pieces for ring in (shell, *holes)]) == pieces


# --- Area of exact rings, as a fraction and rounded once, where the plain sum of doubles would not do ---


def slow_area(rings: ExactRings) -> Fraction:
    total = Fraction(0)
    for ring in rings.rings:
        points = [(Fraction(x, w), Fraction(y, w)) for x, y, w in ring]
        total += sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(points, points[1:] + points[:1], strict=True))
    return total / 2 * Fraction(4) ** rings.exponent


@pytest.mark.parametrize("exponent", [-700, -53, 0, 40])
@pytest.mark.parametrize("seed", range(5))
def test_equals_plain_fractions(seed: int, exponent: int) -> None:
    random = np.random.default_rng(seed)
    ring = tuple(reduced(*map(int, row)) for row in random.integers(1, 1 << 40, (17, 3)))
    rings = ExactRings((ring, ring[::-1][:9]), exponent)
    expected = slow_area(rings)
    assert rings.area() == expected
    assert rings.nearest_area() == nearest_quotient(expected.numerator, expected.denominator)


def test_area_that_nearly_cancels() -> None:
    big, third = 10**300, reduced(1, 1, 3)
    sliver = ((0, 0, 1), (big, 0, 1), third)
    rings = ExactRings((sliver, (third, (big, 0, 1), (0, 0, 1)), ((0, 0, 1), (1, 0, 1), (0, 1, 7))), 0)
    assert rings.area() == Fraction(1, 14)
    assert rings.nearest_area() == 1 / 14


def test_nothing_and_too_much() -> None:
    assert ExactRings((), 0).area() == 0
    for exponent in (0, 900, -900):
        assert str(ExactRings((), exponent).nearest_area()) == "0.0"
    with pytest.raises(NotRepresentableError):
        ExactRings((((0, 0, 1), (1, 0, 1), (0, 1, 1)),), 600).nearest_area()


def test_bounds_may_be_too_much_where_the_area_is_not() -> None:
    far, third = 1 << 1500, reduced(1, 1, 3)
    there, back = ((0, 0, 1), (far, 0, 1), third), (third, (far, 0, 1), (0, 0, 1))
    rings = ExactRings((there, back, ((0, 0, 1), (1, 0, 1), (0, 1, 1))), 400)
    assert rings.nearest_area() == 2.0**799
