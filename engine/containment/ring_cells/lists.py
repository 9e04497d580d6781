"""Which edges of a polygon are listed in which cells, and the side of every cell: compiled half of build.py.

All is counted in integers, so nothing here can be wrong by rounding. A node is a cell that is cut into 2^a by 2^b: the
whole plane at first, then cells that are crowded. An edge's columns in a row of cells may be too many, never too few:
its ends are placed as points are, and where it leaves the row is taken from the places of the ends, which are off by
less than 2^-20 of a fine cell, with a whole fine cell to spare.

**The side of a cell** (locate.py) is the same for all heights of its row, so it is counted at the lowest: the
unlisted edges to the right that have one end below the row and one not, plus the listed ones that go on downward from
an end in the row. Unlisted edges to the right are those listed in the node, which are counted one by one, and those
that are not: the side of the node tells their number, once what the node's own edges add by going on is taken out.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.arrays import FloatArray, Int32Array, IntArray
from engine.containment.ring_cells.locate import EDGE_SHIFT, GOES_ON_DOWN, GOES_ON_UP, as_edge
from engine.jit import allocating_kernel, inline, kernel
from engine.predicates.vectors import as_point2


class Node(NamedTuple):
    """A cell to cut: column and row where fine places are shifted so, side, and its part of the level's list."""

    column: int
    row: int
    u_shift: int
    v_shift: int
    side: int
    first: int
    stop: int


class LevelOfNodes(NamedTuple):
    """The nodes of one level and how they are cut."""

    nodes: IntArray
    """``(n, 7)`` of `Node`."""
    cuts: IntArray
    """``(n, 2)``: a node becomes 2^a by 2^b cells."""
    bases: IntArray
    """First word of each node."""
    edges_of: Int32Array
    """The level's list."""
    edges: FloatArray
    places: FloatArray
    is_tight: bool
    """Whether places are off by no more than rounding."""


class Cut(NamedTuple):
    """The cells of one node: column and row of the first, and where fine places are shifted so, numbers, first word."""

    left: int
    bottom: int
    u_shift: int
    v_shift: int
    n_columns: int
    n_rows: int
    base: int


class Ends(NamedTuple):
    """Places of an edge's ends in the fine grid, not cut to integers."""

    lower_u: float
    lower_v: float
    upper_u: float
    upper_v: float


@inline
def as_node(nodes: Any, row: int) -> Node:
    """Return row `row` of nodes (n, 7) int64."""
    n = nodes[row]
    return Node(n[0], n[1], n[2], n[3], n[4], n[5], n[6])


@inline
def as_ends(places: Any, row: int) -> Ends:
    """Return row `row` of places (m, 4) float64."""
    return Ends(float(places[row, 0]), float(places[row, 1]), float(places[row, 2]), float(places[row, 3]))


@kernel
def place_edges(starts: Any, ends: Any, low: Any, scales: Any, edges: Any, places: Any) -> None:
    """Fill edges (4 (m + 1),), as locate.py reads them, and places (m + 1, 4) of `Ends`, numbers from 1 on.

    starts, ends: (m, 2). low: (2,), half the box's lower corner. scales: (2,).
    """
    for i_edge in range(len(starts)):
        a, b = as_point2(starts, i_edge), as_point2(ends, i_edge)
        if b.y < a.y or (b.y == a.y and b.x < a.x):
            a, b = b, a
        slope = np.inf
        if a.y != b.y:
            slope = (b.x - a.x) / (b.y - a.y)
            if not abs(slope) < np.inf:
                slope = np.nan
        row = i_edge + 1
        edges[4 * row], edges[4 * row + 1], edges[4 * row + 2], edges[4 * row + 3] = a.x, a.y, b.y, slope
        places[row, 0], places[row, 1] = (a.x * 0.5 - low[0]) * scales[0], (a.y * 0.5 - low[1]) * scales[1]
        places[row, 2], places[row, 3] = (b.x * 0.5 - low[0]) * scales[0], (b.y * 0.5 - low[1]) * scales[1]


