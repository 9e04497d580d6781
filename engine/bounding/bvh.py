"""A tree of boxes over many small boxes, eight children a node, in flat arrays, built by the surface-area heuristic.

    node     boxes (n_nodes, 6, 8) float32: rows cx cy cz hx hy hz,      child (n_nodes, 8) int32
             centre and half width of each child, one child to a lane
    inner    boxes that hold whole subtrees                              index of the child's node
    block    at most eight items, first lane always filled               -1 - item
    unused   centre 0, half width -1e30: apart from every box            EMPTY

Node 0 is the root. Coordinates are those of the tree: x = origin + scale * local with a power of two for scale, so that
every local coordinate is at most 2 in magnitude and float32 will do. Half widths are enlarged by what the conversion
may lose: a child's box holds its items. Lanes are asked side by side by `lanes/boxes.py`; a block of eight items costs
what one costs.

The heuristic only decides how fast a query is: where its areas overflow, or many items share one centre, a run of items
is halved as it stands.

Source: I. Wald, On fast construction of SAH-based bounding volume hierarchies, 2007 (binning); I. Wald, C. Benthin,
S. Boulos, Getting rid of packets: efficient SIMD single-ray traversal using multi-branching BVHs, 2008 (collapsing).
"""

from __future__ import annotations

from math import frexp, ldexp
from typing import Any, NamedTuple

import numpy as np

from engine.arrays import Float32Array, FloatArray, Int32Array, read_only
from engine.jit import inline, kernel
from engine.lanes.boxes import EMPTY
from engine.lanes.lanes import aligned
from engine.parallel import poll

WIDTH = 8
N_BINS = 16
HEURISTIC_DEPTH = 40
"""Below this depth runs are halved, so no block lies deeper than `MAX_DEPTH`."""
MAX_DEPTH = HEURISTIC_DEPTH + 40  # 2^40 items and more do not fit into memory
STACK = WIDTH * (MAX_DEPTH + 1)
"""Nodes that wait on a way down a tree at most: eight for each level."""
UNUSED = np.float32(-1e30)
ENLARGED = 2.0**-22
"""Added to half widths: a centre rounded to float32 is off by 2^-24 of at most 2, the half width by as much."""

_FEW_ROWS = 64
_WORK = 1 << 18
"""Items looked at, or nodes filled, between two looks at the deadline: a hundredth of a second."""


class Bvh(NamedTuple):
    """The arrays of the picture above."""

    boxes: Float32Array
    child: Int32Array
    origin: FloatArray
    """(3,)"""
    scale: float


def build_bvh(boxes: FloatArray) -> Bvh:
    """Return the tree over `boxes` (n_items, 6) float64: xmin ymin zmin xmax ymax zmax; n_items >= 1.

    Cost: n log n; two arrays are kept, of some 45 bytes an item.
    Raises: what `poll` does.
    """
    n_items, origin = len(boxes), np.empty(3)
    local, order, stack = np.empty((n_items, 6)), np.arange(n_items), np.zeros((STACK, 2), np.int64)
    halves, runs = np.empty((2 * n_items - 1, 6)), np.empty((2 * n_items - 1, 2), np.int64)
    left, state = np.empty(2 * n_items - 1, np.int64), np.array([1, 1])
    with np.errstate(all="ignore"):  # what underflows here is far below the enlargement of the boxes
        scale = _normalise(read_only(boxes), origin, local)
        runs[0] = 0, n_items
        while state[0] > 0:  # bound: each turn ends a node
            poll()
            _halve(local, order, halves, left, runs, stack, state)
        nodes, child = np.empty((state[1], 6, WIDTH), np.float32), np.empty((state[1], WIDTH), np.int32)
        stack[0], state[:] = 0, 1
        while state[0] > 0:  # bound: each turn fills a node
            poll()
            _widen(local, order, halves, left, runs, nodes, child, stack, state)
    origin.setflags(write=False)
    return Bvh(on_lines(nodes[: state[1]]), on_lines(child[: state[1]]), origin, scale)


def on_lines(array: Any) -> Any:
    """Return a read-only copy that begins with a line of the cache, unless it is small."""
    kept = aligned(array.shape, array.dtype) if len(array) > _FEW_ROWS else np.empty_like(array)
    kept[:] = array
    kept.setflags(write=False)
    return kept


