"""Boxes in a grid: every box is listed in the cell of each value it holds."""

from __future__ import annotations

import numpy as np
import pytest

from engine.bounding.grid import build_box_grid, cell_of


@pytest.mark.parametrize("scale", [1.0, 2.0**1020, 2.0**-1060, 1e-300])
def test_lists_are_conservative(scale: float) -> None:
    random = np.random.default_rng(4)
    low = np.round(random.uniform(0, 8, (60, 2)), 1) * scale
    high = low + np.round(random.uniform(0, 3, (60, 2)), 1) * scale
    grid = build_box_grid([low[:, 0], low[:, 1]], [high[:, 0], high[:, 1]], [7, 5])
    corners = np.concatenate([low, high, (low / 2 + high / 2)])
    for x, y in corners[(corners >= low.min(axis=0)).all(axis=1)].tolist():
        cell = cell_of(x, grid.u.low, grid.u.cells_per_unit, grid.u.n_cells)
        cell += cell_of(y, grid.v.low, grid.v.cells_per_unit, grid.v.n_cells) * grid.u.n_cells
        listed = grid.items[grid.offsets[cell] : grid.offsets[cell + 1]].tolist()
        held = np.flatnonzero(((low <= [x, y]) & (high >= [x, y])).all(axis=1)).tolist()
        assert set(held) <= set(listed)
        assert listed == sorted(listed)


def test_long_boxes_do_not_fill_the_memory() -> None:
    low, high = np.zeros(1000), np.ones(1000)
    grid = build_box_grid([low, low], [high, high], [512, 512])
    assert len(grid.items) <= 8 * (1000 + 512 * 512)


def test_no_extent_is_one_cell() -> None:
    flat = np.full(5, 3.0)
    grid = build_box_grid([flat, flat], [flat, flat], [16, 16])
    assert grid.offsets.tolist() == [0, 5]
