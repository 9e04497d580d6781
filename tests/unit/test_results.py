"""Results as objects: conditions, equality by value, rows, short reprs, GeoJSON."""

from __future__ import annotations

import copy
import dataclasses
import pickle
from typing import Any

import numpy as np
import pytest

import engine
from engine import Aabb, Polygon, Sphere

CUBE = Aabb((0, 0, 0), (1, 1, 1))
BESIDE = Aabb((1, 0, 0), (2, 1, 1))
WALL = engine.Surface([(0, 0, 0), (0, 4, 0), (0, 0, 4)], [(0, 1, 2)])
FAR = Aabb((5, 5, 5), (6, 6, 6))
SQUARE = Polygon([[(0, 0), (4, 0), (4, 4), (0, 4)]])
SEGMENTS = [((-1.0, 0.5, 0.5), (2.0, 0.5, 0.5)), ((0.5, 0.5, 0.5), (0.5, 0.5, 9.0))]


def results() -> dict[str, Any]:
    return {
        "pairs": engine.collide_scene([CUBE, BESIDE, FAR]),
        "pieces": engine.clip_segments(SEGMENTS, CUBE),
        "lines": engine.clip_lines([[(-1, 1), (2, 1), (2, 9)]], SQUARE),
        "polygons": engine.clip_polygons([SQUARE], Aabb((0, 0), (1, 1))),
        "points": engine.locate_scene([(0.5, 0.5, 0.5), (1, 0.5, 0.5), (9, 9, 9)], [CUBE, BESIDE]),
        "scene pieces": engine.Scene([CUBE, BESIDE]).clip_segments(SEGMENTS),
        "sections": engine.section(
            ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]), [0.5]
        ),
        "hits": engine.hits(SEGMENTS, WALL),
        "scene hits": engine.Scene([WALL]).hits(SEGMENTS),
        "batch": engine.overlay_batch([SQUARE], [SQUARE]),
    }


def test_a_collision_is_a_condition() -> None:
    assert engine.collide(CUBE, BESIDE)
    assert not engine.collide(CUBE, FAR)
    assert engine.collide(CUBE, BESIDE).collides
    assert not engine.collide(CUBE, FAR, boolean=True)


SOLIDS = [
    lambda: Aabb((0, 0, 0), (1, 1, 1)),
    lambda: Sphere((0, 0), 1),
    lambda: engine.HalfSpace((1, 0), 2),
    lambda: engine.Convex([[1, 0, 0], [0, 1, 0], [-1, -1, 1]]),
    lambda: Polygon([[(0, 0), (1, 0), (0, 1)]]),
    lambda: Polygon([]),
    lambda: engine.Polyhedron(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    ),
    lambda: engine.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
    lambda: engine.Triangle([(0, 0), (1, 0), (0, 1)]),
    lambda: engine.Implicit([{"powers": [2, 0], "coefficient": -1}, {"powers": [0, 0], "coefficient": 4}]),
    lambda: engine.Csg("difference", [Sphere((0, 0), 2), Sphere((0, 0), 1)]),
]


@pytest.mark.parametrize("make", SOLIDS)
def test_solids_are_equal_by_value(make: Any) -> None:
    one, other = make(), make()
    assert one == other and hash(one) == hash(other)  # noqa: PT018
    assert pickle.loads(pickle.dumps(one)) == one == copy.copy(one)
    assert len({one, other}) == 1
    assert one != 7
    assert [each for each in SOLIDS if each() == one] == [make]


def test_solids_of_other_values_differ() -> None:
    assert Sphere((0, 0), 1) != Sphere((0, 0), 2)
    assert Sphere((0, 0), 1) != Sphere((0, 0, 0), 1)
    assert Sphere((0.0, -0.0), 1) == Sphere((0, 0), 1)
    assert Polygon([[(0, 0), (1, 0), (0, 1)]]) != Polygon([[(1, 0), (0, 1), (0, 0)]])  # the same set, other fields