@kernel
def _normalise(boxes: Any, origin: Any, local: Any) -> float:
    """Fill origin (3,) and local (n, 6) with the boxes in the coordinates of the tree; return scale."""
    n_items, half = boxes.shape[0], 0.0
    for axis in range(3):
        low, high = boxes[0, axis], boxes[0, 3 + axis]
        for item in range(1, n_items):
            low, high = min(low, boxes[item, axis]), max(high, boxes[item, 3 + axis])
        origin[axis] = 0.5 * low + 0.5 * high
        half = max(half, 0.5 * high - 0.5 * low)
    power = frexp(half)[1] - 1 if half > 0.0 else 0
    once = ldexp(1.0, -power // 2)
    again = ldexp(1.0, -power - (-power // 2))  # order: two factors, since 2^-power may be no float
    for item in range(n_items):
        for side in range(6):
            local[item, side] = boxes[item, side] * once * again - origin[side % 3] * once * again
    return ldexp(1.0, power)


@kernel
def _halve(items: Any, order: Any, boxes: Any, left: Any, runs: Any, stack: Any, state: Any) -> None:
    """Go on with a binary tree whose leaves are runs of `order` of at most eight items, for `_WORK` items.

    items (n, 6). Fills boxes (n_nodes, 6), left (n_nodes,): the left child, the right one follows, or -1, and runs
    (n_nodes, 2): first and end in `order`. Caller guarantees 2 n - 1 rows, of which runs has the first. stack: rows of
    node and depth; state: how many rows wait there, and how many nodes there are.
    """
    n_stack, n_nodes, n_seen = state[0], state[1], 0
    bins = np.empty((N_BINS, 7))  # box and number of items of each bin
    while n_stack > 0 and n_seen < _WORK:  # bound: each turn ends one of the 2 n - 1 nodes
        n_stack -= 1
        node, depth = stack[n_stack, 0], stack[n_stack, 1]
        start, end = runs[node, 0], runs[node, 1]
        n_seen += end - start
        _unite(items, order, start, end, boxes[node])
        if end - start <= WIDTH:
            left[node] = -1
            continue
        middle = (start + end) // 2
        if depth < HEURISTIC_DEPTH:
            middle = _split(items, order, start, end, bins)
        left[node] = n_nodes
        runs[n_nodes, 0], runs[n_nodes, 1] = start, middle
        runs[n_nodes + 1, 0], runs[n_nodes + 1, 1] = middle, end
        for side in range(2):
            stack[n_stack, 0], stack[n_stack, 1] = n_nodes + side, depth + 1
            n_stack += 1
        n_nodes += 2
    state[0], state[1] = n_stack, n_nodes


@kernel
def _widen(
    items: Any, order: Any, halves: Any, left: Any, runs: Any, boxes: Any, child: Any, stack: Any, state: Any
) -> None:
    """Go on to join binary nodes to nodes of eight, the largest boxes opened first, for `_WORK` / 8 nodes.

    stack: rows of binary node and node; state: how many rows wait there, and how many nodes are filled or wait.
    """
    n_stack, n_nodes = state[0], state[1]
    gathered = np.empty(WIDTH, np.int64)
    for _ in range(_WORK // WIDTH):
        if n_stack == 0:
            break
        n_stack -= 1
        half, node = stack[n_stack, 0], stack[n_stack, 1]
        for lane in range(WIDTH):
            child[node, lane] = EMPTY
            boxes[node, :3, lane] = 0.0
            boxes[node, 3:, lane] = UNUSED
        if left[half] < 0:
            for place in range(runs[half, 0], runs[half, 1]):
                lane = place - runs[half, 0]
                child[node, lane] = -1 - order[place]
                _set_lane(boxes, node, lane, items[order[place]])
            continue
        gathered[0], gathered[1] = left[half], left[half] + 1
        n_gathered = 2
        for _ in range(WIDTH - 2):
            largest, area = -1, -1.0
            for lane in range(n_gathered):
                if left[gathered[lane]] >= 0 and _half_area(halves[gathered[lane]]) > area:
                    largest, area = lane, _half_area(halves[gathered[lane]])
            if largest < 0:
                break
            opened = left[gathered[largest]]
            gathered[largest], gathered[n_gathered] = opened, opened + 1
            n_gathered += 1
        for lane in range(n_gathered):
            child[node, lane] = n_nodes
            _set_lane(boxes, node, lane, halves[gathered[lane]])
            stack[n_stack, 0], stack[n_stack, 1] = gathered[lane], n_nodes
            n_stack += 1
            n_nodes += 1
    state[0], state[1] = n_stack, n_nodes


@inline
def _set_lane(boxes: Any, node: int, lane: int, box: Any) -> None:
    """Store a box as float32, enlarged."""
    for axis in range(3):
        boxes[node, axis, lane] = 0.5 * (box[axis] + box[3 + axis])
        boxes[node, 3 + axis, lane] = 0.5 * (box[3 + axis] - box[axis]) + ENLARGED


@inline
def _unite(items: Any, order: Any, start: int, end: int, box: Any) -> None:
    """Set `box` to the union of the items of one run."""
    box[:] = items[order[start]]
    for place in range(start + 1, end):
        _grow(box, items, order[place])


@inline
def _centre(items: Any, item: int, axis: int) -> float:
    return 0.5 * items[item, axis] + 0.5 * items[item, 3 + axis]


@inline
def _half_area(box: Any) -> float:
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return x * y + y * z + z * x


@inline
def _split(items: Any, order: Any, start: int, end: int, bins: Any) -> int:
    """Reorder one run so that its left and right part make a good pair of children; return where the right one
    starts."""
    axis, low, width = 0, 0.0, -1.0
    for candidate in range(3):
        smallest = largest = _centre(items, order[start], candidate)
        for place in range(start + 1, end):
            centre = _centre(items, order[place], candidate)
            smallest, largest = min(smallest, centre), max(largest, centre)
        if largest - smallest > width:
            axis, low, width = candidate, smallest, largest - smallest
    scale = N_BINS / width
    if not (0.0 < scale < 1e300 and width < 1e300):  # case: one centre for all, or exponents at the ends of the range
        return (start + end) // 2
    _fill_bins(items, order, start, end, bins, axis, low, scale)
    cut = _best_cut(bins)
    if cut == 0:
        return (start + end) // 2
    left, right = start, end - 1
    while left <= right:  # bound: each turn moves one end inward
        if _bin_of(_centre(items, order[left], axis), low, scale) < cut:
            left += 1
        else:
            order[left], order[right] = order[right], order[left]
            right -= 1
    return left


@inline
def _bin_of(centre: float, low: float, scale: float) -> int:
    return min(N_BINS - 1, int((centre - low) * scale))


@inline
def _fill_bins(items: Any, order: Any, start: int, end: int, bins: Any, axis: int, low: float, scale: float) -> None:
    for index in range(N_BINS):
        bins[index, :3] = np.inf
        bins[index, 3:6] = -np.inf
        bins[index, 6] = 0.0
    for place in range(start, end):
        item = order[place]
        index = _bin_of(_centre(items, item, axis), low, scale)
        for side in range(3):
            bins[index, side] = min(bins[index, side], items[item, side])
            bins[index, 3 + side] = max(bins[index, 3 + side], items[item, 3 + side])
        bins[index, 6] += 1.0


@inline
def _best_cut(bins: Any) -> int:
    """Return the number of bins to the left of the cheapest cut, 0 where no cut has a finite cost."""
    from_right = np.empty(N_BINS)
    box = np.empty(6)
    box[:3], box[3:] = np.inf, -np.inf
    number = 0.0
    for index in range(N_BINS - 1, 0, -1):
        number += bins[index, 6]
        _grow(box, bins, index)
        from_right[index] = number * _half_area(box) if number > 0.0 else np.inf
    box[:3], box[3:] = np.inf, -np.inf
    number, best, cut = 0.0, np.inf, 0
    for index in range(1, N_BINS):
        number += bins[index - 1, 6]
        _grow(box, bins, index - 1)
        if number > 0.0:
            cost = number * _half_area(box) + from_right[index]
            if cost < best:
                best, cut = cost, index
    return cut


@inline
def _grow(box: Any, boxes: Any, row: int) -> None:
    for axis in range(3):
        box[axis] = min(box[axis], boxes[row, axis])
        box[3 + axis] = max(box[3 + axis], boxes[row, 3 + axis])
