"""Noding: all intersections of edges, decided exactly, as events on the edges concerned.

Narrow phase: pairs of edges whose boxes intersect pass a float filter; exact signs decide the rest.

| contact | result |
| --- | --- |
| proper crossing | a point of its own, an event on both edges |
| vertex on an edge | an event on that edge; the vertex becomes a node |
| vertex on vertex | the two are united; both become nodes |
| overlap | the ends of one inside the other, as above |
| fold | two consecutive edges in one direction: an overlap, and their common vertex a node |

Whether disjoint edges are further apart than a margin is decided in floating point: the margins of clearance.py cover
its errors. Points are numbered, vertices first, then crossings; equal points are united under the smallest number,
crossings through one point when the events of an edge are sorted.

Source: the dual traversal of C. Ericson, Real-Time Collision Detection, 2005; signs after J. R. Shewchuk, 1997.
"""

from __future__ import annotations

from collections import namedtuple
from enum import IntEnum
from typing import Final, NamedTuple

import numpy as np

from engine.arrangement.union_find import root_of, unite
from engine.compiling.jit import called, inline, merged
from engine.polygon_overlay.compiled.crossing_signs import Edges, orient
from engine.polygon_overlay.compiled.edge_tree import BENT, BoxTree, begin_pairs, next_pairs
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.types import FlagArray, FloatArray


@merged
def is_far(px: float, py: float, ax: float, ay: float, bx: float, by: float, square: float) -> bool:
    """Return whether the distance of point p from the segment ab is above ``sqrt(square)``; in floating point, not
    proven."""
    dx, dy, ex, ey = bx - ax, by - ay, px - ax, py - ay
    along, length = ex * dx + ey * dy, dx * dx + dy * dy
    if along <= 0.0:
        return ex * ex + ey * ey > square
    if along >= length:
        ex, ey = px - bx, py - by
        return ex * ex + ey * ey > square
    across = dx * ey - dy * ex
    return across * across > square * length


@merged
def _are_on_one_side(x: FloatArray, y: FloatArray, a: int, b: int, c: int, d: int, square: float) -> bool:
    """Return whether vertices c and d are on one side of the line ab, each further from it than ``sqrt(square)``; in
    floating point."""
    dx, dy = x[b] - x[a], y[b] - y[a]
    side_c, side_d = dx * (y[c] - y[a]) - dy * (x[c] - x[a]), dx * (y[d] - y[a]) - dy * (x[d] - x[a])
    nearest = min(abs(side_c), abs(side_d))
    return ((side_c > 0.0) == (side_d > 0.0)) & (nearest * nearest > square * (dx * dx + dy * dy))


@merged
def _crosses(x: FloatArray, y: FloatArray, a: int, b: int, c: int, d: int) -> bool:
    """Return whether the segments ab and cd of vertices cross properly, by signs of floating-point orientations (not
    proven)."""
    dx, dy = x[b] - x[a], y[b] - y[a]
    side_c, side_d = dx * (y[c] - y[a]) - dy * (x[c] - x[a]), dx * (y[d] - y[a]) - dy * (x[d] - x[a])
    if (side_c > 0.0) == (side_d > 0.0):
        return False
    dx, dy = x[d] - x[c], y[d] - y[c]
    side_a, side_b = dx * (y[a] - y[c]) - dy * (x[a] - x[c]), dx * (y[b] - y[c]) - dy * (x[b] - x[c])
    return (side_a > 0.0) != (side_b > 0.0)


@called
def segments_are_far(x: FloatArray, y: FloatArray, a: int, b: int, c: int, d: int, square: float) -> bool:
    """Return whether the distance of the segments ab and cd of vertices is above ``sqrt(square)``; in floating point,
    not proven."""
    if _are_on_one_side(x, y, a, b, c, d, square) or _are_on_one_side(x, y, c, d, a, b, square):
        return True
    return (
        is_far(x[b], y[b], x[c], y[c], x[d], y[d], square)
        and is_far(x[d], y[d], x[a], y[a], x[b], y[b], square)
        and is_far(x[a], y[a], x[c], y[c], x[d], y[d], square)
        and is_far(x[c], y[c], x[a], y[a], x[b], y[b], square)
        and not _crosses(x, y, a, b, c, d)
    )


_ANY_SLACK: Final = 4.0
"""Slack of a parameter known by its sign only: larger than any difference of parameters, so all comparisons are exact.
"""


class Turn(IntEnum):
    """The side to which the second edge of a crossing leaves, seen along the first edge."""

    NOT_SIMPLE = 0
    """Not proven by floating point, or other edges pass through the same point."""
    LEFT = 1
    RIGHT = 2


Events = namedtuple("Events", "edge point other t slack reach first second turn")
"""Points inside edges.

| field | by | meaning |
| --- | --- | --- |
| edge, point | event | the edge; the number of the point |
| other | event | the edge that crosses there, -1 for a vertex |
| t, slack | event | parameter along the edge, and its error bound |
| reach | event | slack + the length along the edge within which the other edge is nearer than the margin |
| first, second, turn | crossing | its edges; a `Turn` |
"""

