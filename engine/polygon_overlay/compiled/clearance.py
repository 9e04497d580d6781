"""Whether edges keep clear of each other: then rounding crossings to doubles cannot change what rings are.

Every crossing moves by less than the unit u of the largest coordinate, every vertex stays. Rings of the arrangement
stay what they are if, by a margin of some units,

- two edges that have no point in common are apart;
- on an edge that crosses another in X, every node but X is away from the other's line: the distance from that line
  grows evenly from X on, so it is enough that the nodes next to X (the ends of the edge among them) are;
- where edges follow each other, the nodes next to their common vertex are away from the other edge.

Then any two stretches between nodes are apart, or meet in a node and the far end of each is away from the other, on the
whole way to their rounded places: no stretch touches, passes or folds onto another. This holds for all edges, so for
those of any result.

No edge may be shorter than the margin either: those of a run that heads for one quadrant are not looked at pair by pair
(edge_tree.py), and two of them are as far apart as each edge between them is long.

Where that leaves doubt, the rounded rings of the result are looked at themselves. Every vertex moves by less than the
unit u of the largest coordinate, on a straight way. Two edges that have no vertex in common cannot touch on that way if
they end more than 2 u apart; nor can two edges fold that have one in common, if the far end of each ends more than 2 u
away from the other. If that holds for every pair with a vertex that moves, the rings after rounding
are the exact ones deformed without a touch: valid, with the same pieces, holes and turns.

Distances are computed in floating point. Differences of rounded coordinates are off by u each, so the distance from a
line by less than 12 u more: `MARGIN` = 16 holds both. Before rounding an orientation is off by 3 u in each length that
it multiplies, so a distance from a line by less than 12 u; with the two vertices that move that makes 14 u. `CLEARANCE`
is four times as much.
"""

from __future__ import annotations

from typing import Final

from engine.arrays import FlagArray, FloatArray, Int32Array
from engine.compiling.jit import inline, merged
from engine.polygon_overlay.compiled.boundary.chain_rings import MEETS, Rings
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_contacts import is_far, segments_are_far
from engine.polygon_overlay.compiled.edge_events import Along
from engine.polygon_overlay.compiled.edge_tree import (
    ANYWHERE,
    FEW,
    POLL,
    RUN,
    BoxTree,
    begin_pairs,
    build_tree,
    next_pairs,
)
from engine.polygon_overlay.compiled.rounded_crossings import Rounded
from engine.predicates.orientation import orient2d
from engine.types import Point2

CLEARANCE: Final = 64.0 * 2.0**-52
MARGIN: Final = 16.0 * 2.0**-52
"""The margins before rounding, and after it, in units of the largest coordinate."""


@inline
def _corner_is_clear(edges: Edges, v: int, share_before: float, share_after: float, margin: float) -> bool:
    """Tell whether the nodes next to vertex v are away from the other edge there.

    share_before, share_after: which part of the edge before v, and of that after it, lies between v and the next node.
    """
    x, y = edges.x, edges.y
    p, q = edges.before[v], edges.after[v]
    ux, uy, wx, wy = x[p] - x[v], y[p] - y[v], x[q] - x[v], y[q] - y[v]
    if ux * wx + uy * wy <= 0.0:  # v is what is nearest to each
        return share_before * max(abs(ux), abs(uy)) > margin and share_after * max(abs(wx), abs(wy)) > margin
    turn = abs(ux * wy - uy * wx)
    return share_before * turn > margin * (abs(wx) + abs(wy)) and share_after * turn > margin * (abs(ux) + abs(uy))


@inline
def corners_are_clear(edges: Edges, n: int, along: Along, margin: float, stop: FlagArray) -> bool:
    """Tell whether the first and the last event of every edge are far enough from the edge that begins or ends there.

    along: by sort_events.
    """
    starts, keys = along.starts, along.keys
    for e in range(n):
        if e & POLL == 0 and stop[0]:
            return False
        first, last = starts[e], starts[e + 1]
        if first == last:
            continue
        before, after = edges.before[e], edges.after[e]
        share_before = share_after = 1.0
        if starts[before] < starts[before + 1]:
            share_before = 1.0 - keys[starts[before + 1] - 1]
        if starts[after] < starts[after + 1]:
            share_after = keys[starts[after]]
        if not _corner_is_clear(edges, e, share_before, keys[first], margin):
            return False
        if not _corner_is_clear(edges, after, 1.0 - keys[last - 1], share_after, margin):
            return False
    return True


