"""Segments on planes: those that hardly cross them."""

from __future__ import annotations

import numpy as np

from engine.solids.aabb import Aabb
from engine.solids.convex import Convex
from tests.unit.segment_clipping.scenes import check, nudged


def test_nearly_parallel_to_planes() -> None:
    rng = np.random.default_rng(9)
    base = np.stack([rng.uniform(-1, 1, (60, 3)), rng.uniform(-1, 1, (60, 3))], axis=1)
    base[:, :, 2] = 0.3
    base = nudged(rng, base)
    check(base, Aabb([-0.5, -0.5, -1], [0.5, 0.5, 0.3]))
    check(base, Convex([[0, 0, -1, 0.3], [1e-17, 0, -1, 0.3], [1, 1, 0, 0.5]]))
