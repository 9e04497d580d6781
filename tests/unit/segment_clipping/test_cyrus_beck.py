"""Segments on planes: those that hardly cross them."""

from __future__ import annotations

import numpy as np

from engine.segment_clipping.clip_segments import clip_segments
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


def test_terms_that_overflow_while_their_sum_does_not() -> None:
    """-1.9e308 + 1.79e308 is negative, -inf in doubles, and 1.85e308 - 1.9e308 at the other end of range."""
    rows = np.array([[1e300, 1e300, 1e-300, 0.0]])  # no power of two brings all of them into range
    ends = np.array(
        [[-1.9e8, 1.79e8, 0.0], [1.0, 1.7e8, 2.0], [1.9e8, -1.85e8, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, -1.0]]
    )
    check(np.array([[p, q] for p in ends for q in ends]), Convex(rows))


def test_blocks_answer_as_single_segments_do() -> None:
    """Parallel and lying segments, points, nearly parallel ones, beside easy ones in one block."""
    rng = np.random.default_rng(5)
    normals = rng.normal(size=(20, 3))
    region = Convex(np.concatenate([np.concatenate([normals, np.ones((20, 1))], axis=1), [[0.0, 0, 1, 0]]]))
    segments = rng.uniform(-2, 2, (200, 2, 3))
    segments[::5, 1] = segments[::5, 0]
    segments[1::5, :, 2] = rng.integers(-1, 2, (40, 1)) * 0.5
    segments[2::5, 1, 2] = segments[2::5, 0, 2] * (1 + 2.0**-52)
    check(segments[:40], region)
    whole = clip_segments(segments, region)
    single = [clip_segments(segments[i : i + 1], region) for i in range(200)]
    assert whole.source.tolist() == [i for i, pieces in enumerate(single) if len(pieces)]
    for name in ("start", "end", "t", "faces"):
        np.testing.assert_array_equal(getattr(whole, name), np.concatenate([getattr(one, name) for one in single]))
