"""Blocks of consecutive edges, so that edges far from all others are not tested one by one.

    ring  o--o--o--o--o--o--o--o--o--o      a block is so many consecutive edges, their box, and the directions
          |  block  |  block  |  block      (right, left, up, down) in which all advance by more than the margin

Consecutive blocks with a common direction share only vertices. Active blocks (tested edge by edge) are those near
another one, by the traversal of edge_tree.py, and those above the top of a ring. All others meet nothing, by the margin
of clearance.py: their boxes are further from all others than that, but for the neighbours with a common direction,
whose edges advance by more than the margin each; so do the edges within a block.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

import numpy as np

from engine.compiling.jit import inline, merged
from engine.polygon_overlay.compiled.edge_tree import LEAF, BoxTree, leaves_of, push_children
from engine.polygon_overlay.compiled.loading import Box, RingArrays, box_of
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.types import FlagArray, FloatArray, Int32Array

NOT_RIGHT: Final = 2
NOT_LEFT: Final = 4
NOT_UP: Final = 8
NOT_DOWN: Final = 16
EVERYWHERE: Final = NOT_RIGHT | NOT_LEFT | NOT_UP | NOT_DOWN
"""Marks of a block: some edge does not advance in that direction; EVERYWHERE: no common direction."""
_TURN_BOUND: Final = 4.0 * BOUND_2D
"""Error bound of a turn by one of its products: ``|r| <= |l| + |l - r|``, so ``BOUND_2D (|l| + |r|)`` is less."""

Blocks = namedtuple("Blocks", "first last following boxes marks is_active firsts")
"""Blocks of consecutive edges.

