"""Half-space, sphere, aabb, convex, triangle: fields and refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import engine


def check_refused(make: Any, error: type[engine.EngineError], where: tuple[Any, ...], words: str) -> None:
    with pytest.raises(error) as info:
        make()
    assert info.value.where == where
    assert words in str(info.value)


def test_half_space() -> None:
    solid = engine.HalfSpace([0, 3, 4], 5)
    assert (solid.type, solid.dimension, solid.offset) == ("half_space", 3, 5.0)
    assert solid.normal.tolist() == [0.0, 3.0, 4.0]
    assert solid.row.tolist() == [0.0, 3.0, 4.0, 5.0]
    assert engine.HalfSpace([5e-324, 0], 1e308).dimension == 2


@pytest.mark.parametrize(
    ("normal", "offset", "error", "where", "words"),
    [
        ([0, -0.0], 1, engine.ZeroNormalError, ("normal",), "[0.0, 0.0]"),
        ([1], 1, engine.WrongDimensionError, ("normal",), "2 or 3"),
        ([1, 0, 0, 0], 1, engine.WrongDimensionError, ("normal",), "2 or 3"),
        ([1, float("inf")], 1, engine.NotFiniteError, ("normal", 1), "inf"),
        ([1, "0"], 1, engine.InvalidArrayError, ("normal", 1), "'0' (str)"),
        ([1, 0], float("nan"), engine.NotFiniteError, ("offset",), "nan"),
        ([1, 0], True, engine.InvalidArrayError, ("offset",), "True (bool)"),
        ([1, 0], [1], engine.InvalidArrayError, ("offset",), "[1] (list)"),
    ],
)
def test_half_space_refusals(normal: Any, offset: Any, error: Any, where: tuple[Any, ...], words: str) -> None:
    check_refused(lambda: engine.HalfSpace(normal, offset), error, where, words)


def test_sphere() -> None:
    solid = engine.Sphere(np.array([1, 2, 3], np.int32), np.float32(0.5))
    assert (solid.type, solid.dimension, solid.radius) == ("sphere", 3, 0.5)
    assert type(solid.radius) is float
    assert engine.Sphere([0, 0], 0).radius == 0.0


@pytest.mark.parametrize(
    ("center", "radius", "error", "where", "words"),
    [
        ([0, 0], -5e-324, engine.NegativeRadiusError, ("radius",), "-5e-324"),
        ([0, 0], float("inf"), engine.NotFiniteError, ("radius",), "inf"),
        ([0, 0], "1", engine.InvalidArrayError, ("radius",), "'1'"),
        ([0, 0], 10**400, engine.InvalidArrayError, ("radius",), "no float64"),
        ([], 1, engine.WrongDimensionError, ("center",), "got 0"),
        ([[0, 0]], 1, engine.InvalidArrayError, ("center", 0), "[0, 0] (list)"),
        (None, 1, engine.InvalidArrayError, ("center",), "center"),
    ],
)
def test_sphere_refusals(center: Any, radius: Any, error: Any, where: tuple[Any, ...], words: str) -> None:
    check_refused(lambda: engine.Sphere(center, radius), error, where, words)


def test_aabb() -> None:
    solid = engine.Aabb(min=[0, 1], max=[0, 2])
    assert (solid.type, solid.dimension) == ("aabb", 2)
    assert (solid.min.tolist(), solid.max.tolist()) == ([0.0, 1.0], [0.0, 2.0])


@pytest.mark.parametrize(
    ("low", "high", "error", "where", "words"),
    [
        ([0, 1e-320, 0], [1, 0, 1], engine.MinAboveMaxError, ("min", 1), "min[1] = 1e-320 is above max[1] = 0.0"),
        ([0, 0], [1, 1, 1], engine.WrongDimensionError, ("max",), "2 numbers each, got 3"),
        ([0, 0], [1, float("nan")], engine.NotFiniteError, ("max", 1), "nan"),
        ([0], [1], engine.WrongDimensionError, ("min",), "got 1"),
    ],
)
def test_aabb_refusals(low: Any, high: Any, error: Any, where: tuple[Any, ...], words: str) -> None:
    check_refused(lambda: engine.Aabb(low, high), error, where, words)


def test_convex() -> None:
    solid = engine.Convex([[1, 0, 0, 0], [0, 5e-324, 0, -1]])
    assert (solid.type, solid.dimension, solid.planes.shape) == ("convex", 3, (2, 4))
    assert engine.Convex([[1, 0, -1], [-1, 0, 0]]).dimension == 2  # empty, and accepted


@pytest.mark.parametrize(
    ("planes", "error", "where", "words"),
    [
        ([], engine.EmptyGeometryError, ("planes",), "at least one row"),
        ([[1, 0, 0], [0, 0, 7]], engine.ZeroNormalError, ("planes", 1), "planes[1] = [0.0, 0.0, 7.0]"),
        ([[1, 0]], engine.WrongDimensionError, ("planes",), "got 1"),
        ([[1, 0, 0, 0, 0]], engine.WrongDimensionError, ("planes",), "got 4"),
        ([[1, 0, 0], [1, 0, 0, 0]], engine.InvalidArrayError, ("planes", 1), "planes[1] has 4"),
        ([1, 0, 0], engine.InvalidArrayError, ("planes", 0), "must be a list"),
        ([[1, 0, float("inf")]], engine.NotFiniteError, ("planes", 0, 2), "inf"),
    ],
)
def test_convex_refusals(planes: Any, error: Any, where: tuple[Any, ...], words: str) -> None:
    check_refused(lambda: engine.Convex(planes), error, where, words)


def test_triangle() -> None:
    solid = engine.Triangle(np.eye(3))
    assert (solid.type, solid.dimension, solid.vertices.shape) == ("triangle", 3, (3, 3))
    assert engine.Triangle([[1, 1]] * 3).dimension == 2


@pytest.mark.parametrize(
    ("vertices", "error", "where", "words"),
    [
        ([[0, 0], [1, 0]], engine.InvalidArrayError, ("vertices",), "got 2"),
        ([], engine.InvalidArrayError, ("vertices",), "got 0"),
        ([[0], [1], [2]], engine.WrongDimensionError, ("vertices",), "got 1"),
        ([[0, 0], [1, 0], [0, 0, 1]], engine.WrongDimensionError, ("vertices", 2), "vertices[2] has 3"),
        ([[0, 0], [1, 0], [0, None]], engine.InvalidArrayError, ("vertices", 2, 1), "None"),
    ],
)
def test_triangle_refusals(vertices: Any, error: Any, where: tuple[Any, ...], words: str) -> None:
    check_refused(lambda: engine.Triangle(vertices), error, where, words)


def test_polygon() -> None:
    solid = engine.Polygon([[[0, 0], [4, 0], [4, 4], [-0.0, 0.0]], np.array([[1, 1], [2, 1], [1, 2]])])
    assert (solid.type, solid.dimension, solid.n_rings) == ("polygon", 2, 2)
    assert solid.ring_offsets.tolist() == [0, 3, 6]
    assert solid.vertices.tolist() == [[0, 0], [4, 0], [4, 4], [1, 1], [2, 1], [1, 2]]
    assert engine.Polygon(np.zeros((2, 4, 2))).ring_offsets.tolist() == [0, 3, 6]
    assert engine.Polygon([[[0, 0], [0, 0], [1, 1]]]).n_rings == 1


@pytest.mark.parametrize("ring", [[[0, 0], [2, 2]], [[0, 0], [2, 2], [0, 0]]])
def test_ring_of_two_positions_is_an_edge(ring: list[list[int]]) -> None:
    edge, square = engine.Polygon([ring]), engine.Polygon([[[1, 1], [3, 1], [3, 3], [1, 3]]])
    assert engine.locate([[1, 1], [0, 0], [1, 0]], edge).tolist() == [0, 0, -1]
    assert engine.collide(edge, square).relation == engine.Relation.TOUCHING
    assert engine.overlay(edge, square, "union").area == 4.0


@pytest.mark.parametrize(
    "ask",
    [
        lambda empty, box: engine.locate([[0, 0]], empty),
        lambda empty, box: engine.collide(box, empty),
        lambda empty, box: engine.collide_scene([empty, box]),
        lambda empty, box: engine.clearance(empty, box),
        lambda empty, box: engine.clip_segments([[[0, 0], [1, 0]]], empty),
        lambda empty, box: engine.bounds(empty),
        lambda empty, box: engine.locate([[0, 0]], engine.Csg("union", [box, empty])),
    ],
)
def test_empty_polygon_is_for_overlays(ask: Any) -> None:
    with pytest.raises(engine.EmptyGeometryError, match="at least one ring"):
        ask(engine.Polygon([]), engine.Aabb([0, 0], [1, 1]))


@pytest.mark.parametrize(
    ("rings", "error", "where", "words"),
    [
        ([[]], engine.RingTooShortError, ("rings", 0), "rings[0] has 0"),
        ([[[0, 0], [1, 0], [0, 1]], [[0, 0]]], engine.RingTooShortError, ("rings", 1), "rings[1] has 1"),
        ([[0, 0], [1, 0], [0, 1]], engine.InvalidArrayError, ("rings", 0, 0), "rings[0][0] must be a list"),
        (np.zeros((4, 2)), engine.InvalidArrayError, ("rings",), "put a single ring into a list"),
        ("text", engine.InvalidArrayError, ("rings",), "str"),
        ([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], engine.WrongDimensionError, ("rings", 0), "2 numbers each, got 3"),
        ([[[0, 0], [1, 0], [0, float("nan")]]], engine.NotFiniteError, ("rings", 0, 2, 1), "nan"),
    ],
)
def test_polygon_refusals(rings: Any, error: Any, where: tuple[Any, ...], words: str) -> None:
    check_refused(lambda: engine.Polygon(rings), error, where, words)
