"""Bounding volume hierarchy (broad phase): a tree of boxes over many small boxes, eight children a node, in flat
arrays, built by the surface-area heuristic.

    node     boxes (n_nodes, 6, 8) float32: rows cx cy cz hx hy hz,      child (n_nodes, 8) int32
             centre and half width of each child, one child to a lane
    inner    boxes that hold whole subtrees                              index of the child's node
    block    at most eight items, first lane always filled               -1 - item
    unused   centre 0, half width -1e30: intersects no box            EMPTY

Node 0 is the root. Coordinates are those of the tree: x = origin + scale * local with a power of two for scale, so that
every local coordinate is at most 2 in magnitude and float32 will do. The origin lies where most items are, in the
median of a few: there float32 is fine enough for details that are small against the whole. Half widths are enlarged by
what the conversion may lose: a child's box holds its items. `lanes/boxes.py` tests all eight lanes at the same time, so
a block of eight items costs as much as one item.

The heuristic affects the speed of queries only: where its areas overflow, or many items share one centre, a run of
items is split in the middle.

Source: I. Wald, On fast construction of SAH-based bounding volume hierarchies, 2007 (binning); I. Wald, C. Benthin, S.
Boulos, Getting rid of packets: efficient SIMD single-ray traversal using multi-branching BVHs, 2008 (collapsing).
"""

from __future__ import annotations

from collections import namedtuple
from math import frexp, ldexp
from typing import Any, NamedTuple

import numpy as np

from engine.compiling.jit import allocating, allocating_kernel, inline, kernel
from engine.lanes.boxes import EMPTY, exchange, fill, join
from engine.lanes.lanes import aligned
from engine.running.budget import poll
from engine.types import Float32Array, FloatArray, Int32Array, IntArray, read_only

WIDTH = 8
N_BINS = 16
HEURISTIC_DEPTH = 40
"""Below this depth runs are halved, so no block lies deeper than `MAX_DEPTH`."""
MAX_DEPTH = HEURISTIC_DEPTH + 40  # 2^40 items and more do not fit into memory
STACK = WIDTH * (MAX_DEPTH + 1)
"""Bound on the number of nodes on the stack while a tree is descended: eight for each level."""
UNUSED = np.float32(-1e30)
ENLARGED = 2.0**-21
"""Enlargement of half widths relative to |centre| + half width: low and high are rounded by 2^-24 of themselves, so are
their mean and half difference, and both results once more."""
LEAST = 2.0**-100
"""Absolute enlargement of half widths: above all underflow, below every difference that a query can detect."""
_SAMPLE = 31
_HUGE = 2.0**1022
"""Half extent from which the origin is the middle: from a point near an end the difference to the other end could
overflow."""

_LEAST_STRETCH, _MOST_STRETCH = 5, 100
"""Exponents: see `_stretch`."""
_MOST_STRETCHED = 2.0**900
"""Boxes beyond this size, or below its reciprocal, are not stretched: coordinates could overflow or lose bits."""

_MOST_UNBALANCED = 512
"""Items up to which a tree is as good without `_stretch`."""
_FEW_ROWS = 64
_FEW_ITEMS, _FEW_BINS = 64, 8
"""A run of at most _FEW_ITEMS items is split with _FEW_BINS bins, because the bins would cost more than the items."""
_FINITE = 1e30
_NO_BOX = np.float32(np.inf)
"""Bound of the empty box; its union with a box is that box."""
_WORK = 1 << 18
"""Number of items processed, or nodes filled, between two checks of the deadline: about 10 ms."""


class Bvh(NamedTuple):
    """A tree of boxes: boxes (n_nodes, 6, 8) and child (n_nodes, 8) as in the table of this module; tree coordinates
    are (x - origin) / scale."""

    boxes: Float32Array
    child: Int32Array
    origin: FloatArray
    """(3,)"""
    scale: float


Items = namedtuple("Items", "boxes centres order")
"""Boxes from which the tree is built, in the order of its leaves: boxes (n, 8), as lanes/boxes.py has them; centres (n,
8), boxes without extent; order (n,), index of each box in the input."""

