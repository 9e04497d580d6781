"""A few points asked about body by body lie where the tables of the whole scene say."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polygon, Surface, locate_scene
from engine.budget import Budget
from engine.containment.scene.locate_scene import locate_few, locate_in
from engine.containment.scene.one_by_one import are_few
from engine.containment.scene.tables import scene_of
from engine.errors import UnsupportedSolidError
from tests.unit.scenes.scenes import scene_of as bodies_of


@pytest.mark.parametrize("dimension", [2, 3])
def test_says_what_the_tables_say(dimension: int) -> None:
    rng = np.random.default_rng(dimension)
    for _ in range(20):
        solids, poses = bodies_of(rng, dimension, int(rng.integers(1, 9)))
        points = np.round(rng.uniform(-3, 3, (6, dimension)) * 2) / 2
        points[3:] += rng.normal(size=(3, dimension)) * 1e-16
        with Budget() as budget:
            few, accuracy = locate_few(points, solids, poses, budget)
            every, expected = locate_in(points, scene_of(solids, poses, dimension, budget), budget, 1, None)
        assert few.offsets.tolist() == every.offsets.tolist()
        assert few.indices.tolist() == every.indices.tolist()
        assert few.on_boundary.tolist() == every.on_boundary.tolist()
        assert (accuracy.decisions, accuracy.n_items) == (expected.decisions, 6)


def test_only_a_few_and_small_ones_are_asked_so() -> None:
    turn = np.linspace(0, 6, 1001)
    large, small = Polygon([np.column_stack([np.cos(turn), np.sin(turn)])]), Polygon([[[0, 0], [1, 0], [0, 1]]])
    point = np.zeros((1, 2))
    assert are_few(point, [small])
    for points, solids in ((point, [small, large]), (point, []), (point, [small] * 17), (point[:0], [small])):
        assert not are_few(points, solids)
    assert not are_few(np.zeros((33, 2)), [small])


def test_names_the_body_that_holds_no_points() -> None:
    with pytest.raises(UnsupportedSolidError) as refused:
        locate_scene([[0, 0, 0]], [Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])])
    assert refused.value.where == ("solids", 0)
