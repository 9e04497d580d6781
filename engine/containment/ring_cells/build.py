"""Builds the cells of a polygon, with the budget of the call that pays for it: level by level, crowded cells cut again.

The topmost cells are up to 64 an edge, cut along the axis where that lengthens the lists least (a comb gets columns
only). Lists longer than `_CROWDED` are cut again in the same way, up to 128 by 128, as long as the lists of all
levels together stay within a budget: edges that are long and close together would fill any memory.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.arrays import FloatArray, Int8Array, Int32Array, IntArray, read_only
from engine.budget import Budget
from engine.containment.rational_locate import next_in_ring
from engine.containment.ring_cells.lists import LevelOfNodes, choose_cuts, count_level, fill_level, place_edges
from engine.containment.ring_cells.locate import FINE_BITS, LAST, SPLIT_BITS, RingCells
from engine.solids.polygon import Polygon

_MOST: Final = 1 << 27
"""Edges whose numbers fit an item."""
_RANGE: Final = 2.0**500
"""Largest coordinate: products of the filter stay finite."""
_FASTEST: Final = 1e300
"""Most fine cells per unit: keeps products finite where all values of an axis lie within some subnormals."""
_NORMAL: Final = 2.0**-960
"""Extent from which places are off by no more than rounding, not by underflow."""
_CROWDED: Final = 3
"""Longest list of a topmost cell; twice as long on each level below, where cutting gains less."""
_TOP_BITS: Final = 20
_TOP_CELLS: Final = (1 << 12, 1 << 20, 64)
"""Cells of the topmost grid: least, most, for each edge."""
_CUT_BITS: Final = (1 << SPLIT_BITS) - 1
_CUT_CELLS: Final = (4, 1 << 12, 16)
_ENTRIES: Final = 32
"""Entries an edge, of all lists ever made, after which no cell is cut any more."""
_WORDS: Final = 1 << 24


def ring_cells_of(solid: Polygon, budget: Budget) -> RingCells | None:
    """Return the cells of `solid`, prepared once; None where its coordinates are out of their range."""
    is_in_range = solid.prepared("is_in_range", lambda: [bool(np.abs(solid.vertices).max() <= _RANGE)])[0]
    if len(solid.vertices) > _MOST or not is_in_range:
        return None
    return solid.prepared("ring_cells", lambda: build_ring_cells(solid, budget), budget.check)


def build_ring_cells(solid: Polygon, budget: Budget) -> RingCells:
    """Return the cells of `solid`, whose coordinates are at most `_RANGE`. Raises what `Budget.check` raises."""
    starts = solid.vertices
    low, high = starts.min(axis=0), starts.max(axis=0)
    halves = high * 0.5 - low * 0.5
    with np.errstate(all="ignore"):
        scales = np.where(halves > 0.0, np.minimum((2.0**FINE_BITS - 2.0) / halves, _FASTEST), 0.0)
    edges, places = np.empty(4 * len(starts) + 4), np.zeros((len(starts) + 1, 4))
    edges[:4] = 0.0, -np.inf, np.inf, np.nan
    ends = read_only(np.ascontiguousarray(starts[next_in_ring(solid)]))
    with np.errstate(all="ignore"):
        place_edges(starts, ends, low * 0.5, scales, edges, places)
    budget.check()
    words, items, bits = _cut(edges, places, halves, budget)
    width, height = (high - low).tolist()
    box = (float(low[0]), float(high[0]), float(low[1]), float(high[1]))
    band = 2.0**-48 * width + 2.0**-1070 * (height + 2.0)
    return RingCells(edges, words, items, box, float(scales[0]), float(scales[1]), bits[0], bits[1], band)


def _cut(
    edges: FloatArray, places: FloatArray, halves: FloatArray, budget: Budget
) -> tuple[Int32Array, Int32Array, tuple[int, int]]:
    """Return words, items and the bits of the topmost columns and rows."""
    n_edges, flag = len(places) - 1, budget.flag
    is_tight = bool(((halves == 0.0) | (halves >= _NORMAL)).all())
    nodes = np.array([[0, 0, FINE_BITS, FINE_BITS, 0, 0, n_edges]])
    edges_of = np.arange(1, n_edges + 1, dtype=np.int32)
    most, cells = np.where(halves > 0.0, _TOP_BITS, 0), _TOP_CELLS
    top, above, owners = np.zeros(2, np.int64), np.zeros(1, np.int64), np.zeros(1, np.int64)
    levels: list[IntArray] = []
    lists = [np.array([0, LAST], np.int32)]
    n_words, n_items, n_entries = 0, 2, 0
    while len(nodes):  # bound: every level takes a bit at least, of 60
        cuts = np.zeros((len(nodes), 2), np.int64)
        choose_cuts(nodes, edges_of, places, most, np.array(cells), is_tight, cuts, flag)
        sizes = 1 << cuts.sum(axis=1)
        bases = np.cumsum(sizes) - sizes
        counts, sides = np.zeros(sizes.sum(), np.int64), np.zeros(sizes.sum(), np.int8)
        level = LevelOfNodes(nodes, cuts, bases, edges_of, edges, places, is_tight)
        count_level(level, counts, sides, flag)
        budget.check()
        n_entries += int(counts.sum())
        is_crowded = (counts > _CROWDED << len(levels)) & np.repeat(sizes > 1, sizes)
        is_crowded &= n_entries < _ENTRIES * n_edges + _TOP_CELLS[0] and n_words + len(counts) < _WORDS
        kept, passed = np.where(is_crowded, 0, counts), np.where(is_crowded, counts, 0)
        firsts = np.where(is_crowded, np.cumsum(passed) - passed, np.cumsum(kept) - kept)
        stops = firsts.copy()
        items, next_edges = np.empty(kept.sum(), np.int32), np.empty(passed.sum(), np.int32)
        fill_level(level, is_crowded, stops, items, next_edges, flag)
        budget.check()
        items[stops[kept > 0] - 1] |= LAST
        words = np.where(kept > 0, (firsts + n_items) << 1, 0).astype(np.int64) + sides
        if levels:
            above[owners] = ~((bases + n_words) << 2 * SPLIT_BITS | cuts[:, 1] << SPLIT_BITS | cuts[:, 0])
        else:
            top, words = cuts[0], np.append(words, 0)  # the last for points out of the box
        levels.append(words)
        lists.append(items)
        n_words, n_items = n_words + len(words), n_items + len(items)
        above, owners = words, np.flatnonzero(is_crowded)
        nodes = _crowded_nodes(nodes, cuts, bases, owners, sides, firsts, stops)
        edges_of, most, cells = next_edges, np.full(2, _CUT_BITS), _CUT_CELLS
    return (np.concatenate(levels).astype(np.int32), np.concatenate(lists), (int(top[0]), int(top[1])))


def _crowded_nodes(
    nodes: IntArray, cuts: IntArray, bases: IntArray, owners: IntArray, sides: Int8Array, firsts: IntArray,
    stops: IntArray,
) -> IntArray:  # fmt: skip
    """Return the nodes of the next level, which are the cells `owners` of this one."""
    parent = np.searchsorted(bases, owners, side="right") - 1
    a, b = cuts[parent].T
    place = owners - bases[parent]
    columns, rows, u_shifts, v_shifts = nodes[parent, :4].T
    return np.stack(
        [
            (columns << a) + (place & (1 << a) - 1),
            (rows << b) + (place >> a),
            u_shifts - a,
            v_shifts - b,
            sides[owners].astype(np.int64),
            firsts[owners],
            stops[owners],
        ],
        axis=1,
    )
