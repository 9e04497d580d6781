"""Pairs of boxes that meet: the brute-force answer, sorted, whatever the blocks."""

from __future__ import annotations

import numpy as np
import pytest

from engine.bounding.sweep import meeting_boxes, pairs_of_boxes
from engine.budget import Budget, Cancel
from engine.errors import CancelledError


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


@pytest.mark.parametrize("stretch", [(1.0, 1.0), (100.0, 1.0), (1.0, 100.0)])
def test_all_pairs_at_once(stretch: tuple[float, float]) -> None:
    random = np.random.default_rng(7)
    low = random.integers(0, 40, (150, 2)) * stretch
    high = low + random.integers(0, 6, (150, 2)) * stretch
    meet = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
    np.testing.assert_array_equal(pairs_of_boxes(low, high, Budget()), np.argwhere(np.triu(meet, 1)))
    assert pairs_of_boxes(low[:0], high[:0], Budget()).shape == (0, 2)


def test_all_pairs_end_when_cancelled() -> None:
    cancel = Cancel()
    cancel.set()
    with Budget(cancel=cancel) as budget, pytest.raises(CancelledError):
        pairs_of_boxes(np.zeros((200, 2)), np.ones((200, 2)), budget)
