"""Which boxes of a tree does a segment, or a box, come near; compiled. Segments of space go down a tree of eight boxes
a node, as they do to the triangles of a mesh (mesh_contacts.py)."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.bounding.bvh import MAX_DEPTH, WIDTH
from engine.jit import inline, kernel
from engine.lanes.boxes import EMPTY, near_segment
from engine.lanes.lanes import lowest_bit
from engine.segment_clipping.box_tree import DEEPEST, LEAF_SIZE, may_meet
from engine.segment_clipping.mesh_contacts import local_segment
from engine.segment_clipping.triangle_contact import corner

_WAITING = WIDTH * (MAX_DEPTH + 1)
"""Nodes that wait: eight for each level of a tree."""


@inline
def _may_meet(item: Any, is_box: bool, box: Any) -> bool:
    if not is_box:
        return may_meet(item, box)
    meet = True
    for k in range(box.shape[1]):
        meet &= (item[0, k] <= box[1, k]) & (item[1, k] >= box[0, k])
    return meet


@kernel
def list_candidates(
    items: Any, start: int, are_boxes: bool, nodes: Any, bodies: Any, boxes: Any, pairs: Any, flag: Any
) -> tuple[int, int]:
    """List in pairs (2, room) the items from `start` on and the bodies that they may meet; return the item reached,
    and how many pairs there are. An item whose bodies find no room is not begun."""
    n_leaves, n_bodies = nodes.shape[0] // 2, bodies.shape[0]
    stack, n_found = np.empty(DEEPEST, np.int64), 0
    for item in range(start, items.shape[0]):
        if flag[0]:
            return item, n_found
        before, depth, stack[0] = n_found, 1, 1
        while depth > 0:  # bound: each node enters the stack once
            depth -= 1
            node = stack[depth]
            if not _may_meet(items[item], are_boxes, nodes[node]):
                continue
            if node < n_leaves:
                stack[depth], stack[depth + 1] = 2 * node + 1, 2 * node
                depth += 2
                continue
            first = (node - n_leaves) * LEAF_SIZE
            for place in range(first, min(first + LEAF_SIZE, n_bodies)):
                if _may_meet(items[item], are_boxes, boxes[bodies[place]]):
                    if n_found == pairs.shape[1]:
                        return item, before
                    pairs[0, n_found], pairs[1, n_found] = item, bodies[place]
                    n_found += 1
    return items.shape[0], n_found


@kernel
def list_near_segments(segments: Any, start: int, tree: Any, inverse: float, pairs: Any, flag: Any) -> tuple[int, int]:
    """Do what `list_candidates` does for segments of space and a `Bvh`; inverse: 1 / scale of the tree."""
    stack, n_found = np.empty(_WAITING, np.int32), 0
    for item in range(start, segments.shape[0]):
        if flag[0]:
            return item, n_found
        before = n_found
        p, q = corner(segments, item, 0), corner(segments, item, 1)
        middle, half, slack, tiny, is_near = local_segment(p, q, tree.origin, inverse)
        depth, stack[0] = int(is_near), 0
        while depth > 0:  # bound: each node enters the stack once
            depth -= 1
            node = stack[depth]
            bits = near_segment(tree.boxes, node, middle, half, np.float32(slack), np.float32(tiny))
            while bits != 0:
                below = tree.child[node, lowest_bit(bits)]
                bits &= bits - 1
                if below >= 0:
                    stack[depth] = below
                    depth += 1
                elif below != EMPTY:
                    if n_found == pairs.shape[1]:
                        return item, before
                    pairs[0, n_found], pairs[1, n_found] = item, -1 - below
                    n_found += 1
    return segments.shape[0], n_found
