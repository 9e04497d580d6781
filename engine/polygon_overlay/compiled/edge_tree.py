"""Broad phase: pairs of intersecting boxes, by the dual traversal of an implicit tree over boxes in ring order.

Consecutive edges of a ring lie near each other: four make a leaf, node i has the children 2 i and 2 i + 1, and each box
is computed from the level below. Only where one edge lies far from the next are boxes first sorted in Morton order.
A box is ``(x_min, x_max, y_min, y_max)``.

A mark is a sum of bits, among them the directions of the edge. Consecutive edges that all head for one quadrant share
vertices only, so a node of such a run is not paired with itself, nor with the next one of the run.

Pairs come in portions, so that memory stays bounded and the caller can poll the clock.

Source: the dual traversal of C. Ericson, Real-time collision detection, 2005, section 6.3; the curve is that of
G. M. Morton, A computer oriented geodetic data base, 1966.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.compiling.jit import allocating, inline, merged
from engine.types import FlagArray, FloatArray

POLL: Final = 0x3FFF
"""Mask of step numbers: steps of 10 to 100 ns between two polls of the stop flag."""
OFTEN: Final = 0x3FF
"""The same for steps of some microseconds."""
LEAF: Final = 4
"""Boxes of a leaf."""
FEW: Final = 40
"""Number of boxes up to which all pairs are tested: fewer steps than a tree, and at most one portion of pairs."""
PORTION: Final = 2048
"""Pairs of one call: some 50 us of exact tests."""
_NUMBER_BITS: Final = 31
"""Low bits of a sort key that store the index of a box; the Morton code stands above them."""
_STEPS: Final = 1 << 16
"""Steps of one call, about a millisecond."""
ANYWHERE: Final = 2 + 4 + 8 + 16
"""Mark of an edge that ends a run: heading right, left, up and down."""
BENT: Final = 32
"""Mark of an edge at whose first vertex the ring certainly turns."""
RUN: Final = 64
"""Mark of an edge that stands for many, which meet nothing; see reducing.py."""
DEEPEST: Final = 256
"""Size of the traversal stack: at most 60 levels, three entries each."""

BoxTree = namedtuple("BoxTree", "boxes marks nodes node_marks places stack pairs")
"""An implicit binary tree over n boxes.

