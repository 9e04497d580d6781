"""Layers as GeoDataFrames: the rows of geopandas, exact areas, what is refused."""

from __future__ import annotations

import warnings
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import engine
from engine.errors import InvalidInputError, InvalidOperationError, NotFiniteError, UnsupportedSolidError
from engine.layers.rows import HOWS
from engine.polygon_overlay.touching import collapsed
from engine.running.budget import Budget
from tests.unit.layers.cells import Cells, layer, runs

geopandas = pytest.importorskip("geopandas")
shapely = pytest.importorskip("shapely")
testing = pytest.importorskip("pandas.testing")


KINDS = ("Polygon", "LineString", "Point")


def shape(cells: Cells | None) -> Any:
    if cells is None:
        return None
    if not cells:
        return shapely.Polygon()
    return shapely.union_all([shapely.box(x, y, x + 1, y + 1) for x, y in cells])


def frame(seed: int, names: str, apart: bool = False, crs: Any = 3857) -> Any:
    """Return a layer of sets of cells, one of them missing, with columns of several types."""
    features = layer(np.random.default_rng(seed), 14, 9, apart)
    features[0] = features[0] or frozenset({(0, 0)})  # geopandas refuses a layer that begins with a missing one
    columns = {
        "n": np.arange(14),
        names[0]: [f"{names}{k}" for k in range(14)],
        names[1]: np.linspace(0, 1, 14),
        names[2]: np.arange(14) % 3 == 0,
    }
    return geopandas.GeoDataFrame(columns, geometry=[*map(shape, features)], index=np.arange(14) * 7 + 3, crs=crs)


@pytest.mark.some(4)
@pytest.mark.parametrize("how", HOWS)
@pytest.mark.parametrize("apart", [False, True])
def test_rows_are_those_of_geopandas(how: str, apart: bool, pytestconfig: pytest.Config) -> None:
    for seed in range(50 if pytestconfig.getoption("--full") else 3):
        left, right = frame(seed, "abc"), frame(seed + 100, "xyz", apart)
        found = engine.layers.overlay(left, right, how, keep_geom_type=True)
        expected = geopandas.overlay(left, right, how, keep_geom_type=True)
        testing.assert_frame_equal(found.drop(columns="geometry"), expected.drop(columns="geometry"))
        assert list(found.columns) == list(expected.columns)
        assert found.geometry.normalize().geom_equals(expected.geometry.normalize()).all()
        assert (found.area == expected.area).all()
        assert found.is_valid.all()
        assert found.crs == expected.crs
        found = engine.layers.overlay(left, right, how, keep_geom_type=False)
        expected = geopandas.overlay(left, right, how, keep_geom_type=False)
        testing.assert_frame_equal(found.drop(columns="geometry"), expected.drop(columns="geometry"))
        for one, other in zip(found.geometry, expected.geometry):
            assert (one is None) == (other is None)
            assert all(mine.equals(theirs) for mine, theirs in zip(by_kind(one), by_kind(other)))
            assert one is None or one.geom_type.removeprefix("Multi") == other.geom_type.removeprefix("Multi")


def by_kind(geometry: Any) -> list[Any]:
    """Return the areas, the lines and the points of a geometry, each of them united: geopandas splits lines."""
    parts = [] if geometry is None else shapely.get_parts(geometry)
    return [shapely.union_all([part for part in parts if part.geom_type == kind] or None) for kind in KINDS]


SLIVER = [[0.2, 0.2], [0.6000000000000001, 0.2], [0.8, 0.6000000000000001]]
BESIDE = [[0.30000000000000004, 0.4], [0.5, 0.4], [0.5, 0.5], [0.30000000000000004, 0.5]]
LEFT, RIGHT = (shapely.box(*corners) for corners in ((0, 0, 1, 4), (1, 0, 2, 4)))


def one(*shapes: Any) -> Any:
    return geopandas.GeoDataFrame({"n": range(len(shapes))}, geometry=list(shapes))


@pytest.mark.parametrize("how", HOWS)
def test_an_area_that_rounding_takes_is_a_row_as_one_that_touches(how: str) -> None:
    left, right = one(shapely.Polygon(SLIVER)), one(shapely.Polygon(BESIDE))
    of_pairs, of_left, of_right = HOWS[how]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = engine.layers.overlay(left, right, how, keep_geom_type=False)
    assert len(found) == of_pairs + of_left + of_right
    assert not of_pairs or found.geometry[0].equals(shapely.Point(0.5, 0.4))
    if of_pairs:
        with pytest.warns(UserWarning, match="left nothing of 1 rows"):
            rows = engine.layers.overlay(left, right, how, keep_geom_type=True)
        assert len(rows) == of_left + of_right


