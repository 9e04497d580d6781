"""Cells of an axis: none decreases along it, ties, roundings and subnormal numbers included."""

from __future__ import annotations

import numpy as np
import pytest

from engine.bounding.grid import cell_of, make_axis


@pytest.mark.parametrize("scale", [1.0, 2.0**1020, 2.0**-1060, 1e-300])
def test_cells_ascend(scale: float) -> None:
    random = np.random.default_rng(4)
    values = np.sort(np.round(random.uniform(0, 8, 200), 1)) * scale
    values = np.sort(np.concatenate([values, np.nextafter(values, -np.inf)[1:], np.nextafter(values, np.inf)[:-1]]))
    axis = make_axis(float(values[0]), float(values[-1]), 7)
    cells = [cell_of(value, axis.low, axis.cells_per_unit, axis.n_cells) for value in values.tolist()]
    assert cells == sorted(cells)
    assert cells[0] == 0
    assert cells[-1] == 6 or scale < 1e-290  # there are fewer cells than asked for


def test_no_extent_is_one_cell() -> None:
    axis = make_axis(3.0, 3.0, 16)
    assert axis.n_cells == 1
    assert cell_of(3.0, axis.low, axis.cells_per_unit, axis.n_cells) == 0
