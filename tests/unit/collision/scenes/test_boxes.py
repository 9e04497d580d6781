"""Pairs of boxes by their bounds: what `collide` says of them one by one."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, collide
from engine.collision.codes import UNSETTLED
from engine.collision.scenes.boxes import relate_box_pairs


@pytest.mark.parametrize("d", [2, 3])
def test_agrees_with_single_pairs_flat_ones_too(d: int) -> None:
    corners = np.sort(np.random.default_rng(d).integers(0, 4, (40, 2, d)), axis=1).astype(float)
    low, high, is_box = corners[:, 0].copy(), corners[:, 1].copy(), np.arange(40) != 7
    pairs = np.array([(i, j) for i in range(40) for j in range(i)])
    found = np.full(len(pairs), UNSETTLED, np.int8)
    relate_box_pairs(low, high, is_box, pairs, found)
    for (i, j), how in zip(pairs.tolist(), found.tolist()):
        expected = collide(Aabb(low[i], high[i]), Aabb(low[j], high[j])).relation
        assert how == (UNSETTLED if 7 in (i, j) else expected)
