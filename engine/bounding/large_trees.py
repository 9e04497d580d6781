"""Trees of very many items (`trees.py`), built on threads.

A large tree has the nodes that it would have if it were built as a small one, but for the order of items where runs are
halved. Its longest runs of items are split in
rounds: in each, threads put the items of fixed ranges into the bins of their runs, and one thread then chooses all
cuts. Runs of up to a 64th of all items are split by a thread each, in a range of binary nodes that is known beforehand;
so are subtrees of that size merged into nodes of eight. Nothing depends on the number of threads.

Source: I. Wald, On fast construction of SAH-based bounding volume hierarchies, 2007 (cuts of large runs by all
threads, then a run a thread).
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from itertools import accumulate
from typing import Any, Final

import numpy as np

from engine.bounding.bvh import MAX_DEPTH, STACK, WIDTH, Bvh, empty_rows
from engine.bounding.sah import (
    N_BINS,
    BinaryTree,
    Bins,
    Items,
    bins_of,
    build_binary_tree,
    cheapest_cut,
    collapse_to_eight,
    fill_bins,
    fill_nodes,
    join_bins,
    part_items,
    read_boxes,
)
from engine.bounding.tree_coordinates import measure, place_tree
from engine.compiling.jit import as_kernel, called, kernel
from engine.lanes.boxes import copy_row
from engine.running.budget import poll
from engine.running.parallel import share
from engine.types import FloatArray, Int32Array, IntArray, read_only

_NODES: Final = 1 << 15
"""Number of nodes filled between two checks of the deadline."""
_RANGES: Final = 64
_LEAST_RANGE: Final = 1 << 12
"""Number of ranges at most, and items of a range at least."""
_PARTS: Final = 64
_ROUNDS: Final = 10
"""Rounds at most, so that few items split from many each time end soon."""
_TOP: Final = 2 * _PARTS * _ROUNDS + 1
"""Bound on the binary nodes above the parts with their roots: at most _PARTS runs are split in a round."""
_MEASURE_SECONDS, _READ_SECONDS, _BIN_SECONDS, _PLACE_SECONDS = 4e-9, 1e-8, 1e-8, 1.2e-8
_SPLIT_SECONDS, _MERGE_SECONDS, _FILL_SECONDS = 1.5e-7, 3e-8, 3e-8
"""Time for each item."""

_measure, _place_tree, _read_boxes, _split = map(as_kernel, (measure, place_tree, read_boxes, build_binary_tree))
_merge_nodes, _fill_nodes = as_kernel(collapse_to_eight), as_kernel(fill_nodes)

Cuts = namedtuple("Cuts", "axis low scale cut slot")
"""By binary node above the parts: the bins of its items, see `bins_of`; the cheapest cut, 0 without one so far; the
place of its bins among those of the round, -1 if it has none."""


def _size_of(n_items: int) -> int:
    """Return the number of items of a range."""
    return max(_LEAST_RANGE, -(-n_items // _RANGES))


def by_range(task: Callable[[int, int], object], n_items: int, seconds: float) -> None:
    """Call ``task(start, stop)`` for ranges of items, on threads where that pays."""
    if n_items <= _LEAST_RANGE:
        task(0, n_items)
        return
    size = _size_of(n_items)
    n_ranges = -(-n_items // size)
    share(lambda first, last: task(first * size, min(last * size, n_items)), n_ranges, seconds * size)


def build_on_threads(boxes: FloatArray, is_stretched: bool, stretch: FloatArray, ends: FloatArray) -> Bvh:
    """Return the tree over boxes (n, 6). stretch, ends: outputs, see `trees.py`."""
    n_items, most, origin, factors = len(boxes), max(WIDTH, len(boxes) // _PARTS), np.empty(3), np.empty(5)
    _measure_on_threads(boxes, ends)
    scale = _place_tree(boxes, ends, is_stretched, stretch, origin, factors)
    items = Items(np.empty((n_items, WIDTH), np.float32), np.empty(n_items, np.int32))
    n_rows = _TOP + 3 * n_items  # untouched rows take no memory
    rows = np.empty((2, n_rows, WIDTH), np.float32)
    halves = BinaryTree(rows[0], rows[1], np.empty(n_rows, np.int32), np.empty((n_rows, 2), np.int32))
    apart = Items(halves.boxes[_TOP:], halves.left[_TOP:])  # in rows that no node has yet
    whole = _read(boxes, origin, factors, apart)
    n_top = _sort(apart, whole, items, halves, most)
    roots = np.flatnonzero(halves.left[:n_top] < 0)

    def split(first: int, last: int) -> None:
        stack, bins = np.zeros((STACK, 2), np.int64), empty_bins(N_BINS)
        for root in roots[first:last]:
            start, end = halves.runs[root].tolist()
            stack[0], state = (root, _ROUNDS), np.array([1, n_top + start, n_top + end, n_top + n_items + 2 * start])
            while state[0] > 0:  # bound: each turn ends a node
                poll()
                _split(items, halves, bins, stack, state)

    share(split, len(roots), _SPLIT_SECONDS * n_items / len(roots))
    nodes, child, parts = _merge(items, halves, most)
    return Bvh(nodes, child, read_only(origin), scale, parts)


def _measure_on_threads(boxes: FloatArray, ends: FloatArray) -> None:
    """Set ends (6,) to the box around boxes (n, 6)."""
    each: list[FloatArray] = []

    def look(start: int, stop: int) -> None:
        _measure(boxes[start:stop], own := np.empty(6))
        each.append(own)

    by_range(look, len(boxes), _MEASURE_SECONDS)
    ends[:3], ends[3:] = np.min(each, axis=0)[:3], np.max(each, axis=0)[3:]
    ends += 0.0  # the sign of a zero depends on the ranges


def empty_bins(n_bins: int) -> Bins:
    """Return uninitialised bins."""
    rows = np.empty((2, n_bins, WIDTH), np.float32)
    return Bins(rows[0], rows[1], np.empty(n_bins, np.int64), np.empty(n_bins, np.float32))


def _read(boxes: FloatArray, origin: FloatArray, factors: FloatArray, items: Items) -> Any:
    """Write the boxes (n, 6) to items in tree coordinates; return the bounds (8,) of all, and of their centres."""
    each: list[Any] = []

    def read(start: int, stop: int) -> None:
        _read_boxes(boxes[start:stop], origin, factors, start, items, bounds := empty_bins(1))
        each.append((bounds.boxes[0], bounds.centres[0]))

    by_range(read, len(boxes), _READ_SECONDS)
    return np.min(each, axis=0)


def _sort(apart: Items, whole: Any, items: Items, halves: BinaryTree, most: int) -> int:
    """Split the runs of more than `most` items, and copy the items from `apart`, which is reordered, in the order of
    the runs; return the number of nodes. whole: as of `_read`."""
    n_items = len(items.order)
    size = _size_of(n_items)
    n_ranges, numbers, factors = -(-n_items // size), np.zeros((3, _TOP), np.int64), np.zeros((2, _TOP), np.float32)
    cuts = Cuts(numbers[0], factors[0], factors[1], numbers[1], numbers[2])
    starts, counts = np.zeros((n_ranges, _TOP), np.int64), np.zeros((n_ranges, _TOP), np.int64)
    starts[:, 0] = np.arange(n_ranges) * size
    counts[:, 0] = np.minimum(n_items - starts[:, 0], size)
    halves.runs[0], (halves.boxes[0], halves.centres[0]) = (0, n_items), whole
    nodes, n_slots = (0, 0, 1), int(_choose_first(halves, cuts, 0, 0, most))
    for turn in range(_ROUNDS):
        if n_slots == 0:
            break
        bins, numbers = _binned(apart, halves.left, cuts, nodes, starts, counts, n_slots)
        least = most if turn + 1 < _ROUNDS else n_items
        n_nodes, n_slots = _choose_cuts(halves, cuts, bins, numbers, *nodes[1:], counts, least)
        nodes = *nodes[1:], n_nodes
    places = np.cumsum(counts, axis=0) - counts + halves.runs[:_TOP, 0]

    def place(low: int, high: int) -> None:
        _sort_ranges(apart, halves.left, cuts, nodes, low, high, starts, counts, 0, empty_bins(0))
        _place_items(apart, halves.left, nodes[2], starts, counts, places, low, high, items)

    share(place, n_ranges, _PLACE_SECONDS * size)
    return int(nodes[2])


def _binned(
    apart: Items, left: IntArray, cuts: Cuts, nodes: tuple[int, int, int], starts: IntArray, counts: IntArray,
    n_slots: int,
) -> tuple[Bins, IntArray]:  # fmt: skip
    """Reorder the items of nodes[0] .. nodes[1] - 1, which are cut, by their children; return the bins of those of the
    nodes up to nodes[2] - 1 that have some, and the number of items in each of those of a range (n_ranges, n_slots *
    N_BINS). starts, counts (n_ranges, n_nodes): the items of each range in a node."""
    bins, n_ranges = empty_bins(len(starts) * n_slots * N_BINS), len(starts)

    def fill(low: int, high: int) -> None:
        _sort_ranges(apart, left, cuts, nodes, low, high, starts, counts, n_slots, bins)

    share(fill, n_ranges, _BIN_SECONDS * int(counts[0, 0]))
    boxes, centres = (rows.reshape(n_ranges, -1, WIDTH).min(axis=0) for rows in (bins.boxes, bins.centres))
    numbers = bins.numbers.reshape(n_ranges, -1)
    return Bins(boxes, centres, numbers.sum(axis=0), bins.costs), numbers


@kernel
def _sort_ranges(
    items: Items, left: IntArray, cuts: Cuts, nodes: tuple[int, int, int], low: int, high: int, starts: IntArray,
    counts: IntArray, n_slots: int, bins: Bins,
) -> None:  # fmt: skip
    """Sort the items of ranges low .. high - 1, see `_binned`. bins: n_slots * N_BINS for each range."""
    for part in range(low, high):
        for node in range(nodes[0], nodes[2]):
            start, slot = starts[part, node], cuts.slot[node]
            end, axis = start + counts[part, node], (cuts.axis[node], cuts.low[node], cuts.scale[node])
            if node >= nodes[1]:
                if slot >= 0:
                    fill_bins(items, start, end, axis, bins, (part * n_slots + slot) * N_BINS, N_BINS)
            elif cuts.cut[node] > 0:
                starts[part, left[node]] = start
                starts[part, left[node] + 1] = part_items(items, start, end, axis, N_BINS, cuts.cut[node])


@called
def _choose_bins(halves: BinaryTree, cuts: Cuts, node: int, slot: int, most: int) -> bool:
    """Choose bins for a new node if it has more than `most` items; return whether it has. slot: their place."""
    axis, low, scale = bins_of(halves, node, N_BINS)
    has_bins = halves.runs[node, 1] - halves.runs[node, 0] > most and scale > 0.0
    cuts.axis[node], cuts.low[node], cuts.scale[node], halves.left[node] = axis, low, scale, -1
    cuts.slot[node] = slot if has_bins else -1
    return has_bins


_choose_first = as_kernel(_choose_bins)


@kernel
def _choose_cuts(
    halves: BinaryTree, cuts: Cuts, bins: Bins, numbers: IntArray, first: int, stop: int, counts: IntArray, most: int
) -> tuple[int, int]:
    """Cut the nodes first .. stop - 1 that have bins, and choose bins for their children with more than `most` items;
    return the number of nodes then, and of those with bins. numbers: as of `_binned`; counts (n_ranges, n_nodes): zero
    on entry for the new nodes, set."""
    n_nodes, n_slots = stop, 0
    for node in range(first, stop):
        start = cuts.slot[node] * N_BINS
        cut = cheapest_cut(halves.boxes, n_nodes, bins, start, N_BINS) if start >= 0 else 0
        if cut == 0:
            continue
        join_bins(halves, n_nodes, bins, start, cut, N_BINS)
        halves.left[node], cuts.cut[node] = n_nodes, cut
        start_of_child = halves.runs[node, 0]
        for side in range(2):
            child, low, high = n_nodes + side, start + side * cut, start + (cut if side == 0 else N_BINS)
            halves.runs[child, 0] = start_of_child
            for part in range(len(counts)):
                for index in range(low, high):
                    counts[part, child] += numbers[part, index]
                start_of_child += counts[part, child]
            halves.runs[child, 1] = start_of_child
            n_slots += _choose_bins(halves, cuts, child, n_slots, most)
        n_nodes += 2
    return n_nodes, n_slots


@kernel
def _place_items(
    apart: Items, left: IntArray, n_nodes: int, starts: IntArray, counts: IntArray, places: IntArray, low: int,
    high: int, items: Items,
) -> None:  # fmt: skip
    """Copy the items of ranges low .. high - 1 to their places (n_ranges, n_nodes) in the runs of nodes that are not
    cut."""
    for part in range(low, high):
        for node in range(n_nodes):
            start, place = starts[part, node], places[part, node]
            for item in range(counts[part, node] if left[node] < 0 else 0):
                copy_row(items.boxes, place + item, apart.boxes, start + item)
                items.order[place + item] = apart.order[start + item]


def _merge(items: Items, halves: BinaryTree, most: int) -> tuple[Any, Any, IntArray]:
    """Return boxes, children and parts of the tree: the nodes of more than `most` items, then each subtree."""
    top = _top_nodes(halves, most)
    n_top = len(top[1])
    below = top[0][n_top:].tolist()
    ends = [*halves.runs[below, 0].tolist(), len(items.order)]
    merged = [top, *([top] * len(below))]

    def merge(first: int, last: int) -> None:
        room = 2 * max(ends[place + 1] - ends[place] for place in range(first, last))
        stack, areas = np.zeros((STACK, 2), np.int64), np.empty(WIDTH, np.float32)
        roots, child = np.empty(room, np.int32), np.empty((room, WIDTH), np.int32)
        for place in range(first, last):
            roots[0], stack[0, 0], state = below[place], 0, np.array([1, 1])
            while state[0] > 0:  # bound: each turn fills a node
                poll()
                _merge_nodes(halves, roots, child, areas, stack, state, _NODES)
            merged[place + 1] = roots[: state[1]].copy(), child[: state[1]].copy()

    def fill(first: int, last: int) -> None:
        for place in range(first, last):
            nodes = slice(*firsts[place : place + 2])
            _fill_nodes(items, halves, *merged[place], nodes.start, boxes[nodes], child[nodes])

    share(merge, len(below), _MERGE_SECONDS * ends[-1] / len(below))
    firsts = [*accumulate((len(children) for _, children in merged), initial=0)]
    boxes, child = empty_rows((firsts[-1], 6, WIDTH), np.float32), empty_rows((firsts[-1], WIDTH), np.int32)
    share(fill, len(merged), _FILL_SECONDS * ends[-1] / len(merged))
    numbers = np.array([*range(n_top), *firsts[1:-1]], np.int32)
    own = child[:n_top]
    own[own >= 0] = numbers[own[own >= 0]]
    return read_only(boxes), read_only(child), np.array([firsts[1:], ends]).T.copy()


def _top_nodes(halves: BinaryTree, most: int) -> tuple[Int32Array, Int32Array]:
    """Return binary nodes (n_top + n_below,) and children (n_top, 8) of the nodes of more than `most` items, the root
    first, and the binary nodes of the subtrees below them in the order of their items."""
    room = WIDTH * _PARTS * MAX_DEPTH  # fewer than _PARTS such nodes in each level
    roots, child = np.zeros(room, np.int32), np.empty((room, WIDTH), np.int32)
    stack, areas, n_nodes = np.zeros((WIDTH, 2), np.int64), np.empty(WIDTH, np.float32), 1
    waiting, top, below = [0], [], []
    while waiting:  # bound: each turn fills a node of more than `most` items
        top.append(waiting.pop())
        stack[0, 0], state = top[-1], np.array([1, n_nodes])
        _merge_nodes(halves, roots, child, areas, stack, state, 1)
        for node in range(n_nodes, state[1]):
            start, stop = halves.runs[roots[node]].tolist()
            if stop - start > most:
                waiting.append(node)
            else:
                below.append((start, node))
        n_nodes = int(state[1])
    order = [*top, *(node for _, node in sorted(below))]
    places = np.empty(n_nodes, np.int32)
    places[order] = np.arange(n_nodes)
    children = child[top]
    return roots[order], np.where(children >= 0, places[np.maximum(children, 0)], children)
