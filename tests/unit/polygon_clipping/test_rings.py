"""What the compiled clipping of polygons hands on."""

from __future__ import annotations

import numpy as np

from engine.polygon_clipping.rings import Cutting, PlaneTables, has_bridges, plane_of


def test_bridges_need_a_plane_that_dropped_a_vertex_and_was_met_in_more_than_two_points() -> None:
    cutting = Cutting(np.arange(3), np.zeros(3), np.array([2, 4, 3]), np.array([True, False, True]))
    assert [has_bridges(cutting, n) for n in range(4)] == [False, False, False, True]


def test_a_plane_is_one_row_of_the_tables() -> None:
    high = np.array([[1.0, 0.0, 2.0], [1.0, 1.0, 0.5]])
    heap = np.zeros(0, np.int64)
    tables = PlaneTables(high, np.zeros((2, 3)), np.array([0, -1]), np.array([-2.0, 0.0]), heap, heap)
    assert [(plane_of(tables, i).number, plane_of(tables, i).axis, plane_of(tables, i).place) for i in range(2)] == [
        (0, 0, -2.0),
        (1, -1, 0.0),
    ]
