"""Pairs of boxes that meet, by an implicit tree over boxes in the order of the rings they come from.

Consecutive edges of a ring lie near each other: four make a leaf, node i has the children 2 i and 2 i + 1, and the
boxes of a level are found from the one below. Only where one edge lies far from the next are they first
put in the order of a space-filling curve. The tree is walked against itself. Each box is
``(x_min, x_max, y_min, y_max)``.

A mark is a sum of bits: among them the quadrants' sides that the edge heads for. Edges one after another that all head
for one quadrant meet nowhere but in the vertices they share, so such a node is not walked against itself, nor two that
follow each other and are one such run together.

Pairs come in portions, so that memory does not grow with their number and the caller can look at the clock.

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
"""Steps of some 10 to 100 ns between two looks at the flag that ends a call, as a mask of their number."""
OFTEN: Final = 0x3FF
"""The same for steps of some microseconds."""
LEAF: Final = 4
FEW: Final = 40
"""Boxes up to which all pairs are looked at: fewer steps than a tree, and no more pairs than a portion."""
PORTION: Final = 2048
"""Pairs at once: some 50 us of exact tests."""
_NUMBER: Final = 31
"""Bits of the number of a box, below those of its place on the curve."""
_STEPS: Final = 1 << 16
"""Steps of the walk at once, about a millisecond."""
ANYWHERE: Final = 2 + 4 + 8 + 16
"""Mark of an edge that ends a run: heading right, left, up and down at once."""
BENT: Final = 32
"""Mark of an edge at whose first vertex the ring surely turns."""
RUN: Final = 64
"""Mark of an edge that stands for many, which meet nothing; see reducing.py."""
DEEPEST: Final = 256
"""Places on the stack: a walk through 60 levels holds at most three pairs a level."""

BoxTree = namedtuple("BoxTree", "boxes marks nodes node_marks places stack pairs")
"""Boxes by number (n, 4) float64, with the mark of each; the tree over them: by node its box and its mark.

places: the boxes in the order of the leaves. stack: (DEEPEST, 2) int64; pairs: (PORTION, 2), those found last.
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
    """Tell whether two closed boxes have a common point."""
    return (  # all four at once: which fails first is not foreseeable, and a branch missed costs more than all
        (boxes[i, 0] <= others[j, 1])
        & (others[j, 0] <= boxes[i, 1])
        & (boxes[i, 2] <= others[j, 3])
        & (others[j, 2] <= boxes[i, 3])
    )


@merged
def box_holds(boxes: FloatArray, i: int, others: FloatArray, j: int) -> bool:
    """Tell whether a box holds another, which may be equal."""
    return (
        (boxes[i, 0] <= others[j, 0])
        & (boxes[i, 1] >= others[j, 1])
        & (boxes[i, 2] <= others[j, 2])
        & (boxes[i, 3] >= others[j, 3])
    )


@merged
def heading(ux: float, uy: float) -> int:
    """Return the mark of an edge with the direction u, which is not zero."""
    return 2 * (ux > 0.0) + 4 * (ux < 0.0) + 8 * (uy > 0.0) + 16 * (uy < 0.0)


@merged
def _is_one_run(mark: int) -> bool:
    """Tell whether edges that follow each other, with this mark in all, head for one quadrant."""
    return (mark & 6) != 6 and (mark & 24) != 24


@merged
def _spread(bits: int) -> int:
    """Return a number below 2^16 with a zero after each of its bits."""
    bits = (bits | (bits << 8)) & 0x00FF00FF
    bits = (bits | (bits << 4)) & 0x0F0F0F0F
    bits = (bits | (bits << 2)) & 0x33333333
    return (bits | (bits << 1)) & 0x55555555


@allocating
def order_boxes(boxes: FloatArray, n: int, places: Any) -> bool:
    """Fill ``places`` with the boxes in the order in which the leaves take them; tell whether it is another order.

    Only the lower left corners are looked at.
    """
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
        key = _spread(min(int(x * by_x), 65535)) | (_spread(min(int(y * by_y), 65535)) << 1)
        keys[k] = key << _NUMBER | k
    keys.sort()
    for k in range(n):
        places[k] = keys[k] & ((1 << _NUMBER) - 1)
    return True


@inline
def build_tree(tree: BoxTree, n: int, stop: FlagArray) -> None:
    """Fill the nodes, their marks and the places of the first n boxes."""
    fill_nodes(tree, n, ANYWHERE if order_boxes(tree.boxes, n, tree.places) else 0, stop)


@inline
def fill_nodes(tree: BoxTree, n: int, added: int, stop: FlagArray) -> None:
    """Fill the nodes and their marks, with the one that is added, by ``places``; empty nodes are inverted."""
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
    """Put the children of a node on the stack of a search upwards; return the depth.

    The lower one is last, so first off: what is found there spares the other.
    """
    low, high = 2 * node, 2 * node + 1
    if tree.nodes[low, 2] > tree.nodes[high, 2]:
        low, high = high, low
    tree.stack[depth, 0], tree.stack[depth + 1, 0] = high, low
    return depth + 2


@inline
def _next_pairs(tree: BoxTree, n: int, depth: int) -> tuple[int, int]:
    """Go on with the walk: write pairs of boxes that meet, each once; return how many, and the depth of the stack."""
    boxes, nodes, node_marks, places = tree.boxes, tree.nodes, tree.node_marks, tree.places
    stack, pairs = tree.stack, tree.pairs
    n_leaves, found, steps = leaves_of(n), 0, 0
    while depth > 0 and found <= PORTION - LEAF * LEAF and steps < _STEPS:
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
            e = places[np.uint64(p)]  # unsigned: no look at whether it counts from the end
            for q in range(p + 1 if i == j else second, min(second + LEAF, n)):
                f = places[np.uint64(q)]
                pairs[found, 0], pairs[found, 1] = e, f
                found += boxes_meet(boxes, np.uint64(e), boxes, np.uint64(f))
    return found, depth


@inline
def _all_pairs(tree: BoxTree, n: int) -> int:
    """Write the pairs of boxes that meet, of so few that all fit; return how many."""
    boxes, pairs = tree.boxes, tree.pairs
    found = 0
    for i in range(n):
        for j in range(i + 1, n):
            pairs[found, 0], pairs[found, 1] = i, j
            found += boxes_meet(boxes, i, boxes, j)
    return found


@inline
def begin_pairs(tree: BoxTree) -> int:
    """Make ready to look for pairs; return the depth for `next_pairs`."""
    tree.stack[0, 0], tree.stack[0, 1] = 1, 1
    return 1


@inline
def next_pairs(tree: BoxTree, n: int, depth: int) -> tuple[int, int]:
    """Write the next portion of pairs, each once, of boxes that meet; return how many, and the depth, 0 at the end.

    Caller guarantees a built tree, unless boxes are few.
    """
    if n <= FEW:
        return _all_pairs(tree, n), 0
    return _next_pairs(tree, n, depth)
