"""Layers as GeoJSON: rows, areas and locations against sets of cells; what passes through; what is refused."""

from __future__ import annotations

import copy
import json
import math
from datetime import date
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from engine import Polygon, locate
from engine.errors import (
    DeadlineExceededError,
    InvalidArrayError,
    InvalidInputError,
    InvalidOperationError,
    NotFiniteError,
    RingTooShortError,
    UnsupportedSolidError,
    WrongDimensionError,
)
from engine.layers import dissolve_features, locate_features, overlay_features, polygon_of
from engine.layers.rows import HOWS
from tests.unit.layers.cells import Cells, collection, layer, rows

SIZE = 9
CENTRES = [(x, y) for x in range(SIZE + 4) for y in range(SIZE + 4)]


def rings_of(geometry: Any) -> list[Any]:
    """Return the rings of a geometry after a check of RFC 7946: closed, shells counter-clockwise, holes clockwise."""
    parts = geometry["coordinates"] if geometry["type"] == "MultiPolygon" else [geometry["coordinates"]]
    assert geometry["type"] == "Polygon" or len(parts) > 1
    found = []
    for part in parts:
        for number, ring in enumerate(part):
            ring = np.asarray(ring).tolist()
            assert ring[0] == ring[-1]
            area = sum(Fraction(a[0]) * Fraction(b[1]) - Fraction(a[1]) * Fraction(b[0]) for a, b in pairwise(ring))
            assert area > 0 if number == 0 else area < 0
            found.append(ring)
    return found


def cells_of(geometry: Any) -> Cells | None:
    """Return the cells whose middle a geometry holds."""
    if geometry is None:
        return None
    held = locate(np.array(CENTRES) + 0.5, Polygon(rings_of(geometry)))
    return frozenset(cell for cell, location in zip(CENTRES, held.tolist(), strict=True) if location > 0)


@pytest.mark.parametrize("how", HOWS)
def test_rows_are_those_of_sets(how: str, pytestconfig: pytest.Config) -> None:
    for seed in range(200 if pytestconfig.getoption("--full") else 6):
        rng = np.random.default_rng([seed, len(how)])
        left, right = layer(rng, 12, SIZE), layer(rng, 9, SIZE, apart=seed % 2 > 0)
        sides = collection(left, side="left"), collection(right)
        found: Any = overlay_features(*sides, how)
        expected = rows(left, right, how)
        assert len(found) == len(expected)
        for feature, (i, j, cells) in zip(found, expected, strict=True):
            assert (feature.get("left"), feature.get("right")) == (
                {"index": i, "id": f"f{i}"} if i >= 0 else None,
                {"index": j, "id": f"f{j}"} if j >= 0 else None,
            )
            assert feature.get("id") == (f"f{max(i, j)}" if min(i, j) < 0 else None)
            told = {"n_1": i, "side": "left"} if i >= 0 else {}
            assert feature["properties"] == told | ({"n_2": j} if j >= 0 else {})
            assert cells_of(feature["geometry"]) == cells


def test_union_by_properties() -> None:
    rng = np.random.default_rng(5)
    features = layer(rng, 20, SIZE)
    given = collection(features)
    for k, feature in enumerate(given["features"]):
        feature["properties"]["kind"] = [k % 3]
    found: Any = list(dissolve_features(given, ["kind", "missing"]))
    for k, feature in enumerate(found):
        some = features[k::3]
        assert feature["properties"] == {"kind": [k], "missing": None, "count": len(some)}
        assert cells_of(feature["geometry"]) == frozenset().union(*(cells for cells in some if cells))
    (whole,) = dissolve_features(given)  # type: ignore[misc]
    assert cells_of(whole["geometry"]) == frozenset().union(*(cells for cells in features if cells))
    (empty,) = dissolve_features(collection([]))  # type: ignore[misc]
    assert (empty["geometry"], empty["properties"]) == (None, {"count": 0})


