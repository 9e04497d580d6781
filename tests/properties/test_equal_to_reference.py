"""The strongest property: every operation gives the reference's answer, on scenes of every difficulty."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import engine
from tests.hard.operations import OPERATIONS
from tests.properties.examples import examples
from tests.properties.strategies import (
    NUMBERS,
    SCALES,
    TAME,
    aabb,
    convex,
    half_space,
    leaf,
    point,
    points_near,
    polygon,
    polyhedron,
    region,
    solid,
    sphere,
    triangle,
)

DIMENSIONS = st.sampled_from([2, 3])


def check(operation: str, data: dict[str, Any]) -> None:
    """Assert that engine and reference agree, on the error too where a coordinate is beyond the doubles."""
    try:
        expected = OPERATIONS[operation].exact(data)
    except OverflowError:
        with pytest.raises(engine.NotRepresentableError):
            OPERATIONS[operation].by_engine(data)
        return
    assert OPERATIONS[operation].by_engine(data) == expected


@examples(150)
@given(st.data(), SCALES, DIMENSIONS)
def test_locate(data: st.DataObject, kind: str, n: int) -> None:
    shape = data.draw(solid(kind, n))
    check("locate", {"solid": shape, "points": data.draw(points_near(shape, kind, n, 12))})


@examples(60)
@given(st.data(), SCALES)
def test_locate_in_meshes(data: st.DataObject, kind: str) -> None:
    shape = data.draw(polyhedron(kind))
    check("locate", {"solid": shape, "points": data.draw(points_near(shape, kind, 3, 15))})


@examples(150)
@given(st.data(), SCALES, DIMENSIONS)
def test_clip_segments(data: st.DataObject, kind: str, n: int) -> None:
    shape = data.draw(region(kind, n))
    ends = data.draw(points_near(shape, kind, n, 8))
    segments = data.draw(st.lists(st.tuples(*[st.sampled_from(ends)] * 2).map(list), min_size=1, max_size=8))
    check("clip_segments", {"region": shape, "segments": segments})


@examples(80)
@given(st.data(), SCALES, DIMENSIONS)
def test_clip_polygons(data: st.DataObject, kind: str, n: int) -> None:
    shape = data.draw(st.one_of(half_space(kind, n), convex(kind, n), aabb(kind, n)))
    ring = st.lists(point(kind, n), min_size=3, max_size=6)
    polygons = data.draw(st.lists(st.lists(ring, min_size=1, max_size=2), min_size=1, max_size=3))
    check("clip_polygons", {"region": shape, "polygons": polygons})


@examples(120)
@given(st.data(), SCALES, st.sampled_from(["intersection", "union", "difference", "symmetric_difference"]))
def test_overlay(data: st.DataObject, kind: str, operation: str) -> None:
    subject, clip = data.draw(polygon(kind)), data.draw(polygon(kind))
    check("overlay", {"subject": subject, "clip": clip, "operation": operation})


@examples(80)
@given(st.data(), SCALES, DIMENSIONS)
def test_bounds(data: st.DataObject, kind: str, n: int) -> None:
    shape = data.draw(st.one_of(aabb(kind, n), triangle(kind, n), polygon(kind) if n == 2 else polyhedron(kind)))
    check("bounds", {"solid": shape})


def body(kind: str, n: int) -> st.SearchStrategy[dict[str, Any]]:
    """Return a body that can collide."""
    smooth = [sphere(kind, n), half_space(kind, n), aabb(kind, n)]
    return st.one_of(*smooth, *([polygon(kind), triangle(kind, 2)] if n == 2 else [polyhedron(kind)]))


def check_collision(data: dict[str, Any]) -> None:
    try:
        OPERATIONS["collide"].exact(data)
    except NotImplementedError:
        return  # a sphere against faces that overlap in a plane: the reference cannot tell
    check("collide", data)


@examples(60)
@given(st.data(), SCALES)
def test_collide_in_the_plane(data: st.DataObject, kind: str) -> None:
    check_collision({"first": data.draw(body(kind, 2)), "second": data.draw(body(kind, 2))})


@examples(12)
@given(st.data(), SCALES)
def test_collide_in_space(data: st.DataObject, kind: str) -> None:
    check_collision({"first": data.draw(body(kind, 3)), "second": data.draw(body(kind, 3))})


@examples(40)
@given(st.data(), TAME)
def test_collide_surfaces(data: st.DataObject, kind: str) -> None:
    surface = {**data.draw(polyhedron(kind)), "type": "surface"}
    surface["faces"] = surface["faces"][: data.draw(st.integers(1, 4))]
    check_collision({"first": surface, "second": data.draw(body(kind, 3))})


ROTATIONS = st.sampled_from(
    [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]],
        [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]],
    ]
)


@st.composite
def pose(draw: st.DrawFn, kind: str) -> dict[str, Any] | None:
    if draw(st.integers(0, 3)) == 0:
        return None
    return {"rotation": draw(ROTATIONS), "translation": draw(point(kind, 3))}


@examples(25)
@given(st.data(), TAME)
def test_collide_posed(data: st.DataObject, kind: str) -> None:
    bodies = {"first": data.draw(body(kind, 3)), "second": data.draw(body(kind, 3))}
    shared = data.draw(pose(kind))
    poses = (shared, shared) if data.draw(st.booleans()) else (shared, data.draw(pose(kind)))
    check_collision({**bodies, "first_pose": poses[0], "second_pose": poses[1]})


@examples(40)
@given(st.data(), TAME)
def test_locate_scene(data: st.DataObject, kind: str) -> None:
    shapes = st.one_of(leaf(kind, 3).filter(lambda s: s["type"] != "implicit"))
    bodies = data.draw(st.lists(st.fixed_dictionaries({"solid": shapes, "pose": pose(kind)}), min_size=1, max_size=4))
    points = data.draw(st.lists(point(kind, 3), min_size=1, max_size=8))
    check("locate_scene", {"bodies": bodies, "points": points})


@examples(15)
@given(st.data(), TAME)
def test_collide_scene(data: st.DataObject, kind: str) -> None:
    shapes = st.one_of(sphere(kind, 3), aabb(kind, 3), half_space(kind, 3))
    bodies = data.draw(st.lists(st.fixed_dictionaries({"solid": shapes, "pose": pose(kind)}), min_size=2, max_size=5))
    try:
        check("collide_scene", {"bodies": bodies})
    except NotImplementedError:
        return


def test_kinds_of_numbers_are_finite() -> None:
    assert set(NUMBERS) > {"lattice", "wild"}
