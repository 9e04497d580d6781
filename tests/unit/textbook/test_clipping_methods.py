"""The textbook's clipping: right on easy input, wrong or without end where it is known to be."""

from __future__ import annotations

import numpy as np
import pytest

from engine.textbook import clip_polygons, clip_segments
from engine.textbook.clip_segments import ACCEPTED, REJECTED, UNFINISHED
from tests.reference.overlay import overlay, signed_area
from tests.reference.segments import clip_segment
from tests.reference.shapes import aabb, polygon, sphere

LOW, HIGH = np.zeros(3), np.full(3, 4.0)


def scattered(n: int, dim: int) -> np.ndarray:
    return np.random.default_rng(11).uniform(-4.0, 8.0, (n, 2, dim))


def assert_equal_to_reference(segments: np.ndarray, clipped: np.ndarray, kept: np.ndarray, region: dict) -> None:
    for segment, found, is_kept in zip(segments.tolist(), clipped, kept, strict=True):
        pieces = clip_segment(segment, region)
        assert bool(is_kept) == bool(pieces)
        if pieces:
            start, end, _ = pieces[0].rounded()
            np.testing.assert_allclose(found, [start, end], rtol=0, atol=1e-13)


def test_segment_on_half_space() -> None:
    segments = np.array([[[0.0, 0.0], [4.0, 0.0]], [[2.0, 1.0], [3.0, 1.0]], [[0.0, 0.0], [1.0, 1.0]]])
    clipped, kept = clip_segments.on_half_space(segments, np.array([1.0, 0.0]), -1.5)
    assert kept.tolist() == [True, True, False]
    assert clipped[0].tolist() == [[1.5, 0.0], [4.0, 0.0]]
    clipped, _ = clip_segments.on_half_space(segments[:, ::-1].copy(), np.array([1.0, 0.0]), -1.5)
    assert clipped[0].tolist() == [[4.0, 0.0], [1.5, 0.0]]


@pytest.mark.parametrize("dim", [2, 3])
def test_cohen_sutherland(dim: int) -> None:
    segments = scattered(150, dim)
    clipped, status = clip_segments.on_box(segments, LOW[:dim], HIGH[:dim])
    assert_equal_to_reference(segments, clipped, status == ACCEPTED, aabb([0] * dim, [4] * dim))
    assert 0 < (status == REJECTED).sum() < 150


def test_cohen_sutherland_never_ends() -> None:
    """The cut point is rounded to just below the plane it was put on, again and again."""
    segment = np.array([[[1.0, 1.0], [-1.0, -1.0]]])
    _, status = clip_segments.on_box(segment, np.array([1e-9, 1e-9]), np.array([3.0, 3.0]))
    assert status[0] == UNFINISHED
    assert clip_segment(segment[0].tolist(), aabb([1e-9, 1e-9], [3, 3]))


def test_cohen_sutherland_accepts_what_misses_a_corner() -> None:
    segment = np.array([[[-7.5, 4.0], [6.0, -3.2]]])
    _, status = clip_segments.on_box(segment, np.zeros(2), np.full(2, 9.0))
    assert status[0] == ACCEPTED
    assert clip_segment(segment[0].tolist(), aabb([0, 0], [9, 9])) == []


def test_convex_cohen_sutherland() -> None:
    rows = [[1, 0, 0, 0], [-1, 0, 0, 4], [0, 1, 0, 0], [0, -1, 0, 4], [0, 0, 1, 0], [0, 0, -1, 4]]
    planes = np.array([*rows, [-1, -1, -1, 8]], float)
    segments = scattered(150, 3)
    clipped, status = clip_segments.on_convex(segments, planes)
    done = status != UNFINISHED
    region = {"type": "convex", "planes": planes.tolist()}
    assert_equal_to_reference(segments[done], clipped[done], status[done] == ACCEPTED, region)
    assert done.mean() > 0.9


def test_convex_cohen_sutherland_fails_to_end_often() -> None:
    planes = np.array([[3.0, 1.0, -1.0], [-1.0, 3.0, -1.1], [-1.0, -1.0, 7.3]])
    segment = np.array([[[3.4000000000000004, 1.7000000000000002], [-4.4, -4.2]]])
    assert clip_segments.on_convex(segment, planes)[1][0] == UNFINISHED
    _, status = clip_segments.on_convex(scattered(2000, 2), planes)
    assert (status == UNFINISHED).mean() > 0.02


