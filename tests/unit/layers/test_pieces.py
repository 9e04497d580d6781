"""Splits, slivers, gaps, altitudes, the antimeridian, streams: what layers are made into besides overlays and joins."""

from __future__ import annotations

import warnings
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import engine
from engine.errors import InvalidInputError, UnsupportedSolidError
from engine.layers.pieces import width_square

geopandas = pytest.importorskip("geopandas")
shapely = pytest.importorskip("shapely")
layers = engine.layers
RNG = np.random.default_rng(51)


def polygon(n: int, size: int) -> Any:
    while True:
        made = shapely.Polygon(RNG.integers(0, size, (n, 2)).astype(float))
        if made.is_valid and made.area:
            return made


def frame(*shapes: Any) -> Any:
    return geopandas.GeoDataFrame({"n": range(len(shapes))}, geometry=[*shapes])


def collection(*shapes: Any) -> Any:
    return frame(*shapes).__geo_interface__


def areas_of(pieces: Any) -> list[float]:
    made = [np.split(piece.vertices, piece.ring_offsets[1:-1]) for piece in pieces]
    return sorted(shapely.Polygon(rings[0], rings[1:]).area for rings in made)


def test_pieces_are_the_faces_within() -> None:
    for _ in range(60):
        body = polygon(int(RNG.integers(3, 8)), 8)
        lines = [shapely.LineString(RNG.integers(-1, 9, (3, 2)).astype(float)) for _ in range(2)]
        faces = shapely.get_parts(
            shapely.polygonize(list(shapely.get_parts(shapely.union_all([body.boundary, *lines]))))
        )
        expected = sorted(face.area for face in faces if body.contains(face.representative_point()))
        assert areas_of(engine.split(body, lines)) == pytest.approx(expected, rel=1e-9)


def test_what_splits_nothing() -> None:
    square = engine.Polygon([[[0, 0], [4, 0], [4, 4], [0, 4]], [[1, 1], [2, 1], [2, 2], [1, 2]]])
    for lines in ([], [[[-1, 3], [2, 3]]], [[[0, 0], [4, 0], [4, 4]]], [[[3, 3], [3, 3]]], [[[9, 9], [8, 7]]]):
        assert areas_of(engine.split(square, lines)) == [15.0], lines
    assert areas_of(engine.split(square, [[[0, 1.5], [1, 1.5]], [[2, 1.5], [4, 1.5]]])) == [5.5, 9.5]
    for bad in (3, np.array(1.0), [[[0, 0], [1, np.nan]]], [[0, 0]], "lines"):
        with pytest.raises(engine.EngineError, match=r"lines|points"):
            engine.split(square, bad)
    with pytest.raises(UnsupportedSolidError, match="split takes polygons"):
        engine.split(engine.Sphere([0, 0], 1), [])


def test_layers_are_split() -> None:
    parts = shapely.MultiPolygon([shapely.box(8, 0, 9, 1), shapely.box(10, 0, 11, 1)])
    fields = frame(shapely.box(0, 0, 2, 2), parts, None, shapely.box(50, 50, 51, 51))
    cuts = frame(shapely.LineString([(1, -1), (1, 5)]), shapely.LineString([(0, 0.5), (9.5, 0.5)]))
    made = layers.split(fields, cuts)
    assert made.n.tolist() == [0, 0, 0, 0, 1, 1, 1, 3]
    assert made.geometry.area.tolist() == [0.5, 1.5, 0.5, 1.5, 0.5, 0.5, 1.0, 1.0]
    rows = list(layers.split_features(fields.dropna().__geo_interface__, cuts.__geo_interface__))
    assert [shapely.geometry.shape(row["geometry"]).area for row in rows] == made.geometry.area.tolist()


def test_widths_are_those_of_all_strips() -> None:
    for _ in range(80):
        ring = RNG.integers(0, 7, (int(RNG.integers(1, 9)), 2)) * float(RNG.choice([1.0, 0.1, 1 / 3]))
        points = [(Fraction(x), Fraction(y)) for x, y in ring.tolist()]
        squares = []
        for ax, ay in points:
            for bx, by in points:
                sides = [(bx - ax) * (y - ay) - (by - ay) * (x - ax) for x, y in points]
                if (ax, ay) != (bx, by) and min(sides) >= 0:
                    squares.append(max(sides) ** 2 / ((bx - ax) ** 2 + (by - ay) ** 2))
        assert width_square(ring) == min(squares, default=0)


