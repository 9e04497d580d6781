"""Segments cut by planes: decided, then cut."""

from __future__ import annotations

import os

import numpy as np
import pytest

from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.base import Solid
from engine.solids.primitives import Aabb, Convex
from tests.unit.segment_clipping.scenes import check, nudged, settled_alone, through
from tests.unit.segment_clipping.test_clip_segments import CORNERS


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


# --- Segments on planes: those that hardly cross them ---


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


# --- Batches on convex regions: scaled ones, those done twice, their progress, any workers ---


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
