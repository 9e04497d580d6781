"""Points, lines and polygons in one layer: predicates, nearest features, overlays, clips, dissolved lines."""

from __future__ import annotations

import warnings
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import engine
from engine.errors import InvalidInputError, InvalidOperationError
from engine.layers.relate import PREDICATES
from engine.layers.rows import HOWS

geopandas = pytest.importorskip("geopandas")
shapely = pytest.importorskip("shapely")
testing = pytest.importorskip("pandas.testing")
layers = engine.layers
RNG = np.random.default_rng(50)


@pytest.fixture(autouse=True)
def _same_layers_in_any_order_of_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    """GEOS rounds where lines cross, so that some layers differ from its answers: each test has its own layers."""
    monkeypatch.setattr(f"{__name__}.RNG", np.random.default_rng(50))


def one(kind: int, size: int) -> Any:
    """Return a geometry with small whole coordinates, on which GEOS is exact: 0 points, 1 lines, 2 polygons."""
    while True:
        parts = [RNG.integers(0, size, (int(RNG.integers(3, 6)), 2)).astype(float) for _ in range(2)]
        made = (
            shapely.multipoints(parts[0]),
            shapely.linestrings(parts[0])
            if RNG.random() < 0.6
            else shapely.MultiLineString([*map(shapely.LineString, parts)]),
            shapely.polygons(parts[0]),
        )[kind]
        if made.is_valid and not (kind == 2 and made.area == 0) and not (kind == 1 and made.length == 0):
            return made


def frame(n: int, size: int, column: str, kinds: tuple[int, ...] = (0, 1, 2), apart: float = 0.0) -> Any:
    shapes = [one(kinds[k % len(kinds)], size) for k in range(n)]
    shapes = [shapely.transform(each, lambda at: at + np.round(RNG.random(2) * apart)) for each in shapes]
    return geopandas.GeoDataFrame({"n": range(n), column: [*map(str, range(n))]}, geometry=[*shapes, None][-n:])


def in_order(joined: Any) -> Any:
    """Return rows without geometry in an order of their own: geopandas gives those of one feature in that of a tree."""
    names = [column for column in joined.columns if column != "geometry"]
    return joined[names].assign(at=joined.index).sort_values(["at", *names]).reset_index(drop=True)


@pytest.mark.parametrize("predicate", [name for name in PREDICATES if name != "equals"])
def test_predicates_are_those_of_geos(predicate: str) -> None:
    for how in ("inner", "left", "right"):
        left, right = frame(24, 5, "a"), frame(24, 5, "b")
        found = layers.sjoin(left, right, how, predicate)  # type: ignore[arg-type]
        testing.assert_frame_equal(in_order(found), in_order(geopandas.sjoin(left, right, how, predicate)))
    first, second = np.asarray(left.geometry)[:, None], np.asarray(right.geometry)[None]
    equal = layers.sjoin(left, right, predicate="equals")
    assert len(equal) == shapely.equals(first, second).sum()