Unions = namedtuple("Unions", "points is_node rings")
"""points: union-find forest of equal points; is_node: by vertex, uint8, 1 if another edge meets it or a ring begins
there; rings: union-find forest of rings that touch."""


@merged
def _add_event(events: Events, at: int, edge: int, point: int, other: int, t: float, slack: float) -> None:
    """Write event number ``at``: edge ``edge`` passes point ``point`` at parameter t, known to +- slack. other: the
    edge that crosses there, -1 for a vertex."""
    events.edge[at], events.point[at], events.other[at] = edge, point, other
    events.t[at], events.slack[at], events.reach[at] = t, slack, slack


@inline
def _add_vertex_on_edge_event(edges: Edges, events: Events, unions: Unions, at: int, e: int, v: int) -> int:
    """Write event number ``at`` if vertex v lies inside edge e, or unite v with an end of e that equals it; return the
    number of events then. Caller guarantees that v lies on the line of e."""
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
def _add_contact(
    edges: Edges, events: Events, unions: Unions, n: int, n_events: int, n_crossings: int, e: int, f: int
) -> tuple[int, int]:
    """Append the events of all common points of edges e and f, decided exactly; return the numbers of events and
    crossings then, of which there are n_events and n_crossings before. n: number of vertices. Caller guarantees room
    for four more events."""
    parent, rings = unions.points, unions.rings
    a, b, c, d = e, edges.after[e], f, edges.after[f]
    if b == c or d == a:  # consecutive edges: their common vertex is all, unless they fold
        tip, p, q = (b, a, d) if b == c else (a, b, c)
        x, y = edges.x, edges.y
        folds = (x[p] > x[tip]) == (x[q] > x[tip]) if x[p] != x[tip] else (y[p] > y[tip]) == (y[q] > y[tip])
        if folds and orient(edges, p, tip, q) == 0:
            unions.is_node[tip] = 1
            n_events = _add_vertex_on_edge_event(edges, events, unions, n_events, e, q)
            n_events = _add_vertex_on_edge_event(edges, events, unions, n_events, f, p)
        return n_events, n_crossings
    side_c, side_d = orient(edges, a, b, c), orient(edges, a, b, d)
    if side_c == side_d and side_c != 0:
        return n_events, n_crossings
    if side_c == 0 and side_d == 0:  # case: collinear; they may overlap, touch in an end, or lie apart
        n_before = n_events
        for v in (c, d):
            n_events = _add_vertex_on_edge_event(edges, events, unions, n_events, e, v)
        for v in (a, b):
            n_events = _add_vertex_on_edge_event(edges, events, unions, n_events, f, v)
        if n_events > n_before or root_of(parent, a) == root_of(parent, c) or root_of(parent, a) == root_of(parent, d) \
                or root_of(parent, b) == root_of(parent, c) or root_of(parent, b) == root_of(parent, d):  # fmt: skip
            unite(rings, edges.ring[e], edges.ring[f])
        return n_events, n_crossings
    side_a, side_b = orient(edges, c, d, a), orient(edges, c, d, b)
    if side_a == side_b:  # not collinear, so both are on one side
        return n_events, n_crossings
    unite(rings, edges.ring[e], edges.ring[f])
    # The lines meet in one point, which lies in both closed edges; an end of one on the other's line is that point.
    if side_c == 0:
        n_events = _add_vertex_on_edge_event(edges, events, unions, n_events, e, c)
    elif side_d == 0:
        n_events = _add_vertex_on_edge_event(edges, events, unions, n_events, e, d)
    if side_a == 0:
        n_events = _add_vertex_on_edge_event(edges, events, unions, n_events, f, a)
    elif side_b == 0:
        n_events = _add_vertex_on_edge_event(edges, events, unions, n_events, f, b)
    if side_a != 0 and side_b != 0 and side_c != 0 and side_d != 0:
        crossing = n + n_crossings
        parent[crossing] = crossing
        events.first[n_crossings], events.second[n_crossings], events.turn[n_crossings] = e, f, Turn.NOT_SIMPLE
        _add_event(events, n_events, e, crossing, f, 0.5, _ANY_SLACK)
        _add_event(events, n_events + 1, f, crossing, e, 0.5, _ANY_SLACK)
        return n_events + 2, n_crossings + 1
    return n_events, n_crossings


class Contacts(NamedTuple):
    """Result of noding. n_events: number of events, -1 if they exceed the room; n_crossings: number of proper
    crossings; n_exact: number of edge pairs decided exactly; are_far: all edges without a common point are further
    apart than the margin, and all contacts are proper crossings."""

    n_events: int
    n_crossings: int
    n_exact: int
    are_far: bool


class Turns(NamedTuple):
    """Orientations of two vertices c, d at a segment ab, in floating point. first: orient2d(a, b, c); second:
    orient2d(a, b, d); bound: on the error of both; length: ``|dx| + |dy|`` of ab."""

    first: float
    second: float
    bound: float
    length: float