@inline
def _entries(node: Any, a: int, b: int, edges_of: Any, places: Any, step: int, is_tight: bool) -> int:
    """Return about how many entries the lists of a node cut into 2^a by 2^b have, from every step-th edge."""
    total = 0
    u_shift, v_shift = node.u_shift - a, node.v_shift - b
    column, row = node.column << a, node.row << b
    for place in range(node.first, node.stop, step):
        ends = as_ends(places, edges_of[place])
        left, right = min(ends.lower_u, ends.upper_u), max(ends.lower_u, ends.upper_u)
        columns = min(int(right) >> u_shift, column + (1 << a) - 1) - max(int(left) >> u_shift, column) + 1
        rows = min(int(ends.upper_v) >> v_shift, row + (1 << b) - 1) - max(int(ends.lower_v) >> v_shift, row) + 1
        total += columns + rows - 1 if is_tight else columns * rows
    return total * step


@kernel
def choose_cuts(
    nodes: Any, edges_of: Any, places: Any, most: Any, cells: Any, is_tight: bool, cuts: Any, flag: Any
) -> None:
    """Fill cuts (n, 2) with a, b of each node: halves where that lengthens the lists least, as long as it pays.

    edges_of: the level's list. most: (2,) largest a and b. cells: (3,) cells of a node: least, most, for each edge.
    """
    for i_node in range(len(nodes)):
        if flag[0]:
            break
        node = as_node(nodes, i_node)
        n_edges = node.stop - node.first
        step = 1 + n_edges // 4096
        a = b = 0
        for _ in range(most[0] + most[1]):
            n_cells = 2 << a + b
            if n_cells > max(cells[0], min(cells[1], cells[2] * n_edges)):
                break
            can_a, can_b = a < min(most[0], node.u_shift), b < min(most[1], node.v_shift)
            in_u = _entries(node, a + 1, b, edges_of, places, step, is_tight) if can_a else 1 << 60
            in_v = _entries(node, a, b + 1, edges_of, places, step, is_tight) if can_b else 1 << 60
            if min(in_u, in_v) > 4 * n_edges + n_cells // 4:
                break
            if in_u < in_v or (in_u == in_v and a <= b):
                a += 1
            else:
                b += 1
        cuts[i_node, 0], cuts[i_node, 1] = a, b


@inline
def _cut_of(level: Any, i_node: int) -> Cut:
    """Return how a node of a level is cut."""
    node, a, b = as_node(level.nodes, i_node), level.cuts[i_node, 0], level.cuts[i_node, 1]
    return Cut(node.column << a, node.row << b, node.u_shift - a, node.v_shift - b, 1 << a, 1 << b, level.bases[i_node])


@inline
def _rows_of(ends: Any, cut: Any) -> tuple[int, int]:
    """Return the first and last row of the cut that an edge reaches into, beyond the node's own if it does."""
    return (int(ends.lower_v) >> cut.v_shift) - cut.bottom, (int(ends.upper_v) >> cut.v_shift) - cut.bottom


@inline
def _columns_of(ends: Any, cut: Any, row: int, is_tight: bool) -> tuple[int, int]:
    """Return the first and last column that an edge may touch in a row of the cut that it reaches into, beyond the
    node's own if it does."""
    left, right = min(ends.lower_u, ends.upper_u), max(ends.lower_u, ends.upper_u)
    first, last = int(left) >> cut.u_shift, int(right) >> cut.u_shift
    if first != last and is_tight and int(ends.lower_v) >> cut.v_shift != int(ends.upper_v) >> cut.v_shift:
        width, rise = ends.upper_u - ends.lower_u, ends.upper_v - ends.lower_v
        bottom, top = float((cut.bottom + row) << cut.v_shift), float((cut.bottom + row + 1) << cut.v_shift)
        enters = ends.lower_u + max(0.0, (bottom - ends.lower_v) / rise) * width
        leaves = ends.lower_u + min(1.0, (top - ends.lower_v) / rise) * width
        least, most = max(0.0, min(enters, leaves) - 1.0), max(enters, leaves) + 1.0
        first, last = max(first, int(least) >> cut.u_shift), min(last, int(most) >> cut.u_shift)
    return first - cut.left, last - cut.left


@inline
def _note_beyond(turns: Any, node: Any, cut: Any, e: Any, ends: Any) -> None:
    """Note from which rows on an edge changes what lies to the right of the node."""
    low, high = _rows_of(ends, cut)
    if int(ends.upper_u) >> node.u_shift > node.column:
        turns[max(0, min(high + 1, cut.n_rows))] ^= 1
    elif e.low != e.high and int(ends.lower_u) >> node.u_shift > node.column:
        turns[0] ^= 1
        turns[max(0, min(low + 1, cut.n_rows))] ^= 1


