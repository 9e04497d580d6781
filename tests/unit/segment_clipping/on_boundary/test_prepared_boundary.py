"""What kernels read of a boundary: every triangle once, inner nodes first; of a polygon all edges, however many."""

from __future__ import annotations

import numpy as np

from engine.segment_clipping.on_boundary.contacts import LEAF_SIZE
from engine.segment_clipping.on_boundary.prepared_boundary import build_box_tree, mesh_of, outline_of


def test_blocks_hold_every_triangle_once_behind_all_inner_nodes() -> None:
    rng = np.random.default_rng(1)
    for n in (1, 8, 9, 500):
        elements = rng.uniform(-1, 1, (n, 3, 3))
        mesh = mesh_of(elements, np.arange(n))
        inner, blocks = mesh.child[: mesh.n_inner], mesh.child[mesh.n_inner :]
        items = blocks[(blocks < 0) & (blocks >= -n)]
        assert sorted(-1 - items) == list(range(n))
        assert len(mesh.corners) == len(blocks)
        below = np.concatenate([[0], inner[(inner >= 0) & (inner < len(mesh.child))]])
        assert sorted(below) == list(range(len(mesh.child)))  # each node has one parent, but the first


def test_numbers_out_of_range_are_not_safe() -> None:
    edges = np.array([[[0.0, 1.0], [1.0, 2.0]], [[1.0, 2.0], [0.0, 1.0]]])
    assert outline_of(edges, np.arange(2), np.array([0, 2])).are_safe
    for number in (1e-40, 1e40):
        assert not outline_of(np.where(edges == 2.0, number, edges), np.arange(2), np.array([0, 2])).are_safe


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
