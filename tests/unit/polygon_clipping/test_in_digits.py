"""What doubles leave open and whole numbers settle in the kernel."""

from __future__ import annotations

import numpy as np
import pytest

from engine.polygon_clipping.clip_polygons import clip_polygons
from engine.solids.convex import Convex
from tests.unit.polygon_clipping.test_clip_polygons import check


@pytest.mark.parametrize("dimension", [2, 3])
def test_planes_through_vertices_need_no_rational_arithmetic(dimension: int) -> None:
    """Every plane passes through a vertex of every ring, so doubles decide none; edges along planes are cut anew."""
    rng = np.random.default_rng(dimension)
    rows = np.c_[rng.integers(-2, 3, (6, dimension)) + 0.25, np.zeros(6)]
    contours = rng.integers(-8, 9, (40, 6, dimension)) / 4
    contours[:, 0] = 0.0
    contours[::2, 3] = 0.0
    clipped, accuracy = clip_polygons(contours, Convex(rows), report=True)
    assert accuracy.n_beyond_filter == 40
    assert accuracy.n_rational < 10
    check(contours, Convex(rows), clipped)
