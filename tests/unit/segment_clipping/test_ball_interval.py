"""Segments that touch a ball, or end on it: decided exactly."""

from __future__ import annotations

import itertools

import numpy as np

from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.sphere import Sphere
from tests.unit.segment_clipping.scenes import check, nudged


def test_tangent_to_the_sphere() -> None:
    rng = np.random.default_rng(7)
    for dimension in (2, 3):
        center = rng.integers(-3, 4, dimension).astype(float)
        touch = np.array([[3, 4, 0], [-4, 3, 0], [0, 5, 0], [5, 0, 0]], float)[:, :dimension]
        along = np.array([[-4, 3, 1], [3, 4, 0], [1, 0, 2], [0, 2, -1]], float)[:, :dimension]
        segments = np.stack([center + touch - along, center + touch + 2 * along], axis=1)
        check(segments, Sphere(center, 5.0))
        pieces = clip_segments(segments, Sphere(center, 5.0))
        if dimension == 2:
            assert (pieces.start == pieces.end).all()
        check(nudged(rng, np.repeat(segments, 30, axis=0)), Sphere(center, 5.0))
        check(np.stack([segments[:, 0], (segments[:, 0] + 2 * segments[:, 1]) / 3], axis=1), Sphere(center, 5.0))


def test_ends_on_the_sphere() -> None:
    rng = np.random.default_rng(8)
    points = np.array([[3, 4, 0], [0, 3, 4], [-5, 0, 0], [0, -5, 0], [8, 6, 0], [0, 0, 0]], float)
    segments = np.array(list(itertools.product(points, points)))
    check(segments, Sphere([0, 0, 0], 5))
    check(nudged(rng, segments), Sphere([0, 0, 0], 5))
