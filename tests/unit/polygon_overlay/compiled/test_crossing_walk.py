"""Two rings that only cross against the overlay in Python integers, and what is left to chains beside them."""

from __future__ import annotations

import numpy as np
import pytest

from engine.polygon_overlay.overlay import overlay
from engine.solids.polygon import Polygon
from tests.unit.polygon_overlay.checks import OPERATIONS, assert_valid
from tests.unit.polygon_overlay.compiled.test_kernel import agree
from tests.unit.polygon_overlay.families import star

COMB = np.array([(0, 0), (9, 0), (9, 5), (7, 5), (7, 1), (5, 1), (5, 5), (3, 5), (3, 1), (1, 1), (1, 5), (0, 5)], float)


def both_ways(ring: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return ring, ring[::-1].copy()


@pytest.mark.some(8)
@pytest.mark.parametrize("operation", OPERATIONS)
@pytest.mark.parametrize("n", [3, 5, 10, 24, 60])
def test_stars_given_either_way_round(n: int, operation: str) -> None:
    random = np.random.default_rng(n)
    for k in range(5):
        first, second = star(random, n), star(random, int(random.integers(3, 30)), 0.2 * k)
        for subject in both_ways(first):
            for clip in both_ways(second):
                assert agree([subject], [clip], operation)


@pytest.mark.parametrize("operation", OPERATIONS)
@pytest.mark.parametrize(
    "clip",
    [
        [(-1, 2), (10, 2.25), (10, 3), (-1, 3.5)],  # across all teeth: many pieces, holes in a union
        [(-1, -1), (10, -1), (10, 0.5), (-1, 0.75)],  # along the back
        [(2, -1), (2.5, -1), (2.5, 6), (2, 6)],  # through the back twice, apart from the teeth
        [(0.25, 0.5), (0.75, 0.5), (0.75, 2)],  # inside: no crossing
        [(-2, -2), (20, -2), (20, 20), (-2, 20)],  # around
        [(1.5, 3), (2.5, 3), (2, 4)],  # between two teeth
        [(4, 2), (6, 2), (6, 8), (4, 8)],  # over the end of one tooth
        [(4, 1), (6, 2), (6, 8), (4, 8)],  # from an edge: no crossing there
        [(1, 5), (4, 8), (-2, 8)],  # in one vertex
        [(4, 2), (6, 3), (4, 3), (6, 2)],  # crosses itself
        [(3, 3), (6, 3), (6, 4)],  # begins in an edge
    ],
)
def test_ways_to_lie(clip: object, operation: str) -> None:
    ring = np.asarray(clip, float)
    for subject in both_ways(COMB):
        for other in both_ways(ring):
            assert agree([subject], [other], operation)
            assert agree([other], [subject], operation)
            assert_valid(overlay(Polygon([subject]), Polygon([other]), operation))


def test_a_union_keeps_its_holes_and_a_difference_its_pieces() -> None:
    band = Polygon([[(-1, 2), (10, 2.25), (10, 3), (-1, 3.5)]])
    found = [overlay(Polygon([COMB]), band, operation) for operation in OPERATIONS]
    assert [(each.n_pieces, each.n_holes) for each in found] == [(3, 0), (1, 2), (4, 0), (8, 0)]


def test_vertices_in_line_are_left_out() -> None:
    square = np.array([(0, 0), (1, 0), (2, 0), (4, 0), (4, 4), (0, 4)], float)
    for operation in OPERATIONS:
        assert agree([square], [[(1, 1), (3, 1.5), (3, 9)]], operation)
        assert agree([square * 1e-7], [np.array([(1, 1), (3, 1.5), (3, 9)]) * 1e-7], operation)


def test_long_runs_of_large_rings_are_put_in_place_again() -> None:
    angles = np.linspace(0, 2 * np.pi, 1500, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for operation in OPERATIONS:
        assert agree([ring], [ring[::-1] * 0.9 + 0.4], operation)
