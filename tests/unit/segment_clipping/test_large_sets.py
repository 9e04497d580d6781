"""Hundreds of thousands of generated cases for each kind of region: every decision and every double is the exact one.

A few scenes of each kind by default; with --full at least 100,000 segments and 100,000 polygons for each kind. All of
them are compared with tests/reference/fast_clipping.py: which pieces there are, their faces, and every coordinate and
parameter to the bit, so the largest error is 0.5 ulp.
"""

from __future__ import annotations

import numpy as np
import pytest

from engine.errors import FaceNotSimpleError, UnsupportedSolidError
from engine.polygon_clipping.clip_polygons import PolygonStatus, clip_polygons
from engine.segment_clipping.clip_segments import clip_segments
from tests.reference import fast_clipping
from tests.reference.sutherland_hodgman import same_cycle
from tests.unit.segment_clipping.large_scenes import SHAPES, scene_of_contours, scene_of_segments
from tests.unit.segment_clipping.scenes import as_json

POLYGON_REGIONS = ["half_space", "aabb", "convex", "convex_polyhedron"]
BLOCKS, CASES = 10, 10_000


def check_segments(seed: list[int], kind: str, n: int) -> int:
    """Check 8 n segments on one region; return how many were."""
    region, segments = scene_of_segments(np.random.default_rng(seed), kind, n)
    try:
        expected = fast_clipping.clip_segments(segments.tolist(), as_json(region))
    except fast_clipping.FlatFaceError:  # rounding at its place took a face's area; test_concave.py has such solids
        return 0
    pieces = clip_segments(segments, region, workers=1)
    found = list(zip(*(array.tolist() for array in (pieces.source, pieces.start, pieces.end, pieces.t, pieces.faces))))
    exact = [(source, start, end, t, list(faces)) for source, (start, end, t, faces) in expected]
    assert found == exact, [pair for pair in zip(found, exact) if pair[0] != pair[1]][:3]
    for array in (pieces.start, pieces.end, pieces.t):
        assert not np.signbit(array[array == 0.0]).any()
    is_next = pieces.source[1:] == pieces.source[:-1]
    assert (pieces.t[1:, 0][is_next] >= pieces.t[:-1, 1][is_next]).all(), "pieces overlap"
    return len(segments)


def check_polygons(seed: list[int], kind: str, n: int) -> int:
    """Check up to 7 n polygons on one region; return how many were."""
    try:
        region, polygons = scene_of_contours(np.random.default_rng(seed), kind, n)
        clipped = clip_polygons(polygons, region, workers=1)
    except (FaceNotSimpleError, UnsupportedSolidError):  # a face without area; rounding made a polyhedron concave
        return 0
    planes = fast_clipping.planes_of(as_json(region))
    assert (clipped.status == PolygonStatus.CLIPPED).all()
    for i, rings in enumerate(polygons):
        exact, may_have_bridges = fast_clipping.clip_polygon([ring.tolist() for ring in rings], planes)
        found = [ring.tolist() for ring in clipped.rings(i)]
        first, last = clipped.polygon_offsets[i : i + 2]
        assert clipped.contours[first:last].tolist() == [j for j, ring in enumerate(exact) if ring], i
        for ring, expected in zip(found, filter(None, exact), strict=True):
            assert same_cycle(ring, expected), (i, ring, expected)
        assert clipped.may_have_bridges[i] == may_have_bridges, i
    assert not np.signbit(clipped.vertices[clipped.vertices == 0.0]).any()
    return len(polygons)


@pytest.mark.parametrize("kind", SHAPES)
def test_segments_sample(kind: str) -> None:
    for seed in range(5):
        check_segments([seed], kind, 3)


@pytest.mark.parametrize("kind", POLYGON_REGIONS)
def test_polygons_sample(kind: str) -> None:
    for seed in range(5):
        check_polygons([seed], kind, 3)


@pytest.mark.full
@pytest.mark.parametrize("block", range(BLOCKS))
@pytest.mark.parametrize("kind", SHAPES)
def test_segments(kind: str, block: int) -> None:
    n_checked = seed = 0
    while n_checked < CASES:  # bound: a scene has some forty segments that stay finite
        n_checked += check_segments([1, block, seed], kind, 6)
        seed += 1


@pytest.mark.full
@pytest.mark.parametrize("block", range(BLOCKS))
@pytest.mark.parametrize("kind", POLYGON_REGIONS)
def test_polygons(kind: str, block: int) -> None:
    n_checked = seed = 0
    while n_checked < CASES:  # bound: as above
        n_checked += check_polygons([2, block, seed], kind, 6)
        seed += 1
