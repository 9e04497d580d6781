"""Ragged arrays in and out: views, repeated ends, holes, GeoJSON of polygons and overlays, what is refused."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import engine
from engine import Polygon, overlay, overlay_batch, polygons
from engine.errors import InvalidArrayError, NotFiniteError, RingTooShortError, WrongDimensionError
from engine.polygon_overlay.pair_arrays import PolygonSelection, arrays_of, concatenate_polygons
from engine.solids.ragged import are_among, ascending, closed_rings

SQUARE = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]
HOLE = [[1.0, 1.0], [1.0, 2.0], [2.0, 2.0]]


def ring_lists(polygon: Polygon) -> list[Any]:
    stops = polygon.ring_offsets.tolist()
    return [polygon.vertices[i:j].tolist() for i, j in pairwise(stops)]


def test_polygons_are_views_of_the_callers_array() -> None:
    rings = [SQUARE, [*SQUARE, SQUARE[0]], SQUARE, HOLE, [*SQUARE, SQUARE[0]], [*HOLE, HOLE[0]]]
    coordinates = np.array([position for ring in rings for position in ring])
    found = polygons(coordinates, np.cumsum([0, *map(len, rings)], dtype=np.int32), [0, 1, 2, 4, 4, 6])
    assert [ring_lists(each) for each in found] == [[SQUARE], [SQUARE], [SQUARE, HOLE], [], [SQUARE, HOLE]]
    shared = [np.shares_memory(each.vertices, coordinates) for each in found]
    assert shared[:2] == [True, True]
    assert not any(each.vertices.flags.writeable for each in found)
    part = polygons(coordinates, np.cumsum([0, *map(len, rings)]), [1, 2])
    assert ring_lists(part[0]) == [SQUARE]
    zero = polygons([[-0.0, 0], [1, 0], [1, 1]], [0, 3], [0, 1])[0]
    assert not np.signbit(zero.vertices).any()


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ((SQUARE, [0, 5], [0, 1]), InvalidArrayError),
        ((SQUARE, [0, 4], [0, 2]), InvalidArrayError),
        ((SQUARE, [0, 3, 2], [0, 2]), InvalidArrayError),
        ((SQUARE, [0.0, 4.0], [0, 1]), InvalidArrayError),
        ((SQUARE, [], [0]), InvalidArrayError),
        (([[0, 0, 0]] * 4, [0, 4], [0, 1]), WrongDimensionError),
        (([*SQUARE, [0, np.nan]], [0, 5], [0, 1]), NotFiniteError),
        ((SQUARE, [0, 1, 4], [0, 2]), RingTooShortError),
    ],
)
def test_what_is_wrong_is_refused(arguments: Any, error: Any) -> None:
    with pytest.raises(error):
        polygons(*arguments)
    with pytest.raises(error):
        arrays_of(*arguments)


def test_arrays_are_those_of_objects() -> None:
    rings = [SQUARE, [*SQUARE, SQUARE[0]], HOLE, SQUARE, [[5, 5], [6, 6]]]
    offsets = np.cumsum([0, *map(len, rings)])
    flat = [position for ring in rings for position in ring]
    arrays = arrays_of(flat, offsets, [0, 1, 3, 3, 5])  # the last ring has no area, and is left out
    assert [ring_lists(arrays.polygon(k)) for k in range(4)] == [[SQUARE], [SQUARE, HOLE], [], [SQUARE]]
    assert arrays.sizes().tolist() == [4, 7, 0, 4]
    some = PolygonSelection(arrays, np.array([3, 1, 2, 1]))
    assert [ring_lists(each) for each in some[1:]] == [[SQUARE, HOLE], [], [SQUARE, HOLE]]
    assert some.n_vertices == 18
    assert [ring_lists(concatenate_polygons([arrays, some.arrays()]).polygon(k)) for k in (4, 5)] == [
        [SQUARE],
        [SQUARE, HOLE],
    ]
    assert ring_lists(arrays.merged(np.array([0, 2])).polygon(0)) == [SQUARE, SQUARE, HOLE]
    found: Any = overlay_batch(some, PolygonSelection(arrays, np.array([1, 0, 0, 2])), "difference")
    expected: Any = overlay_batch(list(some), [arrays.polygon(k) for k in (1, 0, 0, 2)], "difference")
    for name in ("vertices", "ring_offsets", "piece_offsets", "pair_offsets", "areas", "n_pieces_exact"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    assert [each.area for each in found] == [0.5, 0.0, 0.0, 15.5]


def test_batches_come_back() -> None:
    batch: Any = overlay_batch([Polygon([SQUARE])] * 2, [Polygon([HOLE])] * 2, "difference")
    positions, (rings, parts, pairs) = batch.ragged
    assert pairs.tolist() == [0, 1, 2]
    for polygon in polygons(positions, rings, parts):
        assert engine.union_all([polygon]).area == 15.5
    assert closed_rings(np.zeros((0, 2)), np.zeros(1, np.int64))[1].tolist() == [0]


def test_polygons_and_overlays_speak_geojson() -> None:
    holed = overlay(Polygon([SQUARE]), Polygon([HOLE]), "difference")
    told: Any = holed.__geo_interface__
    assert told["type"] == "Polygon"
    assert [ring[0] == ring[-1] for ring in told["coordinates"]] == [True, True]
    again = Polygon(holed)
    assert again.__geo_interface__ == told
    bow = Polygon([[[0, 0], [2, 2], [2, 0], [0, 2]]])
    assert bow.__geo_interface__["type"] == "MultiPolygon"
    assert Polygon([]).__geo_interface__ == {"type": "MultiPolygon", "coordinates": []}

    parts = {"type": "MultiPolygon", "coordinates": [[SQUARE], [[[x + 1, y] for x, y in SQUARE]]]}
    assert engine.union_all([Polygon(SimpleNamespace(__geo_interface__=parts))]).area == 20.0


def test_shapely_passes_through() -> None:
    shapely = pytest.importorskip("shapely")
    shape = shapely.Polygon(SQUARE, [HOLE])
    assert shapely.geometry.shape(Polygon(shape)).equals(shape)
    assert shapely.geometry.shape(overlay(Polygon(shape), Polygon([SQUARE]))).equals(shape)
    shapes = shapely.box(np.arange(9.0), 0, np.arange(9.0) + 2, 1)
    _, positions, (rings, parts) = shapely.to_ragged_array(shapes)
    sides = polygons(positions, rings, parts)
    batch: Any = overlay_batch(sides[:-1], sides[1:])
    found = shapely.from_ragged_array(shapely.GeometryType.MULTIPOLYGON, *batch.ragged)
    assert shapely.equals(found, shapely.intersection(shapes[:-1], shapes[1:])).all()


@pytest.mark.parametrize("shape", [(0,), (1,), (40,), (12, 3)])
def test_integers_once_in_order_and_which_are_among_them(shape: tuple[int, ...]) -> None:
    numbers = np.random.default_rng(1).integers(-9, 9, shape)
    once = ascending(numbers)
    assert once.tolist() == sorted(set(numbers.ravel().tolist()))
    asked = np.arange(-12, 12)
    assert are_among(asked, once).tolist() == [k in once.tolist() for k in asked.tolist()]