@pytest.mark.parametrize(
    ("left", "right", "holds"),
    [
        ("LINESTRING (3 1, 1 3)", "MULTILINESTRING ((3 1, 0 0, 3 3, 2 2))", "touches"),  # crosses where that one ends
        ("LINESTRING (2 2, 2 2, 2 0)", "LINESTRING (1 3, 1 1, 3 1, 0 1, 2 1)", "touches"),
        ("POLYGON ((0 0, 1 0, 1 1, 0 0))", "POLYGON ((1 1, 2 1, 2 2, 1 1))", "touches"),  # covers nothing of it
        ("LINESTRING (0 0, 4 0)", "POLYGON ((1 0, 3 0, 3 1, 1 1, 1 0))", "touches"),
        ("LINESTRING (0 0, 3 0)", "LINESTRING (1 0, 2 0)", "contains"),
        (
            "POLYGON ((0 0, 4 0, 4 4, 0 4, 0 0))",
            "POLYGON ((1 0, 3 0, 3 1, 1 1, 1 0))",
            "contains",
        ),  # a side within a side
        ("POLYGON ((0 0, 4 0, 4 4, 0 4, 0 0))", "POLYGON ((1 0, 3 0, 3 -1, 1 -1, 1 0))", "touches"),  # from outside
        (
            "POLYGON ((0 0, 4 0, 4 4, 0 4, 0 0), (1 1, 3 1, 3 3, 1 3, 1 1))",
            "POLYGON ((1 1, 1 3, 3 3, 3 1, 1 1))",
            "touches",
        ),  # what fills a hole
        (
            "POLYGON ((0 0, 4 0, 4 4, 0 4, 0 0), (1 1, 3 1, 3 3, 1 3, 1 1))",
            "POLYGON ((0 0, 0 4, 4 4, 4 0, 0 0))",
            "covered_by",
        ),  # and an outline alone
        ("POLYGON ((0 0, 2 0, 1 3, 0 0))", "POLYGON ((2 0, 1 3, 0 0, 2 0))", "equals"),
        ("POLYGON ((0 0, 9 0, 9 9, 0 9, 0 0), (1 1, 8 1, 8 8, 1 8, 1 1))", "POLYGON ((2 2, 3 2, 3 3, 2 2))", ""),
        ("LINESTRING (1 1, 1 1)", "POLYGON ((0 0, 2 0, 2 2, 0 2, 0 0))", "within"),
        ("LINESTRING (0.1 0.3, 0.2 0.6)", "POINT (0.30000000000000004 0.9)", ""),
    ],
)
def test_hard_pairs(left: str, right: str, holds: str) -> None:
    one, other = (geopandas.GeoDataFrame(geometry=[shapely.from_wkt(each)]) for each in (left, right))
    true = {name for name in PREDICATES if len(layers.sjoin(one, other, predicate=name))}
    geos = {name for name in PREDICATES if getattr(shapely, name)(one.geometry[0], other.geometry[0])}
    assert true == geos
    assert (holds in true) == bool(holds)


def square_of_distance(one: Any, other: Any) -> Fraction:
    """Return the least exact square of the distances of vertices and edges of geometries that do not meet."""

    def edges(geometry: Any) -> list[Any]:
        made = []
        for part in shapely.get_parts(geometry):
            rings = [part.exterior, *part.interiors] if part.geom_type == "Polygon" else [part]
            for ring in rings:
                at = [tuple(map(Fraction, each)) for each in shapely.get_coordinates(ring).tolist()]
                made += list(pairwise(at)) or [(at[0], at[0])]
        return made

    def square(p: Any, a: Any, b: Any) -> Fraction:
        u, w = (b[0] - a[0], b[1] - a[1]), (p[0] - a[0], p[1] - a[1])
        length = u[0] ** 2 + u[1] ** 2
        t = min(max((u[0] * w[0] + u[1] * w[1]) / length, Fraction(0)), Fraction(1)) if length else Fraction(0)
        return Fraction((w[0] - t * u[0]) ** 2 + (w[1] - t * u[1]) ** 2)

    pairs = [(edges(one), edges(other)), (edges(other), edges(one))]
    return min(square(p, a, b) for mine, theirs in pairs for each in mine for p in each for a, b in theirs)


@pytest.mark.parametrize("after", ["POLYGON ((0 0, 1 0, 1 1, 0 0))", "POINT (9 9)", "MULTILINESTRING EMPTY"])
def test_a_line_of_one_point_is_a_point_whatever_follows_it(after: str) -> None:
    points = geopandas.GeoDataFrame(geometry=shapely.from_wkt(["LINESTRING (2 2, 2 2)", after]))
    square = geopandas.GeoDataFrame(geometry=[shapely.box(0, 0, 4, 4)])
    assert 0 in layers.sjoin(points, square, predicate="within").index


