"""Cells: how they are built and marked."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Cancel, CancelledError, Csg, Polyhedron, locate
from engine.compiling.jit import kernel
from engine.containment import policy
from engine.containment.cells.build import Sides, build_cells, build_sides, label_empty_cells
from engine.containment.cells.lattice import can_have_cells
from engine.containment.cells.locate import side_in_cell
from engine.lanes.lanes import array_at, plain_array_at
from engine.running.budget import Budget
from engine.types import UNDECIDED
from tests.unit.containment.scenes import box_mesh, made, merged


def test_cells_are_built_only_when_they_pay(monkeypatch: pytest.MonkeyPatch) -> None:
    solid = made(box_mesh([0, 0, 0], [1, 1, 1]))
    points = np.random.default_rng(5).uniform(-0.1, 1.1, (5000, 3))
    first, accuracy = locate(points, solid, report=True)
    assert accuracy.method == "ray_parity"
    for _ in range(3):
        again, accuracy = locate(points, solid, report=True)
        assert (again == first).all()
    assert accuracy.method == "segment_parity"
    monkeypatch.setattr(policy, "_CELLS", -np.inf)
    huge = Polyhedron(np.array(box_mesh([0, 0, 0], [1, 1, 1])["vertices"]) * 1e300, box_mesh([0] * 3, [1] * 3)["faces"])
    assert locate(points * 1e300, huge, report=True)[1].method == "ray_parity"
    tree = Csg("union", [solid, made(box_mesh([1, 0, 0], [2, 1, 1]))])
    assert (locate(points, tree) >= first).all()


def test_a_cancelled_build_keeps_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(policy, "_CELLS", -np.inf)
    solid = made(box_mesh([0, 0, 0], [1, 1, 1]))
    cancel = Cancel()
    cancel.set()
    with pytest.raises(CancelledError):
        locate(np.zeros((100, 3)), solid, cancel=cancel)
    with pytest.raises(CancelledError), Budget(None, cancel) as budget:
        build_cells(solid, budget)
    assert locate([[0.5, 0.5, 0.5]] * 100, solid).tolist() == [1] * 100


# --- The sides of cells: what they tell is what `locate` tells, and they tell most of a box ---


@kernel
def _first_of(address: int) -> float:
    return float(array_at(address, (2, 3), np.float64)[1, 2])


@kernel
def _ask(frames: Any, places: Any, points: Any, blur: float, found: Any) -> None:
    for item in range(len(points)):
        found[item] = side_in_cell(frames, places, 0, (points[item, 0], points[item, 1], points[item, 2]), blur)


def _sides(cells: Sides, points: np.ndarray[Any, Any], blur: float) -> np.ndarray[Any, Any]:
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
        cells = build_sides(solid, budget)
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


# --- Sides of cells: empty ones that share a wall copy from the first of them ---


def test_each_empty_cell_is_joined_with_its_copy_by_empty_cells() -> None:
    nx, ny, nz = 4, 3, 5
    counts = np.random.default_rng(0).integers(0, 2, nx * ny * nz)
    labels = np.empty(len(counts), np.int64)
    label_empty_cells(counts, nx, ny, labels)
    assert (labels[counts > 0] == np.flatnonzero(counts)).all()
    group = np.arange(len(counts))  # the least empty cell that each empty one is joined with
    empty = counts.reshape(nz, ny, nx) == 0
    for _ in range(len(counts)):
        cube = group.reshape(nz, ny, nx)
        for axis in range(3):
            first, second = np.moveaxis(cube, axis, 0)[:-1], np.moveaxis(cube, axis, 0)[1:]
            both = np.moveaxis(empty, axis, 0)[:-1] & np.moveaxis(empty, axis, 0)[1:]
            least = np.minimum(first, second)
            first[both] = least[both]
            second[both] = np.minimum(second, least)[both]
    assert (group[labels] == group).all()
    assert (counts[labels[counts == 0]] == 0).all()