def test_slivers_are_listed() -> None:
    some = [polygon(6, 8) for _ in range(60)]
    for least in (0.5, 1.0, 1 / 3, 2.0):
        squares = [width_square(shapely.get_coordinates(each)[:-1]) for each in some]
        expected = [k for k, square in enumerate(squares) if square < Fraction(least) ** 2]
        assert layers.slivers(frame(*some), least).index.tolist() == expected
    long = layers.overlay_features(
        collection(shapely.box(0, 0, 9, 1)), collection(shapely.box(0, 0.75, 9, 9)), min_width=1
    )
    assert long.slivers == ((0, 0, 0.25),)
    assert layers.dissolve_features(collection(shapely.box(0, 0, 9, 1)), min_width=1.0).slivers == ()  # not below
    with pytest.raises(InvalidInputError, match="min_width"):
        layers.slivers(frame(*some), -1.0)


def test_slivers_whose_area_underflows_are_listed() -> None:
    squares = frame(*(shapely.box(0, 0, size, size) for size in (1e-200, 1e-160, 1e-310)))
    assert layers.slivers(squares, 1e-150).width.tolist() == [1e-200, 1e-160, 1e-310]


def test_gaps_are_told_or_refused() -> None:
    cells = [shapely.box(x, y, x + 1, y + 1) for x in range(3) for y in range(3) if (x, y) != (1, 1)]
    with pytest.warns(UserWarning, match=r"1 gaps, .* at \(1.0, 1.0\)"):
        layers.dissolve(frame(*cells), coverage=True)
    with pytest.raises(InvalidInputError, match=r"gap at \(1.0, 1.0\)"):
        layers.dissolve_features(collection(*cells), coverage=True, gaps="refuse")
    lake = shapely.box(0, 0, 3, 3).difference(shapely.box(1, 1, 2, 2)), shapely.box(3, 0, 6, 3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert layers.dissolve(frame(*lake), coverage=True, gaps="refuse").geometry[0].area == 17
    with pytest.raises(InvalidInputError, match=r"gap at \(1.5, 1.0\)"):  # an island that leaves half of it
        layers.dissolve(frame(*lake, shapely.box(1, 1, 1.5, 2)), coverage=True, gaps="refuse")
    notch = shapely.Polygon([(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)])
    with pytest.raises(InvalidInputError, match="gap"):  # a side of the gap is in line with a side of both
        layers.dissolve(frame(notch, shapely.box(1, 2, 2, 3)), coverage=True, gaps="refuse")
    for options in ({"gaps": "x"}, {"gaps": "refuse"}, {"gaps": "refuse", "coverage": True, "grid": 1.0}):
        with pytest.raises(InvalidInputError, match="gaps"):
            layers.dissolve(frame(*cells), **options)


def test_geojson_keeps_altitudes() -> None:
    ring = [[0, 0, 5], [2, 0, 6], [2, 2], [0, 2, 8], [0, 0, 5]]
    line = {"type": "LineString", "coordinates": [[0, 1, 3], [9, 1, 4]]}
    mark = {"type": "Point", "coordinates": [1, 1, 3]}
    given = [{"type": "Polygon", "coordinates": [ring]}, line, mark]
    layer = {"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": each} for each in given]}
    with pytest.warns(UserWarning, match="altitudes: 2 vertices keep theirs, 6 new ones have none"):
        rows = list(layers.overlay_features(layer, collection(shapely.box(1, -1, 5, 5))))
    assert [row["geometry"]["coordinates"] for row in rows] == [
        [[[1, 0], [2, 0, 6], [2, 2], [1, 2], [1, 0]]], [[1, 1], [5, 1]], [1, 1, 3],
    ]  # fmt: skip
    joined = layers.join_features(layer, collection(shapely.box(0, 0, 1, 1)), "touches")
    assert [row["geometry"] for row in joined] == [line, mark]


CROSSING = [(170, 0), (-170, 0), (-170, 10), (170, 10)]


def turned(at: Any, by: float) -> Any:
    """Return positions half a turn on, longitudes from -180 on; by: 360, or 0 for longitudes that begin at 180."""
    return np.column_stack([(at[:, 0] + by) % 360 - 180, at[:, 1]])


@pytest.mark.filterwarnings("ignore:wrap")
def test_the_antimeridian_is_where_other_meridians_are() -> None:
    for _ in range(12):
        pair = [polygon(6, 40) for _ in "ab"]
        here = [frame(shapely.transform(each, lambda at: at - 20)) for each in pair]
        there = [frame(shapely.transform(each.geometry[0], lambda at: turned(at, 360.0))) for each in here]
        for how in ("intersection", "union", "difference"):
            expected = layers.overlay(*here, how)
            found = layers.overlay(*there, how, wrap=180)
            back = [shapely.transform(each, lambda at: turned(at, 0.0)) for each in found.geometry]
            assert [each.area for each in back] == pytest.approx(expected.area.tolist(), abs=1e-9)
            numbers = [[len(shapely.get_parts(each)) for each in some] for some in (back, expected.geometry)]
            assert numbers[0] == numbers[1]


