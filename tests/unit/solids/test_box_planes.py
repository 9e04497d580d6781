"""The rows of a box: zero on its sides, in their order."""

from __future__ import annotations

from engine.solids.aabb import Aabb


def test_rows_stand_in_the_order_of_the_sides() -> None:
    rows = Aabb([-0.0, 2.0], [1.0, 5.0]).rows
    assert str(rows.tolist()) == "[[1.0, 0.0, 0.0], [-1.0, 0.0, 1.0], [0.0, 1.0, -2.0], [0.0, -1.0, 5.0]]"
