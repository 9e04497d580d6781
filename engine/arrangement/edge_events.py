"""The events of each edge in their order along it: floating point where intervals are apart, else exactly.

Events that turn out to be one point are united, so that lines through one point meet in one node.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrangement.crossing_signs import Edges, order_of_crossings, orient
from engine.arrangement.edge_contacts import Events, unite
from engine.jit import inline, merged

_FEW: Final = 24
"""Events that are sorted by insertion at once; more are brought into their approximate order before."""


@merged
def compare_events(edges: Edges, events: Events, e: int, i: int, j: int) -> int:
    """Return -1, 0 or 1 as event i of edge e comes before, with or after event j."""
    gap = events.t[i] - events.t[j]
    slack = events.slack[i] + events.slack[j]
    if gap > slack:
        return 1
    if -gap > slack:
        return -1
    f, g = events.other[i], events.other[j]
    if f >= 0 and g >= 0:
        return 0 if f == g else order_of_crossings(edges, e, f, g)
    if g >= 0:
        return _vertex_before_crossing(edges, e, events.point[i], g)
    if f >= 0:
        return -_vertex_before_crossing(edges, e, events.point[j], f)
    return _order_of_vertices(edges, e, events.point[i], events.point[j])


@inline
def _vertex_before_crossing(edges: Edges, e: int, v: int, f: int) -> int:
    """Return -1, 0 or 1 as vertex v on edge e comes before, at or after the crossing with edge f."""
    side = orient(edges, f, edges.after[f], v)
    if side == 0:
        return 0
    return -1 if side == orient(edges, f, edges.after[f], e) else 1


@inline
def _order_of_vertices(edges: Edges, e: int, v: int, w: int) -> int:
    x, y = edges.x, edges.y
    b = edges.after[e]
    if x[v] != x[w]:
        return -1 if (x[v] < x[w]) == (x[e] < x[b]) else 1
    if y[v] != y[w]:
        return -1 if (y[v] < y[w]) == (y[e] < y[b]) else 1
    return 0


@inline
def sort_events(
    edges: Edges, events: Events, n: int, n_events: int, parent: Any, starts: Any, order: Any, stop: Any
) -> None:
    """Fill ``starts``, (n + 1,), and ``order``: events ``order[starts[e]:starts[e + 1]]`` lie along edge e.

    Unites events at one point in ``parent``.
    """
    starts[: n + 1] = 0
    for i in range(n_events):
        starts[events.edge[i] + 1] += 1
    for e in range(n):
        starts[e + 1] += starts[e]
    for i in range(n_events - 1, -1, -1):  # each edge's part is filled from its end: starts[e + 1] comes down
        e = events.edge[i]
        starts[e + 1] -= 1
        order[starts[e + 1]] = i
    for e in range(n):  # starts[e + 1] has come down to where the part of e begins
        starts[e] = starts[e + 1]
    starts[n] = n_events
    for e in range(n):
        first, last = starts[e], starts[e + 1]
        if last - first < 2:
            continue
        if stop[0]:
            return
        if last - first > _FEW:
            here = order[first:last].copy()
            order[first:last] = here[np.argsort(events.t[here])]
        for k in range(first + 1, last):
            moving = order[k]
            at = k
            while at > first:  # bound: the part sorted so far
                side = compare_events(edges, events, e, order[at - 1], moving)
                if side == 0:
                    unite(parent, events.point[order[at - 1]], events.point[moving])
                if side <= 0:
                    break
                order[at] = order[at - 1]
                at -= 1
            order[at] = moving
