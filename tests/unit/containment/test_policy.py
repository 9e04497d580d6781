"""Which structure a batch is worth: the cheapest pass first, then what the points so far would have paid for."""

from __future__ import annotations

import numpy as np

from engine import Polygon, Polyhedron, locate
from engine.containment.locators import locator_of
from engine.containment.policy import (
    LONG_PASS,
    Choice,
    choose_for_mesh,
    choose_for_rings,
    cost_in_tree,
    mean_faces_above,
)
from engine.running.budget import Budget
from tests.unit.containment.scenes import box_mesh, made, merged


def _boxes(n: int) -> Polyhedron:
    solid: Polyhedron = made(merged(*(box_mesh([k, 0, 0], [k + 0.5, 1, 1]) for k in range(n))))
    return solid


def test_the_second_question_about_a_large_mesh_builds_the_tree() -> None:
    solid = _boxes(300)
    points = np.random.default_rng(0).uniform(0, 300, (100, 3))
    answers = [locate(points, solid).tobytes()]
    assert solid.cached("tree") is None
    answers += [locate(points, solid).tobytes() for _ in range(3)]
    assert solid.cached("tree") is not None
    assert len(set(answers)) == 1


def test_a_long_pass_is_made_once() -> None:
    many = np.random.default_rng(0).uniform(0, 400, (3000, 3))
    for n_points, choice in ((300, Choice.PASS), (1025, Choice.PASS), (3000, Choice.PASS), (100_000, Choice.CELLS)):
        solid = _boxes(400)
        assert len(solid.triangles) > LONG_PASS
        with Budget() as budget:
            assert choose_for_mesh(solid, n_points) == choice
            locator = locator_of(_boxes(400)).chosen(n_points, budget)
        assert locator.is_long == (choice == Choice.PASS)
        first, again = (locate(many[:n_points], solid).tobytes() for _ in range(2))
        assert first == again
    assert not locator_of(_boxes(100)).chosen(300, Budget()).is_long


def test_many_points_get_cells_and_bad_shapes_a_tree() -> None:
    assert choose_for_mesh(_boxes(100), 10) == Choice.PASS
    assert choose_for_mesh(_boxes(10), 10**6) == Choice.CELLS
    assert choose_for_mesh(_boxes(100), 10_000) != Choice.CELLS
    random = np.random.default_rng(1)
    ends = random.normal(size=(500, 2, 3))
    thin = [np.concatenate([pair, pair + 1e-5 * random.normal(size=(2, 3))]) for pair in ends]
    faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    needles = made(merged(*({"vertices": four.tolist(), "faces": faces} for four in thin)))
    assert choose_for_mesh(needles, 20_000) == Choice.CELLS
    assert mean_faces_above(needles) > 20 * mean_faces_above(_boxes(100))
    assert cost_in_tree(needles) > cost_in_tree(_boxes(100))


def test_rings_go_from_a_pass_to_slabs_and_cells() -> None:
    turn = np.linspace(0.0, 2 * np.pi, 5000, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    solid = Polygon([circle])
    assert choose_for_rings(solid, 10) == Choice.PASS
    assert choose_for_rings(solid, 1000) == Choice.LISTS
    assert choose_for_rings(solid, 10_000) == Choice.CELLS
    teeth = np.arange(5000.0)
    comb = np.array([*np.column_stack([teeth, 5000 * (teeth % 2)]).tolist(), [4999, -1], [0, -1]])
    assert choose_for_rings(Polygon([comb]), 5000) == Choice.LISTS  # slabs run along the teeth
    assert choose_for_rings(Polygon([comb @ [[1, 1], [-1, 1]]]), 5000) == Choice.CELLS  # each slab holds half of them
    small = Polygon([circle[::500]])
    assert all(choose_for_rings(small, 10) == Choice.PASS for _ in range(100))
    assert choose_for_rings(solid, 10) == Choice.CELLS  # cells serve few points too


def test_shapes_without_extent_have_finite_costs() -> None:
    flat = made(box_mesh([0, 0, 0], [0, 0, 0]))
    assert np.isfinite(cost_in_tree(flat))
    assert choose_for_mesh(flat, 10**6) == Choice.LISTS
    level = Polygon([[[0, 0], [1, 0], [2, 0]]])
    assert choose_for_rings(level, 100_000) == Choice.CELLS
