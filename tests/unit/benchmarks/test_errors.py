"""Who is right about a pose or a segment: bodies apart, crossing, inside; segments that end on, in and beside."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("gmpy2")

from benchmarks.bodies import Pair
from benchmarks.errors import collides, meets
from benchmarks.workloads import Mesh

FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
CORNER = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
SMALL = np.concatenate([0.1 * CORNER, 0.1 * CORNER + 5])
MOVES = np.array([[0.1, 0.1, 0.1], [0.4, 0.4, 0.2], [0.4, 0.4, 0.21], [0.95, 0, 0], [-4.95, -4.95, -4.95]])
"""Of the two small corners: inside, a rounding off the slanted face, a little off it, crossing, the second inside."""


def a_pair(is_closed: bool) -> Pair:
    small = Mesh("two", SMALL, np.concatenate([FACES, FACES + 4]))
    return Pair("", Mesh("one", CORNER, FACES), small, is_closed, np.tile(np.eye(3), (5, 1, 1)), MOVES)


def test_solids_and_surfaces() -> None:
    assert [collides(a_pair(True), row) for row in range(5)] == [True, False, False, True, True]
    assert [collides(a_pair(False), row) for row in range(5)] == [False, False, False, True, False]


@pytest.mark.parametrize(
    ("segment", "expected"),
    [
        ([[0.1, 0.1, 0.1], [0.2, 0.2, 0.2]], True),  # within
        ([[-1.0, 0.25, 0.25], [0.0, 0.25, 0.25]], True),  # ends on a face
        ([[-1.0, 0.25, 0.25], [-(2.0**-1074), 0.25, 0.25]], False),
        ([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0]], True),  # through a vertex
        ([[0.5, 0.5, 2.0**-60], [1.0, 1.0, 1.0]], False),  # an ulp or so off the slanted face
        ([[3.0, 3.0, 3.0], [2.0, 0.1, 0.1]], False),
    ],
)
def test_a_segment_and_a_body(segment: list[list[float]], expected: bool) -> None:
    assert meets(np.array(segment), Mesh("one", CORNER, FACES)) is expected