@merged
def _is_apart(points: Int32Array, x: FloatArray, y: FloatArray, a: int, b: int, c: int, d: int, square: float) -> bool:
    """Tell whether the edges ab and cd cannot touch, or fold, on the way to their rounded places."""
    if points[a] == points[d]:
        c, d = d, c
    elif points[b] == points[c]:
        a, b = b, a
    elif points[b] == points[d]:
        a, b, c, d = b, a, d, c
    elif points[a] != points[c]:
        return segments_are_far(x, y, a, b, c, d, square)
    if points[b] == points[d]:  # one edge, of two parts
        return True
    return is_far(x[b], y[b], x[c], y[c], x[d], y[d], square) and is_far(x[d], y[d], x[a], y[a], x[b], y[b], square)


@inline
def has_straight_point(rings: Rings, n_rings: int, rounded: Rounded, stop: FlagArray) -> bool:
    """Tell whether rounding put a point, one where rings do not meet, on a straight line with its neighbours."""
    x, y, moved = rounded.x, rounded.y, rounded.moved
    for ring in range(n_rings):
        first, last = rings.offset[ring], rings.offset[ring + 1]
        i, j = last - 2, last - 1
        for k in range(first, last):
            if k & POLL == 0 and stop[0]:
                return True
            if (moved[i] | moved[j] | moved[k]) and not rings.meets[j] & (MEETS | RUN):
                if orient2d(Point2(x[i], y[i]), Point2(x[j], y[j]), Point2(x[k], y[k])) == 0:
                    return True
            i, j = j, k
    return False


@inline
def certify(
    rings: Rings, n_rings: int, n: int, rounded: Rounded, tree: BoxTree, tails: Int32Array, heads: Int32Array,
    stop: FlagArray,
) -> bool:  # fmt: skip
    """Tell whether the rings are certainly valid after rounding, no edges near each other that do not meet.

    n: points of ``rings``. tree, tails, heads: scratch for as many. What is left out (RUN) is away from all that moves.
    """
    x, y, moved, boxes, pairs = rounded.x, rounded.y, rounded.moved, tree.boxes, tree.pairs
    largest = 0.0
    for k in range(n):
        largest = max(largest, abs(x[k]), abs(y[k]))
    margin = MARGIN * largest
    square = margin * margin
    n_edges = 0
    for ring in range(n_rings):
        first, last = rings.offset[ring], rings.offset[ring + 1]
        for k in range(first, last):
            if k & POLL == 0 and stop[0]:
                return False
            if rings.meets[k] & RUN:
                continue
            j = k + 1 if k + 1 < last else first
            tails[n_edges], heads[n_edges], tree.marks[n_edges] = k, j, ANYWHERE
            boxes[n_edges, 0], boxes[n_edges, 1] = min(x[k], x[j]) - margin, max(x[k], x[j]) + margin
            boxes[n_edges, 2], boxes[n_edges, 3] = min(y[k], y[j]) - margin, max(y[k], y[j]) + margin
            n_edges += 1
    if n_edges > FEW:
        build_tree(tree, n_edges, stop)
    depth = begin_pairs(tree)
    while depth > 0:  # bound: the walk through the tree
        if stop[0]:
            return False
        found, depth = next_pairs(tree, n_edges, depth)
        for k in range(found):
            i, j = pairs[k, 0], pairs[k, 1]
            a, b, c, d = tails[i], heads[i], tails[j], heads[j]
            if (moved[a] | moved[b] | moved[c] | moved[d]) and not _is_apart(rings.point, x, y, a, b, c, d, square):
                return False
    return True