BinaryTree = namedtuple("BinaryTree", "boxes centres left runs")
"""A binary tree whose leaves are runs of at most eight items: boxes and centres (2 n - 1, 8), the bounds of a node's
items and of their centres; left, index of the left child (the right child follows), or -1; runs (2 n - 1, 2), first
item of the node and end."""

Bins = namedtuple("Bins", "boxes centres numbers costs")
"""Bins of the surface-area heuristic along an axis.

| field | shape | meaning |
|---|---|---|
| boxes, centres | (16, 8) | bounds of the items, and of their centres |
| numbers | (16,) | number of items |
| costs | (16,) | cost of the items of this bin and of all bins right of it |
"""


def build_bvh(boxes: FloatArray) -> Bvh:
    """Return the tree over `boxes` (n_items, 6) float64: xmin ymin zmin xmax ymax zmax; n_items >= 1. Cost: n log n;
    the two stored arrays take some 45 bytes an item. Raises: DeadlineExceededError, CancelledError."""
    n_items, origin = len(boxes), np.empty(3)
    n_halves = 2 * n_items - 1
    own, around = np.empty((2, n_items, WIDTH), np.float32), np.empty((2, n_halves, WIDTH), np.float32)
    items = Items(own[0], own[1], np.arange(n_items))
    halves = BinaryTree(around[0], around[1], np.empty(n_halves, np.int64), np.empty((n_halves, 2), np.int64))
    stack, state = np.zeros((STACK, 2), np.int64), np.array([int(n_items > WIDTH), 1])
    with np.errstate(all="ignore"):  # what underflows here is far below the enlargement of the boxes
        scale = _normalise(read_only(boxes), origin, items, halves)
        while state[0] > 0:  # bound: each turn ends a node
            poll()
            _build_binary_tree(items, halves, stack, state)
        room = int(state[1])  # a bound; what is left untouched takes no memory
        nodes, child = empty_rows((room, 6, WIDTH), np.float32), empty_rows((room, WIDTH), np.int32)
        stack[0], state[:] = 0, 1
        while state[0] > 0:  # bound: each turn fills a node
            poll()
            _collapse_to_eight(items, halves, nodes, child, stack, state)
    origin.setflags(write=False)
    return Bvh(read_only(nodes[: state[1]]), read_only(child[: state[1]]), origin, scale)


def build_stretched_bvh(boxes: FloatArray) -> tuple[Bvh, FloatArray, FloatArray]:
    """Return (tree, origin, scale): the tree over boxes (n_items, 6), which are overwritten, stretched along each axis
    by a power of two so that float32, and one slack for all axes, resolve what is small on a short axis; and by axis x
    = origin + scale * local, (3,) each."""
    _stretch(boxes, stretch := np.ones(3))
    tree = build_bvh(boxes)
    return tree, read_only(tree.origin / stretch), read_only(tree.scale / stretch)


def build_balanced_bvh(boxes: FloatArray) -> Bvh:
    """Return the tree of `build_bvh` over boxes (n_items, 6), which are overwritten; of more than _MOST_UNBALANCED with
    runs split as if all axes had similar extents (`_stretch`): by the surface area of a long thin mesh, nodes would be
    wide across its short axes."""
    if len(boxes) <= _MOST_UNBALANCED:
        return build_bvh(boxes)
    _stretch(boxes, stretch := np.ones(3))
    tree = build_bvh(boxes)
    if stretch.tolist() == [1.0, 1.0, 1.0]:
        return tree
    narrowed = tree.boxes * np.tile(1.0 / stretch, 2).astype(np.float32)[:, None]
    np.maximum(narrowed[:, 3:], np.float32(LEAST), out=narrowed[:, 3:])
    narrowed = np.where(tree.child[:, None] == EMPTY, tree.boxes, narrowed)
    return Bvh(cache_aligned(narrowed), tree.child, read_only(tree.origin / stretch), tree.scale)


