"""Who is right about a pose: answers that are wrong on purpose are found, on bodies apart, crossing and inside."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("gmpy2")

from benchmarks.poses import Pair
from benchmarks.settled import collides, judged
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


def test_the_wrong_answers_are_counted() -> None:
    right = np.array([True, False, False, True, True])
    text, counts = judged(a_pair(True), right, ~right, "peer")
    assert (counts["differ"], counts["ours_wrong"], counts["peer_wrong"]) == (5, 0, 5)
    assert text == "5 answers differ: ours wrong 0, peer wrong 5"
    assert judged(a_pair(True), right, right, "peer") == ("0 answers differ", {"differ": 0})
    mixed = right ^ np.array([True, False, False, False, False])
    assert judged(a_pair(True), mixed, right, "peer")[1]["ours_wrong"] == 1
