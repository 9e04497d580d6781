"""What notebooks show of shapes and results, reprs of one short line, and shapely's objects."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from typing import Any

import numpy as np
import pytest

import engine

THIRD = 1 / 3
SQUARE = engine.Polygon([[(0, 0), (4, 0), (4, 4), (0, 4)], [(1, 1), (2, 1), (1, 2)]])
LINE = [[(-1, 3), (5, 3)]]
TETRAHEDRON = engine.Polyhedron(
    [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
)
FLAT = {
    "polygon": lambda: SQUARE,
    "empty": lambda: engine.Polygon([]),
    "huge": lambda: engine.Polygon([[(-1e308, -1e308), (1e308, 0), (0, 1e308)]]),
    "overlay": lambda: engine.overlay(SQUARE, SQUARE, "union"),
    "nothing": lambda: engine.overlay(SQUARE, SQUARE, "difference"),
    "lines": lambda: engine.clip_lines(LINE, SQUARE),
    "segments": lambda: engine.clip_segments(LINE, SQUARE),
    "clipped": lambda: engine.clip_polygons([SQUARE], engine.Aabb((0, 0), (1, 1))),
}


@pytest.mark.parametrize("name", FLAT)
def test_the_plane_is_drawn(name: str) -> None:
    picture = ElementTree.fromstring(FLAT[name]()._repr_svg_())
    (view,) = picture
    paths = [path.get("d", "") for path in view]
    assert bool(paths) is (name not in ("empty", "nothing"))
    assert all(path.startswith("M") and "nan" not in path and "inf" not in path for path in paths)
    x, y, wide, tall = map(float, view.get("viewBox", "").split())
    assert np.isfinite([x, y, wide, tall]).all()
    assert wide > 0 < tall


def test_a_mesh_has_three_views_and_large_ones_are_thinned() -> None:
    views = list(ElementTree.fromstring(TETRAHEDRON._repr_svg_()))
    assert len(views) == 3
    assert [view[0].get("d", "").count("M") for view in views] == [6, 6, 6]
    sizes = [[float(x) for x in view.get("viewBox", "").split()[2:]] for view in views]
    assert sizes[0][0] < sizes[0][1]  # along z: 1 wide, 2 tall
    n = 100_000
    ring = np.random.default_rng(0).normal(size=(n, 2))  # crosses itself some 500 million times
    assert len(engine.Polygon([ring])._repr_svg_()) < 1e6


def test_tables_are_shown_in_rows() -> None:
    text = engine.clip_segments(np.tile(LINE, (30, 1, 1)), SQUARE)._repr_html_()
    table, note = ElementTree.fromstring(f"<div>{text}</div>")
    assert len(table) == 11
    assert [cell.text for cell in table[0]][:3] == ["source", "start_0", "start_1"]
    assert note.text == "SegmentPieces: 30 pieces"
    empty = engine.collide_scene([SQUARE])
    assert "0 pairs" in empty._repr_html_()


def test_shapely_has_the_same_areas() -> None:
    pytest.importorskip("shapely")
    assert SQUARE.to_shapely().area == 15.5
    assert engine.overlay(SQUARE, SQUARE, "union").to_shapely().area == 15.5
    assert engine.clip_lines(LINE, SQUARE).to_shapely().length == 4.0
    assert engine.clip_polygons([SQUARE], engine.Aabb((0, 0), (3, 1))).to_shapely().area == 3.0


CUBE, BALL = engine.Aabb((0, 0, 0), (1, 1, 1)), engine.Sphere((10 * THIRD, THIRD, THIRD), THIRD)
RESULTS: dict[str, Any] = {
    **FLAT,
    "piece": lambda: engine.overlay(SQUARE, SQUARE, "union").pieces[0],
    "box": lambda: engine.Aabb((-THIRD * 1e300,) * 3, (THIRD * 1e-300,) * 3),
    "half-space": lambda: engine.HalfSpace((THIRD * 1e-300,) * 3, THIRD * 1e-300),
    "sphere": lambda: engine.Sphere((THIRD * 1e-300,) * 3, THIRD * 1e-300),
    "triangle": lambda: engine.Triangle([(THIRD, THIRD, THIRD), (1, THIRD, 0), (0, THIRD, 1)]),
    "pose": lambda: engine.Pose.from_axis_angle([1, 2, 3], THIRD, (THIRD,) * 3),
    "clearance": lambda: engine.clearance(CUBE, BALL),
    "collision": lambda: engine.collide(CUBE, CUBE, detail=True),
    "witness": lambda: engine.collide(CUBE, CUBE).witness,
    "bounds": lambda: engine.bounds(TETRAHEDRON),
    "comparison": lambda: engine.compare("contains", [(0.0, 0, 0)], CUBE),
    "pairs": lambda: engine.collide_scene([CUBE, CUBE]),
    "locations": lambda: engine.locate_scene([(0, 0, 0)], [CUBE]),
    "batch": lambda: engine.overlay_batch([SQUARE], [SQUARE]),
    "scene": lambda: engine.Scene([CUBE]),
    "mesh": lambda: TETRAHEDRON,
}


@pytest.mark.parametrize("name", RESULTS)
def test_a_repr_is_one_short_line(name: str) -> None:
    text = repr(RESULTS[name]())
    assert len(text) <= 120
    assert "\n" not in text
    assert "object at" not in text


def test_reprs_say_what_happened() -> None:
    assert repr(engine.clearance(CUBE, engine.Sphere((3, 0.5, 0.5), 1.0))) == "<Clearance: 1.0, face 1 to ball>"
    assert repr(engine.clearance(CUBE, CUBE)) == "<Clearance: 0.0>"
    assert repr(engine.collide(CUBE, engine.Aabb((1, 0, 0), (2, 1, 1)))) == "<Collision: touching, face_face 1 0>"


@pytest.mark.parametrize("at", [(448262.0, 5411932.0), (1e15, -1e15), (0.0, 0.0), (-1.7e308, 1e308), (1e-320, 0.0)])
def test_a_square_is_a_square_wherever_it_is(at: tuple[float, float]) -> None:
    """Six digits of its coordinates would be all one."""
    x, y = at
    size = max(1.0, abs(x) * 2.0**-40) if x != 1e-320 else 1e-320
    view = ElementTree.fromstring(
        engine.Polygon([[(x, y), (x + size, y), (x + size, y + size), (x, y + size)]])._repr_svg_()
    )[0]
    drawn = [[float(z) for z in part.split(",")] for part in view[0].get("d", "").strip("MZ").split("L")]
    sides = [np.subtract(q, p) for p, q in zip(drawn, drawn[1:] + drawn[:1], strict=True)]
    if size > 1e-300:
        assert np.allclose(sides, [(224, 0), (0, -224), (-224, 0), (0, 224)], atol=1.0 if abs(x) > 1e300 else 0.2)
    assert np.isfinite(drawn).all()
    assert all(
        "inf" not in str(value) and "nan" not in str(value) for each in (view, *view) for value in each.attrib.values()
    )


def test_many_short_lines_are_thinned_too() -> None:
    rings = np.random.default_rng(0).random((50_000, 3, 2))
    assert len(engine.Polygon(list(rings))._repr_svg_()) < 2e6