def test_all_nearest_features_are_there() -> None:
    left, right = (frame(15, 3, name, apart=12.0) for name in "ab")
    found = layers.sjoin_nearest(left, right, distance_col="far")
    expected = {}
    for i, first in enumerate(left.geometry):
        squares = [
            Fraction(0) if shapely.intersects(first, second) else square_of_distance(first, second)
            for second in right.geometry[:-1]
            if first
        ]
        expected |= {(i, j): square for j, square in enumerate(squares) if first and square == min(squares)}
    pairs = list(zip(found.index, found.index_right))
    assert pairs == sorted(expected)
    for pair, far in zip(pairs, found.far):
        low, high = (Fraction(max(0.0, float(np.nextafter(far, way)))) for way in (-np.inf, np.inf))
        assert ((low + Fraction(far)) / 2) ** 2 <= expected[pair] <= ((high + Fraction(far)) / 2) ** 2
    limit = 2.0
    within = layers.sjoin(left, right, predicate="dwithin", distance=limit)
    near = layers.sjoin_nearest(left, right, max_distance=limit)
    assert {*zip(near.index, near.index_right)} <= {*zip(within.index, within.index_right)}
    assert layers.sjoin_nearest(left, left, exclusive=True).eval("index != index_right").all()
    for how in ("left", "right"):
        testing.assert_frame_equal(
            in_order(layers.sjoin_nearest(left, right, how, distance_col="far")),  # type: ignore[arg-type]
            in_order(geopandas.sjoin_nearest(left, right, how, distance_col="far")),
        )


@pytest.mark.parametrize("kind", [0, 1])
@pytest.mark.parametrize("how", HOWS)
def test_points_and_lines_are_overlaid(kind: int, how: str) -> None:
    left, right = frame(8, 8, "a", (kind,)), frame(6, 8, "b", (2,))
    for keep in (True, False):
        found = layers.overlay(left, right, how, keep_geom_type=keep)
        expected = geopandas.overlay(left, right, how, keep_geom_type=keep)
        testing.assert_frame_equal(found.drop(columns="geometry"), expected.drop(columns="geometry"))
        whole = shapely.union_all(right.geometry.dropna().to_numpy())
        for mine, theirs, row in zip(found.geometry, expected.geometry, found.to_dict("records")):
            assert (mine is None) == (theirs is None)
            if kind == 1 and mine and isinstance(row["a"], str) and not isinstance(row.get("b"), str):
                theirs = left.geometry[int(row["a"])].difference(whole)  # one by one, rounding adds slivers
            assert mine is None or mine.hausdorff_distance(theirs) < 1e-9


def test_what_is_left_of_a_line_between_neighbours_is_nothing() -> None:
    """The border is crossed where doubles cannot say; geopandas leaves a piece of 1e-16 there."""
    line = geopandas.GeoDataFrame(geometry=[shapely.LineString([(0.1, 0.05), (2.9, 0.77)])])
    cells = [shapely.Polygon([(k, 0), (k + 1, 0), (k + 1.3, 1), (k + 0.3, 1)]) for k in range(-1, 4)]
    cells[2] = shapely.union_all(cells[2])
    assert len(layers.overlay(line, geopandas.GeoDataFrame(geometry=cells), "difference")) == 0
    rows = layers.overlay(line, geopandas.GeoDataFrame({"n": range(5)}, geometry=cells))
    assert rows.n.tolist() == [1, 2, 3]
    assert rows.geometry.length.sum() == pytest.approx(line.geometry.length[0], rel=1e-15)