| field | by | meaning |
| --- | --- | --- |
| first, last | block | its first vertex; one past the first vertex of its last edge |
| following | block | the next block of the ring |
| boxes, marks | block | x_min, x_max, y_min, y_max; uint8, directions in which it does not advance |
| is_active | block | uint8, its edges are tested one by one |
| firsts | ring | its first block, and the end |
"""


@inline
def load_blocks(rings: RingArrays, size: int, blocks: Blocks, n: int, ring: int, stop: FlagArray) -> int:
    """Append the blocks, of up to ``size`` edges each, of all rings; the first is block number n, of ring number
    ``ring``. Return the number of blocks then."""
    vertices, offsets, n_rings = rings.vertices, rings.offsets, rings.offsets.shape[0] - 1
    first, last, boxes = blocks.first, blocks.last, blocks.boxes
    for i_ring in range(n_rings):
        start, end = offsets[i_ring], offsets[i_ring + 1]
        blocks.firsts[ring + i_ring] = n
        for a in range(start, end, size):
            if stop[0]:
                return n
            b = min(a + size, end)
            part = vertices[a:b]
            closing = b if b < end else start
            x_min, x_max, y_min, y_max = box_of(part, 0, b - a)
            boxes[n, 0], boxes[n, 1] = min(x_min, vertices[closing, 0]), max(x_max, vertices[closing, 0])
            boxes[n, 2], boxes[n, 3] = min(y_min, vertices[closing, 1]), max(y_max, vertices[closing, 1])
            first[n], last[n] = a, b
            n += 1
    blocks.firsts[ring + n_rings] = n
    return n


@inline
def box_of_blocks(boxes: FloatArray, first: int, last: int) -> Box:
    """Return the box around the boxes first .. last - 1; inverted (minimum above maximum) if there is none."""
    x_min = y_min = np.inf
    x_max = y_max = -np.inf
    for i in range(first, last):
        x_min, x_max = min(x_min, boxes[i, 0]), max(x_max, boxes[i, 1])
        y_min, y_max = min(y_min, boxes[i, 2]), max(y_max, boxes[i, 3])
    return x_min, x_max, y_min, y_max


@inline
def mark_blocks(rings: RingArrays, margin: float, blocks: Blocks, ring: int, stop: FlagArray) -> None:
    """Fill the marks and successors of the blocks of all rings, the first of which is ring number ``ring``; activate
    blocks without a common direction or with a doubtful vertex. A vertex is doubtful if floats do not prove that the
    ring turns there, or that it differs from the vertex before. margin: by which edges must advance in a direction."""
    vertices, offsets, n_rings = rings.vertices, rings.offsets, rings.offsets.shape[0] - 1
    for i_ring in range(n_rings):
        start, end = offsets[i_ring], offsets[i_ring + 1]
        begin, after = blocks.firsts[ring + i_ring], blocks.firsts[ring + i_ring + 1]
        for block in range(begin, after):
            if stop[0]:
                return
            a, b = blocks.first[block], blocks.last[block]
            before = (a if a > start else end) - 1
            px, py = vertices[a, 0], vertices[a, 1]
            vx, vy = px - vertices[before, 0], py - vertices[before, 1]
            n_right = n_left = n_up = n_down = n_bent = 0
            for k in range(a, b):
                j = k + 1 if k + 1 < end else start
                qx, qy = vertices[j, 0], vertices[j, 1]
                ux, uy = qx - px, qy - py
                n_right += ux > margin
                n_left += ux < -margin
                n_up += uy > margin
                n_down += uy < -margin
                left, right = vx * uy, vy * ux
                n_bent += abs(left - right) > _TURN_BOUND * abs(left) + GUARD_2D
                px, py, vx, vy = qx, qy, ux, uy
            size = b - a
            blocks.marks[block] = _way(n_right == size, n_left == size, n_up == size, n_down == size)
            blocks.is_active[block] = blocks.marks[block] == EVERYWHERE or n_bent < size
            blocks.following[block] = block + 1
        if after > begin:
            blocks.following[after - 1] = begin


@inline
def _way(is_right: bool, is_left: bool, is_up: bool, is_down: bool) -> int:
    """Return the mark of a block: NOT_RIGHT, NOT_LEFT, NOT_UP or NOT_DOWN for each direction in which not all its edges
    advance. The arguments: whether all do."""
    mark = 0 if is_right else NOT_RIGHT
    mark |= 0 if is_left else NOT_LEFT
    mark |= 0 if is_up else NOT_UP
    return mark | (0 if is_down else NOT_DOWN)


_VISITS: Final = 8
"""Visits of node pairs for each block, above which the traversal costs more than it can save."""


@merged
def _are_near(boxes: FloatArray, i: int, others: FloatArray, j: int, gap: float) -> bool:
    """Return whether box i of ``boxes`` and box j of ``others`` are at most ``gap`` apart along both axes."""
    return (
        (boxes[i, 0] - others[j, 1] <= gap)
        & (others[j, 0] - boxes[i, 1] <= gap)
        & (boxes[i, 2] - others[j, 3] <= gap)
        & (others[j, 2] - boxes[i, 3] <= gap)
    )


@inline
def count_active(blocks: Blocks, n: int) -> int:
    """Return the number of edges in the active ones of n blocks."""
    n_active = 0
    for i in range(n):
        if blocks.is_active[i]:
            n_active += blocks.last[i] - blocks.first[i]
    return n_active


@inline
def activate_blocks_near(blocks: Blocks, n: int, gap: float, tree: BoxTree, n_most: int, stop: FlagArray) -> bool:
    """Activate each of n blocks whose box is within ``gap`` of another's, except for consecutive blocks with a common
    direction; return False if n_most edges or more become active, the traversal takes too long, or it is stopped. tree:
    built over the boxes of the blocks, with the mark EVERYWHERE on the last block of each ring."""
    nodes, stack = tree.nodes, tree.stack
    n_active = count_active(blocks, n)
    n_leaves, visits = leaves_of(n), _VISITS * n
    stack[0, 0], stack[0, 1], depth = 1, 1, 1
    while depth > 0:  # bound: the walk through the tree
        if n_active >= n_most or visits < 0 or stop[0]:
            return False
        depth -= 1
        visits -= 1
        i, j = stack[depth, 0], stack[depth, 1]
        if j - i <= 1 and _head_together(tree.node_marks[i], tree.node_marks[j]):  # invariant: i <= j, on one level
            continue
        if i < n_leaves:
            for a in range(2 * i, 2 * i + 2):
                for b in range(2 * j if i != j else a, 2 * j + 2):
                    if _are_near(nodes, a, nodes, b, gap):
                        stack[depth, 0], stack[depth, 1] = a, b
                        depth += 1
        else:
            n_active += _activate_in_leaves(blocks, n, gap, tree.places, i - n_leaves, j - n_leaves)
    return True


@merged
def _head_together(mark: int, other: int) -> bool:
    """Return whether two consecutive blocks with these marks have a common direction in which all edges of both advance
    (a mark has the NOT_ bits of the directions in which they do not)."""
    return (mark | other) & EVERYWHERE != EVERYWHERE


@inline
def _activate_in_leaves(blocks: Blocks, n: int, gap: float, places: Int32Array, leaf: int, other: int) -> int:
    """Activate the blocks of leaf ``leaf`` and leaf ``other`` of the tree over n blocks that are within ``gap`` of each
    other; return the number of edges in the blocks newly activated. places: the blocks in the order of the leaves.
    Consecutive blocks with a common direction are exempt."""
    first, last, boxes, marks, is_active = blocks.first, blocks.last, blocks.boxes, blocks.marks, blocks.is_active
    n_activated = 0
    low, high = LEAF * leaf, LEAF * other
    for p in range(low, min(low + LEAF, n)):
        e = places[p]
        for q in range(p + 1 if leaf == other else high, min(high + LEAF, n)):
            f = places[q]
            if (is_active[e] and is_active[f]) or not _are_near(boxes, e, boxes, f, gap):
                continue
            if (blocks.following[e] == f or blocks.following[f] == e) and _head_together(marks[e], marks[f]):
                continue
            n_activated += 0 if is_active[e] else last[e] - first[e]
            n_activated += 0 if is_active[f] else last[f] - first[f]
            is_active[e] = is_active[f] = 1
    return n_activated


@inline
def activate_blocks_above(blocks: Blocks, n: int, x: float, y: float, tree: BoxTree) -> None:
    """Activate all of n blocks that may contain the first edge above the point (x, y), an infinitesimal step to its
    right. tree: over their boxes."""
    ceiling = float("inf")  # certainly above the edge that is next above the point
    for is_searching in (True, False):
        tree.stack[0, 0], depth = 1, 1
        while depth > 0:  # bound: each node enters the stack once
            depth -= 1
            node = tree.stack[depth, 0]
            if not _is_above(tree.nodes, node, x, y, ceiling):
                continue
            if node < leaves_of(n):
                depth = push_children(tree, node, depth)
                continue
            first = LEAF * (node - leaves_of(n))
            for place in range(first, min(first + LEAF, n)):
                i = tree.places[place]
                if not _is_above(blocks.boxes, i, x, y, ceiling):
                    continue
                if not is_searching:
                    blocks.is_active[i] = 1
                elif blocks.boxes[i, 2] > y and blocks.marks[i] & (NOT_RIGHT | NOT_LEFT) != (NOT_RIGHT | NOT_LEFT):
                    ceiling = min(ceiling, blocks.boxes[i, 3])  # an edge of this block passes there


@merged
def _is_above(boxes: FloatArray, i: int, x: float, y: float, ceiling: float) -> bool:
    """Return whether box i intersects the ray from (x, y) straight up, an infinitesimal step to the right, at or below
    height ``ceiling``."""
    return not (boxes[i, 0] > x or boxes[i, 1] <= x or boxes[i, 3] < y or boxes[i, 2] > ceiling)
