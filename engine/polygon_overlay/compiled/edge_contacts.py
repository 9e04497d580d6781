"""Where the edges of rings meet: every contact decided exactly and entered as an event on the edges concerned.

    proper crossing        a point of its own, an event on both edges
    vertex in an edge      an event on that edge; the vertex becomes a node
    vertex on vertex       the two are united; both become nodes
    overlap                the ends of one inside the other, as above
    fold                   two consecutive edges in one direction: an overlap, and their common vertex a node

Points are numbered: vertices first, crossings after them. Equal points are united (the smallest number stands for
all, so a vertex where there is one), crossings through one point later, when the events of an edge are sorted.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from engine.arrangement.union_find import root_of, unite
from engine.jit import called, inline, merged
from engine.polygon_overlay.compiled.crossing_signs import Edges, orient

POLL: Final = 0x3FFF
"""Steps of some 10 to 100 ns between two looks at the flag that ends a call, as a mask of their number."""
OFTEN: Final = 0x3FF
"""The same for steps of some microseconds."""
_ANY_SLACK: Final = 4.0
"""Slack of a parameter known by its sign only: any comparison with it is made exactly."""
NOT_SIMPLE: Final = 0
LEFT: Final = 1
RIGHT: Final = 2
"""How the second edge of a crossing leaves, seen along the first; NOT_SIMPLE where floating point is not sure of that,
or the crossing is not alone."""


class Events(NamedTuple):
    """Points inside edges. edge: the edge; point: its number; other: the edge that crosses there, -1 for a vertex;
    t, slack: parameter along the edge and bound of its error; reach: how far along the edge the other one is nearer
    than the margin of clearance.py, where that is not in doubt already, and the slack. By crossing: first and second,
    its edges; turn: LEFT or RIGHT as the second leaves to that side of the first, or NOT_SIMPLE."""

    edge: Any
    point: Any
    other: Any
    t: Any
    slack: Any
    reach: Any
    first: Any
    second: Any
    turn: Any


class Unions(NamedTuple):
    """points: forest of points that are one; is_node: by vertex, uint8; rings: forest of rings that hang together."""

    points: Any
    is_node: Any
    rings: Any


@merged
def _add_event(events: Events, at: int, edge: int, point: int, other: int, t: float, slack: float) -> None:
    events.edge[at], events.point[at], events.other[at] = edge, point, other
    events.t[at], events.slack[at], events.reach[at] = t, slack, slack


@inline
def _put_vertex(edges: Edges, events: Events, unions: Unions, at: int, e: int, v: int) -> int:
    """Enter vertex v, which lies on the line of edge e, if it is in the closed edge; return the number of events."""
    x, y = edges.x, edges.y
    a, b = e, edges.after[e]
    for end in (a, b):
        if x[v] == x[end] and y[v] == y[end]:
            if v != end:
                unions.is_node[v] = unions.is_node[end] = 1
                unite(unions.points, v, end)
            return at
    if abs(x[b] - x[a]) >= abs(y[b] - y[a]):
        inside = (x[v] > x[a]) == (x[v] < x[b])
        t = (x[v] - x[a]) / (x[b] - x[a])
    else:
        inside = (y[v] > y[a]) == (y[v] < y[b])
        t = (y[v] - y[a]) / (y[b] - y[a])
    if inside:
        unions.is_node[v] = 1
        _add_event(events, at, e, v, -1, t, 2.0**-50)
        at += 1
    return at


@called
def enter_contact(
    edges: Edges, events: Events, unions: Unions, n: int, n_events: int, n_crossings: int, e: int, f: int
) -> tuple[int, int]:
    """Enter what the edges e and f have in common, decided exactly; return the numbers of events and crossings.

    n: number of vertices. There is room for four events more.
    """
    parent, rings = unions.points, unions.rings
    a, b, c, d = e, edges.after[e], f, edges.after[f]
    if b == c or d == a:  # consecutive edges: their common vertex is all, unless they fold
        tip, p, q = (b, a, d) if b == c else (a, b, c)
        x, y = edges.x, edges.y
        folds = (x[p] > x[tip]) == (x[q] > x[tip]) if x[p] != x[tip] else (y[p] > y[tip]) == (y[q] > y[tip])
        if folds and orient(edges, p, tip, q) == 0:
            unions.is_node[tip] = 1
            n_events = _put_vertex(edges, events, unions, n_events, e, q)
            n_events = _put_vertex(edges, events, unions, n_events, f, p)
        return n_events, n_crossings
    side_c, side_d = orient(edges, a, b, c), orient(edges, a, b, d)
    if side_c == side_d and side_c != 0:
        return n_events, n_crossings
    if side_c == 0 and side_d == 0:  # case: collinear; they may overlap, touch in an end, or lie apart
        known = n_events
        for v in (c, d):
            n_events = _put_vertex(edges, events, unions, n_events, e, v)
        for v in (a, b):
            n_events = _put_vertex(edges, events, unions, n_events, f, v)
        if n_events > known or root_of(parent, a) == root_of(parent, c) or root_of(parent, a) == root_of(parent, d) \
                or root_of(parent, b) == root_of(parent, c) or root_of(parent, b) == root_of(parent, d):  # fmt: skip
            unite(rings, edges.ring[e], edges.ring[f])
        return n_events, n_crossings
    side_a, side_b = orient(edges, c, d, a), orient(edges, c, d, b)
    if side_a == side_b:  # not collinear, so both are on one side
        return n_events, n_crossings
    unite(rings, edges.ring[e], edges.ring[f])
    # The lines meet in one point, which lies in both closed edges; an end of one on the other's line is that point.
    if side_c == 0:
        n_events = _put_vertex(edges, events, unions, n_events, e, c)
    elif side_d == 0:
        n_events = _put_vertex(edges, events, unions, n_events, e, d)
    if side_a == 0:
        n_events = _put_vertex(edges, events, unions, n_events, f, a)
    elif side_b == 0:
        n_events = _put_vertex(edges, events, unions, n_events, f, b)
    if side_a != 0 and side_b != 0 and side_c != 0 and side_d != 0:
        crossing = n + n_crossings
        parent[crossing] = crossing
        events.first[n_crossings], events.second[n_crossings], events.turn[n_crossings] = e, f, NOT_SIMPLE
        _add_event(events, n_events, e, crossing, f, 0.5, _ANY_SLACK)
        _add_event(events, n_events + 1, f, crossing, e, 0.5, _ANY_SLACK)
        return n_events + 2, n_crossings + 1
    return n_events, n_crossings