def test_clip_and_dissolve() -> None:
    mask = frame(2, 9, "m", (2,))
    for kinds in ((0,), (1,), (2,), (0, 1, 2)):
        layer = frame(9, 9, "a", kinds)
        found, expected = layers.clip(layer, mask), geopandas.clip(layer, mask, sort=True)
        testing.assert_frame_equal(found.drop(columns="geometry"), expected.drop(columns="geometry"))
        assert all(a.hausdorff_distance(b) < 1e-9 for a, b in zip(found.geometry, expected.geometry))
        if len(kinds) == 1:
            groups, theirs = (each.geometry for each in (layers.dissolve(layer, "n"), layer.dissolve("n")))
            assert all(a.is_empty == b.is_empty for a, b in zip(groups, theirs))
            assert layers.dissolve(layer).geometry[0].hausdorff_distance(layer.dissolve().geometry[0]) < 1e-9
    lines = [shapely.LineString(at) for at in ([(0, 0), (4, 0)], [(6, 0), (2, 0)], [(1, -1), (1, 1)])]
    united = layers.dissolve(geopandas.GeoDataFrame(geometry=lines)).geometry[0]
    assert united.length == 8.0
    box = layers.clip(geopandas.GeoDataFrame(geometry=lines), (0, 0, 1, 1))
    assert box.geometry.length.tolist() == [1.0, 1.0]


def test_a_group_of_several_dimensions_is_one_collection() -> None:
    """What lines have outside of polygons, and points outside of both; geopandas' union, but decided exactly."""
    wkt = ["POLYGON ((0 0, 4 0, 4 4, 0 4, 0 0))", "LINESTRING (-2 2, 6 2)", "MULTIPOINT (1 1, 9 9, 9 9)", "POINT (5 2)",
           "LINESTRING (0 0, 0 3)", "POLYGON ((4 0, 6 0, 6 1, 4 1, 4 0))", "POINT EMPTY"]  # fmt: skip
    layer = geopandas.GeoDataFrame({"k": [*"aaaaaab"]}, geometry=[shapely.from_wkt(each) for each in wkt])
    united, none = layers.dissolve(layer, "k").geometry
    assert none.is_empty
    expected = shapely.from_wkt(
        "GEOMETRYCOLLECTION (POLYGON ((0 0, 0 4, 4 4, 4 1, 6 1, 6 0, 0 0)), LINESTRING (4 2, 6 2),"
        "LINESTRING (-2 2, 0 2), POINT (9 9))"
    )
    assert [*map(shapely.normalize, united.geoms)] == [
        *map(shapely.normalize, [expected.geoms[k] for k in (3, 2, 1, 0)])
    ]
    (row,) = layers.dissolve_features(layer.iloc[:6].__geo_interface__)
    assert {each["type"] for each in row["geometry"]["geometries"]} == {"Polygon", "MultiLineString", "Point"}
    edge = [shapely.Polygon([(0, 0), (7, 6), (1, 5)]), shapely.LineString([(0, 0), (3.5, 3)]), shapely.Point(3.5, 3)]
    (area,) = layers.dissolve(geopandas.GeoDataFrame(geometry=edge)).geometry
    assert area.equals(edge[0])
    for seed in range(4):
        rng = np.random.default_rng(seed)
        some = frame(12, 9, "a").assign(k=rng.integers(0, 3, 12))
        for a, b in zip(layers.dissolve(some, "k").geometry, some.dissolve("k").geometry):
            for dim in ("Polygon", "LineString"):  # of points GEOS keeps some that are on lines
                mine, theirs = (
                    shapely.union_all([each for each in shapely.get_parts(whole) if each.geom_type == dim])
                    for whole in (a, b)
                )
                assert mine.symmetric_difference(theirs).area < 1e-9
                assert mine.is_empty or mine.hausdorff_distance(theirs) < 1e-9


