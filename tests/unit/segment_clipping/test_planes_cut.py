"""Points on slanted planes: those of whole numbers, where these are not asked."""

from __future__ import annotations

import numpy as np
import pytest

from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.convex import Convex
from tests.unit.segment_clipping.scenes import settled_alone


@pytest.mark.parametrize("dimension", [2, 3])
def test_points_are_those_of_whole_numbers(dimension: int) -> None:
    rng = np.random.default_rng(dimension)
    region = Convex(np.c_[rng.normal(size=(7, dimension)), rng.uniform(0.5, 1, 7)])
    segments = rng.uniform(-2, 2, (100, 2, dimension))
    pieces, accuracy = clip_segments(segments, region, report=True)
    assert accuracy.n_rational == 0
    exact = [settled_alone(p, q, region) for p, q in segments.tolist()]
    assert list(zip(*(array.tolist() for array in (pieces.t, pieces.start, pieces.end, pieces.faces)))) == [
        ([*piece.t], piece.start, piece.end, [*piece.faces]) for piece in exact if piece is not None
    ]