@pytest.mark.full
def test_whoever_meets_makes_a_row() -> None:
    """Triangles of tenths: corners that are not quite on edges, by less than a coordinate can say."""
    source = np.random.default_rng(11)
    triangles = [[shapely.Polygon(ring) for ring in source.integers(0, 9, (60, 3, 2)) / 10] for _ in range(2)]
    left, right = ([each for each in some if each.area > 0.001] for some in triangles)
    found = engine.layers.overlay(one(*left), one(*right), keep_geom_type=False)
    expected = [
        [i, k]
        for i, first in enumerate(left)
        for k, second in enumerate(right)
        if engine.collide(engine.Polygon(first), engine.Polygon(second)).relation != engine.Relation.DISJOINT
    ]
    assert found[["n_1", "n_2"]].to_numpy().tolist() == expected
    kinds = {geometry.geom_type for geometry in found.geometry}
    assert {"Point", "LineString", "Polygon"} <= kinds
    for i, k, geometry in found.itertuples(index=False):
        corners = shapely.points(shapely.get_coordinates(geometry))
        assert max(shapely.distance(side, corners).max() for side in (left[i], right[k])) < 1e-15
    with pytest.warns(UserWarning, match="rounding left nothing of"):
        engine.layers.overlay(one(*left), one(*right), keep_geom_type=True)


def test_what_rounding_leaves_of_rings_are_lines_that_end_where_lines_meet() -> None:
    budget = Budget()
    back = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (3.0, 1.0), (1.0, 1.0), (1.0, 0.0)]
    star = [(0.0, 0.0), (2.0, 0.0), (0.0, 0.0), (0.0, 2.0), (0.0, 0.0), (-2.0, 0.0)]
    made = collapsed([(3, back), (4, star), (7, [(5.0, 5.0)] * 3), (8, [(0.0, 0.0), (2.0, 2.0), (1.0, 1.0)])], budget)
    lines = [made.vertices[start:stop].tolist() for start, stop in pairwise(made.offsets)]
    assert made.lines.tolist() == [3, 4, 4, 4, 8]
    assert lines[0] == [[0, 0], [1, 0], [1, 1], [3, 1]]
    assert all(len(line) == 2 for line in lines[1:4])
    assert lines[4] == [[0, 0], [1, 1], [2, 2]]
    assert (made.points.tolist(), made.places.tolist()) == ([7], [[5, 5]])
    ring = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
    assert len(collapsed([(0, ring)], budget).vertices) == 4


@pytest.mark.parametrize(
    ("function", "options"),
    [
        *[("overlay", option) for option in ({"tolerance": 1.0}, {"make_valid": True}, {"keep_geom_type": "no"})],
        *[("dissolve", option) for option in ({"tolerance": 10}, {"method": "unary"}, {"x": 1}, {"by": "absent"})],
        *[("dissolve", option) for option in ({"aggfunc": 3}, {"level": 9}, {"aggfunc": "no such"})],
        *[("sjoin", option) for option in ({"predicate": "near"}, {"lsuffix": 3}, {"on_attribute": "a"}, {"how": [1]})],
    ],
)
def test_an_option_that_is_not_ours_is_refused_by_name(function: str, options: Any) -> None:
    """Passed on to geopandas, a grid_size lost members of groups without a word."""
    given = one(LEFT, RIGHT)
    sides = {"overlay": [given, given], "dissolve": [given], "sjoin": [one(shapely.Point(1, 1)), given]}[function]
    with pytest.raises(InvalidInputError, match="|".join([*options, "absent", "no such"])):
        getattr(engine.layers, function)(*sides, **options)


@pytest.mark.parametrize("value", [None, "x", 3, [], {}, np.zeros(3), shapely.box(0, 0, 1, 1), object()])
def test_what_is_no_layer_is_refused(value: Any) -> None:
    given, pandas = one(LEFT), pytest.importorskip("pandas")
    for bad in (value, pandas.DataFrame({"a": [1]}), geopandas.GeoDataFrame({"a": [1]})):
        for call in (
            lambda bad=bad: engine.layers.overlay(bad, given),
            lambda bad=bad: engine.layers.overlay(given, bad),
            lambda bad=bad: engine.layers.dissolve(bad),
            lambda bad=bad: engine.layers.sjoin(bad, given),
            lambda bad=bad: engine.layers.sjoin(one(shapely.Point(1, 1)), bad),
        ):
            with pytest.raises(InvalidInputError, match="must be a GeoDataFrame"):
                call()


