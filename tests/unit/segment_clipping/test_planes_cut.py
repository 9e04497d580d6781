"""Points on slanted planes: those of whole numbers, where these are not asked."""

from __future__ import annotations

import numpy as np
import pytest

from engine.segment_clipping.clip_segments import clip_segments
from engine.segment_clipping.exact_segments import clip_by_planes
from engine.solids.convex import Convex


@pytest.mark.parametrize("dimension", [2, 3])
def test_points_are_those_of_whole_numbers(dimension: int) -> None:
    rng = np.random.default_rng(dimension)
    region = Convex(np.c_[rng.normal(size=(7, dimension)), rng.uniform(0.5, 1, 7)])
    segments = rng.uniform(-2, 2, (100, 2, dimension))
    pieces, accuracy = clip_segments(segments, region, report=True)
    assert accuracy.n_rational == 0
    exact = [clip_by_planes(p, q, region.planes.tolist()) for p, q in segments.tolist()]
    assert list(zip(*(array.tolist() for array in (pieces.t, pieces.start, pieces.end, pieces.faces)))) == [
        ([*piece.t], piece.start, piece.end, [*piece.faces]) for piece in exact if piece is not None
    ]
