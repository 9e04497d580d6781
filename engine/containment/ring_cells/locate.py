"""Polygon by cells: a point's side is the side kept of its cell, changed by the few edges that are listed there.

**Sides.** Take the ray from q to the right, as in polygon_ray_parity.py, and a cell, on whose row of cells lies q. An
edge that is not listed in the cell is, as far as it runs in this row, wholly to the left (never met) or wholly to the
right: met if low <= y < high. So the edges to the right change what they add at the heights of their ends only, and
those cancel where both edges of a vertex are not listed. Where one is, or both are, let the listed edge go on for ever
beyond a vertex that lies in a column to the right: an edge that reaches it as its upper end counts for all y above as
well, one that leaves it upward for all y below. With two edge ends at a vertex, what is not listed plus what goes on is
even there, so that

    side(q) = side of the cell  xor  (crossings of the ray with the listed edges, made longer so)

holds with one constant for the whole cell (build.py finds it by counting, without any arithmetic that
rounds). A horizontal edge has its right end as the upper one.

      |  cell   |   b
      | q- - - -|- / - ; - ->     Of a and b, which share a vertex v, only a is listed in the cell. Below v the ray
      |         | v  ;            meets a. Above v it meets b, but the list knows a only, made longer (;): it is met
      | q- - - -|/- - - - - ->    once at either height, so the side kept of the cell is the same for both.
      |        a|
      |       / |

**The filter.** An edge is (x, low, high, slope): x at its lower end, slope = dx / dy. q is to its left if
p = slope (q.y - low) is above s = q.x - x. With u = 2^-53 the slope carries 3 u, so p is off by less than 5.1 u |p| and
s by u |s|. |s| <= W, the width of the polygon's box, for every q in the box. Between low and high |p| <= W too, and
p - s is off by less than 7 u W. Beyond them only a lengthened edge is asked, whose p is positive and above s if exact:
up to p = 4 W the error stays below 22 u W, farther on p - s is clearly positive. `band` is 32 u W, plus what underflow
may cost (2^-1075 each for slope and product, the first times q.y - low). A slope that overflows is NaN, which is never
sure; that of a horizontal edge is infinite: above it p is infinite and right, at its height NaN. A point that is not
sure, with a q.y from low to high included, is left UNDECIDED for the exact ray: so are all points on an edge or vertex.

**Walking.** A point's place in a grid of 2^30 by 2^30 is two integers; a cell at any depth is what a shift leaves of
them. A word is a leaf, which holds its side and its list, or names 2^a by 2^b words below. Points go in blocks, each
step for all of them: no step waits for the memory or the comparison of the point before.

Source: the parity is Shimrat's, 1962; new here are the lengthened edges.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import FlagArray, FloatArray, Int32Array
from engine.containment.posed.filters import NOT_FINITE, has_not_finite
from engine.jit import allocating_kernel, inline, merged
from engine.predicates.vectors import as_point2
from engine.types import UNDECIDED

FINE_BITS: Final = 30
"""Depth of the finest grid."""
SIDE: Final = 1
"""Bit of a leaf's word: its side. The bits above are the place of its list in `items`, 0 for none."""
SPLIT_BITS: Final = 3
"""Bits of ~word, lowest first: a, b, then the place of the first of 2^(a + b) words."""
LAST: Final = 1
"""Bits of an item below the number of its edge."""
GOES_ON_UP: Final = 2
GOES_ON_DOWN: Final = 4
EDGE_SHIFT: Final = 3
_BLOCK: Final = 256


class RingCells(NamedTuple):
    """What `locate_by_ring_cells` reads."""

    edges: FloatArray
    """``(4 m,)``: x, low, high, slope of each; edge 0 is one that is never sure."""
    words: Int32Array
    """Those of the topmost cells, row by row, one for the points out of the box, then those below."""
    items: Int32Array
    """Listed edges, each list ended by LAST; list 0 is not read, list 1 is never sure."""
    box: tuple[float, float, float, float]
    """xmin, xmax, ymin, ymax."""
    u_scale: float
    """Fine cells a halved unit of x."""
    v_scale: float
    u_bits: int
    """Topmost columns are 2^u_bits."""
    v_bits: int
    band: float


class Edge(NamedTuple):
    """An edge that goes up from (x, low) to height high."""

    x: float
    low: float
    high: float
    slope: float


class _Block(NamedTuple):
    """Points that go together, (256,) each: their coordinates, fine places, words found and states."""

    xs: FloatArray
    ys: FloatArray
    us: Int32Array
    vs: Int32Array
    found: Int32Array
    states: FlagArray
    """Side, and one bit above for a point that is not sure."""
    waiting: Any
    """uint32: the points that wait for the next step, and the place in `items` of each."""
    places: Any


@inline
def as_edge(edges: Any, row: int) -> Edge:
    """Return edge `row` of edges (4 m,) float64. An unsigned row saves the compiler the care for negative ones."""
    first = np.uint32(4 * row)
    return Edge(
        float(edges[first]), float(edges[first + np.uint32(1)]), float(edges[first + np.uint32(2)]),
        float(edges[first + np.uint32(3)]),
    )  # fmt: skip