def test_what_is_dropped_is_said() -> None:
    left, right = frame(0, "abc"), frame(1, "xyz")
    with pytest.warns(UserWarning, match="without geometry"):
        engine.layers.overlay(left, right, "difference")
    with pytest.warns(UserWarning, match="different CRS"):
        engine.layers.overlay(left, right.set_crs(4326, allow_override=True))
    for how in HOWS:
        none: Any = engine.layers.overlay(left, right[:0], how, keep_geom_type=True)
        same: Any = engine.layers.overlay(left, right.translate(100).to_frame("geometry"), how, keep_geom_type=True)
        assert len(none) <= len(same)
        assert list(none.columns) == list(geopandas.overlay(left, right[:1], how, keep_geom_type=True).columns)


def test_parts_that_overlap_are_united() -> None:
    cells: Cells = frozenset({(0, 0), (1, 0), (1, 1), (2, 1)})
    several = shapely.from_geojson(str({"type": "MultiPolygon", "coordinates": runs(cells)}).replace("'", '"'))
    left = geopandas.GeoDataFrame(geometry=[several])
    whole = geopandas.GeoDataFrame(geometry=[shapely.box(-1, -1, 5, 5)])
    assert engine.layers.overlay(left, whole).area.tolist() == [4.0]
    assert engine.layers.overlay(whole, left, "difference").area.tolist() == [32.0]


@pytest.mark.parametrize(
    "options",
    [
        *({"by": "c"}, {}, {"by": ["c", "n"], "as_index": False}, {"by": "a", "sort": False}, {"level": 0}),
        *({"by": "c", "aggfunc": "sum", "numeric_only": True}, {"by": "a", "dropna": False, "observed": True}),
        {"by": "c", "aggfunc": {"n": "max", "b": "sum"}},
    ],
)
def test_dissolve_is_that_of_geopandas(options: Any) -> None:
    given = frame(3, "abc").rename_geometry("shape")
    given["a"] = ["q", "p"] * 7
    found, expected = engine.layers.dissolve(given, **options), given.dissolve(**options)
    testing.assert_frame_equal(found.drop(columns="shape"), expected.drop(columns="shape"))
    assert list(found.columns) == list(expected.columns)
    assert found.geometry.normalize().geom_equals(expected.geometry.normalize()).all()
    assert found.crs == expected.crs


@pytest.mark.parametrize("how", ["inner", "left"])
def test_sjoin_is_that_of_geopandas(how: str) -> None:
    at = np.stack(np.meshgrid(np.arange(0, 10, 0.5), np.arange(0, 10, 0.5)), axis=-1).reshape(-1, 2)
    points = geopandas.GeoDataFrame({"n": np.arange(len(at))}, geometry=shapely.points(at), crs=3857)
    points.loc[5, "geometry"] = None
    areas = frame(4, "xyz")
    found = engine.layers.sjoin(points, areas, how)
    expected = geopandas.sjoin(points, areas, how=how)
    assert list(found.columns) == list(expected.columns)
    keys = ["n_left", "index_right"]
    first, second = (each.sort_values(keys).drop(columns="geometry") for each in (found, expected))
    testing.assert_frame_equal(first, second)
    with pytest.raises(UnsupportedSolidError, match=r"left\[0\]"):
        engine.layers.sjoin(one(shapely.GeometryCollection([shapely.Point(0, 0)])), areas)
    with pytest.raises(InvalidOperationError):
        engine.layers.sjoin(points, areas, "outer")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("geometry", "error", "says"),
    [
        ("LINESTRING (0 0, 1 1)", UnsupportedSolidError, "LineString"),
        ("GEOMETRYCOLLECTION (POINT (0 0))", UnsupportedSolidError, "explode"),
        ("POLYGON ((0 0, 1 0, 1 1, 0 0))", NotFiniteError, "nan"),
    ],
)
def test_the_feature_at_fault_is_named(geometry: str, error: Any, says: str) -> None:
    shapes = [shapely.box(0, 0, 1, 1), None, shapely.from_wkt(geometry)]
    if error is NotFiniteError:
        with np.errstate(invalid="ignore"):
            shapes[2] = shapely.polygons([[0, 0], [1, 0], [1, np.nan], [0, 0]])
    wrong = geopandas.GeoDataFrame(geometry=shapes, index=["p", "q", "r"])
    with pytest.raises(error, match=says) as caught:
        engine.layers.overlay(frame(0, "abc", crs=None), wrong)
    assert caught.value.message.startswith("right[2] (index r)")
    assert caught.value.where == ("right", 2)


def test_without_geopandas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "geopandas", None)
    with pytest.raises(InvalidInputError, match=r"exact-geometry\[geo\]"):
        engine.layers.overlay(None, None)
