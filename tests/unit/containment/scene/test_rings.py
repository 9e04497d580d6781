"""Small polygons, all edges at once: equal to rational arithmetic, and no more is told of a point that is no number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Polygon
from engine.containment.rational_locate import rational_location
from engine.containment.scene.rings import boxes_of_rings, close_rings, locate_in_small_rings
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
    sizes = np.diff(solid.ring_offsets)
    xs, ys = np.empty(15), np.empty(15)
    close_rings(solid.vertices, sizes, xs, ys)
    offsets = np.append(0, np.cumsum(sizes + 1))
    lows, highs = np.empty((1, 2)), np.empty((1, 2))
    boxes_of_rings(xs, ys, offsets, np.array([0, 2]), lows, highs)
    assert (lows[0] == solid.vertices.min(axis=0)).all()
    assert (highs[0] == solid.vertices.max(axis=0)).all()
    points = random.integers(-1, 13, (300, 2)) / 2.0
    found, blurred = np.empty(len(points), np.int8), np.empty(len(points), np.int8)
    _ask(xs, ys, offsets, points, 0.0, found)
    assert found.tolist() == [rational_location(point, solid) for point in points.tolist()]
    _ask(xs, ys, offsets, points, 2.0**-30, blurred)
    assert ((blurred == found) | (blurred == UNDECIDED)).all()
    with np.errstate(invalid="ignore"):
        _ask(xs, ys, offsets, np.full((1, 2), np.nan), np.inf, blurred[:1])
    assert blurred[0] == UNDECIDED
