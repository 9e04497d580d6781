"""The grid finds the pairs that the sweep finds, for boxes of any mix of sizes."""

from __future__ import annotations

import numpy as np
import pytest

from engine.bounding.box_grid import pairs_of_boxes
from engine.bounding.sweep import meeting_boxes

FLAG = np.zeros(1, np.uint8)


def all_pairs(blocks) -> list[list[int]]:
    return np.concatenate([np.empty((0, 2), np.int64), *blocks]).tolist()


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kind", ["alike", "lattice", "mixed", "infinite", "flat", "far", "one_place", "tiny"])
def test_the_pairs_are_those_of_the_sweep(kind: str, dimension: int) -> None:
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
    expected = all_pairs(meeting_boxes(low, high, FLAG))
    assert all_pairs(pairs_of_boxes(low, high, FLAG)) == expected
    blocks = list(pairs_of_boxes(low, high, FLAG, 100))
    assert all(block.tolist() == sorted(block.tolist()) for block in blocks)
    assert sorted(all_pairs(blocks)) == expected


def test_a_raised_flag_ends_it() -> None:
    low = np.random.default_rng(0).uniform(0, 10, (500, 3))
    assert all_pairs(pairs_of_boxes(low, low + 1, np.ones(1, np.uint8))) == []
