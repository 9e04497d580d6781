"""Who is right about a pose or a segment: bodies apart, crossing, inside; segments that end on, in and beside."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("gmpy2")

from benchmarks import errors
from benchmarks.bodies import Pair
from benchmarks.contenders import Placed, is_closed, t_by_segment
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


def test_where_a_segment_meets_a_mesh_first_and_how_often() -> None:
    """Through a vertex, beside it by an ulp, within a face's plane but not in the face, along an edge."""
    corner, nowhere = Mesh("one", CORNER, FACES), np.nan
    segments = np.array([[[1, -1, 0], [1, 3, 0]], [[1 + 2**-52, -1, 0], [1 + 2**-52, 3, 0]], [[-1, 2, 0], [3, 2, 0]],
                         [[-1, 0, 0], [3, 0, 0]]], float)  # fmt: skip
    assert np.array_equal(errors.hits_of(segments, corner, "first"), [0.25, nowhere, nowhere, 0.25], equal_nan=True)
    assert errors.hits_of(segments, corner, "all").tolist() == [1, 0, 0, 1]
    assert errors.hits_of(segments, corner, "any").tolist() == [True, False, False, True]
    judged = errors.places([0.25 + 1e-7, 0.5, nowhere, 0.75], errors.hits_of(segments, corner, "first"))
    assert judged == {"judged": 4, "wrong": 2, "refused": 0, "worst": [1, 3]}


def test_what_a_plane_leaves_of_a_corner() -> None:
    """A sixth of a cube; above a half there is an eighth of it, whose section is an eighth of a square."""
    corner = Mesh("one", CORNER, FACES)
    assert errors.volume_of(corner) == 1 / 6
    rows = np.array([[0.0, 0, 1, -0.5], [0.0, 0, 1, 0]])
    assert errors.cut_measures(corner, rows, False).tolist() == [[1 / 48, 1.0], [1 / 6, 1.0]]
    assert errors.cut_measures(corner, rows, True).tolist() == [[0.125, 1.0], [0.5, 1.0]]
    couples = [
        (Placed(corner), Placed(Mesh("other", CORNER + move, FACES))) for move in ([1, 0, 0], [1 + 2**-52, 0, 0])
    ]
    assert errors.meet(couples).tolist() == [True, False]


def test_neighbours_by_their_boxes_and_their_relations() -> None:
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    left, right = (
        np.array([square, square + 5]),
        np.array([np.add(square, [1, 0]), 0.5 * square + 0.25, np.add(square, [0.5, 0])]),
    )
    pairs = errors.boxes_that_meet(left, right)
    assert pairs.tolist() == [[0, 0], [0, 1], [0, 2]]
    assert errors.relations(left, right, pairs).tolist() == [4, 2, 3]


def test_whether_a_mesh_is_closed_by_position() -> None:
    assert is_closed(CORNER, FACES)
    assert is_closed(CORNER[FACES].reshape(-1, 3), np.arange(12).reshape(-1, 3))
    assert not is_closed(CORNER, FACES[:3])
    assert not is_closed(CORNER, np.concatenate([FACES[:3], FACES[3:, ::-1]]))
    assert np.array_equal(
        t_by_segment(3, np.array([0, 0, 2]), np.array([0.5, 0.25, 1.0])), [0.25, np.nan, 1.0], equal_nan=True
    )
