"""Chunks of polygons in the kernel."""

from __future__ import annotations

import numpy as np
import pytest

from engine.budget import Budget
from engine.errors import CancelledError
from engine.polygon_clipping import clip_polygons as polygons_module
from engine.polygon_clipping.batches import clip_chunk, kernel_scene
from engine.solids.aabb import Aabb


def test_a_raised_flag_ends_a_chunk() -> None:
    """The kernel stopping for it does not pass for a lack of room, of which more and more would be made."""
    region, budget, offsets = Aabb([-1, -1], [1, 1]), Budget(), np.arange(6)
    contours = polygons_module.as_contours(np.ones((5, 3, 2)), 2)
    scene = kernel_scene(region, contours.vertices, 1.0, polygons_module._planes(region, budget), budget)
    assert scene is not None
    budget.flag[0] = 1
    with pytest.raises(CancelledError):
        clip_chunk(
            scene,
            contours.ring_offsets,
            offsets,
            0,
            5,
            budget,
            np.zeros(5, np.int64),
            np.zeros(5, np.uint8),
            offsets > 9,
        )
