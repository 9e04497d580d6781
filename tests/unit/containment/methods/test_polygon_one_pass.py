"""Small polygons, all edges at once: equal to rational arithmetic, and no more is told of a point that is no number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Polygon, Triangle, locate
from engine.arrays import read_only
from engine.containment.methods.polygon_one_pass import close_rings, locate_by_ring_pass, locate_in_small_rings
from engine.containment.posed.filters import NOT_FINITE
from engine.containment.rational_locate import rational_location
from engine.jit import kernel
from engine.types import UNDECIDED


@kernel
def _ask(xs: Any, ys: Any, offsets: Any, points: Any, blur: float, found: Any) -> None:
    for item in range(len(points)):
        rings = 0, len(offsets) - 1
        found[item], _ = locate_in_small_rings(xs, ys, offsets, rings, (points[item, 0], points[item, 1]), blur)


@pytest.mark.parametrize("seed", range(5))
def test_rings_that_cross_themselves(seed: int) -> None:
    random = np.random.default_rng(seed)
    solid = Polygon([random.integers(0, 6, (n, 2)) for n in (9, 4)])
    xs, ys, offsets = close_rings(solid.vertices, solid.ring_offsets)
    for first, end, begin in zip(offsets, offsets[1:], solid.ring_offsets):
        ring = np.stack([xs[first:end], ys[first:end]], axis=1)
        assert ring[0].tolist() == ring[-1].tolist() == solid.vertices[begin].tolist()
    points = random.integers(-1, 13, (300, 2)) / 2.0
    found, blurred = np.empty(len(points), np.int8), np.empty(len(points), np.int8)
    _ask(xs, ys, offsets, points, 0.0, found)
    assert found.tolist() == [rational_location(point, solid) for point in points.tolist()]
    _ask(xs, ys, offsets, points, 2.0**-30, blurred)
    assert ((blurred == found) | (blurred == UNDECIDED)).all()
    with np.errstate(invalid="ignore"):
        _ask(xs, ys, offsets, np.full((1, 2), np.nan), np.inf, blurred[:1])
    assert blurred[0] == UNDECIDED


def test_a_pass_tells_what_rational_arithmetic_tells() -> None:
    random = np.random.default_rng(7)
    solid = Polygon([random.integers(0, 6, (n, 2)) for n in (300, 4)])
    points = read_only(random.integers(-1, 13, (200, 2)) / 2.0)
    found, flag = np.empty(len(points), np.int8), np.zeros(1, np.uint8)
    expected = [rational_location(point, solid) for point in points.tolist()]
    locate_by_ring_pass(points, np.zeros(0), solid.vertices, solid.ring_offsets, found, flag)
    assert found.tolist() == expected
    small = Polygon([solid.vertices[:40], solid.vertices[300:]])  # a block of points, and few points
    expected = [rational_location(point, small) for point in points.tolist()]
    for some in (slice(None), slice(0, 9)):
        locate_by_ring_pass(points[some], np.zeros(0), small.vertices, small.ring_offsets, found[some], flag)
        assert found[some].tolist() == expected[some]
    blurs, blurred = np.full(len(points), 2.0**-30), np.empty(len(points), np.int8)
    locate_by_ring_pass(points, blurs, small.vertices, small.ring_offsets, blurred, flag)
    assert ((blurred == expected) | (blurred == UNDECIDED)).all()
    bad = read_only(np.array([[0.0, np.inf]]))
    assert locate_by_ring_pass(bad, np.zeros(0), small.vertices, small.ring_offsets, found, flag) == NOT_FINITE


def test_plane_triangle_without_area_is_its_segment() -> None:
    flat = Triangle([[0, 0], [2, 2], [1, 1]])
    assert locate([[0.5, 0.5], [2, 2], [3, 3], [1, 1.5]], flat).tolist() == [0, 0, -1, -1]


def test_lattice_points_equal_integers() -> None:
    random = np.random.default_rng(0)
    for _ in range(50):
        corners = random.integers(-3, 4, (3, 2))
        points = random.integers(-4, 5, (100, 2))
        expected = []
        for q in points:
            sides = [
                int(np.linalg.det(np.stack([b - a, q - a])).round()) for a, b in zip(corners, np.roll(corners, -1, 0))
            ]
            is_boxed = (q >= corners.min(axis=0)).all() and (q <= corners.max(axis=0)).all()
            is_astride = min(sides) < 0 < max(sides)
            expected.append(-1 if is_astride or not is_boxed else 0 if 0 in sides else 1)
        assert locate(points, Triangle(corners)).tolist() == expected
