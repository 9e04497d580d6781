"""Convex pairs against the overlay in Python integers: what floating point settles, and what it leaves."""

from __future__ import annotations

import numpy as np
import pytest

from engine.polygon_overlay.overlay import overlay
from engine.solids.polygon import Polygon
from tests.unit.polygon_overlay.checks import assert_valid
from tests.unit.polygon_overlay.compiled.test_kernel import agree

SQUARE = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)])


def convex(random: np.random.Generator, n: int) -> np.ndarray:
    angles = 2 * np.pi / n * (np.arange(n) + random.uniform(0.0, 0.9, n))
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1) + random.uniform(-0.5, 0.5, 2)
    return np.roll(ring[:: random.choice([-1, 1])], random.integers(n), axis=0)


@pytest.mark.parametrize("n", [3, 4, 7, 30])
def test_random(n: int) -> None:
    random = np.random.default_rng(n)
    for _ in range(6):
        first, second = convex(random, n), convex(random, int(random.integers(3, 12)))
        assert agree([first], [second], "intersection")
        agree([np.round(first * 3)], [np.round(second * 3)], "intersection")
        agree([first + 1e15], [second + 1e15], "intersection")


@pytest.mark.parametrize(
    ("clip", "area"),
    [
        (SQUARE / 4 + 1.25, 1),  # inside
        (SQUARE * 4 - 3.75, 16),  # around
        ([(1.5, 2.5), (7.5, 2.25), (7.5, 2.75)], None),  # through one edge
        ([(-1.0, 2.0), (1.0, -2.5), (1.25, -2.0)], None),  # across two edges that follow each other
        ([(-1.5, 1.75), (5.5, 2.0), (5.75, 2.25), (-1.25, 2.5)], None),  # from side to side
        (SQUARE + np.array([2.5, 7.5]), 0),  # apart
        (SQUARE * 0.75 + np.array([4.5, 0.5]), 0),
        ([(3.5, 6.5), (6.5, 3.5), (7.0, 7.0)], 0),  # boxes meet, polygons do not
        (SQUARE, 16),  # equal
        (SQUARE + np.array([4, 0]), 0),  # an edge in common
        (SQUARE + np.array([4, 4]), 0),  # a vertex in common
        (SQUARE / 2 + np.array([1, 2]), 4),  # a stretch in common
        ([(0.0, 0.0), (4.0, 4.0), (0.0, 4.0)], 8),  # half, cut from vertex to vertex
        ([(1.0, 1.0), (2.0, 1.0), (3.0, 1.0), (3.0, 3.0)], 2),  # three vertices in line
    ],
)
def test_ways_to_lie(clip: object, area: float | None) -> None:
    ring = np.asarray(clip, float)
    for subject in (SQUARE, SQUARE[::-1]):
        for other in (ring, ring[::-1]):
            assert agree([subject], [other], "intersection")
            assert agree([other], [subject], "intersection")
            if area is not None:
                assert overlay(Polygon([subject]), Polygon([other])).area == area


def test_winding_twice_is_not_convex() -> None:
    """All turns of a pentagram are to the left; even-odd leaves its middle out."""
    angles = 4 * np.pi / 5 * np.arange(5) + 0.1
    star = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    assert agree([star], [SQUARE - 2.1], "intersection")
    result = overlay(Polygon([star]), Polygon([SQUARE - 2.1]))
    assert result.n_pieces == 5
    assert_valid(result)
