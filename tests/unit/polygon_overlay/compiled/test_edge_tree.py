"""Pairs of boxes from the implicit tree: all that brute force finds, each once, and few others."""

from __future__ import annotations

import numpy as np
import pytest

from engine.jit import allocating_kernel
from engine.polygon_overlay.compiled import edge_tree


@allocating_kernel
def pairs_of(tree, found):  # type: ignore[no-untyped-def]
    """Return how many pairs there are, written to `found`."""
    n = len(tree.boxes)
    edge_tree.build_tree(tree, n, np.zeros(1, np.uint8))
    depth, total = edge_tree.begin_pairs(tree, n, np.zeros(1, np.uint8)), 0
    while depth > 0:
        count, depth = edge_tree.next_pairs(tree, n, depth)
        found[total : total + count] = tree.pairs[:count]
        total += count
    return total


@pytest.mark.parametrize("n", [1, 3, 4, 5, 33, 41, 300, 1500])
@pytest.mark.parametrize("share", [1.0, 0.2])
@pytest.mark.parametrize("wanders", [True, False])
def test_every_pair_once(n: int, share: float, wanders: bool) -> None:
    random = np.random.default_rng([n, wanders])
    low = np.cumsum(random.normal(size=(n, 2)), axis=0) if wanders else random.random((n, 2)) * np.sqrt(n)
    high = low + random.random((n, 2)) * 2
    boxes = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1)
    meets_none = random.random(n) > share
    boxes[meets_none, 3] = -np.inf
    marks = np.full(n, edge_tree.ANYWHERE, np.uint8)
    n_leaves = int(edge_tree.leaves_of(n))
    found = np.empty((n * n, 2), np.int64)
    tree = edge_tree.BoxTree(
        boxes,
        marks,
        np.empty((2 * n_leaves, 4)),
        np.empty(2 * n_leaves, np.uint8),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
        np.empty((edge_tree.DEEPEST, 2), np.int64),
        np.empty((edge_tree.PORTION, 2), np.int64),
    )
    total = pairs_of(tree, found)
    got = sorted(tuple(sorted(pair)) for pair in found[:total].tolist())
    left, right, lower, upper = boxes.T
    meet = (left[:, None] <= right) & (left <= right[:, None]) & (lower[:, None] <= upper) & (lower <= upper[:, None])
    expected = set(zip(*(side.tolist() for side in np.nonzero(np.triu(meet, 1))), strict=True))
    assert len(set(got)) == total
    assert expected <= set(got)
    assert total <= 1.05 * len(expected) + 5
    assert not meets_none[found[:total]].any()