| field | dtype, shape | meaning |
| --- | --- | --- |
| boxes, marks | float64 (n, 4), uint8 (n,) | the boxes and their bits |
| nodes, node_marks | by node | box around the boxes below it, the or of their marks; node 1 is the root |
| places | int32 (n,) | the boxes in the order of the leaves |
| stack, pairs | (DEEPEST, 2), (PORTION, 2) | scratch of a traversal; the pairs of its last portion |
"""


@inline
def leaves_of(n: int) -> int:
    """Return the number of leaves for n boxes, a power of two."""
    n_leaves = 1
    while n_leaves * LEAF < n:  # bound: 60 doublings
        n_leaves *= 2
    return n_leaves


@merged
def boxes_meet(boxes: FloatArray, i: int, others: FloatArray, j: int) -> bool:
    """Return whether box i of ``boxes`` and box j of ``others``, closed, have a common point."""
    return (  # branch-free: a mispredicted branch costs more than all four
        (boxes[i, 0] <= others[j, 1])
        & (others[j, 0] <= boxes[i, 1])
        & (boxes[i, 2] <= others[j, 3])
        & (others[j, 2] <= boxes[i, 3])
    )


@merged
def box_contains(boxes: FloatArray, i: int, others: FloatArray, j: int) -> bool:
    """Return whether box i of ``boxes`` contains box j of ``others`` (equal boxes do)."""
    return (
        (boxes[i, 0] <= others[j, 0])
        & (boxes[i, 1] >= others[j, 1])
        & (boxes[i, 2] <= others[j, 2])
        & (boxes[i, 3] >= others[j, 3])
    )


@merged
def heading(ux: float, uy: float) -> int:
    """Return the direction bits of an edge: 2 right, 4 left, 8 up, 16 down; caller guarantees that (ux, uy) is not
    zero."""
    return 2 * (ux > 0.0) + 4 * (ux < 0.0) + 8 * (uy > 0.0) + 16 * (uy < 0.0)


@merged
def _is_one_run(mark: int) -> bool:
    """Return whether edges with these direction bits (`heading`), combined by or, all head for one quadrant: never
    right and left, nor up and down."""
    return (mark & 6) != 6 and (mark & 24) != 24


@merged
def _interleave_zeros(bits: int) -> int:
    """Return a number below 2^16 with a zero inserted after each bit (half of a Morton code)."""
    bits = (bits | (bits << 8)) & 0x00FF00FF
    bits = (bits | (bits << 4)) & 0x0F0F0F0F
    bits = (bits | (bits << 2)) & 0x33333333
    return (bits | (bits << 1)) & 0x55555555


@allocating
def order_boxes(boxes: FloatArray, n: int, places: Any) -> bool:
    """Fill ``places`` with 0 .. n - 1 in Morton order of the boxes' lower left corners; return True. Return False, with
    ``places`` ascending, if the path through the corners in the given order is short already: in Morton order it grows
    like ``sqrt(n)``."""
    x_min = y_min = float("inf")
    x_max = y_max = float("-inf")
    way, x_last, y_last = 0.0, boxes[0, 0], boxes[0, 2]
    for k in range(n):
        places[k] = k
        x, y = boxes[k, 0], boxes[k, 2]
        x_min, x_max, y_min, y_max = min(x_min, x), max(x_max, x), min(y_min, y), max(y_max, y)
        way += abs(x - x_last) + abs(y - y_last)
        x_last, y_last = x, y
    wide, high = x_max - x_min, y_max - y_min
    if way * way <= 2.0 * n * (wide + high) * (
        wide + high
    ):  # the way through n places, well ordered, grows with the root
        return False
    keys = np.empty(n, np.int64)
    by_x, by_y = 65535.0 / wide if wide > 0.0 else 0.0, 65535.0 / high if high > 0.0 else 0.0
    for k in range(n):
        x, y = boxes[k, 0] - x_min, boxes[k, 2] - y_min
        key = _interleave_zeros(min(int(x * by_x), 65535)) | (_interleave_zeros(min(int(y * by_y), 65535)) << 1)
        keys[k] = key << _NUMBER_BITS | k
    keys.sort()
    for k in range(n):
        places[k] = keys[k] & ((1 << _NUMBER_BITS) - 1)
    return True


@inline
def build_tree(tree: BoxTree, n: int, stop: FlagArray) -> None:
    """Build the tree over the first n boxes of ``tree.boxes``: fill ``places``, ``nodes`` and ``node_marks``."""
    fill_nodes(tree, n, ANYWHERE if order_boxes(tree.boxes, n, tree.places) else 0, stop)


@inline
def fill_nodes(tree: BoxTree, n: int, added: int, stop: FlagArray) -> None:
    """Fill ``nodes`` and ``node_marks`` of the tree over n boxes from ``places``; nodes without boxes get inverted
    boxes. added: bits that every leaf's mark gets besides those of its boxes."""
    boxes, nodes, node_marks, places = tree.boxes, tree.nodes, tree.node_marks, tree.places
    n_leaves = leaves_of(n)
    for leaf in range(n_leaves):
        if leaf & POLL == 0 and stop[0]:
            return
        x_min = y_min = float("inf")
        x_max = y_max = float("-inf")
        mark = added
        for place in range(LEAF * leaf, min(LEAF * leaf + LEAF, n)):
            k = places[place]
            x_min, x_max = min(x_min, boxes[k, 0]), max(x_max, boxes[k, 1])
            y_min, y_max = min(y_min, boxes[k, 2]), max(y_max, boxes[k, 3])
            mark |= tree.marks[k]
        node = n_leaves + leaf
        nodes[node, 0], nodes[node, 1], nodes[node, 2], nodes[node, 3] = x_min, x_max, y_min, y_max
        node_marks[node] = mark
    for node in range(n_leaves - 1, 0, -1):
        left, right = 2 * node, 2 * node + 1
        nodes[node, 0], nodes[node, 1] = min(nodes[left, 0], nodes[right, 0]), max(nodes[left, 1], nodes[right, 1])
        nodes[node, 2], nodes[node, 3] = min(nodes[left, 2], nodes[right, 2]), max(nodes[left, 3], nodes[right, 3])
        node_marks[node] = node_marks[left] | node_marks[right]


