"""Signs and windings, written as examples, and the examples of docstrings."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import numpy as np
import pytest

import engine
from engine.predicates.rational import orient2d_rational, orient3d_rational

PAGE = Path(__file__).resolve().parents[2] / "docs" / "conventions.md"
UNIT_BOX = engine.Aabb([0, 0, 0], [1, 1, 1])


def area(ring: np.ndarray) -> float:
    x, y = np.asarray(ring, float).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def y_points_up() -> None:
    assert area(np.array([(0, 0), (1, 0), (1, 1), (0, 1)])) == 1


def outer_rings_run_counter_clockwise() -> None:
    big = engine.Polygon([[(0, 0), (0, 4), (4, 4), (4, 0)]])
    small = engine.Polygon([[(1, 1), (2, 1), (2, 2), (1, 2)]])
    (piece,) = engine.overlay(big, small, "difference").pieces
    assert (area(piece.shell), [area(hole) for hole in piece.holes]) == (16, [-1])


def faces_run_counter_clockwise_from_outside() -> None:
    a, b, c = np.array([(0, 0, 1), (1, 0, 1), (0, 1, 1)])
    assert np.cross(b - a, c - a).tolist() == [0, 0, 1]


def a_half_space_normal_points_inward() -> None:
    above = engine.HalfSpace([0, 0, 1], -2)
    assert engine.contains([(0, 0, 3), (0, 0, 1)], above).tolist() == [True, False]


def convex_rows_hold_where_they_are_not_negative() -> None:
    assert engine.locate([(2, 0), (1, 0), (0, 0)], engine.Convex([[1, 0, -1]])).tolist() == [1, 0, -1]


def orient2d_is_positive_for_a_left_turn() -> None:
    assert orient2d_rational((0, 0), (1, 0), (0, 1)) == 1


def orient3d_is_positive_where_the_normal_points() -> None:
    assert orient3d_rational((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)) == 1


def solids_are_closed() -> None:
    assert engine.contains([(1, 0.5, 0.5)], UNIT_BOX).tolist() == [True]
    assert engine.locate([(1, 0.5, 0.5)], UNIT_BOX)[0] == engine.Location.BOUNDARY


def locations_are_signs() -> None:
    assert engine.locate([(0.5, 0.5, 0.5), (2, 0.5, 0.5)], UNIT_BOX).tolist() == [1, -1]


def inside_is_even_odd() -> None:
    nested = engine.Polygon([[(0, 0), (4, 0), (4, 4), (0, 4)], [(1, 1), (3, 1), (3, 3), (1, 3)]])
    assert engine.locate([(0.5, 0.5), (2, 2)], nested).tolist() == [1, -1]


def minus_zero_is_zero() -> None:
    assert repr(float(engine.Sphere((-0.0, 0, 0), 1).center[0])) == "0.0"


def a_pose_rotates_then_moves() -> None:
    pose = engine.Pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [1, 0, 0])
    assert (pose.rotation @ [1, 0, 0] + pose.translation).tolist() == [1, 1, 0]
    point = engine.Sphere([1, 0, 0], 0)
    assert engine.collide(point, engine.Sphere([1, 1, 0], 0), first_pose=pose).relation == engine.Relation.TOUCHING


def planes_of_a_box_are_counted_by_axis() -> None:
    pieces = engine.clip_segments([((0.5, 0.5, 0.5), (0.5, 2, 0.5))], UNIT_BOX)
    assert pieces.faces.tolist() == [[-1, 3]]


def t_runs_from_start_to_end() -> None:
    assert engine.clip_segments([((-1, 0), (3, 0))], engine.Aabb([0, -1], [1, 1])).t.tolist() == [[0.25, 0.5]]


def lengths_carry_the_unit_of_the_caller() -> None:
    assert engine.bounds(engine.Sphere([0, 0], 2)).sphere.radius == 2


EXAMPLES = [
    y_points_up,
    outer_rings_run_counter_clockwise,
    faces_run_counter_clockwise_from_outside,
    a_half_space_normal_points_inward,
    convex_rows_hold_where_they_are_not_negative,
    orient2d_is_positive_for_a_left_turn,
    orient3d_is_positive_where_the_normal_points,
    solids_are_closed,
    locations_are_signs,
    inside_is_even_odd,
    minus_zero_is_zero,
    a_pose_rotates_then_moves,
    planes_of_a_box_are_counted_by_axis,
    t_runs_from_start_to_end,
    lengths_carry_the_unit_of_the_caller,
]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.__name__)
def test_the_example_of_a_convention(example: object) -> None:
    example()  # type: ignore[operator]


def test_every_convention_has_an_example() -> None:
    rows = [line for line in PAGE.read_text("utf-8").splitlines() if line.startswith("|")]
    assert len(rows) - 2 == len(EXAMPLES)


# --- The example in each docstring of the engine runs and prints what it says ---


ROOT = Path(__file__).resolve().parents[2]
MODULES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for path in sorted((ROOT / "engine").rglob("*.py"))
    if ">>>" in path.read_text("utf-8")
]


@pytest.mark.parametrize("name", MODULES)
def test_examples(name: str) -> None:
    assert doctest.testmod(importlib.import_module(name)).failed == 0
