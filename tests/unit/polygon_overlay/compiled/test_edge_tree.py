"""Edges that may meet: the tree, events along an edge, what keeps clear."""

from __future__ import annotations

import numpy as np
import pytest

from engine.compiling.jit import allocating_kernel
from engine.polygon_overlay.compiled import edge_tree
from tests.unit.polygon_overlay.checks import OPERATIONS
from tests.unit.polygon_overlay.compiled.test_kernel import agree


@allocating_kernel
def pairs_of(tree, found):  # type: ignore[no-untyped-def]
    """Return how many pairs there are, written to `found`."""
    n = len(tree.boxes)
    edge_tree.build_tree(tree, n, np.zeros(1, np.uint8))
    depth, total = edge_tree.begin_pairs(tree), 0
    while depth > 0:
        count, depth = edge_tree.next_pairs(tree, n, depth)
        found[total : total + count] = tree.pairs[:count]
        total += count
    return total


@pytest.mark.some(6)
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


# --- Events along an edge: thousands on one, in the order of their parameters, those at one point united ---


@pytest.mark.parametrize("n_teeth", [6, 40])
@pytest.mark.parametrize("is_even", [True, False])
def test_many_crossings_on_one_edge(n_teeth: int, is_even: bool) -> None:
    """A comb across a bar whose edges meet every tooth: runs sorted by insertion, then merged."""
    random = np.random.default_rng(n_teeth)
    x = np.arange(2.0 * n_teeth) if is_even else np.sort(random.uniform(0, 2 * n_teeth, 2 * n_teeth))
    comb = np.concatenate([np.stack([x, np.arange(2 * n_teeth) % 2 * 8.0], axis=1), [[2 * n_teeth, -1], [-1, -1]]])
    bar = np.array(
        [(-2.0, 3.0), (2.0 * n_teeth + 1, 3.0 + random.uniform(0, 0.1)), (2.0 * n_teeth + 1, 4.0), (-2.0, 4.0)]
    )
    assert agree([comb], [bar], "intersection")
    assert agree([comb], [bar], "symmetric_difference")


def test_many_crossings_in_a_small_part_of_an_edge() -> None:
    """Where the parameters are no address, since nearly all are one part of the edge: runs, merged."""
    x = np.concatenate([np.random.default_rng(1).permutation(60) * 2.0**-20, [500.0, 1000.0]])
    needles = [[(place, 0.0), (place + 2.0**-22, 0.0), (place, 9.0)] for place in x]
    for operation in ("intersection", "difference"):
        assert agree(needles, [[(-9.0, 1.0), (2000.0, 2.0), (2000.0, 3.0), (-9.0, 4.0)]], operation)


def test_many_lines_through_one_point() -> None:
    angles = np.arange(10) * np.pi / 10
    blades = [np.round(64 * np.array([(-np.cos(a), -np.sin(a)), (np.cos(a), np.sin(a)), (np.cos(a), 1 + np.sin(a))]))
              for a in angles]  # fmt: skip
    bar = np.array([(-70.0, -70.0), (70.0, 70.0), (70.0, 71.0)])
    agree(blades, [bar], "union")


# --- Edges near each other: the certificate may fail, but what passes it is what exact arithmetic says ---


@pytest.mark.parametrize("steps", [0, 3, 60, 300])
@pytest.mark.parametrize("turns", [0, 1])
def test_stripes_so_many_units_apart(steps: int, turns: int) -> None:
    """Gaps between edges, between crossings along an edge, and between a crossing and a vertex."""
    gap = steps * 2.0**-52
    rng = np.random.default_rng([steps, turns])
    slant = rng.uniform(0.1, 0.4)
    stripe = np.array([(-0.9, 0.1), (0.9, 0.1 + slant), (0.9, 0.3 + slant), (-0.9, 0.3)])
    comb = np.array(
        [(-0.5, -0.8), (0.5, -0.8), (0.5, 0.9), (gap, 0.9), (gap, -0.2), (0.0, -0.2), (0.0, 0.9), (-0.5, 0.7)]
    )
    corner = np.array([(0.5 - gap, -1.0), (1.0, -1.0), (1.0, 1.0), (0.5 - gap, 1.0)])
    for clip in (comb, corner, stripe + gap):
        other = clip[:, ::-1] if turns else clip
        agree([stripe, comb], [other], "union")
        for operation in OPERATIONS:
            agree([stripe], [other], operation)
