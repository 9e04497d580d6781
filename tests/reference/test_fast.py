"""The quick references against the slow ones, on scenes of every kind."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference import fast_clipping, fast_overlay
from tests.reference.overlay import OPERATIONS, overlay
from tests.reference.segments import clip_segments
from tests.reference.shapes import polygon
from tests.reference.sutherland_hodgman import clip_contour, planes_of, rounded, same_cycle
from tests.unit.segment_clipping.large_scenes import SHAPES, scene_of_contours, scene_of_segments
from tests.unit.segment_clipping.scenes import as_json


@pytest.mark.parametrize("kind", SHAPES)
def test_segments(kind: str, pytestconfig: pytest.Config) -> None:
    for seed in range(40 if pytestconfig.getoption("--full") else 2):
        region, segments = scene_of_segments(np.random.default_rng([3, seed]), kind, 1)
        slow = [
            (source, (*piece.rounded(), piece.faces))
            for source, piece in clip_segments(segments.tolist(), as_json(region))
        ]
        assert fast_clipping.clip_segments(segments.tolist(), as_json(region)) == slow


@pytest.mark.parametrize("kind", ["half_space", "aabb", "convex", "convex_polyhedron"])
def test_polygons(kind: str, pytestconfig: pytest.Config) -> None:
    for seed in range(40 if pytestconfig.getoption("--full") else 3):
        region, polygons = scene_of_contours(np.random.default_rng([4, seed]), kind, 1)
        planes, rows = fast_clipping.planes_of(as_json(region)), planes_of(as_json(region))
        for rings in polygons:
            fast = fast_clipping.clip_polygon([ring.tolist() for ring in rings], planes)[0]
            for found, ring in zip(fast, rings, strict=True):
                expected = rounded(clip_contour(ring.tolist(), rows))
                assert found == expected or same_cycle(found, expected)


def test_overlay_areas(pytestconfig: pytest.Config) -> None:
    rng = np.random.default_rng(5)
    for seed in range(300 if pytestconfig.getoption("--full") else 12):
        rings = [
            (rng.integers(0, 4, (int(rng.integers(3, 6)), 2)) + (seed % 3) * rng.integers(-1, 2, 2) * 2.0**-50).tolist()
            for _ in range(3)
        ]
        found = fast_overlay.areas(rings[:2], rings[2:])
        for operation in OPERATIONS:
            assert found.of(operation) == overlay(polygon(*rings[:2]), polygon(rings[2]), operation).area
