"""Segments on boxes: the loop ends, ties go to the smaller plane, pieces stay in the box; meetings keep their bound."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from engine.predicates.cut_point import T_BOUND
from engine.segment_clipping.clip_segments import clip_segments
from engine.segment_clipping.cohen_sutherland import compare_parameters, plane_crossing
from engine.solids.primitives import Aabb, Convex
from tests.unit.segment_clipping.scenes import through


def test_the_textbook_loop_that_never_ends() -> None:
    pieces = clip_segments([[[1.0, 1.0], [-1.0, -1.0]]], Aabb([1e-9, 1e-9], [3, 3]))
    assert pieces.end.tolist() == [[1e-9, 1e-9]]
    assert pieces.faces.tolist() == [[-1, 0]]


def test_faces_and_touching_points_by_hand() -> None:
    box = Aabb([0, 0], [2, 2])
    cases: list[tuple[Any, Any, Any]] = [
        ([[-1, -1], [3, 3]], (0.25, 0.75), (0, 1)),  # through two corners: smallest plane
        ([[-1, 1], [1, -1]], (0.5, 0.5), (0, 2)),  # touches a corner
        ([[0, 0], [-1, 0]], (0.0, 0.0), (-1, 0)),  # leaves at once
        ([[-1, 0], [0, 0]], (1.0, 1.0), (0, -1)),  # arrives at the end
        ([[-1, 0], [3, 0]], (0.25, 0.75), (0, 1)),  # in a face
        ([[1, 1], [1, 1]], (0.0, 1.0), (-1, -1)),  # a point inside
        ([[2, 2], [2, 2]], (0.0, 1.0), (-1, -1)),  # a point on a corner
    ]
    for region in (box, Convex([[1, 0, 0], [-1, 0, 2], [0, 1, 0], [0, -1, 2]])):
        pieces = clip_segments(np.array([case[0] for case in cases], float), region)
        assert pieces.source.tolist() == list(range(len(cases)))
        assert [tuple(t) for t in pieces.t] == [case[1] for case in cases]
        assert [tuple(faces) for faces in pieces.faces] == [case[2] for case in cases]
    assert len(clip_segments([[[3.0, 3.0], [3.0, 3.0]]], box)) == 0


def test_boxes_are_idempotent_and_hold_their_pieces() -> None:
    rng = np.random.default_rng(10)
    box = Aabb(rng.uniform(-1, 0, 3), rng.uniform(0, 1, 3))
    segments = through(rng, np.array([box.min, box.max]), 3000)
    pieces = clip_segments(segments, box)
    assert ((pieces.start >= box.min) & (pieces.start <= box.max)).all()
    again = clip_segments(np.stack([pieces.start, pieces.end], axis=1), box)
    assert again.source.tolist() == list(range(len(pieces)))
    np.testing.assert_array_equal(again.start, pieces.start)
    np.testing.assert_array_equal(again.end, pieces.end)
    assert (again.faces == -1).all()


def rational(numbers: np.ndarray) -> list[Fraction]:
    return [Fraction(number) for number in numbers.tolist()]


def test_parameters_are_within_their_bound_and_in_their_order() -> None:
    rng = np.random.default_rng(1)
    n_sure = 0
    for _ in range(200):
        ends = rng.integers(-6, 7, (2, 2)) / 3 if rng.random() < 0.5 else rng.integers(-6, 7, (2, 2)) / 2
        places = rng.integers(-3, 4, 2) / 2
        if (ends[:, 0] == ends[:, 1]).any():
            continue
        found = [
            plane_crossing(p, q, at, float(k)) for k, ((p, q), at) in enumerate(zip(ends.tolist(), places.tolist()))
        ]
        exact = [Fraction(at - p) / Fraction(q - p) for (p, q), at in zip(map(rational, ends), rational(places))]
        for m, t in zip(found, exact):
            assert abs(Fraction(m.t) + Fraction(m.t_low) - t) <= Fraction(T_BOUND) * abs(t)
        gap, is_sure = compare_parameters(*found)
        n_sure += is_sure
        if is_sure:
            assert (gap > 0) - (gap < 0) == (exact[0] > exact[1]) - (exact[0] < exact[1])
    assert n_sure > 100