def test_a_row_of_a_line_and_a_point_stays_where_the_layer_has_both() -> None:
    line, mark = shapely.LineString([(0, 1), (6, 1)]), shapely.Point(9, 9)
    meets = shapely.MultiPolygon([shapely.box(1, 0, 2, 2), shapely.Polygon([(4, 1), (5, 2), (3, 2)])])
    expected = shapely.GeometryCollection([shapely.Point(4, 1), shapely.LineString([(1, 1), (2, 1)])])
    for keep in (None, True, False):
        (row,) = layers.overlay(
            geopandas.GeoDataFrame(geometry=[line, mark]), geopandas.GeoDataFrame(geometry=[meets]), keep_geom_type=keep
        ).geometry
        assert row.normalize() == expected.normalize()
    with pytest.warns(UserWarning, match="1 rows"):  # of a layer of points alone, the other's rest is no point
        assert len(layers.overlay(geopandas.GeoDataFrame(geometry=[mark]), geopandas.GeoDataFrame(geometry=[meets]),
                                  "union")) == 1  # fmt: skip


def test_a_grid_and_a_coverage() -> None:
    cells = [shapely.box(k, 0, k + 1, 1) for k in range(3)]
    layer = geopandas.GeoDataFrame(geometry=cells)
    assert layers.dissolve(layer, coverage=True).geometry[0].equals(shapely.box(0, 0, 3, 1))
    cells[2] = shapely.box(1.75, 0.5, 3, 1)
    with pytest.raises(InvalidInputError, match=r"features 1 and 2 overlap at \(1.75, 0.5\)"):
        layers.dissolve(geopandas.GeoDataFrame(geometry=cells), coverage=True)
    nearly = geopandas.GeoDataFrame(geometry=[cells[0], shapely.box(1.0000001, 0, 2, 1)])
    assert layers.dissolve(nearly, grid_size=0.25).geometry[0].equals(shapely.box(0, 0, 2, 1))
    assert len(layers.overlay(nearly, nearly, grid=0.25)) == 2
    for bad in ({"grid": 0.3}, {"grid": 1.0, "grid_size": 1.0}):
        with pytest.raises(InvalidInputError, match="grid"):
            layers.clip(nearly, cells[0], **bad)  # type: ignore[arg-type]


def test_altitudes_stay_where_vertices_do() -> None:
    field = geopandas.GeoDataFrame(geometry=[shapely.Polygon([(0, 0, 5), (2, 0, 6), (2, 2, 7), (0, 2, 8)])])
    with pytest.warns(UserWarning, match="1 vertices keep theirs, 4 new ones have none"):
        part = layers.clip(field, shapely.box(1, 1, 3, 3)).geometry[0]
    heights = {(x, y): z for x, y, z in shapely.get_coordinates(part, include_z=True).tolist()}
    assert heights[2, 2] == 7
    assert all(np.isnan(z) for place, z in heights.items() if place != (2, 2))


def test_what_a_join_does_not_take_is_named() -> None:
    some = frame(3, 5, "a")
    with pytest.raises(InvalidOperationError, match="predicate must be one of"):
        layers.sjoin(some, some, predicate="disjoint")
    for options in ({"predicate": "dwithin"}, {"distance": 1.0}, {"predicate": "dwithin", "distance": -1.0}):
        with pytest.raises(InvalidInputError, match="distance"):
            layers.sjoin(some, some, **options)  # type: ignore[arg-type]
    for options in ({"max_distance": "x"}, {"distance_col": 3}, {"on_attribute": "n"}, {"exclusive": 2}):
        with pytest.raises(InvalidInputError, match=next(iter(options))):
            layers.sjoin_nearest(some, some, **options)  # type: ignore[arg-type]


def test_a_deadline_ends_one_pair_of_long_lines() -> None:
    x = np.arange(40_000)
    zigzags = np.c_[x % 2 * 1000.0, x * 0.01], np.c_[x * 0.015, x % 2 * 400.0 + 0.003]
    sides = [geopandas.GeoDataFrame(geometry=[shapely.LineString(at)]) for at in zigzags]
    with pytest.raises(engine.DeadlineExceededError):
        layers.sjoin(*sides, predicate="overlaps", deadline=0.3)