@kernel
def _stretch(boxes: FloatArray, stretch: FloatArray) -> None:
    """Multiply boxes (n, 6) by `stretch` (3,), ones on entry: powers of two, up to 2^_MOST_STRETCH, for axes that are
    shorter by more than 2^_LEAST_STRETCH than the longest."""
    longest, size = 0.0, 0.0
    for turn in range(6):
        axis, low, high = turn % 3, np.inf, -np.inf
        for item in range(boxes.shape[0]):
            low, high = min(low, boxes[item, axis]), max(high, boxes[item, 3 + axis])
        size, extent = max(size, abs(low), abs(high)), 0.5 * high - 0.5 * low
        if turn < 3:
            longest = max(longest, extent)
        elif extent > 0.0 and 1.0 / _MOST_STRETCHED < size < _MOST_STRETCHED:
            shorter = min(frexp(longest)[1] - frexp(extent)[1], _MOST_STRETCH)
            stretch[axis] = ldexp(1.0, shorter) if shorter > _LEAST_STRETCH else 1.0
    for axis in range(3):
        for item in range(boxes.shape[0] if stretch[axis] != 1.0 else 0):
            boxes[item, axis] *= stretch[axis]
            boxes[item, 3 + axis] *= stretch[axis]


def empty_rows(shape: tuple[int, ...], dtype: Any) -> Any:
    """Return an uninitialised array, aligned to a cache line unless it has few rows."""
    return aligned(shape, dtype) if shape[0] > _FEW_ROWS else np.empty(shape, dtype)


def cache_aligned(array: Any) -> Any:
    """Return a read-only copy of an array, aligned to a cache line unless it is small."""
    aligned_copy = empty_rows(array.shape, array.dtype)
    aligned_copy[:] = array
    aligned_copy.setflags(write=False)
    return aligned_copy


