"""What the table of methods makes of solids: prisms, trees and callables."""

from __future__ import annotations

import numpy as np
import pytest

import engine
from engine import Aabb, Csg, Implicit, Sphere, Triangle, locate
from tests.reference.containment import locate as reference


def test_prism_over_a_triangle_of_space() -> None:
    prism = Triangle([[0, 0, 1], [4, 0, 1], [0, 4, 1]])
    assert locate([[1, 1, 99], [0, 1, -7], [4, 0, 3], [2, 2, 0], [2, 2.1, 0]], prism).tolist() == [1, 0, 0, 0, -1]
    tilted = Triangle([[0, 0, 0], [1, 0.1, 0.3], [0.7, 1, 0.1]])
    points = np.random.default_rng(1).uniform(-1, 2, (200, 3))
    solid = {"type": "triangle", "vertices": tilted.vertices.tolist()}
    assert locate(points, tilted).tolist() == [reference(point, solid) for point in points.tolist()]


def test_prism_without_area_is_all_boundary() -> None:
    assert locate([[5, 5, 5], [0, 0, 0]], Triangle([[0, 0, 0], [1, 1, 1], [2, 2, 2]])).tolist() == [0, 0]


def test_csg_shares_operands() -> None:
    ball = Sphere([0, 0], 2)
    tree: engine.Solid = ball
    for _ in range(20):  # two to the twentieth leaves along all paths, one in truth
        tree = Csg("union", [tree, tree]) if tree is ball or tree.n_leaves < 1 << 18 else tree  # type: ignore[attr-defined]
    assert locate([[0, 0], [2, 0], [3, 0]], tree).tolist() == [1, 0, -1]


def test_csg_difference_of_touching_boxes() -> None:
    tree = Csg("difference", [Aabb([0, 0], [4, 4]), Aabb([0, 0], [2, 4])])
    assert locate([[1, 1], [2, 1], [3, 1], [0, 1], [4, 4]], tree).tolist() == [-1, 0, 1, 0, 0]


def test_callable_reports_float64() -> None:
    solid = Implicit.from_callable(lambda p: 1.0 - p[:, 0] ** 2 - p[:, 1] ** 2, 2)
    found, accuracy = locate([[0, 0], [1, 0], [2, 0]], solid, report=True)
    assert found.tolist() == [1, 0, -1]
    assert accuracy.decisions == "float64"
    nested = Csg("union", [solid, Aabb([5, 5], [6, 6])])
    assert locate([[5, 5]], nested, report=True)[1].decisions == "float64"


def test_callable_that_returns_nan_or_another_shape_is_refused() -> None:
    with pytest.raises(engine.NotFiniteError, match=r"\[1.0, 2.0\]"):
        locate([[1, 2]], Implicit.from_callable(lambda p: p[:, 0] * np.nan, 2))
    with pytest.raises(engine.InvalidArrayError):
        locate([[1, 2]], Implicit.from_callable(lambda p: p, 2))
