"""A boundary, prepared and cut on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine.containment.locators import locator_of
from engine.running.budget import Budget
from engine.segment_clipping.clip_segments import clip_segments
from engine.segment_clipping.on_boundary.boundary import clip_chunk
from engine.segment_clipping.on_boundary.contacts import GROUP, LEAF_SIZE
from engine.segment_clipping.on_boundary.prepared_boundary import build_box_tree, mesh_of, outline_of
from engine.segment_clipping.pieces import Pieces, joined
from engine.solids.base import Solid
from engine.solids.polygon import Polygon
from engine.types import OPEN, read_only
from tests.reference.shapes import box, union_of
from tests.unit.segment_clipping.on_boundary.test_boundary import REGIONS, solid_of, vertices_of
from tests.unit.segment_clipping.scenes import assert_exact, random_segments, through


def nothing_settled(segments: Any, locations: Any, boundary: Any, budget: Any) -> tuple[list[Pieces], np.ndarray]:
    return [], np.full(len(segments), OPEN, np.uint8)


def test_kernel_and_exact_integers_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    """Proper crossings cut by the kernel are what exact integers give, bit by bit."""
    for dimension, regions in REGIONS.items():
        rng = np.random.default_rng(dimension)
        for region in regions():
            segments = np.concatenate([random_segments(rng, 40, dimension), through(rng, vertices_of(region), 40)])
            both = [clip_segments(segments, region)]
            with monkeypatch.context() as patch:
                patch.setattr("engine.segment_clipping.on_boundary.boundary.cut_at_crossings", nothing_settled)
                both.append(clip_segments(segments, region))
            for name in ("source", "start", "end", "t", "faces"):
                np.testing.assert_array_equal(getattr(both[0], name), getattr(both[1], name))


@pytest.mark.full
def test_more_crossings_than_there_is_room_for_at_first() -> None:
    """A comb of 50 teeth and 40 boxes in a row, cut lengthwise, again and again."""
    teeth = np.arange(100.0)
    tips = np.stack([teeth, np.where(teeth % 2, 1.0, 5.0)], axis=1)
    comb = Polygon([[*tips.tolist(), [99.0, 0.0], [0.0, 0.0]]])
    boxes = solid_of(union_of(*(box((4 * k, 0, 0), (4 * k + 1.5, 1, 1)) for k in range(40))))
    along: list[tuple[Solid, Any, int]] = [
        (comb, [[-1.3, 2.9], [100.1, 3.1]], 50),
        (boxes, [[-1, 0.3, 0.4], [163.7, 0.6, 0.7]], 40),
    ]
    for region, line, n in along:
        pieces, accuracy = clip_segments(np.array([line] * 110), region, report=True)
        assert len(pieces) == 110 * n
        assert accuracy.n_rational == 0
        assert_exact(clip_segments([line], region), np.array([line]), region)


def test_groups_answer_as_a_few_segments_do() -> None:
    """More segments at once than a group holds, with more contacts than have room or wait at once."""
    rng = np.random.default_rng(8)
    boxes = solid_of(union_of(*(box((4 * k, 0, 0), (4 * k + 1.5, 1, 1)) for k in range(40))))
    n = GROUP + 300
    segments = rng.uniform((-2, -0.1, -0.1), (164, 1.1, 1.1), (n, 2, 3))
    segments[::50, 1] = segments[::50, 0]
    segments = read_only(segments)  # the kind that the kernel is compiled for
    budget, locator = Budget(), locator_of(boxes)
    whole = clip_chunk(segments, 0, n, boxes, locator, budget)[0]
    parts = [clip_chunk(segments, i, min(i + 60, n), boxes, locator, budget)[0] for i in range(0, n, 60)]
    assert len(whole.source) > 3 * n
    for one, many in zip(whole, joined(parts)):
        np.testing.assert_array_equal(one, many)


# --- What kernels read of a boundary: every triangle once, inner nodes first ---


def test_blocks_hold_every_triangle_once_behind_all_inner_nodes() -> None:
    rng = np.random.default_rng(1)
    for n in (1, 8, 9, 500):
        elements = rng.uniform(-1, 1, (n, 3, 3))
        mesh = mesh_of(elements.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3), np.arange(n))
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
