"""When cells are built, and that a build that is cancelled leaves nothing behind."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Cancel, CancelledError, Csg, Polyhedron, locate
from engine.budget import Budget
from engine.containment import policy
from engine.containment.cells.build import build_cells
from tests.unit.containment.scenes import box_mesh, made


def test_cells_are_built_only_when_they_pay(monkeypatch: pytest.MonkeyPatch) -> None:
    solid = made(box_mesh([0, 0, 0], [1, 1, 1]))
    points = np.random.default_rng(5).uniform(-0.1, 1.1, (5000, 3))
    first, accuracy = locate(points, solid, report=True)
    assert accuracy.method == "ray_parity"
    for _ in range(3):
        again, accuracy = locate(points, solid, report=True)
        assert (again == first).all()
    assert accuracy.method == "segment_parity"
    monkeypatch.setattr(policy, "_CELLS_FROM", 0)
    huge = Polyhedron(np.array(box_mesh([0, 0, 0], [1, 1, 1])["vertices"]) * 1e300, box_mesh([0] * 3, [1] * 3)["faces"])
    assert locate(points * 1e300, huge, report=True)[1].method == "ray_parity"
    tree = Csg("union", [solid, made(box_mesh([1, 0, 0], [2, 1, 1]))])
    assert (locate(points, tree) >= first).all()


def test_a_cancelled_build_keeps_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(policy, "_CELLS_FROM", 0)
    solid = made(box_mesh([0, 0, 0], [1, 1, 1]))
    cancel = Cancel()
    cancel.set()
    with pytest.raises(CancelledError):
        locate(np.zeros((100, 3)), solid, cancel=cancel)
    with pytest.raises(CancelledError), Budget(None, cancel) as budget:
        build_cells(solid, budget)
    assert locate([[0.5, 0.5, 0.5]] * 100, solid).tolist() == [1] * 100
