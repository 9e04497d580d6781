"""Points on a ball: those of whole numbers and their roots, where these are not asked."""

from __future__ import annotations

import numpy as np
import pytest

from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.sphere import Sphere
from tests.unit.segment_clipping.scenes import settled_alone


@pytest.mark.parametrize("dimension", [2, 3])
def test_points_are_those_of_whole_numbers(dimension: int) -> None:
    segments = np.random.default_rng(dimension).uniform(-2, 2, (100, 2, dimension))
    center = [0.1, -0.3, 0.2][:dimension]
    pieces, accuracy = clip_segments(segments, Sphere(center, 1.1), report=True)
    assert accuracy.n_rational == 0
    exact = [settled_alone(p, q, Sphere(center, 1.1)) for p, q in segments.tolist()]
    assert list(zip(*(array.tolist() for array in (pieces.t, pieces.start, pieces.end, pieces.faces)))) == [
        ([*piece.t], piece.start, piece.end, [*piece.faces]) for piece in exact if piece is not None
    ]