@merged
def _place(cells: Any, block: Any, count: int) -> None:
    """Find the fine place of each point of a block, and the number of its topmost cell."""
    x_min, x_max, y_min, y_max = cells.box
    x_half, y_half, u_scale, v_scale = x_min * 0.5, y_min * 0.5, cells.u_scale, cells.v_scale
    u_bits, u_shift, v_shift = cells.u_bits, FINE_BITS - cells.u_bits, FINE_BITS - cells.v_bits
    outside = 1 << cells.u_bits + cells.v_bits
    for k in range(count):
        x, y = block.xs[k], block.ys[k]
        is_out = (x < x_min) | (x > x_max) | (y < y_min) | (y > y_max)
        u = np.int32((min(max(x, x_min), x_max) * 0.5 - x_half) * u_scale)
        v = np.int32((min(max(y, y_min), y_max) * 0.5 - y_half) * v_scale)
        block.us[k], block.vs[k] = u, v
        block.found[k] = outside if is_out else ((v >> v_shift) << u_bits) + (u >> u_shift)


@merged
def _enter(cells: Any, block: Any, count: int) -> int:
    """Look up the words of the topmost cells; returns how many points wait for more than the side kept there."""
    words, found, states, waiting = cells.words, block.found, block.states, block.waiting
    n_waiting = 0
    for k in range(count):
        word = words[np.uint32(found[k])]
        found[k], states[k] = word, word & SIDE
        waiting[np.uint32(n_waiting)] = k
        n_waiting += (word < 0) | (word > SIDE)
    return n_waiting


@merged
def _walk_down(cells: Any, block: Any, n_waiting: int) -> int:
    """Go down to the leaf of each point that waits; returns how many of the leaves have a list."""
    words, waiting, places, us, vs = cells.words, block.waiting, block.places, block.us, block.vs
    u_shift, v_shift = FINE_BITS - cells.u_bits, FINE_BITS - cells.v_bits
    n_listed = 0
    for i_waiting in range(n_waiting):
        k = waiting[i_waiting]
        word, u_below, v_below = block.found[k], u_shift, v_shift
        while word < 0:  # bound: each turn takes at least one bit of 60
            a, b = ~word & 7, ~word >> SPLIT_BITS & 7
            u_below -= a
            v_below -= b
            row, column = vs[k] >> v_below & (1 << b) - 1, us[k] >> u_below & (1 << a) - 1
            word = words[np.uint32((~word >> 2 * SPLIT_BITS) + (row << a) + column)]
        block.states[k] = word & SIDE
        waiting[np.uint32(n_listed)], places[np.uint32(n_listed)] = k, word >> 1
        n_listed += word > SIDE
    return n_listed


@merged
def _take_edges(cells: Any, block: Any, n_waiting: int) -> int:
    """Let one listed edge change the state of each point that waits; returns how many have more to come."""
    edges, items, band = cells.edges, cells.items, cells.band
    xs, ys, states, waiting, places = block.xs, block.ys, block.states, block.waiting, block.places
    n_listed = 0
    for i_waiting in range(n_waiting):
        k, place = waiting[i_waiting], places[i_waiting]
        item = items[place]
        e, x, y = as_edge(edges, item >> EDGE_SHIFT), xs[k], ys[k]
        ahead = e.slope * (y - e.low) - (x - e.x)
        is_above = (y >= e.low) | (item & GOES_ON_DOWN != 0)
        is_below = (y < e.high) | (item & GOES_ON_UP != 0)
        is_passed = is_above & is_below & (ahead > 0.0)
        is_unsure = is_above & (is_below | (y == e.high)) & (not abs(ahead) > band)
        states[k] = (states[k] ^ np.uint8(is_passed)) | (np.uint8(is_unsure) << 1)
        waiting[np.uint32(n_listed)], places[np.uint32(n_listed)] = k, place + np.uint32(1)
        n_listed += item & LAST == 0
    return n_listed


@allocating_kernel
def locate_by_ring_cells(points: Any, cells: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 2) from a `RingCells`; returns how many are open, or NOT_FINITE."""
    if has_not_finite(points):
        return NOT_FINITE
    xs, ys, states = np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK, np.uint8)
    us, vs, found = np.empty(_BLOCK, np.int32), np.empty(_BLOCK, np.int32), np.empty(_BLOCK, np.int32)
    waiting, places = np.empty(_BLOCK, np.uint32), np.empty(_BLOCK, np.uint32)
    block = _Block(xs, ys, us, vs, found, states, waiting, places)
    n_open = 0
    for start in range(0, len(points), _BLOCK):
        count = min(_BLOCK, len(points) - start)
        for k in range(count):
            q = as_point2(points, start + k)
            xs[k], ys[k] = q.x, q.y
        _place(cells, block, count)
        n_waiting = _walk_down(cells, block, _enter(cells, block, count))
        while n_waiting > 0:  # bound: the length of the longest list
            if flag[0]:
                return n_open
            n_waiting = _take_edges(cells, block, n_waiting)
        for k in range(count):
            is_unsure = states[k] > SIDE
            locations[start + k] = UNDECIDED if is_unsure else 2 * np.int8(states[k]) - 1
            n_open += is_unsure
    return n_open
