"""Batches on convex regions: scaled ones, those done twice, their progress, any workers."""

from __future__ import annotations

import os

import numpy as np
import pytest

from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.aabb import Aabb
from engine.solids.convex import Convex
from tests.unit.segment_clipping.scenes import check, through
from tests.unit.segment_clipping.test_clip_segments import CORNERS


def test_rounding_up_to_the_smallest_normal_number() -> None:
    """A crossing just below the middle of the largest subnormal number and the smallest normal one.

    Rounded to 53 bits it is that middle, rounded again the normal number.
    """
    least = 2.0**-1022
    line = [[2 * least, least], [-2 * least, -(3 - 2.0**-51) * least]]
    check(np.array([line] * 64), Aabb([-least, 0.0], [2 * least, least]))


def test_the_same_for_any_workers_and_chunks() -> None:
    rng = np.random.default_rng(11)
    segments = through(rng, CORNERS[3], 20000)
    one, many = (clip_segments(segments, Aabb([-1] * 3, [2] * 3), workers=workers) for workers in (1, 3))
    for name in ("source", "start", "end", "t", "faces"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name))


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="about compiled speed")
@pytest.mark.parametrize("scale", [1.0, 2.0**900])  # the second is done twice: as it is, then scaled
def test_progress_counts_each_segment_once(scale: float) -> None:
    draw = np.random.default_rng(12)
    segments = draw.integers(-3, 4, (20_000, 2, 3)) * 0.5 * scale
    region = Convex(np.array([[1.0, 1, 1, 2 * scale], [-1.0, 0.5, 0, scale], [0, 0, -1.0, scale]]))
    for workers in (1, 2):
        counts: list[int] = []
        clip_segments(segments, region, workers=workers, progress=counts.append)
        assert sum(counts) == len(segments)
        assert min(counts) > 0
