"""All contacts of the edges of rings: pairs whose boxes meet, decided by floating point where it is sure."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.arrangement.union_find import unite
from engine.jit import inline, merged
from engine.polygon_overlay.compiled.clearance import edges_are_far
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_contacts import LEFT, RIGHT, Events, Unions, enter_contact
from engine.polygon_overlay.compiled.edge_tree import DOUBTFUL, BoxTree, begin_pairs, boxes_meet, next_pairs
from engine.predicates.orientation import BOUND_2D, GUARD_2D


class Contacts(NamedTuple):
    """How many events (-1: no room), crossings, and pairs that floating point left to exact signs; are_far: all edges
    that do not meet are further apart than the margin, and all contacts are crossings."""

    n_events: int
    n_crossings: int
    n_exact: int
    are_far: bool


class Turns(NamedTuple):
    """Of a segment ab and the points c and d: orient(a, b, c) and orient(a, b, d) in floating point, a bound for the
    errors of both, and ab's length, which is the sum of both coordinates'."""

    first: float
    second: float
    bound: float
    length: float


@merged
def turns(x: Any, y: Any, a: int, b: int, c: int, d: int) -> Turns:
    """Return the turns from the segment ab to the points c and d."""
    i, j, k, m = np.uint64(a), np.uint64(b), np.uint64(c), np.uint64(d)  # no look at whether they count from the end
    ux, uy = x[j] - x[i], y[j] - y[i]
    left, right = ux * (y[k] - y[i]), uy * (x[k] - x[i])
    far_left, far_right = ux * (y[m] - y[i]), uy * (x[m] - x[i])
    size = max(abs(left) + abs(right), abs(far_left) + abs(far_right))
    return Turns(left - right, far_left - far_right, BOUND_2D * size + GUARD_2D, abs(ux) + abs(uy))


@merged
def smaller_of(found: Turns) -> float:
    """Return the size of the smaller turn."""
    return min(abs(found.first), abs(found.second))


@merged
def agree(found: Turns) -> bool:
    """Tell whether both turns have one sign: the points lie on one side, where the bound does not say otherwise."""
    return (found.first > 0.0) == (found.second > 0.0)


@inline
def find_contacts(
    edges: Edges, n: int, n_rings: int, margin: float, events: Events, unions: Unions, tree: BoxTree, stop: Any
) -> Contacts:
    """Enter all contacts; the edges of pairs of which `Contacts.are_far` does not hold get the mark DOUBTFUL.

    tree: over the boxes of the edges, with the margin around them. unions: filled.
    """
    for i in range(n):
        unions.points[i] = i
    unions.is_node[:n] = 0
    for ring in range(n_rings):
        unions.rings[ring] = ring
    room = min(events.edge.shape[0] - 4, 2 * (events.first.shape[0] - 1))
    x, y, after, boxes, pairs = edges.x, edges.y, edges.after, tree.boxes, tree.pairs
    n_events = n_crossings = n_exact = 0
    are_far = True
    depth = begin_pairs(tree, n, stop)
    while depth > 0 and not stop[0]:  # bound: the walk through the tree
        found, depth = next_pairs(tree, n, depth)
        for k in range(found):
            i, j = pairs[k, 0], pairs[k, 1]
            b, d = after[i], after[j]
            to_j = turns(x, y, i, b, j, d)
            nearest = smaller_of(to_j)
            if agree(to_j) and nearest > margin * to_j.length and nearest > to_j.bound:
                continue
            if not boxes_meet(boxes, i, boxes, j):
                continue
            if n_events > room:
                return Contacts(-1, 0, 0, False)
            if (b == j and abs(to_j.second) > to_j.bound) or (d == i and abs(to_j.first) > to_j.bound):
                continue  # consecutive edges that are not in line
            if b != j and d != i:
                to_i = turns(x, y, j, d, i, b)
                nearest_i = smaller_of(to_i)
                is_beside = agree(to_i) and nearest_i > to_i.bound
                if is_beside or (agree(to_j) and nearest > to_j.bound):  # no contact
                    if not (is_beside and nearest_i > margin * to_i.length) and not edges_are_far(edges, i, j, margin):
                        _put_in_doubt(tree.marks, i, j)
                        are_far = False
                    continue
                if nearest > to_j.bound and nearest_i > to_i.bound:
                    unite(unions.rings, edges.ring[i], edges.ring[j])
                    unions.points[n + n_crossings] = n + n_crossings
                    events.turn[n_crossings] = LEFT if to_i.first > 0.0 else RIGHT  # edge i comes from j's left
                    events.first[n_crossings], events.second[n_crossings] = i, j
                    _add_event(events, n_events, n + n_crossings, i, j, to_i, margin)
                    _add_event(events, n_events + 1, n + n_crossings, j, i, to_j, margin)
                    n_events, n_crossings = n_events + 2, n_crossings + 1
                    continue
            n_events, n_crossings = enter_contact(edges, events, unions, n, n_events, n_crossings, i, j)
            n_exact += 1
            _put_in_doubt(tree.marks, i, j)
            are_far = are_far and (b == j or d == i) and not unions.is_node[b if b == j else i]  # else they fold
    return Contacts(n_events, n_crossings, n_exact, are_far)


@merged
def _put_in_doubt(marks: Any, e: int, f: int) -> None:
    marks[e] |= DOUBTFUL
    marks[f] |= DOUBTFUL


@merged
def _add_event(events: Events, at: int, crossing: int, edge: int, other: int, ends: Turns, margin: float) -> None:
    """Enter the event at ``at`` of a proper crossing whose signs are sure; ends: the turns from ``other`` to both ends.

    t = A / (A + B), with A and B off by r at most, is off by r / (A + B), and by three roundings.
    """
    total = abs(ends.first) + abs(ends.second)
    slack = ends.bound / total + 2.0**-50
    events.edge[at], events.point[at], events.other[at] = edge, crossing, other
    events.t[at], events.slack[at] = abs(ends.first) / total, slack
    events.reach[at] = slack + margin * ends.length / total
