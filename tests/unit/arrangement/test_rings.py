"""Rings of regions: separate at touching points, whole with holes that touch, straight nodes gone."""

from __future__ import annotations

import numpy as np
import pytest

from engine.arrangement.arrange import arrange_rings
from engine.arrangement.rings import trace_pieces
from engine.arrangement.subdivision import label_faces, subdivide

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
