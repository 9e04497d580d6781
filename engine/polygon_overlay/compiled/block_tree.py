"""Which blocks of rings must be looked at edge by edge: those near another block, and those above a ring's top.

All other blocks meet nothing, by the margin of clearance.py: their boxes are further from all others than that, but for
the blocks before and after that head the same way, whose edges advance by more than the margin each. So are edges of
the same block.

The walk is that of edge_tree.py; what it finds are not pairs but blocks.
"""

from __future__ import annotations

from typing import Any, Final

from engine.jit import inline, merged
from engine.polygon_overlay.compiled.edge_tree import LEAF, BoxTree, leaves_of, push_children
from engine.polygon_overlay.compiled.ring_blocks import CHORD, EVERYWHERE, NOT_LEFT, NOT_RIGHT, Blocks

_VISITS: Final = 8
"""Leaves looked at against each other, by block, beyond which looking costs more than it can save."""


@merged
def _are_near(boxes: Any, i: int, others: Any, j: int, gap: float) -> bool:
    """Tell whether two boxes may be no further apart than ``gap``."""
    return (
        (boxes[i, 0] - others[j, 1] <= gap)
        & (others[j, 0] - boxes[i, 1] <= gap)
        & (boxes[i, 2] - others[j, 3] <= gap)
        & (others[j, 2] - boxes[i, 3] <= gap)
    )


@inline
def count_active(blocks: Blocks, n: int) -> int:
    """Return the number of edges of active blocks, without chords."""
    n_active = 0
    for i in range(n):
        if blocks.is_active[i] and not blocks.marks[i] & CHORD:
            n_active += blocks.last[i] - blocks.first[i]
    return n_active


@inline
def wake_near(blocks: Blocks, n: int, gap: float, tree: BoxTree, n_most: int, stop: Any) -> bool:
    """Make blocks active whose boxes may be no further apart than ``gap``; tell whether few enough are.

    tree: built, with marks of which the last of each ring has all bits. n_most: edges of active blocks that are too
    many.
    """
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
            n_active += _wake_in_leaves(blocks, n, gap, tree.places, i - n_leaves, j - n_leaves)
    return True


@merged
def _head_together(mark: int, other: int) -> bool:
    """Tell whether blocks that follow each other, with these marks, head one way together."""
    return (mark | other) & EVERYWHERE != EVERYWHERE


@inline
def _wake_in_leaves(blocks: Blocks, n: int, gap: float, places: Any, leaf: int, other: int) -> int:
    """Make active those of two leaves that are near each other; return how many edges these are, not active before."""
    first, last, boxes, marks, is_active = blocks.first, blocks.last, blocks.boxes, blocks.marks, blocks.is_active
    n_woken = 0
    low, high = LEAF * leaf, LEAF * other
    for p in range(low, min(low + LEAF, n)):
        e = places[p]
        for q in range(p + 1 if leaf == other else high, min(high + LEAF, n)):
            f = places[q]
            if (is_active[e] and is_active[f]) or not _are_near(boxes, e, boxes, f, gap):
                continue
            if (blocks.following[e] == f or blocks.following[f] == e) and _head_together(marks[e], marks[f]):
                continue
            n_woken += 0 if is_active[e] else last[e] - first[e]
            n_woken += 0 if is_active[f] else last[f] - first[f]
            is_active[e] = is_active[f] = 1
    return n_woken


@inline
def wake_above(blocks: Blocks, n: int, x: float, y: float, tree: BoxTree) -> None:
    """Make active, of the blocks above a point, a step to its right, those that may hold what is next above it."""
    ceiling = float("inf")  # surely above the edge that is next above the point
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
def _is_above(boxes: Any, i: int, x: float, y: float, ceiling: float) -> bool:
    """Tell whether a box holds points above a point, a step to its right, and below a ceiling."""
    return not (boxes[i, 0] > x or boxes[i, 1] <= x or boxes[i, 3] < y or boxes[i, 2] > ceiling)