def test_points_in_features() -> None:
    rng = np.random.default_rng(6)
    features = layer(rng, 12, SIZE)
    places: list[Any] = [[x / 2, y / 2] for x in range(20) for y in range(20)]
    points = {
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "properties": None, "geometry": place and {"type": "Point", "coordinates": place}}
            for place in [*places, None]
        ],
    }

    def around(x: float, y: float) -> set[tuple[int, int]]:
        return {(i, j) for i in {math.ceil(x) - 1, math.floor(x)} for j in {math.ceil(y) - 1, math.floor(y)}}

    expected = [
        (k, j, not around(x, y) <= cells)
        for k, (x, y) in enumerate(places)
        for j, cells in enumerate(features)
        if cells and around(x, y) & cells
    ]
    found: Any = locate_features(points, collection(features))
    assert [(f["point"]["index"], f["polygon"]["index"], f["boundary"]) for f in found] == expected
    every: Any = list(locate_features(points, collection(features), outside=True))
    alone = {f["point"]["index"] for f in every if "polygon" not in f}
    assert alone == set(range(len(places) + 1)) - {k for k, _, _ in expected}
    assert every[-1]["geometry"] is None
    assert len(every) == len(expected) + len(alone)


def test_spikes_of_parts_that_overlap_are_boundary() -> None:
    """As those of one polygon are: a part is closed, whatever it is united with."""
    spiked = [[(0, 0), (2, 0), (2, 1), (5, 1), (2, 1), (2, 2), (0, 2), (0, 0)]]
    square = [[(1, 0), (3, 0), (3, 2), (1, 2), (1, 0)]]
    flat = [[(6, 0), (8, 0), (7, 0), (6, 0)]]
    geometry = {"type": "MultiPolygon", "coordinates": [spiked, square, flat]}
    layer = {"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, "geometry": geometry}]}
    expected = {(4, 1): True, (5, 1): True, (2.5, 1): False, (2, 0.5): False, (2, 0): True, (7, 0): True, (4, 2): None}
    points = [
        {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": place}} for place in expected
    ]
    found: Any = locate_features({"type": "FeatureCollection", "features": points}, layer, outside=True)
    assert [row.get("boundary") for row in found] == list(expected.values())


def test_what_is_beside_the_geometry_passes_through() -> None:
    left = collection([frozenset({(0, 0)}), None], deep={"a": [1, None, 2.5], "big": 10**30})
    left["crs"] = {"type": "name", "properties": {"name": "EPSG:3857"}}
    right = collection([frozenset({(0, 0), (1, 0)})])
    before = copy.deepcopy((left, right))
    found: Any = overlay_features(left, right, "union")
    assert found.crs == left["crs"]
    assert [feature["properties"] for feature in found] == [
        {"n_1": 0, "deep": {"a": [1, None, 2.5], "big": 10**30}, "n_2": 0},
        {"n_1": 1, "deep": {"a": [1, None, 2.5], "big": 10**30}},
        {"n_2": 0},
    ]
    assert (left, right) == before
    with pytest.raises(InvalidInputError, match="crs"):
        overlay_features(left, {**right, "crs": 1})


def test_slivers_that_rounding_loses_are_counted() -> None:
    left, right = (
        {
            "type": "FeatureCollection",
            "features": [{"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [r]}}],
        }
        for r in ([[0, 0], [3, 1], [3, 2], [0, 0]], [[0, 0], [3, 1], [1 + 2**-52, 1], [0, 0]])
    )
    found: Any = overlay_features(left, right)
    assert len(found) + found.collapsed == 1


def faulty(change: Any) -> Any:
    """Return a layer of three features whose second is changed."""
    given = collection([frozenset({(0, 0)})] * 3)
    change(given["features"][1])
    return given


def ring(*positions: Any) -> Any:
    return lambda feature: feature["geometry"].update(type="Polygon", coordinates=[list(positions)])


@pytest.mark.parametrize(
    ("change", "error", "says"),
    [
        (lambda f: f["geometry"].update(type="LineString"), UnsupportedSolidError, "is LineString"),
        (lambda f: f.update(geometry=[]), UnsupportedSolidError, "is "),
        (lambda f: f.update(properties=[]), InvalidInputError, "no object"),
        (lambda f: f["properties"].update(a=[math.inf]), NotFiniteError, "JSON cannot hold"),
        (ring([0, 0, 0, 0], [1, 0, 0, 0], [1, 1, 0, 0]), WrongDimensionError, "three with an altitude"),
        (ring([0, 0, 0], [1, 0], [1, 1, "x"]), InvalidArrayError, "must be a number"),
        (ring([0, 0], [1, 0], [1, 1, math.inf]), NotFiniteError, "inf"),
        (ring([0, 0], [1, math.nan], [1, 1]), NotFiniteError, "nan"),
        (ring([0, 0], [1, "1"], [1, 1]), InvalidArrayError, "must be a number"),
        (ring([0, 0]), RingTooShortError, "one position"),
        (
            lambda f: f["geometry"].update(type="Polygon", coordinates=[[], [[0, 0], [1, 0], [1, 1]]]),
            RingTooShortError,
            "shell without positions that has holes",
        ),
        (lambda f: f["geometry"].update(coordinates=7), InvalidArrayError, "no lists"),
        (lambda f: f["geometry"].pop("coordinates"), InvalidArrayError, "no lists"),
    ],
)
def test_the_feature_at_fault_is_named(change: Any, error: Any, says: str) -> None:
    with pytest.raises(error, match=says) as caught:
        overlay_features(collection([]), faulty(change))
    assert caught.value.where[:3] == ("right", "features", 1)
    assert "right.features[1] (id 'f1')" in caught.value.message


@pytest.mark.parametrize("coordinates", [[], [[]], [[], []], [[[]]], [[[]], [[], []]]])
def test_polygons_without_positions_are_empty(coordinates: Any) -> None:
    kind = "Polygon" if coordinates in ([], [[]], [[], []]) else "MultiPolygon"
    geometry = {"type": kind, "coordinates": coordinates}
    given = {"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": geometry}]}
    assert [row["geometry"] for row in dissolve_features(given)] == [None]
    assert len(overlay_features(given, collection([frozenset({(0, 0)})]))) == 0
    assert polygon_of(geometry).n_rings == 0


def test_what_is_no_layer() -> None:
    for value in (None, [], {}, {"type": "Feature"}, {"type": "FeatureCollection", "features": 1}):
        with pytest.raises(InvalidInputError, match="FeatureCollection"):
            overlay_features(value, collection([]))
    with pytest.raises(InvalidInputError, match=r"features\[0\]"):
        overlay_features({"type": "FeatureCollection", "features": [1]}, collection([]))
    with pytest.raises(InvalidOperationError, match="identity"):
        overlay_features(collection([]), collection([]), "xor")
    with pytest.raises(UnsupportedSolidError, match="not Point"):
        locate_features(collection([frozenset({(0, 0)})]), collection([]))
    assert len(overlay_features(collection([]), collection([None]), "union")) == 1


def test_no_property_is_lost_without_a_word() -> None:
    """By a suffix that gives it another's name, by a count of its own name, by a name read as letters."""
    cells = [frozenset({(0, 0)})]
    for left, right in (({"a": 1, "a_1": 2}, {"a": 3}), ({"a": 1}, {"a": 3, "a_2": 2}), ({"a": 1, "a_2": 2}, {"a": 3})):
        sides = collection(cells), collection(cells)
        for side, properties in zip(sides, (left, right), strict=True):
            side["features"][0]["properties"] = properties
        with pytest.raises(InvalidInputError, match=r"two properties would be named 'a_[12]'"):
            overlay_features(*sides)
    by: Any
    for by in (["count"], "n", [1], 5, [["n"]]):
        with pytest.raises(InvalidInputError) as caught:
            dissolve_features(collection(cells), by)
        assert caught.value.where == ("by",)


def test_properties_that_json_cannot_hold_are_named() -> None:
    for value in (date(2026, 1, 1), {1}, b"x", 1j, np.datetime64("2026-01-01")):
        given = collection([None, None])
        given["features"][1]["properties"]["when"] = value
        with pytest.raises(
            InvalidInputError, match=r"layer.features\[1\].* has a property that JSON cannot hold: it is"
        ):
            dissolve_features(given)
    whole: Any = list(dissolve_features(collection([None], n=np.int64(3), m=np.arange(2)), ["n", "m"]))
    assert whole[0]["properties"] == {"n": 3, "m": [0, 1], "count": 1}


def test_keys_that_are_no_text_are_named() -> None:
    given = collection(layer(np.random.default_rng(1), 3, SIZE))
    given["features"][1]["properties"] = {"a": 1, 2: "b"}
    with pytest.raises(InvalidInputError, match=r"layer.features\[1\].* names are text"):
        dissolve_features(given)
    given["features"][1]["properties"] = {"a": {"b": 1, 2: 3}}
    with pytest.raises(InvalidInputError, match=r"^by compares a value that JSON cannot hold"):
        dissolve_features(given, ["a"])


def test_deadline_and_arrays() -> None:
    rng = np.random.default_rng(7)
    sides = [collection(layer(rng, 40, SIZE)) for _ in range(2)]
    with pytest.raises(DeadlineExceededError):
        overlay_features(*sides, "union", deadline=0.0)
    expected: Any = overlay_features(*sides, "union", deadline=60.0)
    for side in sides:  # as the service's decoder may hand it over
        for feature in side["features"]:
            if feature["geometry"] is not None and len(feature["geometry"]["coordinates"]):
                feature["geometry"]["coordinates"] = np.array(feature["geometry"]["coordinates"], float)
    found: Any = overlay_features(*sides, "union")

    def text(rows: Any) -> str:
        return json.dumps([*rows], default=lambda array: array.tolist())

    assert text(found) == text(expected)


def test_groups_are_of_equal_values() -> None:
    values: list[Any] = [1, 1.0, True, "1", 0.0, -0.0, None, 2**70, float(2**70), {"a": 1, "b": 2}, {"b": 2.0, "a": 1}]
    given = collection([None] * (len(values) + 1))
    for feature, value in zip(given["features"], values):  # the last has no such property, which is as null
        feature["properties"] = {"k": value}
    found: Any = dissolve_features(given, ["k", "absent"])
    assert [row["properties"]["count"] for row in found] == [2, 1, 1, 2, 2, 2, 2]
    assert {row["properties"]["absent"] for row in found} == {None}


def test_many_names_take_no_longer_than_they_are_many() -> None:
    """Each was looked for among all others: 30,000 took 25 s, and absent names were looked for in each feature."""
    cells = [frozenset({(0, 0)})]
    left, right = collection(cells), collection(cells)
    left["features"][0]["properties"] = {**{f"n{k}": 0 for k in range(200_000)}, "a": 1, "a_1": 2}
    right["features"][0]["properties"] = {"a": 1}
    with pytest.raises(InvalidInputError, match="'a_1'"):
        overlay_features(left, right, deadline=20.0)
    whole: Any = dissolve_features(collection([None] * 20_000), [f"n{k}" for k in range(5_000)], deadline=20.0)
    assert (len(whole), len(whole.make(0, 1)[0]["properties"])) == (1, 5_001)


@pytest.mark.parametrize(
    ("change", "path"),
    [
        (lambda f: f.update(id=math.nan), ("id",)),
        (lambda f: f.update(id={"a": [1, -math.inf]}), ("id", "a", 1)),
        (lambda f: f["properties"].update(a=[{}, {"b": math.inf}]), ("properties", "a", 1, "b")),
    ],
)
def test_what_is_not_finite_is_named_where_it_stands(change: Any, path: tuple[Any, ...]) -> None:
    with pytest.raises(NotFiniteError) as caught:
        overlay_features(faulty(change), collection([]))
    assert caught.value.where == ("left", "features", 1, *path)
    for call in (lambda layer: overlay_features(layer, collection([])), dissolve_features):
        with pytest.raises(NotFiniteError) as caught:
            call({**collection([]), "crs": {"a": [math.nan]}})
        assert caught.value.where[1:] == ("crs", "a", 0)


def test_how_long_an_answer_is_is_known_before_it_is_made() -> None:
    rng = np.random.default_rng(3)
    left, right = collection(layer(rng, 12, SIZE), text="x" * 1000), collection(layer(rng, 9, SIZE), ä="é" * 99)
    points = {
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "id": k, "geometry": {"type": "Point", "coordinates": [k, k], "more": "x" * 500}}
            for k in range(9)
        ],
    }
    answers: list[Any] = [overlay_features(left, right, how) for how in HOWS]
    answers += [dissolve_features(left, ["n", "absent"]), dissolve_features(left)]
    answers += [locate_features(points, right, outside=True)]
    for answer in answers:
        texts = [
            len(json.dumps(row, separators=(",", ":"), ensure_ascii=False, default=lambda a: a.tolist()).encode())
            for row in answer
        ]
        least = np.diff(answer.n_bytes)
        assert len(least) == len(texts) > 0
        assert (least <= texts).all()
        assert sum(texts) < 3 * answer.n_bytes[-1]
