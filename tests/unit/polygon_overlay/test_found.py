"""Pairs taken from what was found, and put together again, are what they were."""

from __future__ import annotations

import numpy as np

from engine.polygon_overlay.found import NO_PAIRS, Found, chained, joined, one_pair, ring_sizes, taken
from engine.solids.ragged import summed


def pair_of(random: np.random.Generator) -> Found:
    sizes = random.integers(3, 6, random.integers(0, 4))
    return one_pair(random.random((sizes.sum(), 2)), summed(sizes), np.arange(len(sizes) + 1), 0.25, 7)


def same(first: Found, second: Found) -> bool:
    return all(a.tolist() == b.tolist() for a, b in zip(first, second, strict=True))


def test_taken_and_joined() -> None:
    random = np.random.default_rng(1)
    pairs = [pair_of(random) for _ in range(9)]
    together = joined([NO_PAIRS, *pairs])
    order = random.permutation(9)
    assert same(taken(together, order), joined([pairs[k] for k in order.tolist()]))
    assert same(taken(together, np.arange(9)), together)
    assert same(taken(together, np.zeros(0, np.int64)), NO_PAIRS)


def test_offsets() -> None:
    assert chained([np.array([0, 2, 5]), np.array([0]), np.array([0, 1])]).tolist() == [0, 2, 5, 6]
    assert ring_sizes(one_pair(np.array([[0.0, 1], [3, 1], [3, 2]]), np.array([0, 3]), np.array([0, 1]), 0, 0)) == [2]
    assert len(ring_sizes(NO_PAIRS)) == 0
