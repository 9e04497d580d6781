"""Rings cut by one plane after another."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from engine import Polyhedron, UnsupportedSolidError
from engine.polygon_clipping.clip_polygons import ClippedPolygons, clip_polygons
from engine.polygon_clipping.planes import plan_of
from engine.polygon_clipping.rings import Cutting, PlaneTables, has_bridges, plane_of
from tests.unit.polygon_clipping.test_clip_polygons import regions_of, rings_of

CUBE = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], float)


def planes(faces: list[list[int]], vertices: np.ndarray = CORNERS) -> list:
    return plan_of(Polyhedron(vertices, faces), lambda: None).rows


def test_a_cube_has_six_planes_whichever_way_its_faces_are_turned() -> None:
    assert len(planes(CUBE)) == 6
    assert set(planes([face[::-1] for face in CUBE])) == set(planes(CUBE))


def test_a_face_without_area_goes_the_long_way() -> None:
    sliver = [*CUBE[:5], [4, 5, 7], [4, 7, 8], [4, 8, 6], [6, 8, 7]]
    middle = np.concatenate([CORNERS, [[0.5, 0.5, 1.0]]])
    assert set(planes(sliver, middle)) == set(planes(CUBE))


def test_a_dent_is_refused_with_its_face() -> None:
    dented = np.concatenate([CORNERS, [[0.5, 0.5, 0.5]]])
    with pytest.raises(UnsupportedSolidError, match="not convex"):
        planes([*CUBE[:5], [4, 5, 8], [5, 7, 8], [7, 6, 8], [6, 4, 8]], dented)


# --- What the compiled clipping of polygons hands on ---


def test_bridges_need_a_plane_that_dropped_a_vertex_and_was_met_in_more_than_two_points() -> None:
    cutting = Cutting(np.arange(3), np.zeros(3), np.array([2, 4, 3]), np.array([True, False, True]))
    assert [has_bridges(cutting, n) for n in range(4)] == [False, False, False, True]


def test_a_plane_is_one_row_of_the_tables() -> None:
    high = np.array([[1.0, 0.0, 2.0], [1.0, 1.0, 0.5]])
    heap = np.zeros(0, np.int64)
    tables = PlaneTables(high, np.zeros((2, 3)), np.array([0, -1]), np.array([-2.0, 0.0]), heap, heap)
    assert [(plane_of(tables, i).number, plane_of(tables, i).axis, plane_of(tables, i).place) for i in range(2)] == [
        (0, 0, -2.0),
        (1, -1, 0.0),
    ]


# --- The kernel, whichever of its arithmetics settles a polygon, against exact integers ---


def test_kernel_and_exact_integers_agree(monkeypatch: pytest.MonkeyPatch, pytestconfig: pytest.Config) -> None:
    """What the kernel settles is what exact integers settle, bit by bit, bridges included."""
    n = 3000 if pytestconfig.getoption("--full") else 60
    for dimension in (2, 3):
        rng = np.random.default_rng(dimension)
        polygons = [
            [ring[j : j + 4] for j in range(0, len(ring), 4)]
            for ring in itertools.chain(*rings_of(rng, n, dimension).values())
        ]
        for region in regions_of(rng, dimension):
            both = [clip_polygons(polygons, region)]
            with monkeypatch.context() as patch:
                patch.setattr("engine.polygon_clipping.clip_polygons.kernel_scene", lambda *_: None)
                both.append(clip_polygons(polygons, region))
            for name in ClippedPolygons.__slots__:
                np.testing.assert_array_equal(getattr(both[0], name), getattr(both[1], name), err_msg=str(region))