def test_features_of_geojson() -> None:
    layer, mask = frame(6, 8, "a"), frame(3, 8, "b", (2,))
    texts: Any = [each[each.geometry.notna()].__geo_interface__ for each in (layer, mask)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for found, expected in (
            (layers.clip_features(*texts), layers.clip(layer, mask, keep_geom_type=True)),
            (layers.overlay_features(*texts, "union"), layers.overlay(layer, mask, "union")),
        ):
            shapes = [None if each["geometry"] is None else shapely.geometry.shape(each["geometry"]) for each in found]
            expected = expected[expected.geometry.notna()]
            assert [each.area + each.length for each in shapes if each] == pytest.approx(
                (expected.area + expected.length).tolist()
            )
    rows = layers.join_features(*texts, "crosses", outside=True)
    told = [(each["left"]["index"], each.get("right", {}).get("index", -1)) for each in rows]
    pairs = layers.sjoin(layer[layer.geometry.notna()].reset_index(), mask, "left", "crosses")
    assert told == [(i, -1 if j != j else int(j)) for i, j in zip(pairs.index, pairs.index_right)]
    wrong = {"type": "LineString", "coordinates": [[0, 0], [1, "x"]]}
    collection = {"type": "FeatureCollection", "features": [{"type": "Feature", "id": 7, "geometry": wrong}]}
    with pytest.raises(engine.EngineError, match=r"layer.features\[0\] \(id 7\)"):
        layers.clip_features(collection, texts[1])


def test_features_that_meet_are_zero_apart_at_every_scale() -> None:
    for size in (1.0, 2.0**50, 2.0**300):
        line = geopandas.GeoDataFrame(geometry=[shapely.LineString([(0, 0), (4 * size, 4 * size)])])
        point = geopandas.GeoDataFrame(geometry=[shapely.Point(size, size)])
        assert layers.sjoin_nearest(point, line, distance_col="d").d.tolist() == [0.0]


@pytest.mark.parametrize("size", [2.0**1000, 2.0**-500, 2.0**-1070])
def test_layers_at_any_scale_are_related(size: float) -> None:
    for shape in (shapely.Point(size, size), shapely.LineString([(0, 0), (4 * size, 3 * size)])):
        for _ in range(3):  # the memory that trees are made in is another each time
            np.full(8, np.nan)  # which may be this
            layer = geopandas.GeoDataFrame(geometry=[shape])
            assert len(layers.sjoin(layer, layer, predicate="contains")) == 1
    pair = [geopandas.GeoDataFrame(geometry=[shapely.Point(*at)]) for at in ((1.0, 2.0**-500), (2.0**400, 0.0))]
    assert len(layers.sjoin(*pair)) == 0


def test_distances_beyond_the_range_are_refused_of_a_layer_at_the_origin_too() -> None:
    origin, far = (geopandas.GeoDataFrame(geometry=[shapely.Point(x, 0.0)]) for x in (0.0, 2.0**1000))
    for left, right in ((origin, far), (far, origin)):
        with pytest.raises(engine.NotRepresentableError, match="scale the layers"):
            layers.sjoin_nearest(left, right)
        with pytest.raises(engine.NotRepresentableError, match="scale the layers"):
            layers.sjoin(left, right, predicate="dwithin", distance=1.0)


def test_points_and_polygons_dissolve_without_any_line() -> None:
    """There was nothing to join, and numpy said so."""
    square, through = shapely.box(0, 0, 1, 1), shapely.LineString([(2, 2), (2, 2)])
    for other, expected in (
        (shapely.Point(0.5, 0.5), square),
        (shapely.Point(5, 0.5), shapely.GeometryCollection([shapely.Point(5, 0.5), square])),
        (through, square),
    ):
        made = layers.dissolve(geopandas.GeoDataFrame(geometry=[other, square])).geometry.iloc[0]
        assert made.normalize().equals(expected.normalize())
