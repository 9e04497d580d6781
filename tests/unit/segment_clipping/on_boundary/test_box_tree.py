"""The tree of boxes over a boundary: nothing is lost, whatever its size."""

from __future__ import annotations

import numpy as np

from engine.segment_clipping.on_boundary.box_tree import LEAF_SIZE, build_box_tree


def test_box_tree_holds_every_element() -> None:
    rng = np.random.default_rng(4)
    for n, n_rings in ((1, 1), (2, 2), (LEAF_SIZE, 1), (LEAF_SIZE + 1, 1), (100, 1), (100, 33)):
        low = rng.uniform(-1, 1, (n, 3)) * 10.0 ** rng.integers(-300, 300, (n, 1))
        high = low + rng.uniform(0, 1, (n, 3))
        order, boxes = build_box_tree(low, high, np.linspace(0, n, n_rings + 1).astype(np.int64))
        assert sorted(order.tolist()) == list(range(n))
        for place, element in enumerate(order):
            node = len(boxes) // 2 + place // LEAF_SIZE
            while node:
                assert (boxes[node, 0] <= low[element]).all()
                assert (boxes[node, 1] >= high[element]).all()
                node //= 2
