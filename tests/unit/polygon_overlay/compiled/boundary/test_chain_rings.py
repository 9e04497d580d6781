"""Boundary rings where walks pass a node twice, and where straight points are left out."""

from __future__ import annotations

import pytest

from engine.polygon_overlay.overlay import overlay
from engine.solids.polygon import Polygon
from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_kernel import agree

FRAME = [(0, 0), (8, 0), (8, 8), (0, 8)]
CASES = {
    "hole touches its shell": [[(4, 0), (6, 3), (2, 3)]],
    "hole touches its shell twice": [[(4, 0), (6, 4), (4, 8), (2, 4)]],
    "holes touch each other": [[(2, 2), (4, 4), (2, 6)], [(4, 4), (6, 2), (6, 6)]],
    "a chain of holes encloses a part": [[(2, 2), (6, 2), (4, 3)], [(6, 2), (6, 6), (5, 4)], [(2, 2), (5, 4), (6, 6)]],
    "corner to corner": [[(8, 8), (9, 8), (9, 9)], [(-1, -1), (0, 0), (-1, 0)]],
}


@pytest.mark.parametrize("name", CASES)
def test_walks_are_cut_into_simple_rings(name: str) -> None:
    for operation in OPERATIONS:
        assert agree([FRAME], CASES[name], operation)
        assert agree(
            [[(x / 3, y / 7) for x, y in FRAME]], [[(x / 3, y / 7) for x, y in r] for r in CASES[name]], operation
        )


def test_straight_points_leave_no_trace() -> None:
    fine = [(x, 0) for x in range(9)] + [(8, y) for y in range(1, 9)] + [(x, 8) for x in range(7, -1, -1)] + [(0, 3)]
    union = overlay(Polygon([fine]), Polygon([[(2, 2), (8, 2), (8, 6), (2, 6)]]), "union")
    assert union.vertices.tolist() == [[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]]
