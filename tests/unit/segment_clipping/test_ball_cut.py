"""Segments that cross a ball, touch it, or end on it: decisions and points are those of whole numbers and roots."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.primitives import Sphere
from tests.unit.segment_clipping.scenes import check, nudged, settled_alone


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


@pytest.mark.parametrize("dimension", [2, 3])
def test_tangents_as_near_as_doubles_come_need_no_whole_numbers(dimension: int) -> None:
    random = np.random.default_rng(dimension)
    touch = random.normal(size=(200, 3)) * (1.0, 1.0, dimension - 2.0)
    touch /= np.linalg.norm(touch, axis=1, keepdims=True)
    along = np.cross(
        touch, random.normal(size=(200, 3)) if dimension == 3 else np.broadcast_to([0.0, 0.0, 1.0], (200, 3))
    )
    segments = np.ascontiguousarray(np.stack([touch - along, touch + 2.0 * along], axis=1)[:, :, :dimension])
    pieces, accuracy = clip_segments(segments, Sphere([0.0] * dimension, 1.0), report=True)
    assert accuracy.n_rational <= 2
    assert 50 < len(pieces) < 150
    check(segments, Sphere([0.0] * dimension, 1.0))


def test_a_tangent_of_whole_numbers_is_a_point() -> None:
    lengths = np.arange(1.0, 9.0)[:, None]
    touch, along = np.array([3.0, 4.0]), np.array([-4.0, 3.0])
    segments = np.stack([touch - lengths * along, touch + 3.0 * along * np.ones((8, 1))], axis=1)
    pieces = clip_segments(segments, Sphere([0.0, 0.0], 5.0))
    assert pieces.start.tolist() == pieces.end.tolist() == [[3.0, 4.0]] * 8
    check(segments, Sphere([0.0, 0.0], 5.0))


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