@inline
def _note_in_row(sides: Any, head: int, cut: Any, columns: Any, goes_on: int, is_passed: bool) -> None:
    """Note what an edge changes in the cells of a row, at the last cell of those that it changes.

    columns: the first and last in which the edge is listed. goes_on: those before it lie left of where it goes on down.
    is_passed: it passes the lowest height of the row, so it is right of all columns before the first.
    """
    first, last = columns
    if is_passed:
        if first > 0:
            sides[head + min(first, cut.n_columns) - 1] ^= 1
        return
    stop = min(min(last + 1, goes_on), cut.n_columns)
    if max(0, first) < stop:
        sides[head + stop - 1] ^= 1
        if first > 0:
            sides[head + first - 1] ^= 1


@inline
def _add_up(sides: Any, turns: Any, cut: Any) -> None:
    """Add up what was noted: at a column it holds for it and all before it, beyond the node for all rows above."""
    beyond = 0
    for row in range(cut.n_rows):
        beyond ^= turns[row]
        side = beyond
        for word in range(cut.base + (row + 1) * cut.n_columns - 1, cut.base + row * cut.n_columns - 1, -1):
            side ^= sides[word]
            sides[word] = side


@allocating_kernel
def count_level(level: Any, counts: Any, sides: Any, flag: Any) -> None:
    """Fill counts and sides (n_words,) of the cells of all nodes of a `LevelOfNodes`; both zero before."""
    for i_node in range(len(level.nodes)):
        if flag[0]:
            break
        node, cut = as_node(level.nodes, i_node), _cut_of(level, i_node)
        turns = np.zeros(cut.n_rows + 1, np.int8)  # of what lies beyond the node, from each row on
        turns[0] = node.side
        for place in range(node.first, node.stop):
            if place & 4095 == 4095 and flag[0]:
                break
            i_edge = level.edges_of[place]
            e, ends = as_edge(level.edges, i_edge), as_ends(level.places, i_edge)
            _note_beyond(turns, node, cut, e, ends)
            low, high = _rows_of(ends, cut)
            goes_on = (int(ends.lower_u) >> cut.u_shift) - cut.left if e.low != e.high else -1  # in the columns before
            for row in range(max(0, low), min(high, cut.n_rows - 1) + 1):
                columns, head = _columns_of(ends, cut, row, level.is_tight), cut.base + row * cut.n_columns
                for column in range(max(0, columns[0]), min(columns[1], cut.n_columns - 1) + 1):
                    counts[head + column] += 1
                _note_in_row(sides, head, cut, columns, goes_on, row > low)
        _add_up(sides, turns, cut)


@kernel
def fill_level(level: Any, is_crowded: Any, next_places: Any, items: Any, next_edges: Any, flag: Any) -> None:
    """List the edges in items, or in next_edges where is_crowded (n_words,), from next_places (n_words,) on."""
    for i_node in range(len(level.nodes)):
        if flag[0]:
            break
        node, cut = as_node(level.nodes, i_node), _cut_of(level, i_node)
        for place in range(node.first, node.stop):
            if place & 4095 == 4095 and flag[0]:
                break
            i_edge = level.edges_of[place]
            e, ends = as_edge(level.edges, i_edge), as_ends(level.places, i_edge)
            low, high = _rows_of(ends, cut)
            upper = (int(ends.upper_u) >> cut.u_shift) - cut.left
            lower = (int(ends.lower_u) >> cut.u_shift) - cut.left if e.low != e.high else -1
            for row in range(max(0, low), min(high, cut.n_rows - 1) + 1):
                first, last = _columns_of(ends, cut, row, level.is_tight)
                for column in range(max(0, first), min(last, cut.n_columns - 1) + 1):
                    word = cut.base + row * cut.n_columns + column
                    there = next_places[word]
                    next_places[word] = there + 1
                    if is_crowded[word]:
                        next_edges[there] = i_edge
                    else:
                        goes_on = GOES_ON_UP if upper > column else GOES_ON_DOWN if lower > column else 0
                        items[there] = (i_edge << EDGE_SHIFT) | goes_on
