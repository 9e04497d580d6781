"""Steps in which a `Bvh` is built (`trees.py`): boxes in the tree's coordinates, a binary tree by the surface-area
heuristic (SAH), and its nodes merged into nodes of eight children.

The heuristic affects the speed of queries only: where its areas overflow, or many items share one centre, a run of
items is split in the middle.

Source: I. Wald, On fast construction of SAH-based bounding volume hierarchies, 2007 (binning); I. Wald, C. Benthin, S.
Boulos, Getting rid of packets: efficient SIMD single-ray traversal using multi-branching BVHs, 2008 (merging).
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np

from engine.bounding.bvh import ENLARGED, HEURISTIC_DEPTH, LEAST, UNUSED, WIDTH
from engine.bounding.tree_coordinates import read_item
from engine.compiling.jit import called, inline
from engine.lanes.boxes import EMPTY, exchange, fill, join, join_centre
from engine.types import Float32Array, FloatArray, Int32Array, IntArray

N_BINS = 16
_FEW_ITEMS, _FEW_BINS = 64, 8
"""A run of at most _FEW_ITEMS items is split with _FEW_BINS bins, because the bins would cost more than the items."""
_FINITE = 1e30
_NO_BOX = np.float32(np.inf)
"""Bound of the empty box; its union with a box is that box."""
_WORK = 1 << 18
"""Number of items processed between two checks of the deadline: about 10 ms."""

Items = namedtuple("Items", "boxes order")
"""Boxes from which the tree is built, in the order of its leaves: boxes (n, 8), low x, y, z, 0, then minus high; order
(n,), index of each box in the input."""

BinaryTree = namedtuple("BinaryTree", "boxes centres left runs")
"""A binary tree whose leaves are runs of at most eight items: boxes and centres (n_nodes, 8), the bounds of a node's
items and of their centres; left, index of the left child (the right child follows), or -1; runs (n_nodes, 2), first
item of the node and end."""

Bins = namedtuple("Bins", "boxes centres numbers costs")
"""Bins of the surface-area heuristic along an axis.

| field | shape | meaning |
|---|---|---|
| boxes, centres | (16, 8) | bounds of the items, and of their centres |
| numbers | (16,) | number of items |
| costs | (16,) | cost of the items of this bin and of all bins right of it |
"""


@inline
def set_empty(halves: Any, node: int) -> None:
    """Set the bounds (boxes and centres) of a node or bin to the empty box."""
    fill(halves.boxes, node, _NO_BOX)
    fill(halves.centres, node, _NO_BOX)


@inline
def include_item(halves: Any, node: int, items: Items, item: int) -> None:
    """Enlarge the bounds (boxes and centres) of a node or bin by an item."""
    join(halves.boxes, node, items.boxes, item)
    join_centre(halves.centres, node, items.boxes, item)


@inline
def centre_of(items: Items, item: int, axis: int) -> float:
    """Return a coordinate of an item's centre."""
    return np.float32(0.5) * (items.boxes[item, axis] - items.boxes[item, 4 + axis])


@inline
def include(halves: Any, node: int, others: Any, other: int) -> None:
    """Enlarge the bounds (boxes and centres) of a node or bin by those of a bin."""
    join(halves.boxes, node, others.boxes, other)
    join(halves.centres, node, others.centres, other)


@called
def read_boxes(
    boxes: FloatArray, origin: FloatArray, factors: FloatArray, first: int, items: Items, bounds: Bins
) -> None:
    """Write boxes (n, 6) in the tree's coordinates to items from the first on, with their numbers; and what bounds them
    to row 0 of bounds. origin, factors: as of `place_tree`."""
    set_empty(bounds, 0)
    for item in range(len(boxes)):
        read_item(boxes, item, origin, factors, items, first + item)
        items.order[first + item] = first + item
        include_item(bounds, 0, items, first + item)


