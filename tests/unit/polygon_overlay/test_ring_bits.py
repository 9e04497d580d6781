"""Rings share a bit only where no label can mistake one for another, and names are given back only where sure."""

from __future__ import annotations

import numpy as np
import pytest

from engine.parallel import Budget
from engine.polygon_overlay.compiled.ring_labels import MOST_BITS
from engine.polygon_overlay.ring_bits import Corners, RingBits, assign_bits, boxes_of, rings_meant


def squares(centres: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * radius
    return (centres[:, None] + corners).reshape(-1, 2), np.arange(len(centres) + 1) * 4


@pytest.mark.parametrize("n_rings", [5, MOST_BITS, 300])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("order", [0, 2])
def test_rings_that_share_a_bit_are_apart(n_rings: int, seed: int, order: int) -> None:
    random = np.random.default_rng(seed)
    low, high = boxes = boxes_of(*squares(random.random((n_rings, 2)), 0.02))
    piece_offsets = np.concatenate([[0], 1 + np.flatnonzero(random.random(n_rings - 1) < 0.6), [n_rings]])
    labels = assign_bits(boxes, piece_offsets, Budget(), order)
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


def meant(rings: list[set[int]], boxes: Corners, parts: Corners, n_pieces: int) -> list[list[int]] | None:
    """Return what evidence names where part k comes from rings[k]."""
    piece_offsets = np.arange(n_pieces + 1)

    def evidence(labels: RingBits) -> np.ndarray:
        return np.array([sum({1 << int(labels.bits[ring]) for ring in each}) for each in rings])

    labels = assign_bits(boxes, piece_offsets, Budget())
    assert labels is not None
    return rings_meant(labels, evidence(labels), boxes, piece_offsets, parts, evidence, Budget())


def test_evidence_names_rings_whose_boxes_meet_the_part() -> None:
    boxes = boxes_of(*squares(np.arange(100)[:, None] * [1.0, 0.0], 0.4))
    alone = [{ring} for ring in range(100)]
    assert meant(alone, boxes, boxes, 100) == [[ring] for ring in range(100)]
    own = RingBits(np.arange(3), np.arange(3))
    assert rings_meant(own, np.array([5, 2]), boxes, np.arange(4), boxes, lambda _: None, Budget()) == [[0, 2], [1]]


@pytest.mark.parametrize("seed", range(3))
def test_rings_of_one_bit_near_a_part_are_told_apart_by_other_orders(seed: int) -> None:
    """Parts as wide as forty rings, each from a few of them; one from all rings is not told from one from most."""
    random = np.random.default_rng(seed)
    low, high = boxes = boxes_of(*squares(np.arange(200)[:, None] * [1.0, 0.0], 0.4))
    rings = [{first, *(first + random.integers(0, 40, 3)).tolist()} for first in range(0, 160, 7)]
    ends = [min(each) for each in rings], [max(each) for each in rings]
    assert meant(rings, boxes, (low[ends[0]], high[ends[1]]), 200) == [sorted(each) for each in rings]
    assert meant([set(range(199))], boxes, (low[:1], high[-1:]), 200) is None
