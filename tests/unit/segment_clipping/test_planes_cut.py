"""Points on planes, of boxes and slanted ones: those of whole numbers, where these are not asked."""

from __future__ import annotations

import numpy as np
import pytest

from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.convex import Convex
from tests.unit.segment_clipping.scenes import settled_alone


@pytest.mark.parametrize("is_box", [False, True])
@pytest.mark.parametrize("dimension", [2, 3])
def test_points_are_those_of_whole_numbers(dimension: int, is_box: bool) -> None:
    """More than a block of segments, so that whole and short ones are cut."""
    rng = np.random.default_rng(dimension)
    region: Solid = Aabb([-1 / 3] * dimension, [0.7] * dimension)
    if not is_box:
        region = Convex(np.c_[rng.normal(size=(7, dimension)), rng.uniform(0.5, 1, 7)])
    segments = rng.uniform(-2, 2, (150, 2, dimension))
    pieces, accuracy = clip_segments(segments, region, report=True)
    assert accuracy.n_rational == 0
    exact = [settled_alone(p, q, region) for p, q in segments.tolist()]
    assert list(zip(*(array.tolist() for array in (pieces.t, pieces.start, pieces.end, pieces.faces)))) == [
        ([*piece.t], piece.start, piece.end, [*piece.faces]) for piece in exact if piece is not None
    ]
