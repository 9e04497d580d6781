"""Points in the order of their cells get the answers that they get as they stand."""

from __future__ import annotations

import numpy as np
import pytest

from engine import locate
from engine.budget import Budget
from engine.containment import policy
from engine.containment.cells import order as cell_order
from engine.containment.cells.build import build_cells
from tests.unit.containment.scenes import box_mesh, made, merged


def test_ordered_points_get_the_same_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(policy, "_CELLS_FROM", 0)
    solid = made(merged(box_mesh([0, 0, 0], [3, 3, 3]), box_mesh([1, 1, 1], [4, 4, 2])))
    points = np.random.default_rng(8).uniform(-0.5, 4.5, (20_000, 3))
    points[::5, 2] = 3.0  # on a face
    plain = locate(points, solid)
    monkeypatch.setattr(cell_order, "_FEWEST_POINTS", 1)
    monkeypatch.setattr(cell_order, "_FEWEST_GROUPS", 1)
    monkeypatch.setattr(cell_order, "_SHARE", 0.0)
    with Budget() as budget:
        order = cell_order.order_if_it_pays(points, build_cells(solid, budget), budget)
    assert order is not None
    assert (np.sort(order) == np.arange(len(points))).all()
    assert (locate(points, solid) == plain).all()
    assert (locate(points, solid, workers=1) == plain).all()