@merged
def push_children(tree: BoxTree, node: int, depth: int) -> int:
    """Push both children of a node on ``tree.stack``, whose depth is ``depth``, the one with the lower bottom on top;
    return the new depth."""
    low, high = 2 * node, 2 * node + 1
    if tree.nodes[low, 2] > tree.nodes[high, 2]:
        low, high = high, low
    tree.stack[depth, 0], tree.stack[depth + 1, 0] = high, low
    return depth + 2


@inline
def _next_pairs(tree: BoxTree, n: int, depth: int) -> tuple[int, int]:
    """Continue the dual traversal of the tree over n boxes from the stack of ``depth`` entries: write intersecting
    pairs to ``tree.pairs``; return their number and the new depth."""
    boxes, nodes, node_marks, places = tree.boxes, tree.nodes, tree.node_marks, tree.places
    stack, pairs = tree.stack, tree.pairs
    n_leaves, n_pairs, steps = leaves_of(n), 0, 0
    while depth > 0 and n_pairs <= PORTION - LEAF * LEAF and steps < _STEPS:
        depth -= 1
        steps += 1
        i, j = stack[depth, 0], stack[depth, 1]
        if j - i <= 1 and _is_one_run(node_marks[i] | node_marks[j]):  # invariant: i <= j, both on one level
            continue
        if i < n_leaves:
            for a in range(2 * i, 2 * i + 2):
                for b in range(2 * j if i != j else a, 2 * j + 2):
                    stack[depth, 0], stack[depth, 1] = a, b
                    depth += boxes_meet(nodes, np.uint64(a), nodes, np.uint64(b))
            continue
        first, second = LEAF * (i - n_leaves), LEAF * (j - n_leaves)
        for p in range(first, min(first + LEAF, n)):
            e = places[np.uint64(p)]  # unsigned: no check for negative indices
            for q in range(p + 1 if i == j else second, min(second + LEAF, n)):
                f = places[np.uint64(q)]
                pairs[n_pairs, 0], pairs[n_pairs, 1] = e, f
                n_pairs += boxes_meet(boxes, np.uint64(e), boxes, np.uint64(f))
    return n_pairs, depth


@inline
def _all_pairs(tree: BoxTree, n: int) -> int:
    """Write all intersecting pairs of the first n <= FEW boxes to ``tree.pairs``; return their number."""
    boxes, pairs = tree.boxes, tree.pairs
    n_pairs = 0
    for i in range(n):
        for j in range(i + 1, n):
            pairs[n_pairs, 0], pairs[n_pairs, 1] = i, j
            n_pairs += boxes_meet(boxes, i, boxes, j)
    return n_pairs


@inline
def begin_pairs(tree: BoxTree) -> int:
    """Start the dual traversal of a tree with itself; return the depth of its stack, to pass to `next_pairs`."""
    tree.stack[0, 0], tree.stack[0, 1] = 1, 1
    return 1


@inline
def next_pairs(tree: BoxTree, n: int, depth: int) -> tuple[int, int]:
    """Write the next portion of intersecting pairs of n boxes to ``tree.pairs``, each pair once; return their number
    and the new depth of the stack. depth: of `begin_pairs`, or of the call before; 0: the traversal has ended. Caller
    guarantees a built tree if n > FEW."""
    if n <= FEW:
        return _all_pairs(tree, n), 0
    return _next_pairs(tree, n, depth)
