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

For the stretches of two edges no more is needed than what is said of these two. So where it fails both get the mark
DOUBTFUL, and ring_certificate.py looks at what is left of edges with that mark in the rounded rings of the result:

- of two edges that are near each other, or whose contact floating point is not sure of, whatever it is, both;
- of nodes near each other on an edge, or near an end of it, that edge and all that cross it in one of them;
- of two edges in whose corner a node is near the other, both;
- an edge shorter than the margin, the one before it, and the one after it: others of a run that heads for one quadrant
  are not looked at pair by pair (edge_tree.py), and two of them are as far apart as each edge between them is long.

A vertex on an edge is a node whose distance from others is sure: the edges that meet there are in doubt by their
contact, and its reach is the slack of its parameter.

Distances are computed in floating point. An orientation is off by 3 u in each length that it multiplies, so a distance
from a line by less than 12 u; with the two vertices that move that makes 14 u. `CLEARANCE` is four times as much.
"""

from __future__ import annotations

from typing import Any, Final

from engine.jit import inline
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_contacts import POLL
from engine.polygon_overlay.compiled.edge_events import Along
from engine.polygon_overlay.compiled.edge_tree import DOUBTFUL
from engine.polygon_overlay.compiled.ring_certificate import segments_are_far

CLEARANCE: Final = 64.0 * 2.0**-52
"""The margin, in units of the largest coordinate."""


@inline
def edges_are_far(edges: Edges, e: int, f: int, margin: float) -> bool:
    """Tell whether two edges that do not meet are surely further apart than the margin."""
    return segments_are_far(edges.x, edges.y, e, edges.after[e], f, edges.after[f], margin * margin)


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
def corners_are_clear(edges: Edges, n: int, along: Along, margin: float, marks: Any, stop: Any) -> bool:
    """Tell whether the first and the last event of every edge are far enough from the edge that begins or ends there.

    along: by sort_events. Edges of corners where that is not so get the mark DOUBTFUL.
    """
    starts, keys = along.starts, along.keys
    are_clear = True
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
            are_clear = False
            marks[before] |= DOUBTFUL
            marks[e] |= DOUBTFUL
        if not _corner_is_clear(edges, after, 1.0 - keys[last - 1], share_after, margin):
            are_clear = False
            marks[e] |= DOUBTFUL
            marks[after] |= DOUBTFUL
    return are_clear