def test_rings_that_cross_are_told() -> None:
    crossing, other = frame(shapely.Polygon(CROSSING)), frame(shapely.box(175, 5, 180, 20))
    with pytest.warns(UserWarning, match="wrap: 1 polygons cross the antimeridian"):
        assert layers.clip(crossing, other, wrap=180).geometry[0].equals(shapely.box(175, 5, 180, 10))
    with pytest.warns(UserWarning, match="1 rings have steps of more than 180 degrees"):
        layers.clip_features(crossing.__geo_interface__, other.__geo_interface__)
    square, around = shapely.box(0, 0, 1, 1), shapely.Polygon([(0, 80), (120, 80), (-120, 80)])
    far = shapely.Polygon([(0, 0), (1e300, 0), (0, 1)])  # a cut at each turn would take all memory
    for body, what in ((around, "a ring that goes around a pole"), (far, "a longitude of size 1e[+]300")):
        with pytest.raises(InvalidInputError, match=rf"layer\[1\] \(index 1\) has {what}"):
            layers.dissolve(frame(square, body), wrap=180)
        with pytest.raises(InvalidInputError, match=rf"layer.features\[1\].* has {what}"):
            layers.dissolve_features(collection(square, body), wrap=180)
    for options in ({"wrap": 90}, {"wrap": True}, {"wrap": 180, "min_width": 1.0}):
        with pytest.raises(InvalidInputError, match=r"wrap|min_width"):
            layers.dissolve_features(other.__geo_interface__, **options)


def test_what_is_outside_of_a_mask() -> None:
    line, points = shapely.LineString([(1, 1), (9, 1)]), shapely.points([(1, 1), (9, 9)])
    layer = frame(shapely.box(0, 0, 2, 2), line, points[0], None, points[1])
    mask = frame(shapely.box(0, 0, 1, 5), shapely.box(0.5, 0, 1.5, 5))
    made = layers.clip(layer, mask, keep="outside")
    assert made.n.tolist() == [0, 1, 4]
    assert made.geometry.to_wkt().tolist()[1] == "LINESTRING (1.5 1, 9 1)"
    assert made.geometry[0].equals(shapely.box(1.5, 0, 2, 2))


def test_a_stream_answers_as_all_at_once() -> None:
    towns = collection(*(shapely.Point(*RNG.integers(0, 9, 2)) for _ in range(20)))
    fields = collection(*(polygon(4, 9) for _ in range(4)))
    whole = {
        "clip": layers.clip_features(towns, fields), "join": layers.join_features(towns, fields, outside=True),
        "nearest": layers.nearest_features(towns, fields), "contains": layers.locate_features(towns, fields),
    }  # fmt: skip
    for operation, expected in whole.items():
        stream = layers.FeatureStream(operation, fields, **({"outside": True} if operation == "join" else {}))
        features = towns["features"]
        found = [row for start in range(0, 20, 7) for row in stream.rows(features[start : start + 7])]
        for row in found:
            row["properties"] = {name.replace("_1", ""): value for name, value in row["properties"].items()}
        for row in (rows := list(expected)):
            row["properties"] = {name.replace("_1", ""): value for name, value in row["properties"].items()}
        assert found == rows
    with pytest.raises(engine.EngineError, match=r"stream.features\[20\]"):
        stream.rows([{"type": "Feature", "geometry": {"type": "Point", "coordinates": "x"}}])
    with pytest.raises(InvalidInputError, match="no option 'self'"):
        layers.FeatureStream(operation="clip", layer=fields, self=1)
    for wrong in ({"operation": "zip"}, {"operation": "clip", "by": 1}, {"operation": "clip", "layer": 3}):
        with pytest.raises(engine.EngineError, match=r"operation|option|layer"):
            layers.FeatureStream(**{"layer": fields, **wrong})


def test_what_is_prepared_is_forgotten_with_the_geometries() -> None:
    layer, mark = frame(shapely.box(0, 0, 1, 1), shapely.box(5, 5, 6, 6)), frame(shapely.Point(0.5, 0.5))
    assert layers.sjoin(mark, layer).n_right.tolist() == [0]
    layer.geometry.array[1] = shapely.box(0, 0, 2, 2)  # in place
    assert layers.sjoin(mark, layer).n_right.tolist() == [0, 1]
    with pytest.raises(UnsupportedSolidError, match="polygons"):
        layers.overlay(layer, mark)


def test_empty_geometries_of_other_kinds_are_accepted_as_they_are_once_prepared() -> None:
    layer = frame(shapely.box(0, 0, 2, 2), shapely.LineString(), shapely.GeometryCollection(), None)
    for _ in range(2):
        assert layers.overlay(frame(shapely.box(1, 0, 3, 2)), layer).geometry.area.tolist() == [2.0]
        assert len(layers.sjoin(layer, layer)) == 1