@called
def build_binary_tree(items: Items, halves: BinaryTree, bins: Bins, stack: IntArray, state: IntArray) -> None:
    """Continue building the binary tree, for about `_WORK` items. bins: N_BINS, scratch; stack: (node, depth) of nodes
    to be split, whose runs and bounds are set. state (4,): length of the stack and the next two rows of nodes, read and
    written; the end of these rows, and first of others for when they are full."""
    n_stack, n_nodes, n_seen = state[0], state[1], 0
    while n_stack > 0 and n_seen < _WORK:  # bound: each turn ends one of the 2 n - 1 nodes
        n_stack -= 1
        node, depth = stack[n_stack, 0], stack[n_stack, 1]
        start, end = halves.runs[node, 0], halves.runs[node, 1]
        n_seen += end - start
        if end - start <= WIDTH:
            halves.left[node] = -1
            continue
        n_nodes = n_nodes if n_nodes + 2 <= state[2] or n_nodes >= state[3] else state[3]
        middle = _partition(items, halves, node, bins, n_nodes) if depth < HEURISTIC_DEPTH else start
        if middle == start:
            middle = (start + end) // 2
            set_empty(halves, n_nodes)
            set_empty(halves, n_nodes + 1)
            for item in range(start, end):
                include_item(halves, n_nodes + (item >= middle), items, item)
        halves.left[node] = n_nodes
        halves.runs[n_nodes, 0], halves.runs[n_nodes, 1] = start, middle
        halves.runs[n_nodes + 1, 0], halves.runs[n_nodes + 1, 1] = middle, end
        for side in range(2):
            stack[n_stack, 0], stack[n_stack, 1] = n_nodes + side, depth + 1
            n_stack += 1
        n_nodes += 2
    state[0], state[1] = n_stack, n_nodes


@inline
def half_area(rows: Float32Array, row: int) -> float:
    x, y, z = -rows[row, 4] - rows[row, 0], -rows[row, 5] - rows[row, 1], -rows[row, 6] - rows[row, 2]
    return x * y + y * z + z * x


@inline
def _partition(items: Items, halves: BinaryTree, node: int, bins: Bins, parts: int) -> int:
    """Split the items of a node between two children, nodes parts and parts + 1, by the surface-area heuristic (SAH);
    reorder the items and set the children's bounds. Returns the index of the right child's first item; the node's first
    item if there is no useful cut."""
    start, end = halves.runs[node, 0], halves.runs[node, 1]
    n_bins = N_BINS if end - start > _FEW_ITEMS else _FEW_BINS
    axis, low, scale = bins_of(halves, node, n_bins)
    if scale == 0.0:
        return start
    fill_bins(items, start, end, (axis, low, scale), bins, 0, n_bins)
    cut = cheapest_cut(halves.boxes, parts, bins, 0, n_bins)
    if cut == 0:
        return start
    join_bins(halves, parts, bins, 0, cut, n_bins)
    return part_items(items, start, end, (axis, low, scale), n_bins, cut)


@inline
def bins_of(halves: BinaryTree, node: int, n_bins: int) -> tuple[int, Any, Any]:
    """Return the axis along which the centres of a node's items lie farthest apart, the start of bins along it and
    their number for a unit; that is 0 if all have one centre."""
    axis, low, width = 0, np.float32(0.0), np.float32(-1.0)
    for candidate in range(3):
        smallest, largest = halves.centres[node, candidate], -halves.centres[node, 4 + candidate]
        if largest - smallest > width:
            axis, low, width = candidate, smallest, largest - smallest
    scale = np.float32(n_bins) / width
    return axis, low, scale if 0.0 < scale < _FINITE else np.float32(0.0)


@inline
def fill_bins(items: Items, start: int, end: int, axis: Any, bins: Bins, first: int, n_bins: int) -> None:
    """Set `n_bins` bins from the first on to the items from start to end. axis: as of `bins_of`."""
    for index in range(first, first + n_bins):
        set_empty(bins, index)
        bins.numbers[index] = 0
    along, low, scale = axis
    for item in range(start, end):
        index = first + bin_of(centre_of(items, item, along), low, scale, n_bins)
        include_item(bins, index, items, item)
        bins.numbers[index] += 1


@inline
def part_items(items: Items, start: int, end: int, axis: Any, n_bins: int, cut: int) -> int:
    """Reorder the items from start to end so that those in bins left of the cut come first; return their end."""
    along, low, scale = axis
    left = start  # what is exchanged in vain costs less than a branch that nobody foresees
    for item in range(start, end):
        is_left = bin_of(centre_of(items, item, along), low, scale, n_bins) < cut
        exchange(items.boxes, left, item)
        items.order[left], items.order[item] = items.order[item], items.order[left]
        left += int(is_left)
    return left


@inline
def join_bins(halves: BinaryTree, parts: int, bins: Bins, first: int, cut: int, n_bins: int) -> None:
    """Set the bounds of nodes `parts` and `parts` + 1 to those of `n_bins` bins from the first on, left and right of a
    cut."""
    for side in range(2):
        set_empty(halves, parts + side)
    for index in range(n_bins):
        include(halves, parts + (index >= cut), bins, first + index)


