"""A tree of boxes over many small boxes, in flat arrays, built by the surface-area heuristic.

    node        boxes (n_nodes, 6): xmin ymin zmin xmax ymax zmax       child (n_nodes,)
    inner       the union of its two children                           index of the left child, the right one follows
    leaf        the box of one item, unchanged                          -1 - item

Node 0 is the root; a child stands behind its parent. Boxes are unions of the input boxes, so no rounding is involved.
The heuristic only decides how fast a query is: where its areas overflow, or many items share one centre, a run of items
is halved as it stands.

Source: I. Wald, On fast construction of SAH-based bounding volume hierarchies, 2007 (binning).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine.jit import inline, kernel

N_BINS = 16
HEURISTIC_DEPTH = 40
"""Below this depth runs are halved, so no leaf lies deeper than `MAX_DEPTH`."""
MAX_DEPTH = HEURISTIC_DEPTH + 40  # 2^40 items and more do not fit into memory


class Bvh(NamedTuple):
    """The two arrays of the picture above."""

    boxes: npt.NDArray[np.float64]
    child: npt.NDArray[np.int64]


def build_bvh(boxes: npt.NDArray[np.float64]) -> Bvh:
    """Return the tree over `boxes` (n_items, 6) float64, n_items >= 1. Cost: n log n; two arrays are kept."""
    n_nodes = 2 * boxes.shape[0] - 1
    tree = Bvh(np.empty((n_nodes, 6)), np.empty(n_nodes, np.int64))
    with np.errstate(all="ignore"):  # uncompiled runs only: overflow and empty widths are cases of `_split`
        _build(boxes, tree.boxes, tree.child)
    tree.boxes.setflags(write=False)
    tree.child.setflags(write=False)
    return tree


@kernel
def _build(items: Any, boxes: Any, child: Any) -> None:
    """Fill `boxes` and `child` (caller guarantees 2 n - 1 rows) from the item boxes (n, 6)."""
    n_items = items.shape[0]
    order = np.arange(n_items)
    stack = np.empty((2 * MAX_DEPTH, 4), np.int64)  # node, first of its run, end of its run, depth
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, 0, n_items, 0
    n_stack, n_nodes = 1, 1
    bins = np.empty((N_BINS, 7))  # box and number of items of each bin
    while n_stack > 0:  # bound: each turn writes one of the 2 n - 1 nodes
        n_stack -= 1
        node, start, end, depth = stack[n_stack, 0], stack[n_stack, 1], stack[n_stack, 2], stack[n_stack, 3]
        if end - start == 1:
            boxes[node] = items[order[start]]
            child[node] = -1 - order[start]
            continue
        _unite(items, order, start, end, boxes[node])
        middle = (start + end) // 2
        if depth < HEURISTIC_DEPTH:
            middle = _split(items, order, start, end, bins)
        child[node] = n_nodes
        for side in range(2):
            stack[n_stack, 0] = n_nodes + side
            stack[n_stack, 1] = start if side == 0 else middle
            stack[n_stack, 2] = middle if side == 0 else end
            stack[n_stack, 3] = depth + 1
            n_stack += 1
        n_nodes += 2


@inline
def _unite(items: Any, order: Any, start: int, end: int, box: Any) -> None:
    """Set `box` to the union of the items of one run."""
    box[:] = items[order[start]]
    for place in range(start + 1, end):
        item = order[place]
        for axis in range(3):
            box[axis] = min(box[axis], items[item, axis])
            box[3 + axis] = max(box[3 + axis], items[item, 3 + axis])


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
        _grow(box, bins[index])
        from_right[index] = number * _half_area(box) if number > 0.0 else np.inf
    box[:3], box[3:] = np.inf, -np.inf
    number, best, cut = 0.0, np.inf, 0
    for index in range(1, N_BINS):
        number += bins[index - 1, 6]
        _grow(box, bins[index - 1])
        if number > 0.0:
            cost = number * _half_area(box) + from_right[index]
            if cost < best:
                best, cut = cost, index
    return cut


@inline
def _grow(box: Any, other: Any) -> None:
    for axis in range(3):
        box[axis] = min(box[axis], other[axis])
        box[3 + axis] = max(box[3 + axis], other[3 + axis])
