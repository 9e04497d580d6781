"""Exact beside plain: where they differ is where the textbook's own method says otherwise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import engine
from engine.textbook import clip_segments, polygons

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
RING = [[0.0, 0.0], [0.7, 0.1], [0.9, 0.8], [0.1, 0.6]]


def points_on_edges(n: int) -> Any:
    source, ring = np.random.default_rng(0), np.array(RING)
    edge, t = source.integers(4, size=n), source.uniform(size=(n, 1))
    return ring[edge] * (1 - t) + ring[(edge + 1) % 4] * t


def test_points_differ_where_the_book_differs() -> None:
    points, polygon = points_on_edges(500), engine.Polygon([RING])
    for method in ("half-line", "signed angles", "unsigned angles", "same side"):
        found = engine.compare("contains", points, polygon, method=method)
        assert found.method == method
        assert np.array_equal(found.exact, engine.contains(points, polygon))
        assert np.array_equal(found.differing, np.flatnonzero(found.exact != found.plain))
        assert len(found.inexact) == 0
        assert min(found.seconds_exact, found.seconds_plain) > 0
    plain = polygons.by_half_line(points, polygon.vertices, polygon.ring_offsets)
    assert np.array_equal(engine.compare("contains", points, polygon).plain, plain)
    assert len(engine.compare("contains", points, polygon).differing) > 0


def test_segments_differ_in_what_is_kept_and_in_coordinates() -> None:
    source, box = np.random.default_rng(1), engine.Aabb([0.1, 0.1], [0.7, 0.9])
    corners, reach = np.array([0.1, 0.9]), source.uniform(0.1, 1.0, (300, 2))
    segments = np.stack([corners - reach, corners + reach * source.uniform(0.5, 2.0, (300, 1))], axis=1)
    found = engine.compare("clip_segments", segments, box)
    clipped, kept = clip_segments.on_box(segments, box.min, box.max)
    exact = np.zeros(300, bool)
    exact[engine.clip_segments(segments, box).source] = True
    assert np.array_equal(found.differing, np.flatnonzero((kept == 1) != exact))
    assert not set(found.differing) & set(found.inexact)
    assert np.array_equal(found.plain[kept == 1], clipped[kept == 1].reshape(-1, 4))


@pytest.mark.parametrize("method", ["vertices in the other", "edges through faces", "volumes first"])
def test_bodies(method: str) -> None:
    first = engine.Polyhedron(CORNERS, FACES)
    inside = engine.Polyhedron(0.1 * CORNERS + 0.1, FACES)
    found = engine.compare("collide", first, inside, method=method)
    assert found.exact.tolist() == [True]
    assert found.differing.tolist() == ([0] if method == "edges through faces" else [])


@pytest.mark.parametrize(
    "region", [engine.HalfSpace([1.0, 0.0], -0.5), engine.Aabb([0.5, 0.5], [1, 1]), engine.Convex([[1.0, 0.0, -0.5]])]
)
def test_polygons(region: Any) -> None:
    polygons = np.random.default_rng(2).uniform(0, 1, (50, 4, 2))
    found = engine.compare("clip_polygons", polygons, region)
    assert found.exact.tolist() == found.plain.tolist()


SOLIDS = [
    engine.HalfSpace([1.0, 2.0, 3.0], -1.0), engine.Convex([[1.0, 2.0, 3.0, -1.0], [0.0, 0.0, -1.0, 1.0]]),
    engine.Polyhedron(CORNERS, FACES), engine.Triangle(CORNERS[:3]), engine.Triangle(CORNERS[:3, :2]),
    engine.Aabb([-0.5, -0.2, 0.1], [0.3, 0.9, 0.7]), engine.Implicit(powers=[[2, 0], [0, 0]], coefficients=[-1.0, 0.3]),
    engine.Csg("difference", [engine.Aabb([-1.0] * 3, [0.5] * 3), engine.Polyhedron(CORNERS, FACES)]),
    engine.Csg("union", [engine.Aabb([0.0, 0.0], [0.5, 0.5]), engine.Triangle(CORNERS[:3, :2]),
                         engine.Csg("intersection", [engine.HalfSpace([1.0, 0.5], 0.2)])]),
]  # fmt: skip


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: f"{solid.type} {solid.dimension}D")
def test_every_method_answers_for_easy_points(solid: Any) -> None:
    points = np.random.default_rng(3).uniform(-1, 1, (100, solid.dimension))
    for method in engine.compare("contains", points, solid).methods:
        found = engine.compare("contains", points, solid, method=method)
        assert len(found.differing) == 0, method
    assert engine.compare("contains", points[:0], solid).exact.shape == (0,)


def test_refusals() -> None:
    box, large = engine.Aabb([0, 0], [1, 1]), np.zeros((1, 2))
    with pytest.raises(engine.InvalidOperationError, match="one of contains, collide"):
        engine.compare("locate", large, box)  # type: ignore[arg-type]
    with pytest.raises(engine.UnsupportedSolidError, match="no method for contains with sphere") as refused:
        engine.compare("contains", large, engine.Sphere([0, 0], 1))
    assert refused.value.where == ("solid",)
    with pytest.raises(engine.InvalidOperationError, match="one of Cohen-Sutherland"):
        engine.compare("clip_segments", np.zeros((1, 2, 2)), box, method="x")
    with pytest.raises(engine.WrongDimensionError, match=r"got shape \(1, 3\)"):
        engine.compare("contains", np.zeros((1, 3)), engine.Polygon([RING]))
    with pytest.raises(engine.DeadlineExceededError):
        engine.compare("contains", points_on_edges(10), engine.Polygon([RING]), deadline=0.0)
