"""Boxes in a grid: every box is listed in the cell of each value it holds."""

from __future__ import annotations

import numpy as np
import pytest

from engine.bounding.grid import cell_of, list_in_cells


@pytest.mark.parametrize("scale", [1.0, 2.0**1020, 2.0**-1060, 1e-300])
def test_lists_are_conservative(scale: float) -> None:
    random = np.random.default_rng(4)
    low = np.round(random.uniform(0, 8, (60, 2)), 1) * scale
    high = low + np.round(random.uniform(0, 3, (60, 2)), 1) * scale
    flat = np.zeros(1)
    (u, v, _), offsets, items = list_in_cells([*low.T, flat], [*high.T, flat], [7, 5, 1], 444, lambda: None)
    corners = np.concatenate([low, high, (low / 2 + high / 2)])
    for x, y in corners[(corners >= low.min(axis=0)).all(axis=1)].tolist():
        cell = cell_of(x, u.low, u.cells_per_unit, u.n_cells)
        cell += cell_of(y, v.low, v.cells_per_unit, v.n_cells) * u.n_cells
        listed = items[offsets[cell] : offsets[cell + 1]].tolist()
        held = np.flatnonzero(((low <= [x, y]) & (high >= [x, y])).all(axis=1)).tolist()
        assert set(held) <= set(listed)
        assert listed == sorted(listed)


def test_long_boxes_do_not_fill_the_memory() -> None:
    low, high = np.zeros(1000), np.ones(1000)
    flat = np.zeros(1)
    _, _, items = list_in_cells([low, low, flat], [high, high, flat], [512, 512, 1], 1 << 20, lambda: None)
    assert len(items) <= 8 * (1000 + 512 * 512)


def test_no_extent_is_one_cell() -> None:
    flat = np.full(5, 3.0)
    _, offsets, _ = list_in_cells([flat] * 3, [flat] * 3, [16, 16, 1], 1000, lambda: None)
    assert offsets.tolist() == [0, 5]
