"""Rings share a bit only where no label can mistake one for another, and names are given back only where sure."""

from __future__ import annotations

import numpy as np
import pytest

from engine.arrangement.ring_labels import MOST_BITS
from engine.clipping.ring_bits import RingBits, assign_bits, boxes_of, rings_meant
from engine.parallel import Budget


def squares(centres: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * radius
    return (centres[:, None] + corners).reshape(-1, 2), np.arange(len(centres) + 1) * 4


@pytest.mark.parametrize("n_rings", [5, MOST_BITS, 300])
@pytest.mark.parametrize("seed", range(3))
def test_rings_that_share_a_bit_are_apart(n_rings: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    low, high = boxes = boxes_of(*squares(random.random((n_rings, 2)), 0.02))
    piece_offsets = np.concatenate([[0], 1 + np.flatnonzero(random.random(n_rings - 1) < 0.6), [n_rings]])
    labels = assign_bits(boxes, piece_offsets, Budget())
    assert labels is not None
    assert len(labels.shells) == min(n_rings, len(labels.shells)) <= MOST_BITS
    shell_of = np.repeat(piece_offsets[:-1], np.diff(piece_offsets))
    assert (labels.shells[labels.bits] == labels.bits[shell_of]).all()
    for i in range(n_rings):
        same = np.flatnonzero(labels.bits == labels.bits[i])
        meets = (low[same] <= high[i]).all(axis=1) & (low[i] <= high[same]).all(axis=1)
        assert same[meets].tolist() == [i]


def test_rings_in_each_other_take_too_many_bits() -> None:
    low = np.arange(100.0)[:, None] * [1, 1]
    assert assign_bits((low, 300 - low), np.arange(101), Budget()) is None


def test_a_bit_means_the_one_ring_whose_box_meets_the_part() -> None:
    boxes = boxes_of(*squares(np.arange(100)[:, None] * [1.0, 0.0], 0.4))
    labels = assign_bits(boxes, np.arange(101), Budget())
    assert labels is not None
    assert rings_meant(labels, boxes, 1 << labels.bits, boxes, Budget()) == [[ring] for ring in range(100)]
    assert rings_meant(labels, boxes, np.array([1]), (boxes[0][:1], boxes[1][-1:]), Budget()) is None
    own = RingBits(np.arange(3), np.arange(3))
    assert rings_meant(own, boxes, np.array([5, 2]), boxes, Budget()) == [[0, 2], [1]]
