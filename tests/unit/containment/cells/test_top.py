"""Level 0 of the cells: what it tells is what `locate` tells, and it tells most of a box."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Polyhedron, locate
from engine.budget import Budget
from engine.containment.cells.locate import side_in_cell
from engine.containment.cells.top import TopCells, build_top_cells, can_have_cells
from engine.jit import kernel
from engine.lanes.addresses import array_at, plain_array_at
from engine.types import UNDECIDED
from tests.unit.containment.scenes import box_mesh, made, merged


@kernel
def _first_of(address: int) -> float:
    return float(array_at(address, (2, 3), np.float64)[1, 2])


@kernel
def _ask(frames: Any, places: Any, points: Any, blur: float, found: Any) -> None:
    for item in range(len(points)):
        found[item] = side_in_cell(frames, places, 0, (points[item, 0], points[item, 1], points[item, 2]), blur)


def _sides(cells: TopCells, points: np.ndarray[Any, Any], blur: float) -> np.ndarray[Any, Any]:
    found = np.empty(len(points), np.int8)
    _ask(cells.frame[None], np.array([cells.place]), points, blur, found)
    return found


@pytest.mark.parametrize("scale", [1.0, 2.0**-300, 2.0**300])
@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_cells_tell_what_locate_tells(scale: float, shift: float) -> None:
    mesh = merged(box_mesh([0, 0, 0], [7, 5, 3]), box_mesh([1, 1, 1], [2, 3, 5]), box_mesh([6, 4, 2], [9, 6, 4]))
    solid: Polyhedron = made({**mesh, "vertices": ((np.array(mesh["vertices"]) + shift) * scale).tolist()})
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    random = np.random.default_rng(0)
    points = np.concatenate([random.uniform(low, high, (20_000, 3)), solid.vertices])
    lattice = np.clip((np.round(random.uniform(-1, 10, (5000, 3)) * 4) / 4 + shift) * scale, low, high)
    points = np.concatenate([points, lattice])
    with Budget() as budget:
        cells = build_top_cells(solid, budget)
    sides = _sides(cells, points, 0.0)
    is_told = sides != UNDECIDED
    assert (sides[is_told] == locate(points, solid)[is_told]).all()
    assert is_told[:20_000].mean() > 0.25
    blur = float((high - low).min()) / 16.0  # most cells are as wide: a blurred point that is told lies in one
    is_told = _sides(cells, points, blur) != UNDECIDED
    index = (np.stack([points - blur, points, points + blur]) - cells.frame[:3]) * cells.frame[3:]
    assert (index[:, is_told].astype(int).min(axis=0) == index[:, is_told].astype(int).max(axis=0)).all()


def test_what_is_out_of_range_gets_none() -> None:
    mesh = box_mesh([0, 0, 0], [1, 1, 1])
    for scale in (2.0**500, 2.0**-500):
        vertices = np.array(mesh["vertices"]) * scale
        assert not can_have_cells(made({**mesh, "vertices": vertices.tolist()}))


def test_an_array_by_its_address() -> None:
    values = np.arange(6.0)
    assert plain_array_at(values.ctypes.data, (2, 3), np.float64).tolist() == [[0, 1, 2], [3, 4, 5]]
    assert plain_array_at(values.ctypes.data, (0,), np.float64).tolist() == []
    assert _first_of(values.ctypes.data) == 5.0
