"""The yardstick of the tables of clipping does what the textbook's plain methods do."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.contenders import naive_clipping
from engine.textbook import clip_polygons, clip_segments
from engine.textbook.clip_segments import UNFINISHED


@pytest.mark.parametrize("dim", [2, 3])
def test_batches_do_what_the_plain_methods_do(dim: int) -> None:
    rng = np.random.default_rng(dim)
    segments, low, high = rng.uniform(-2, 2, (400, 2, dim)), np.full(dim, -1.0), np.full(dim, 1.0)
    on_box = naive_clipping.clip_on_box_2d if dim == 2 else naive_clipping.clip_on_box_3d
    plain, fast = clip_segments.on_box(segments, low, high), on_box(segments, low, high)
    settled = plain[1] != UNFINISHED  # some never end; setting the cut coordinate helps the batches
    np.testing.assert_array_equal(plain[1][settled], fast[1][settled])
    np.testing.assert_allclose(plain[0][plain[1] == 1], fast[0][plain[1] == 1], atol=1e-12)
    if dim == 3:
        rows = np.c_[rng.normal(size=(9, 3)), np.ones(9)]
        plain, fast = clip_segments.on_convex(segments, rows), naive_clipping.clip_on_planes_3d(segments, rows)
        settled = plain[1] != UNFINISHED
        np.testing.assert_array_equal(plain[1][settled] == 1, fast[1][settled])
        plain, fast = clip_segments.on_sphere(segments, low, 1.0), naive_clipping.clip_on_sphere_3d(segments, low, 1.0)
        np.testing.assert_array_equal(plain[1], fast[1])
        np.testing.assert_allclose(plain[0][plain[1]], fast[0][plain[1]], atol=1e-12)


def test_rings_in_batches() -> None:
    rng = np.random.default_rng(3)
    rings = [rng.uniform(-2, 2, (size, 3)) for size in (3, 4, 7, 5)]
    rows = np.c_[rng.normal(size=(4, 3)), np.ones(4)]
    offsets = np.concatenate([[0], np.cumsum([len(ring) for ring in rings])])
    vertices, ends = naive_clipping.clip_rings_on_planes(np.concatenate(rings), offsets, rows)
    for i, ring in enumerate(rings):
        expected = clip_polygons.on_convex([ring], rows)
        found = vertices[ends[i] : ends[i + 1]]
        np.testing.assert_allclose(found, expected[0] if expected else np.zeros((0, 3)), atol=1e-12)
