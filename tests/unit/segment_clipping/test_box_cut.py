"""Points that the kernels of boxes, planes and balls make: those of whole numbers, where these are not asked."""

from __future__ import annotations

import numpy as np
import pytest

from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.aabb import Aabb
from tests.unit.segment_clipping.scenes import settled_alone


@pytest.mark.parametrize("dimension", [2, 3])
def test_points_are_those_of_whole_numbers(dimension: int) -> None:
    """More than a block of segments, so that whole and short ones are cut."""
    segments = np.random.default_rng(dimension).uniform(-2, 2, (150, 2, dimension))
    region = Aabb([-1 / 3] * dimension, [0.7] * dimension)
    pieces, accuracy = clip_segments(segments, region, report=True)
    assert accuracy.n_rational == 0
    exact = [settled_alone(p, q, region) for p, q in segments.tolist()]
    assert list(zip(*(array.tolist() for array in (pieces.t, pieces.start, pieces.end, pieces.faces)))) == [
        ([*piece.t], piece.start, piece.end, [*piece.faces]) for piece in exact if piece is not None
    ]
