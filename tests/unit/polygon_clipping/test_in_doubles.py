"""What doubles and double-doubles prove: long rings in runs, lattices through corners."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from engine.polygon_clipping.clip_polygons import clip_polygons
from engine.solids.aabb import Aabb
from engine.solids.convex import Convex
from tests.unit.polygon_clipping.test_clip_polygons import check


@pytest.mark.parametrize("dimension", [2, 3])
def test_long_rings_are_taken_in_runs(dimension: int) -> None:
    """Many vertices on one side of all planes, and single ones on the planes between them; the ends of a ring equal."""
    rng = np.random.default_rng(6)
    walks = np.cumsum(rng.integers(-1, 2, (12, 40, dimension)) / 4, axis=1)
    walks[6:] += rng.uniform(-0.1, 0.1, (6, 40, dimension))
    walks[:3, -1] = walks[:3, 0]
    for region in (
        Aabb([-0.5] * dimension, [0.5] * dimension),
        Convex(np.c_[np.eye(dimension) + 1, np.ones(dimension)]),
    ):
        check(walks, region)


@pytest.mark.parametrize("dimension", [2, 3])
def test_contours_through_corners_stay_in_the_kernel(dimension: int) -> None:
    """Exact zeros that geometry explains need no integers: corners of a box, corners and edges of an octahedron."""
    rng = np.random.default_rng(dimension)
    contours = rng.integers(-20, 21, (60, 5, dimension)) / 8
    contours[:20] = rng.uniform(-2, 2, (20, 5, dimension))
    offset = rng.integers(-8, 9, (20, dimension)) / 8
    contours[:20, 0], contours[:20, 1] = 1 + offset, 1 - offset  # an edge through the corner of the box
    contours[20:30, 1:3, 0] = 1.0  # an edge on a plane
    signs = np.array(list(itertools.product([-1.0, 1.0], repeat=dimension)))
    for region in (Aabb([-1] * dimension, [1] * dimension), Convex(np.c_[signs, np.full(len(signs), 1.5)])):
        clipped, accuracy = clip_polygons(contours, region, report=True)
        assert accuracy.n_rational < 6
        check(contours, region, clipped)