@pytest.mark.parametrize("name", results())
def test_results_are_equal_by_value_and_say_what_they_are(name: str) -> None:
    one, other = results()[name], results()[name]
    assert one == other
    assert hash(one) == hash(other)
    assert pickle.loads(pickle.dumps(one)) == one
    assert set(one.to_dict()) == {each.name for each in dataclasses.fields(one) if not each.name.startswith("_")}
    assert len(repr(one)) <= 120
    assert str(len(one)) in repr(one)
    assert one != 7


def test_pairs_and_pieces_are_iterated() -> None:
    pairs = engine.collide_scene([CUBE, BESIDE, FAR])
    assert list(pairs) == [(0, 1, engine.Relation.TOUCHING)]
    assert (len(pairs), bool(pairs), bool(engine.collide_scene([CUBE, FAR]))) == (1, True, False)
    pieces = [(source, start.tolist(), end.tolist()) for source, start, end in engine.clip_segments(SEGMENTS, CUBE)]
    assert pieces == [(0, [0, 0.5, 0.5], [1, 0.5, 0.5]), (1, [0.5, 0.5, 0.5], [0.5, 0.5, 1])]
    held = results()["points"]
    assert [held[point].tolist() for point in (0, 1, 2, -1, -2)] == [[0], [0, 1], [], [], [0, 1]]


def test_rows_become_dataframes() -> None:
    pytest.importorskip("pandas")
    frame = results()["pieces"].to_pandas()
    assert list(frame) == [
        "source", "start_0", "start_1", "start_2", "end_0", "end_1", "end_2", "t_0", "t_1", "faces_0",
                           "faces_1"]  # fmt: skip
    assert frame["end_0"].tolist() == [1.0, 0.5]
    assert list(results()["pairs"].to_pandas()) == ["first", "second", "relation"]


def test_pieces_of_lines_are_geojson() -> None:
    shapely = pytest.importorskip("shapely")
    for name in ("pieces", "lines"):
        result = results()[name]
        assert shapely.geometry.shape(result).geom_type == "MultiLineString"
    assert shapely.geometry.shape(results()["lines"]).length == 5.0
    (piece,) = engine.overlay(SQUARE, SQUARE, "union").pieces
    assert shapely.geometry.shape(piece).area == 16.0


def test_the_repr_of_an_overlay_is_short() -> None:
    hole = Polygon([[(1, 1), (2, 1), (2, 2), (1, 2)]])
    assert repr(engine.overlay(SQUARE, hole, "difference")) == "<Overlay: 1 piece, 1 hole, area 15>"
    huge = Polygon([[(0, 0), (1e200, 0), (0, 1e200)]])
    assert repr(engine.overlay(huge, huge)) == "<Overlay: 1 piece, 0 holes, 3 vertices>"
    assert np.isfinite(engine.overlay(SQUARE, hole).area)


def test_results_of_many_items_are_iterated() -> None:
    """What an item has, in their order; an index beyond them is an error, so that no loop runs on."""
    assert [rings[0].tolist() for rings in results()["polygons"]] == [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]]
    assert [bodies.tolist() for bodies in results()["points"]] == [[0], [0, 1], []]
    assert [(source, body) for source, body, _, _ in results()["scene pieces"]] == [(0, 0), (0, 1), (1, 0)]
    assert results()["points"][-2].tolist() == [0, 1]
    for point in (3, -4):
        with pytest.raises(IndexError, match="3 points"):
            results()["points"][point]


def test_locations_in_a_scene_are_rows_of_point_and_body() -> None:
    box = engine.Aabb((0, 0), (1, 1))
    table = engine.locate_scene([(0.5, 0.5), (9, 9), (1, 0.5)], [box, box]).to_pandas()
    assert table.to_dict("list") == {
        "point": [0, 0, 2, 2], "body": [0, 1, 0, 1], "on_boundary": [False, False, True, True],
    }  # fmt: skip
