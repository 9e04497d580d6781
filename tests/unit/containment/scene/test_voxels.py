"""Voxels: what they tell is what `locate` tells, and they tell most of a box."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Polyhedron, locate
from engine.containment.scene.build_voxels import build_voxels
from engine.jit import kernel
from engine.lanes.addresses import array_at, plain_array_at
from engine.parallel import Budget
from engine.types import UNDECIDED
from tests.unit.containment.scenes import box_mesh, made, merged


@kernel
def _first_of(address: int) -> float:
    return float(array_at(address, (2, 3), np.float64)[1, 2])


def _sides(solid: Polyhedron, points: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return what the voxels tell of points of the box, in plain arithmetic."""
    with Budget() as budget:
        voxels = build_voxels(solid, budget)
    assert voxels is not None
    index = ((points - voxels.frame[:3]) * voxels.frame[3:]).astype(np.int64)
    assert ((index >= 0) & (index < 1 << voxels.shift)).all()
    voxel = (index[:, 2] << voxels.shift | index[:, 1]) << voxels.shift | index[:, 0]
    side = (voxels.packed[voxel >> 2] >> (2 * (voxel & 3)) & 3).astype(int) - 1
    return np.where(side == 0, UNDECIDED, side)


@pytest.mark.parametrize("scale", [1.0, 2.0**-300, 2.0**300])
@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_voxels_tell_what_locate_tells(scale: float, shift: float) -> None:
    mesh = merged(box_mesh([0, 0, 0], [7, 5, 3]), box_mesh([1, 1, 1], [2, 3, 5]), box_mesh([6, 4, 2], [9, 6, 4]))
    solid: Polyhedron = made({**mesh, "vertices": ((np.array(mesh["vertices"]) + shift) * scale).tolist()})
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    random = np.random.default_rng(0)
    points = np.concatenate([random.uniform(low, high, (20_000, 3)), solid.vertices])
    lattice = np.clip((np.round(random.uniform(-1, 10, (5000, 3)) * 4) / 4 + shift) * scale, low, high)
    points = np.concatenate([points, lattice])
    sides = _sides(solid, points)
    is_told = sides != UNDECIDED
    assert (sides[is_told] == locate(points, solid)[is_told]).all()
    assert is_told[:20_000].mean() > 0.25


def test_what_is_out_of_range_gets_none() -> None:
    mesh = box_mesh([0, 0, 0], [1, 1, 1])
    with Budget() as budget:
        for scale in (2.0**500, 2.0**-500):
            vertices = np.array(mesh["vertices"]) * scale
            assert build_voxels(made({**mesh, "vertices": vertices.tolist()}), budget) is None


def test_an_array_by_its_address() -> None:
    values = np.arange(6.0)
    assert plain_array_at(values.ctypes.data, (2, 3), np.float64).tolist() == [[0, 1, 2], [3, 4, 5]]
    assert plain_array_at(values.ctypes.data, (0,), np.float64).tolist() == []
    assert _first_of(values.ctypes.data) == 5.0
