"""Segments that are told to be far apart are, by their exact distance; those clearly so are told."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine.polygon_overlay.compiled.segment_distance import segments_are_far
from tests.unit.polygon_overlay.compiled.test_crossing_signs import Point, cross


def square_of_distance(p: Point, a: Point, b: Point) -> Fraction:
    """Return the square of the distance of a point from a segment."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = dx * dx + dy * dy
    t = (
        min(max(((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length, Fraction(0)), Fraction(1))
        if length
        else Fraction(0)
    )
    return (a[0] + t * dx - p[0]) ** 2 + (a[1] + t * dy - p[1]) ** 2


@pytest.mark.parametrize("seed", range(200))
def test_far_apart(seed: int) -> None:
    random = np.random.default_rng(seed)
    ends = random.integers(-4, 5, (4, 2)).astype(float)
    a, b, c, d = [(Fraction(x), Fraction(y)) for x, y in ends.tolist()]
    crosses = cross(a, b, c) * cross(a, b, d) < 0 and cross(c, d, a) * cross(c, d, b) < 0
    pairs = ((a, c, d), (b, c, d), (c, a, b), (d, a, b))
    square = Fraction(0) if crosses else min(square_of_distance(*each) for each in pairs)
    x, y = np.ascontiguousarray(ends.T)
    for margin in (0.25, 1.0, 4.0):
        is_far = segments_are_far(x, y, 0, 1, 2, 3, margin)
        assert not is_far or square > margin * (1 - 2.0**-40)
        assert is_far or square < margin * (1 + 2.0**-40)