@inline
def bin_of(centre: float, low: float, scale: float, n_bins: int) -> int:
    return min(n_bins - 1, int((centre - low) * scale))


@inline
def cheapest_cut(boxes: Float32Array, scratch: int, bins: Bins, first: int, n_bins: int) -> int:
    """Return how many of `n_bins` bins from the first on are left of the cheapest cut by the surface-area heuristic, 0
    if no cut has a finite cost. Overwrites boxes[scratch] and the costs of the bins."""
    fill(boxes, scratch, _NO_BOX)
    number = 0
    for index in range(n_bins - 1, 0, -1):
        number += bins.numbers[first + index]
        join(boxes, scratch, bins.boxes, first + index)
        bins.costs[first + index] = np.float32(number) * half_area(boxes, scratch) if number > 0 else np.float32(np.inf)
    fill(boxes, scratch, _NO_BOX)
    number, best, cut = 0, np.float32(np.inf), 0
    for index in range(1, n_bins):
        number += bins.numbers[first + index - 1]
        join(boxes, scratch, bins.boxes, first + index - 1)
        if number > 0:
            cost = np.float32(number) * half_area(boxes, scratch) + bins.costs[first + index]
            if cost < best:
                best, cut = cost, index
    return cut


@called
def collapse_to_eight(
    halves: BinaryTree, roots: Int32Array, child: Int32Array, areas: Float32Array, stack: IntArray, state: IntArray,
    n_turns: int,
) -> None:  # fmt: skip
    """Continue merging binary nodes into nodes of eight children, opening the largest boxes first, for at most
    `n_turns` nodes. roots (n_nodes,): the binary node of each; child: EMPTY for lanes that are not children. areas
    (8,): scratch; stack: nodes to be filled. state (2,): length of the stack, and number of nodes filled or on it, read
    and written."""
    n_stack, n_nodes, left = state[0], state[1], halves.left
    for _ in range(n_turns):
        if n_stack == 0:
            break
        n_stack -= 1
        node = stack[n_stack, 0]
        for lane in range(WIDTH):
            child[node, lane] = EMPTY
        if left[roots[node]] < 0:
            continue
        n_gathered, largest = 1, 0
        roots[n_nodes] = roots[node]
        while largest >= 0 and n_gathered < WIDTH:
            opened = left[roots[n_nodes + largest]]
            for place in (largest, n_gathered):
                roots[n_nodes + place], is_open = opened, left[opened] >= 0
                areas[place] = half_area(halves.boxes, opened) if is_open else np.float32(-1.0)
                opened += 1
            n_gathered += 1
            largest, area = -1, np.float32(-1.0)
            for lane in range(n_gathered):
                if areas[lane] > area:
                    largest, area = lane, areas[lane]
        for lane in range(n_gathered):
            child[node, lane], stack[n_stack, 0] = n_nodes, n_nodes
            n_stack += 1
            n_nodes += 1
    state[0], state[1] = n_stack, n_nodes


@called
def fill_nodes(
    items: Items, halves: BinaryTree, roots: Int32Array, own: Int32Array, first: int, boxes: Float32Array,
    child: Int32Array,
) -> None:  # fmt: skip
    """Fill boxes and children of nodes. roots, own: binary nodes and children as of `collapse_to_eight`; first: what
    is added to their numbers."""
    for node in range(len(child)):
        start, is_leaf = halves.runs[roots[node], 0], halves.left[roots[node]] < 0
        n_lanes = halves.runs[roots[node], 1] - start
        for lane in range(WIDTH):
            if is_leaf and lane < n_lanes:
                child[node, lane] = -1 - items.order[start + lane]
                _set_lane(boxes, node, lane, items.boxes, start + lane)
            elif own[node, lane] >= 0:
                child[node, lane] = first + own[node, lane]
                _set_lane(boxes, node, lane, halves.boxes, roots[own[node, lane]])
            else:
                child[node, lane] = EMPTY
                for row in range(6):
                    boxes[node, row, lane] = 0.0 if row < 3 else UNUSED


@inline
def _set_lane(boxes: Float32Array, node: int, lane: int, rows: Float32Array, row: int) -> None:
    """Store the box of a row (low x, y, z, 0, then minus high) in a lane of a node, as centre and enlarged half
    widths."""
    for axis in range(3):
        low, high = float(rows[row, axis]), -float(rows[row, 4 + axis])
        boxes[node, axis, lane] = 0.5 * (low + high)
        boxes[node, 3 + axis, lane] = 0.5 * (high - low) + ENLARGED * max(abs(low), abs(high)) + LEAST
