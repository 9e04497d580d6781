"""Sutherland-Hodgman in Python's integers."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.polygon_clipping.clip_polygons import clip_polygons
from engine.polygon_clipping.in_integers import MOST_BITS, clip_polygon, integer_row, plane_through
from engine.solids.aabb import Aabb


def test_too_complex_is_marked_and_spoils_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    monkeypatch.setattr("engine.polygon_clipping.in_integers.MOST_BITS", 400)
    assert MOST_BITS == 1 << 17
    box = Aabb([-0.5] * 3, [0.5] * 3)
    easy = [[0.0, 0.0, 0.0], [0.25, 0.0, 0.0], [0.0, 0.25, 0.0]]
    hard = rng.uniform(-1, 1, (6, 3)).tolist()
    clipped = clip_polygons([[easy], [hard, easy], [easy]], box)
    assert clipped.status.tolist() in ([0, 1, 0], [0, 0, 0])  # a kernel may settle what exact arithmetic would not
    assert clipped.rings(0)[0].tolist() == clipped.rings(2)[0].tolist() == easy


def test_areas_on_both_sides_of_a_line_add_up() -> None:
    """What is left of a ring on either side of a line, bridges or not, has its area, but for rounding."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        ring, line = rng.integers(-9, 10, (7, 2)) * 1.0, rng.integers(-5, 6, 3) * 1.0
        line[0] += not line[:2].any()
        areas = [area(ring.tolist())]
        for row in (line, -line):
            (left,), _ = clip_polygon([ring.tolist()], [integer_row(row.tolist())], lambda: None)
            assert all(abs(x) <= 9 for vertex in left for x in vertex)
            areas.append(area(left))
        assert abs(areas[1] + areas[2] - areas[0]) < Fraction(1, 10**10)


def area(ring: Any) -> Fraction:
    points = [tuple(map(Fraction, vertex)) for vertex in ring]
    return sum((p[0] * q[1] - p[1] * q[0] for p, q in zip(points, points[1:] + points[:1])), Fraction(0)) / 2


def test_a_plane_through_three_points_is_zero_at_them_and_positive_behind() -> None:
    row = plane_through([0.5, 0.0, 0.25], [1.5, 0.0, 0.25], [0.5, 2.0, 0.25])
    values = [sum(a * x for a, x in zip(row, (*point, 1.0))) for point in ([9.0, 9.0, 0.25], [0, 0, 0], [0, 0, 1])]
    assert [(value > 0) - (value < 0) for value in values] == [0, 1, -1]
