"""A pickle is checked as it is read: kernels trust offsets and indices, a changed one crashed the process."""

from __future__ import annotations

import dataclasses
import pickle
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import engine

SQUARE = engine.Polygon([[[0, 0], [4, 0], [4, 4], [0, 4]], [[1, 1], [2, 1], [1, 2]]])
OTHER = engine.Polygon([[[2, -1], [6, -1], [6, 3.5]]])
CUBE_FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
CUBE_VERTICES = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
CUBE = engine.Polyhedron(CUBE_VERTICES, CUBE_FACES)
TETRAHEDRON = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
VALUES: dict[str, Any] = {
    "polygon": SQUARE,
    "triangle": engine.Triangle([[0, 0], [1, 0], [0, 1]]),
    "polyhedron": CUBE,
    "triangles": engine.Polyhedron(*TETRAHEDRON),
    "surface": engine.Surface(CUBE_VERTICES, CUBE_FACES[:3]),
    "implicit": engine.Implicit([{"powers": [2, 0], "coefficient": -1}, {"powers": [0, 1], "coefficient": 4}]),
    "tree": engine.Csg("union", [SQUARE, OTHER]),
    "scene": engine.Scene([SQUARE, OTHER]),
    "overlay": engine.overlay(SQUARE, OTHER),
    "union": engine.union_all([SQUARE, OTHER]),
    "batch": engine.overlay_batch([SQUARE, OTHER], [OTHER, SQUARE], "difference"),
    "clipped": engine.clip_polygons([[[[0, 0], [4, 0], [4, 4]]]], engine.Aabb([0, 0], [2, 2])),
    "lines": engine.clip_lines([[[0, 0], [3, 1], [5, 5]]], engine.Aabb([0, 0], [2, 2])),
    "cut": engine.cut(CUBE, engine.HalfSpace([1, 2, 3], -1)),
    "sections": engine.section(CUBE, [0.25, 0.5], normal=[1, 2, 3]),
    "locations": engine.locate_scene([[0.5, 0.5], [3, 0]], [SQUARE, OTHER]),
}


def whole_numbers(value: Any) -> Iterator[np.ndarray]:
    """Yield every array of whole numbers that a pickle of `value` holds."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "i" and value.dtype.itemsize > 1:
            yield value
    elif isinstance(value, (tuple, list, dict)):
        for item in value.values() if isinstance(value, dict) else value:
            yield from whole_numbers(item)
    elif isinstance(value, (engine.Solid, engine.Scene)) or (
        dataclasses.is_dataclass(value) and not isinstance(value, type)
    ):
        yield from whole_numbers(value.__reduce_ex__(4)[1:])


def use(value: Any) -> None:
    """Ask what goes by the offsets: of what is out of range this crashes the process."""
    if isinstance(value, engine.Polygon):
        engine.locate(np.random.default_rng(1).uniform(-1, 5, (5000, 2)), value)
        engine.overlay(value, OTHER)
    elif isinstance(value, engine.Solid):
        engine.locate(np.zeros((1, value.dimension)), value) if value.type != "surface" else None
    elif isinstance(value, engine.Overlay):
        _ = value.area, value.piece_areas, value.pieces, value.sources, value.__geo_interface__
    elif isinstance(value, engine.OverlayBatch):
        _ = value.areas, [each and each.area for each in value.overlays], value.ragged
    elif isinstance(value, engine.Scene):
        value.locate([[0.5, 0.5]])


@pytest.mark.parametrize("name", VALUES)
def test_a_changed_pickle_is_refused_or_means_something(name: str) -> None:
    value = VALUES[name]
    use(value)
    octets = pickle.dumps(value)
    n_refused = 0
    for array in list(whole_numbers(value)):
        for place in range(array.size):
            for number in (
                2 ** (8 * array.itemsize - 24),
                -1,
                -(2 ** (8 * array.itemsize - 2)),
                int(array.flat[0]) + 1,
            ):
                changed = array.copy()
                changed.flat[place] = number
                if array.tobytes() in octets:
                    try:
                        again = pickle.loads(octets.replace(array.tobytes(), changed.tobytes()))
                        use(again)
                    except engine.EngineError:
                        n_refused += 1
                    except ZeroDivisionError:  # of edges that are there, but do not cross
                        assert name in ("overlay", "union", "batch")
    assert n_refused or name in ("implicit", "triangle")


def test_every_class_that_holds_offsets_is_here() -> None:
    have = {type(value) for value in VALUES.values()}
    for name in engine.__all__:
        kind = getattr(engine, name)
        if isinstance(kind, type) and any("offsets" in field for field in getattr(kind, "__annotations__", ())):
            assert kind in have, name


@pytest.mark.parametrize("name", VALUES)
def test_a_pickle_that_was_not_changed_is_what_it_was(name: str) -> None:
    value = VALUES[name]
    again = pickle.loads(pickle.dumps(value))
    for one, other in zip(whole_numbers(value), whole_numbers(again), strict=True):
        np.testing.assert_array_equal(one, other)


def test_rings_that_end_where_they_begin_stay_so() -> None:
    """A second check must not take a ring's last vertex for a repeated first one a second time."""
    polygon = engine.Polygon([[[0, 0], [1, 0], [0, 0], [0, 0]], [[0, 0], [1, 1]]])
    again = pickle.loads(pickle.dumps(polygon))
    assert again.vertices.tolist() == polygon.vertices.tolist()
    assert again.ring_offsets.tolist() == polygon.ring_offsets.tolist()
    assert pickle.loads(pickle.dumps(engine.Polygon([]))).n_rings == 0


def test_a_pose_and_a_ball_are_checked() -> None:
    half = np.array([0.5]).tobytes()
    for value in (engine.Pose([[1, 0], [0, 1]], [0.5, 0.5]), engine.Sphere([0.5, 0.5, 0.5], 1)):
        with pytest.raises(engine.NotFiniteError):
            pickle.loads(pickle.dumps(value).replace(half, np.array([np.nan]).tobytes()))
    with pytest.raises(engine.NotRigidError):
        pickle.loads(pickle.dumps(engine.Pose([[1, 0], [0, 1]], [0.5, 0.5])).replace(np.eye(2).tobytes(), 4 * half))
