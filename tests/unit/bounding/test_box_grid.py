"""Grids of boxes and of points."""

from __future__ import annotations

import numpy as np
import pytest

from engine.bounding.box_grid import all_pairs_of_boxes, cell_of, make_axis, pairs_of_boxes
from engine.errors import CancelledError
from engine.running.budget import Budget, Cancel


def all_pairs(blocks) -> list[list[int]]:
    return np.concatenate([np.empty((0, 2), np.int64), *blocks]).tolist()


def brute_force(low: np.ndarray, high: np.ndarray) -> list[list[int]]:
    meet = ((low[:, None] <= high) & (low <= high[:, None])).all(axis=2)
    return np.argwhere(np.triu(meet, 1)).tolist()


@pytest.mark.some(8)
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kind", ["alike", "lattice", "mixed", "infinite", "flat", "far", "one_place", "tiny"])
def test_the_pairs_are_those_that_meet(kind: str, dimension: int) -> None:
    rng = np.random.default_rng(dimension)
    low = rng.uniform(0, 12, (700, dimension))
    size = rng.uniform(0.5, 1.0, (700, dimension))
    if kind == "lattice":
        low, size = np.floor(low), np.ones_like(low)
    elif kind == "mixed":
        size[:300] *= rng.uniform(0, 8, (300, 1))
    elif kind == "flat":
        low[:, -1], size[:, -1] = 3.0, 0.0
    elif kind == "far":
        low += 1e15
    elif kind == "one_place":
        low[:], size[:] = 1.0, 0.0
    elif kind == "tiny":
        low, size = low * 1e-310, size * 1e-310
    high = low + size
    if kind == "infinite":
        low[5], high[5], low[6] = -np.inf, np.inf, -np.inf
    expected = brute_force(low, high)
    assert all_pairs(pairs_of_boxes(low, high, Budget())) == expected
    blocks = list(pairs_of_boxes(low, high, Budget(), 100))
    assert all(block.tolist() == sorted(block.tolist()) for block in blocks)
    assert sorted(all_pairs(blocks)) == expected


@pytest.mark.parametrize("workers", [1, 2, 3, 16])
def test_parts_of_many_boxes_by_threads(workers: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("engine.bounding.box_grid._PARTED", 300)
    rng = np.random.default_rng(11)
    low = rng.uniform(0, 12, (1500, 3))
    high = low + rng.uniform(0.2, 1.2, low.shape)
    expected = brute_force(low, high)
    for size in (1 << 18, 640):
        blocks = list(pairs_of_boxes(low, high, Budget(), size, workers=workers))
        assert all(block.tolist() == sorted(block.tolist()) for block in blocks)
        assert sorted(all_pairs(blocks)) == expected


@pytest.mark.parametrize("workers", [1, 2, 16])
def test_a_block_of_boxes_that_all_meet_has_the_pairs_of_few_of_them(workers: int) -> None:
    """Each part of the boxes may list all pairs of one box: 64 parts at once gave blocks of a million pairs."""
    low, block = np.zeros((1 << 14, 3)), 1 << 15
    with Budget() as budget:
        blocks = pairs_of_boxes(low, low + 1.0, budget, block, workers=workers)
        assert all(len(part) < block + len(low) for _, part in zip(range(20), blocks))


def test_a_cancelled_call_ends() -> None:
    low, cancel = np.random.default_rng(0).uniform(0, 10, (500, 3)), Cancel()
    cancel.set()
    with Budget(cancel=cancel) as budget, pytest.raises(CancelledError):
        list(pairs_of_boxes(low, low + 1, budget))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("block", [1, 7, 1 << 18])
def test_every_pair_of_few_once(dimension: int, block: int) -> None:
    rng = np.random.default_rng(dimension)
    low = rng.integers(0, 8, (40, dimension)).astype(float)
    high = low + rng.integers(0, 3, low.shape)
    low[5], high[6], low[7], high[7] = -np.inf, np.inf, -np.inf, np.inf
    blocks = list(pairs_of_boxes(low, high, Budget(), block))
    assert sorted(all_pairs(blocks)) == brute_force(low, high)
    assert all(len(part) < block + len(low) for part in blocks)


@pytest.mark.parametrize("stretch", [(1.0, 1.0), (100.0, 1.0), (1.0, 100.0)])
def test_all_pairs_at_once(stretch: tuple[float, float], monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(7)
    low = random.integers(0, 40, (150, 2)) * stretch
    high = low + random.integers(0, 6, (150, 2)) * stretch
    expected = brute_force(low, high)
    assert all_pairs_of_boxes(low, high, Budget()).tolist() == expected
    for name, value in {"BLOCK": 50, "_SAMPLE": 5}.items():  # many blocks, sorted in many ranges
        monkeypatch.setattr(f"engine.bounding.box_grid.{name}", value)
    assert all_pairs_of_boxes(low, high, Budget()).tolist() == expected
    assert all_pairs_of_boxes(low[:0], high[:0], Budget()).shape == (0, 2)


def test_all_pairs_end_when_cancelled() -> None:
    cancel = Cancel()
    cancel.set()
    with Budget(cancel=cancel) as budget, pytest.raises(CancelledError):
        all_pairs_of_boxes(np.zeros((200, 2)), np.ones((200, 2)), budget)


# --- Cells of an axis: none decreases along it, ties, roundings and subnormal numbers included ---


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
