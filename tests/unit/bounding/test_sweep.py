"""Pairs of boxes that meet: the brute-force answer, sorted, whatever the blocks."""

from __future__ import annotations

import numpy as np
import pytest

from engine.bounding.sweep import meeting_boxes


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("block", [1, 7, 1 << 18])
def test_every_pair_once_in_order(dimension: int, block: int) -> None:
    rng = np.random.default_rng(dimension)
    low = rng.integers(0, 8, (40, dimension)).astype(float)
    high = low + rng.integers(0, 3, low.shape)
    low[5], high[6], low[7], high[7] = -np.inf, np.inf, -np.inf, np.inf
    meet = ((low[:, None] <= high) & (low <= high[:, None])).all(axis=2)
    expected = np.argwhere(np.triu(meet, 1))
    blocks = list(meeting_boxes(low, high, np.zeros(1, np.uint8), block))
    np.testing.assert_array_equal(np.concatenate(blocks), expected)
    assert all(len(part) <= block or len(set(part[:, 0])) == 1 for part in blocks)


def test_a_raised_flag_ends_it() -> None:
    low = np.zeros((3000, 3))
    assert list(meeting_boxes(low, low + 1, np.ones(1, np.uint8))) == []
