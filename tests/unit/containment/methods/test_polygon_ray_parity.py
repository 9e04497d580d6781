"""Rings by ray and parity: each kernel answer equals rational arithmetic, on a lattice full of levels and touches."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polygon
from engine.arrays import read_only
from engine.containment.methods.polygon_ray_parity import locate_in_rings
from engine.containment.rational_locate import rational_location
from engine.containment.rings import rings_of


@pytest.mark.parametrize("seed", range(5))
def test_rings_that_cross_themselves(seed: int) -> None:
    random = np.random.default_rng(seed)
    solid = Polygon([random.integers(0, 6, (n, 2)) for n in (9, 4)])
    points = read_only(random.integers(-1, 13, (300, 2)) / 2.0)
    found = np.empty(len(points), np.int8)
    locate_in_rings(points, np.zeros(len(points)), rings_of(solid), found, np.zeros(1, np.uint8))
    assert found.tolist() == [rational_location(point, solid) for point in points.tolist()]
