"""The fast references say what the slow ones say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.reference import fast_clipping, fast_overlay
from tests.reference.containment import locate_many
from tests.reference.many_points import locate_points
from tests.reference.overlay import OPERATIONS, overlay
from tests.reference.segments import clip_segments
from tests.reference.shapes import box, polygon, tetrahedron, union_of
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


# --- The fast reference for many points against the slow one ---


def triangulated(solid: dict[str, Any]) -> tuple[Any, Any]:
    faces = [[face[0], face[k], face[k + 1]] for face in solid["faces"] for k in range(1, len(face) - 1)]
    return np.array(solid["vertices"], float), np.array(faces)


SPIRE = tetrahedron((0, 0, 0), (4, 1, 0), (1, 4, 0), (2, 2, 4))
SOLIDS = [
    box((0, 0, 0), (4, 4, 4)),
    union_of(box((0, 0, 0), (3, 3, 3)), box((1, 1, 1), (4, 4, 2)), SPIRE),
    union_of(box((0, 0, 0), (2, 2, 2)), box((0, 0, 0), (2, 2, 2)), box((2, 0, 0), (4, 2, 2))),
    union_of(box((0, 0, 0), (1, 4, 4)), box((1, 1, 1), (1, 3, 3))),  # the second without a volume
]


@pytest.mark.parametrize("number", range(len(SOLIDS)))
@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (5e-324, 0.0), (2.0**900, 0.0), (0.1, 1e9), (1e-5, 1.0)])
def test_equal_to_the_slow_reference(number: int, scale: float, offset: float) -> None:
    vertices, faces = triangulated(SOLIDS[number])
    axis = np.arange(-1.0, 6.0)
    points = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)[number::7]
    points = np.concatenate([points, np.random.default_rng(number).uniform(-1, 5, (10, 3))])
    vertices, points = vertices * scale + offset, points * scale + offset
    solid = {"type": "polyhedron", "vertices": vertices.tolist(), "faces": faces.tolist()}
    assert locate_points(points, vertices, faces).tolist() == locate_many(points.tolist(), solid)


@pytest.mark.data
@pytest.mark.parametrize("name", ["c3d_spot_off1e6", "syn_bracket_off1e9", "syn_menger2", "syn_sliver_uv"])
def test_equal_to_the_answers_of_the_hard_sets(data: Path, name: str) -> None:
    case = np.load(data / "hard_containment" / f"{name}.npz")
    some = slice(None, None, 7)
    assert (locate_points(case["points"][some], case["vertices"], case["faces"]) == case["location"][some]).all()