@kernel
def _normalise(boxes: FloatArray, origin: FloatArray, items: Items, halves: BinaryTree) -> float:
    """Write the boxes in tree coordinates to items, and set origin (3,) and the root (node 0) of the binary tree;
    return the scale, a power of two."""
    n_items, half = boxes.shape[0], 0.0
    for axis in range(3):
        low, high = boxes[0, axis], boxes[0, 3 + axis]
        for item in range(1, n_items):
            low, high = min(low, boxes[item, axis]), max(high, boxes[item, 3 + axis])
        is_huge = 0.5 * high - 0.5 * low >= _HUGE
        origin[axis] = 0.5 * low + 0.5 * high if is_huge else _middle_of(boxes, axis)
        half = max(half, 0.5 * high - 0.5 * origin[axis], 0.5 * origin[axis] - 0.5 * low)
    power = frexp(half)[1] if half > 0.0 else 0  # half: of what is to be at most 2
    once = ldexp(1.0, -power // 2)
    again = ldexp(1.0, -power - (-power // 2))  # order: two factors, since 2^-power may be no float
    halves.runs[0, 0], halves.runs[0, 1], halves.left[0] = 0, n_items, -1
    _set_empty(halves, 0)
    for item in range(n_items):
        for axis in range(4):
            low, high = 0.0, 0.0
            if axis < 3:
                moved = origin[axis] * once * again
                low, high = boxes[item, axis] * once * again - moved, boxes[item, 3 + axis] * once * again - moved
            items.boxes[item, axis], items.boxes[item, 4 + axis] = low, -high
            items.centres[item, axis], items.centres[item, 4 + axis] = 0.5 * (low + high), -0.5 * (low + high)
        _include(halves, 0, items, item)
    return ldexp(1.0, power)


@allocating
def _middle_of(boxes: FloatArray, axis: int) -> float:
    """Return the median, over a sample of boxes, of their centre's coordinate on an axis."""
    n_seen, step = 0, (len(boxes) - 1) // _SAMPLE + 1
    sorted_centres = np.empty(_SAMPLE)
    for item in range(0, len(boxes), step):
        centre, place = 0.5 * boxes[item, axis] + 0.5 * boxes[item, 3 + axis], n_seen
        while place > 0 and sorted_centres[place - 1] > centre:
            sorted_centres[place] = sorted_centres[place - 1]
            place -= 1
        sorted_centres[place] = centre
        n_seen += 1
    return sorted_centres[n_seen // 2]


@inline
def _set_empty(halves: Any, node: int) -> None:
    """Set the bounds (boxes and centres) of a node or bin to the empty box."""
    fill(halves.boxes, node, _NO_BOX)
    fill(halves.centres, node, _NO_BOX)


@inline
def _include(halves: Any, node: int, others: Any, other: int) -> None:
    """Enlarge the bounds (boxes and centres) of a node or bin by those of an item or bin."""
    join(halves.boxes, node, others.boxes, other)
    join(halves.centres, node, others.centres, other)


@allocating_kernel
def _build_binary_tree(items: Items, halves: BinaryTree, stack: IntArray, state: IntArray) -> None:
    """Continue building the binary tree, for about `_WORK` items. stack: (node, depth) of nodes to be split. state
    (2,): length of the stack and number of nodes, read and written. Caller guarantees 2 n - 1 rows of nodes, the first
    one filled."""
    n_stack, n_nodes, n_seen = state[0], state[1], 0
    boxes, centres = np.empty((N_BINS, WIDTH), np.float32), np.empty((N_BINS, WIDTH), np.float32)
    bins = Bins(boxes, centres, np.empty(N_BINS, np.int64), np.empty(N_BINS, np.float32))
    while n_stack > 0 and n_seen < _WORK:  # bound: each turn ends one of the 2 n - 1 nodes
        n_stack -= 1
        node, depth = stack[n_stack, 0], stack[n_stack, 1]
        start, end = halves.runs[node, 0], halves.runs[node, 1]
        n_seen += end - start
        if end - start <= WIDTH:
            halves.left[node] = -1
            continue
        middle = _partition(items, halves, node, bins, n_nodes) if depth < HEURISTIC_DEPTH else start
        if middle == start:
            middle = (start + end) // 2
            _set_empty(halves, n_nodes)
            _set_empty(halves, n_nodes + 1)
            for item in range(start, end):
                _include(halves, n_nodes + (item >= middle), items, item)
        halves.left[node] = n_nodes
        halves.runs[n_nodes, 0], halves.runs[n_nodes, 1] = start, middle
        halves.runs[n_nodes + 1, 0], halves.runs[n_nodes + 1, 1] = middle, end
        for side in range(2):
            stack[n_stack, 0], stack[n_stack, 1] = n_nodes + side, depth + 1
            n_stack += 1
        n_nodes += 2
    state[0], state[1] = n_stack, n_nodes


@allocating_kernel
def _collapse_to_eight(
    items: Items, halves: BinaryTree, boxes: Float32Array, child: Int32Array, stack: IntArray, state: IntArray
) -> None:
    """Continue merging binary nodes into nodes of eight children, opening the largest boxes first, for at most `_WORK`
    / 8 nodes. stack: (binary node, node to be filled). state (2,): length of the stack, and number of nodes filled or
    on it, read and written."""
    n_stack, n_nodes = state[0], state[1]
    gathered, areas = np.empty(WIDTH, np.int64), np.empty(WIDTH, np.float32)
    left, runs = halves.left, halves.runs
    for _ in range(_WORK // WIDTH):
        if n_stack == 0:
            break
        n_stack -= 1
        half, node = stack[n_stack, 0], stack[n_stack, 1]
        for lane in range(WIDTH):
            child[node, lane] = EMPTY
            for row in range(6):
                boxes[node, row, lane] = 0.0 if row < 3 else UNUSED
        if left[half] < 0:
            for place in range(runs[half, 0], runs[half, 1]):
                lane = place - runs[half, 0]
                child[node, lane] = -1 - items.order[place]
                _set_lane(boxes, node, lane, items.boxes, place)
            continue
        n_gathered, largest = 1, 0
        gathered[0] = half
        while largest >= 0 and n_gathered < WIDTH:
            opened = left[gathered[largest]]
            for place in (largest, n_gathered):
                gathered[place], is_open = opened, left[opened] >= 0
                areas[place] = _half_area(halves.boxes, opened) if is_open else np.float32(-1.0)
                opened += 1
            n_gathered += 1
            largest, area = -1, np.float32(-1.0)
            for lane in range(n_gathered):
                if areas[lane] > area:
                    largest, area = lane, areas[lane]
        for lane in range(n_gathered):
            child[node, lane] = n_nodes
            _set_lane(boxes, node, lane, halves.boxes, gathered[lane])
            stack[n_stack, 0], stack[n_stack, 1] = gathered[lane], n_nodes
            n_stack += 1
            n_nodes += 1
    state[0], state[1] = n_stack, n_nodes


@inline
def _set_lane(boxes: Float32Array, node: int, lane: int, rows: Float32Array, row: int) -> None:
    """Store the box of a row (low x, y, z, 0, then minus high) in a lane of a node, as centre and enlarged half
    widths."""
    for axis in range(3):
        low, high = float(rows[row, axis]), -float(rows[row, 4 + axis])
        boxes[node, axis, lane] = 0.5 * (low + high)
        boxes[node, 3 + axis, lane] = 0.5 * (high - low) + ENLARGED * max(abs(low), abs(high)) + LEAST


@inline
def _half_area(rows: Float32Array, row: int) -> float:
    x, y, z = -rows[row, 4] - rows[row, 0], -rows[row, 5] - rows[row, 1], -rows[row, 6] - rows[row, 2]
    return x * y + y * z + z * x


@inline
def _partition(items: Items, halves: BinaryTree, node: int, bins: Bins, parts: int) -> int:
    """Split the items of a node between two children, nodes parts and parts + 1, by the surface-area heuristic (SAH);
    reorder the items and set the children's bounds. Returns the index of the right child's first item; the node's first
    item if there is no useful cut."""
    start, end, low, width, axis = halves.runs[node, 0], halves.runs[node, 1], np.float32(0.0), np.float32(-1.0), 0
    for candidate in range(3):
        smallest, largest = halves.centres[node, candidate], -halves.centres[node, 4 + candidate]
        if largest - smallest > width:
            axis, low, width = candidate, smallest, largest - smallest
    n_bins = N_BINS if end - start > _FEW_ITEMS else _FEW_BINS
    scale = np.float32(n_bins) / width
    if not (0.0 < scale < _FINITE):  # case: one centre for all
        return start
    for index in range(n_bins):
        _set_empty(bins, index)
        bins.numbers[index] = 0
    for item in range(start, end):
        index = _bin_of(items.centres[item, axis], low, scale, n_bins)
        _include(bins, index, items, item)
        bins.numbers[index] += 1
    cut = _cheapest_cut(halves.boxes, parts, bins, n_bins)
    if cut == 0:
        return start
    left = start  # the end of the left part; what is exchanged in vain costs less than a branch that nobody foresees
    for item in range(start, end):
        is_left = _bin_of(items.centres[item, axis], low, scale, n_bins) < cut
        exchange(items.boxes, left, item)
        exchange(items.centres, left, item)
        items.order[left], items.order[item] = items.order[item], items.order[left]
        left += int(is_left)
    for side in range(2):
        _set_empty(halves, parts + side)
    for index in range(n_bins):
        _include(halves, parts + (index >= cut), bins, index)
    return left


@inline
def _bin_of(centre: float, low: float, scale: float, n_bins: int) -> int:
    return min(n_bins - 1, int((centre - low) * scale))


@inline
def _cheapest_cut(boxes: Float32Array, scratch: int, bins: Bins, n_bins: int) -> int:
    """Return the number of bins on the left of the cheapest cut by the surface-area heuristic, 0 if no cut has a finite
    cost. Overwrites boxes[scratch] and the costs of the bins."""
    fill(boxes, scratch, _NO_BOX)
    number = 0
    for index in range(n_bins - 1, 0, -1):
        number += bins.numbers[index]
        join(boxes, scratch, bins.boxes, index)
        bins.costs[index] = np.float32(number) * _half_area(boxes, scratch) if number > 0 else np.float32(np.inf)
    fill(boxes, scratch, _NO_BOX)
    number, best, cut = 0, np.float32(np.inf), 0
    for index in range(1, n_bins):
        number += bins.numbers[index - 1]
        join(boxes, scratch, bins.boxes, index - 1)
        if number > 0:
            cost = np.float32(number) * _half_area(boxes, scratch) + bins.costs[index]
            if cost < best:
                best, cut = cost, index
    return cut
