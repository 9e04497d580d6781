"""Order of the events along each edge: by float parameters where their error intervals are disjoint, else exactly.

Events at one point are united, so that edges through one point meet in one node.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

from engine.arrangement.union_find import unite
from engine.compiling.jit import called, inline
from engine.polygon_overlay.compiled.crossing_signs import Edges, order_of_crossings, orient
from engine.polygon_overlay.compiled.edge_contacts import Events, Turn, Unions
from engine.polygon_overlay.compiled.edge_tree import POLL
from engine.types import FlagArray

_RUN: Final = 16
"""Number of consecutive items sorted by insertion, before such runs are merged."""

Along = namedtuple("Along", "starts order keys spare_keys spare")
"""Events sorted along each edge: those of edge e are ``order[starts[e]:starts[e + 1]]``, and ``keys`` has their
parameters. spare_keys, spare: scratch as large as keys and order."""


@called
def compare_events(edges: Edges, events: Events, e: int, i: int, j: int) -> int:
    """Return -1, 0 or 1: along edge e, event i comes before, with or after event j. Exact."""
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
    """Return -1, 0 or 1: along edge e, vertex v, which lies on e, comes before, at or after the crossing with edge f.
    Exact."""
    side = orient(edges, f, edges.after[f], v)
    if side == 0:
        return 0
    return -1 if side == orient(edges, f, edges.after[f], e) else 1


@inline
def _order_of_vertices(edges: Edges, e: int, v: int, w: int) -> int:
    """Return -1, 0 or 1: along edge e, vertex v comes before, with or after vertex w; both lie on e. Exact."""
    x, y = edges.x, edges.y
    b = edges.after[e]
    if x[v] != x[w]:
        return -1 if (x[v] < x[w]) == (x[e] < x[b]) else 1
    if y[v] != y[w]:
        return -1 if (y[v] < y[w]) == (y[e] < y[b]) else 1
    return 0


@inline
def _sort_by_key(along: Along, first: int, last: int) -> None:
    """Sort ``along.keys[first:last]`` ascending, and ``along.order`` with it, by a stable merge sort."""
    order, keys, spare_keys, spare = along.order, along.keys, along.spare_keys, along.spare
    width = _RUN
    for low in range(first, last, width):
        for k in range(low + 1, min(low + width, last)):
            key, moving, at = keys[k], order[k], k
            while at > low and keys[at - 1] > key:  # bound: the run
                keys[at], order[at] = keys[at - 1], order[at - 1]
                at -= 1
            keys[at], order[at] = key, moving
    while width < last - first:  # bound: doubles
        for low in range(first, last, 2 * width):
            middle, high = min(low + width, last), min(low + 2 * width, last)
            i, j = low, middle
            for k in range(low, high):
                if j >= high or (i < middle and keys[i] <= keys[j]):
                    spare_keys[k], spare[k] = keys[i], order[i]
                    i += 1
                else:
                    spare_keys[k], spare[k] = keys[j], order[j]
                    j += 1
        for k in range(first, last):
            keys[k], order[k] = spare_keys[k], spare[k]
        width *= 2


@inline
def _group_events(events: Events, along: Along, n: int, n_events: int, stop: FlagArray) -> bool:
    """Bucket the n_events events by their edge in ``along``, unsorted within each of the n edges; return False if
    ``stop`` is set."""
    starts = along.starts
    starts[: n + 1] = 0
    for i in range(n_events):
        if i & POLL == 0 and stop[0]:
            return False
        starts[events.edge[i] + 1] += 1
    for e in range(n):
        starts[e + 1] += starts[e]
    for i in range(n_events - 1, -1, -1):  # each edge's part is filled from its end: starts[e + 1] comes down
        if i & POLL == 0 and stop[0]:
            return False
        e = events.edge[i]
        starts[e + 1] -= 1
        along.order[starts[e + 1]] = i
        along.keys[starts[e + 1]] = events.t[i]
    for e in range(n):  # starts[e + 1] has come down to where the part of e begins
        starts[e] = starts[e + 1]
    starts[n] = n_events
    return True


@called
def _sort_exactly(edges: Edges, events: Events, along: Along, unions: Unions, n: int, e: int) -> None:
    """Sort the events of edge e in ``along`` by exact comparisons (binary insertion), unite the points of events that
    coincide, and mark their crossings NOT_SIMPLE. n: number of vertices; crossing c is point n + c."""
    order, keys, points, first = along.order, along.keys, events.point, along.starts[e]
    for k in range(first + 1, along.starts[e + 1]):
        moving, key, low, high = order[k], keys[k], first, k
        middle, is_same = k - 1, False  # nearly sorted: the last is tested first
        while low < high:  # invariant: those before low are not after the moving one, those from high on are
            side = compare_events(edges, events, e, order[middle], moving)
            if side > 0:
                high = middle
            else:
                low, is_same = middle + 1, side == 0
            middle = (low + high) // 2
        if is_same:
            before = order[low - 1]
            for point in (points[before], points[moving]):
                if point >= n:
                    events.turn[point - n] = Turn.NOT_SIMPLE
            unite(unions.points, points[before], points[moving])
        for at in range(k, low, -1):
            order[at], keys[at] = order[at - 1], keys[at - 1]
        order[low], keys[low] = moving, key


@inline
def sort_events(
    edges: Edges, events: Events, along: Along, unions: Unions, n: int, n_events: int, stop: FlagArray
) -> bool:
    """Sort the n_events events along each of n edges into ``along``, unite points of events that coincide, and mark
    their crossings NOT_SIMPLE. Returns whether, on every edge, events are further from each other than the sum of their
    reaches (``events.reach``), and further from both ends than their own reach; False if ``stop`` is set."""
    if not _group_events(events, along, n, n_events, stop):
        return False
    starts, order, keys = along.starts, along.order, along.keys
    are_clear = True
    for e in range(n):
        first, last = starts[e], starts[e + 1]
        if last == first:
            continue
        if stop[0]:
            return False
        if last - first > 1:
            _sort_by_key(along, first, last)
        is_sorted = True
        slack, reach = events.slack[order[first]], events.reach[order[first]]
        is_clear = keys[first] > reach
        for k in range(first + 1, last):
            slack_before, slack = slack, events.slack[order[k]]
            reach_before, reach = reach, events.reach[order[k]]
            gap = keys[k] - keys[k - 1]
            is_sorted &= gap > slack + slack_before
            is_clear &= gap > reach + reach_before
        are_clear = are_clear and is_clear and 1.0 - keys[last - 1] > reach
        if not is_sorted:
            _sort_exactly(edges, events, along, unions, n, e)
    return are_clear