@pytest.mark.parametrize("dim", [2, 3])
def test_segment_on_sphere(dim: int) -> None:
    segments = scattered(150, dim)
    clipped, kept = clip_segments.on_sphere(segments, np.full(dim, 2.0), 3.0)
    assert_equal_to_reference(segments, clipped, kept, sphere([2] * dim, 3))
    points = np.array([[[2.0] * dim] * 2, [[9.0] * dim] * 2])
    assert clip_segments.on_sphere(points, np.full(dim, 2.0), 3.0)[1].tolist() == [True, False]


def test_segment_on_sphere_is_wrong_beside_a_tangent() -> None:
    segment, center, radius = [[0.7000000000000001, 1.6], [9.1, 7.5]], [5.4, 0.4], 3.683394093369894
    assert clip_segments.on_sphere(np.array([segment]), np.array(center), radius)[1][0]
    assert clip_segment(segment, sphere(center, radius)) == []


def test_sutherland_hodgman() -> None:
    triangle = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]])
    planes = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, -1.0]])
    (contour,) = clip_polygons.on_convex([triangle], planes)
    assert contour.tolist() == [[3.0, 1.0], [1.0, 3.0], [1.0, 1.0]]
    assert clip_polygons.clip_polygon([triangle], np.array([1.0, 0.0]), -9.0) == []


def test_sutherland_hodgman_leaves_bridges_and_clips_holes() -> None:
    comb = np.array([[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]], float)
    (left,) = clip_polygons.clip_polygon([comb], np.array([0.0, 1.0]), -2.0)
    assert len(left) == 8  # two parts, one ring
    frame = [np.array([[0, 0], [6, 0], [6, 6], [0, 6]], float), np.array([[2, 2], [4, 2], [4, 4], [2, 4]], float)]
    outer, hole = clip_polygons.clip_polygon(frame, np.array([1.0, 0.0]), -3.0)
    assert (signed_area(outer.tolist()), signed_area(hole.tolist())) == (18, 2)


def test_sutherland_hodgman_keeps_what_an_earlier_step_rounded() -> None:
    """The exact crossing is outside the second plane by less than an ulp; its rounded stand-in is on it."""
    triangle = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 3.0]])
    third = -1.0 / 3.0
    (contour,) = clip_polygons.on_convex([triangle], np.array([[0.0, 1.0, -1.0], [1.0, 0.0, 2 * third]]))
    assert len(contour) >= 1
    assert contour[:, 0].min() == 2.0 / 3.0  # the exact 2/3 is larger than the double: a whole sliver was kept


def test_polygon_on_concave_polygon() -> None:
    comb = np.array(
        [[0, 0], [5, 0], [5, 4], [4, 4], [4, 1], [3, 1], [3, 4], [2, 4], [2, 1], [1, 1], [1, 4], [0, 4]], float
    )
    bar = np.array([[-0.5, 2.0], [5.5, 2.25], [5.5, 3.0], [-0.5, 3.25]])
    rings = clip_polygons.intersection(comb, bar)
    exact = overlay(polygon(comb.tolist()), polygon(bar.tolist()), "intersection")
    assert len(rings) == len(exact.pieces) == 3
    assert sum(abs(signed_area(ring.tolist())) for ring in rings) == pytest.approx(float(exact.area), rel=1e-14)
    small = np.array([[0.25, 0.25], [0.5, 0.25], [0.5, 0.5]])
    assert clip_polygons.intersection(comb, small)[0].tolist() == small.tolist()
    assert clip_polygons.intersection(small, comb)[0].tolist() == small.tolist()
    assert clip_polygons.intersection(small + 10.0, comb) == []


def test_polygon_on_concave_polygon_is_wrong_when_edges_overlap() -> None:
    first, second = np.array([[0, 0], [4, 0], [4, 4], [0, 4]], float), np.array([[0, 0], [2, 0], [2, 6], [0, 6]], float)
    exact = overlay(polygon(first.tolist()), polygon(second.tolist()), "intersection")
    found = clip_polygons.intersection(first, second)
    assert exact.area == 8
    assert sum(abs(signed_area(ring.tolist())) for ring in found) != 8