@merged
def turns(x: FloatArray, y: FloatArray, a: int, b: int, c: int, d: int) -> Turns:
    """Return the orientations of vertices c and d relative to the segment ab of vertices, with their error bound."""
    i, j, k, m = np.uint64(a), np.uint64(b), np.uint64(c), np.uint64(d)  # unsigned: no check for negative indices
    ux, uy = x[j] - x[i], y[j] - y[i]
    left, right = ux * (y[k] - y[i]), uy * (x[k] - x[i])
    far_left, far_right = ux * (y[m] - y[i]), uy * (x[m] - x[i])
    size = max(abs(left) + abs(right), abs(far_left) + abs(far_right))
    return Turns(left - right, far_left - far_right, BOUND_2D * size + GUARD_2D, abs(ux) + abs(uy))


@merged
def smaller_turn(pair: Turns) -> float:
    """Return the smaller magnitude of two turns."""
    return min(abs(pair.first), abs(pair.second))


@merged
def same_sign(pair: Turns) -> bool:
    """Return whether both turns have the same sign; proven if their magnitudes exceed the bound."""
    return (pair.first > 0.0) == (pair.second > 0.0)


@inline
def find_contacts(
    edges: Edges, n: int, n_rings: int, margin: float, events: Events, unions: Unions, tree: BoxTree, stop: FlagArray
) -> Contacts:
    """Node the edges: write the contacts of n edges in n_rings rings to ``events`` (crossings, and vertices on edges),
    and fill ``unions``. margin: the distance that `Contacts.are_far` compares with. tree: over the boxes of the edges,
    enlarged by the margin."""
    for i in range(n):
        unions.points[i] = i
    unions.is_node[:n] = 0
    for ring in range(n_rings):
        unions.rings[ring] = ring
    room = min(events.edge.shape[0] - 4, 2 * (events.first.shape[0] - 1))
    x, y, after, pairs = edges.x, edges.y, edges.after, tree.pairs
    n_events = n_crossings = n_exact = 0
    are_far = True
    depth = begin_pairs(tree)
    while depth > 0 and not stop[0]:  # bound: the walk through the tree
        n_pairs, depth = next_pairs(tree, n, depth)
        for k in range(n_pairs):
            i, j = pairs[k, 0], pairs[k, 1]
            b, d = after[i], after[j]
            if b == j and tree.marks[j] & BENT:
                continue
            to_j = turns(x, y, i, b, j, d)
            nearest = smaller_turn(to_j)
            if same_sign(to_j) and nearest > margin * to_j.length and nearest > to_j.bound:
                continue
            if n_events > room:
                return Contacts(-1, 0, 0, False)
            if (b == j and abs(to_j.second) > to_j.bound) or (d == i and abs(to_j.first) > to_j.bound):
                continue  # consecutive edges that are not in line
            if b != j and d != i:
                to_i = turns(x, y, j, d, i, b)
                nearest_i = smaller_turn(to_i)
                is_apart = same_sign(to_i) and nearest_i > to_i.bound
                if is_apart or (same_sign(to_j) and nearest > to_j.bound):  # no contact
                    is_far = is_apart and nearest_i > margin * to_i.length
                    are_far = are_far and (is_far or segments_are_far(x, y, i, b, j, d, margin * margin))
                    continue
                if nearest > to_j.bound and nearest_i > to_i.bound:
                    unite(unions.rings, edges.ring[i], edges.ring[j])
                    unions.points[n + n_crossings] = n + n_crossings
                    events.turn[n_crossings] = (
                        Turn.LEFT if to_i.first > 0.0 else Turn.RIGHT
                    )  # edge i comes from j's left
                    events.first[n_crossings], events.second[n_crossings] = i, j
                    _add_crossing(events, n_events, n + n_crossings, i, j, to_i, margin)
                    _add_crossing(events, n_events + 1, n + n_crossings, j, i, to_j, margin)
                    n_events, n_crossings = n_events + 2, n_crossings + 1
                    continue
            n_events, n_crossings = _add_contact(edges, events, unions, n, n_events, n_crossings, i, j)
            n_exact += 1
            are_far = are_far and (b == j or d == i) and not unions.is_node[b if b == j else i]  # else they fold
    return Contacts(n_events, n_crossings, n_exact, are_far)


@merged
def _add_crossing(events: Events, at: int, crossing: int, edge: int, other: int, ends: Turns, margin: float) -> None:
    """Write event number ``at``: a proper crossing on ``edge``, proven by floats. crossing: its point; other: the other
    edge; margin: added to the reach; ends: orientations A, B of the two ends of ``edge`` relative to ``other``. ``t =
    |A| / (|A| + |B|)``; with A and B off by at most r, ``error <= r / (|A| + |B|) + 3 roundings``.
    """
    total = abs(ends.first) + abs(ends.second)
    _add_event(events, at, edge, crossing, other, abs(ends.first) / total, ends.bound / total + 2.0**-50)
    events.reach[at] += margin * ends.length / total
