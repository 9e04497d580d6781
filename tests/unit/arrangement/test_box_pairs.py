"""The sweep finds every pair of closed boxes that meet, once."""

from __future__ import annotations

import numpy as np
import pytest

from engine.arrangement.box_pairs import box_pairs
from engine.errors import CancelledError
from engine.parallel import Budget, Cancel


@pytest.mark.parametrize("stretch", [(1.0, 1.0), (100.0, 1.0), (1.0, 100.0)])
def test_equals_all_against_all(stretch: tuple[float, float]) -> None:
    random = np.random.default_rng(7)
    low = random.integers(0, 40, (150, 2)) * stretch
    high = low + random.integers(0, 6, (150, 2)) * stretch
    meet = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
    expected = [pair for pair in np.argwhere(meet).tolist() if pair[0] < pair[1]]
    assert sorted(box_pairs(low, high, Budget()).tolist()) == expected


def test_more_pairs_than_first_room_and_none_at_all() -> None:
    assert len(box_pairs(np.zeros((60, 2)), np.ones((60, 2)), Budget())) == 60 * 59 // 2
    assert box_pairs(np.zeros((0, 2)), np.zeros((0, 2)), Budget()).shape == (0, 2)


def test_ends_when_cancelled() -> None:
    cancel = Cancel()
    cancel.set()
    with Budget(cancel=cancel) as budget, pytest.raises(CancelledError):
        box_pairs(np.zeros((200, 2)), np.ones((200, 2)), budget)
