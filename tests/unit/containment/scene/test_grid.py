"""The grid of a scene: the cell of a point lists every body whose box holds it, in ascending order."""

from __future__ import annotations

import numpy as np
import pytest

from engine.containment.scene.grid import build_scene_grid, cell_at


@pytest.mark.parametrize("depth", [0.0, 4.0])
def test_lists_are_conservative(depth: float) -> None:
    random = np.random.default_rng(0)
    lows = random.integers(0, 20, (200, 3)) / 2.0 * [1.0, 1.0, depth]
    highs = lows + random.integers(0, 4, (200, 3)) / 2.0 * [1.0, 1.0, depth]
    bodies = np.arange(3, 200, 2)
    grid = build_scene_grid(bodies, lows, highs)
    for point in np.concatenate([lows[bodies], highs[bodies]]):
        cell = cell_at(tuple(point.tolist()), grid)
        listed = grid.items[grid.offsets[cell] : grid.offsets[cell + 1]].tolist()
        held = bodies[((lows <= point) & (point <= highs)).all(axis=1)[bodies]].tolist()
        assert set(held) <= set(listed)
        assert listed == sorted(listed)
    assert cell_at((-1.0, 0.0, 0.0), grid) == -1


def test_no_bodies_are_in_no_cell() -> None:
    grid = build_scene_grid(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)))
    assert cell_at((0.0, 0.0, 0.0), grid) == -1
