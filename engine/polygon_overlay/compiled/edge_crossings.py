"""All contacts of the edges of rings: pairs whose boxes meet, decided by floating point where it is sure."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.jit import inline, merged
from engine.polygon_overlay.compiled.clearance import edges_are_far
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_contacts import LEFT, RIGHT, UNKNOWN, Events, enter_contact, unite
from engine.polygon_overlay.compiled.edge_tree import DOUBTFUL, boxes_meet, encode_boxes, next_pairs
from engine.predicates.orientation import BOUND_2D, GUARD_2D

FEW: Final = 40
"""Edges up to which all pairs of boxes are looked at: fewer steps than a tree."""


@inline
def find_contacts(
    edges: Edges, n: int, n_rings: int, margin: float, events: Events, turn: Any, parent: Any, marked: Any, rings: Any,
    boxes: Any, marks: Any, tree: Any, tree_marks: Any, places: Any, lows: Any, highs: Any, stack: Any, pairs: Any,
    stop: Any,
) -> tuple[int, int, int, bool]:  # fmt: skip
    """Enter all contacts; return the numbers of events (-1: no room), crossings and pairs beyond the filter.

    Returns also whether all edges that do not meet are further apart than ``margin``, and all contacts are crossings;
    the edges of pairs of which that does not hold get the mark DOUBTFUL. boxes: those of the edges, with the margin
    around them. lows, highs: scratch for their codes. rings: filled with the forest of rings that hang together.
    turn: by crossing, filled with LEFT or RIGHT as its second edge leaves to that side of the first, or UNKNOWN.
    """
    for i in range(n):
        parent[i] = i
    marked[:n] = 0
    for ring in range(n_rings):
        rings[ring] = ring
    room = min(events.edge.shape[0] - 4, 2 * (events.first.shape[0] - 1))
    x, y, after = edges.x, edges.y, edges.after
    n_events = n_crossings = n_exact = 0
    is_clear = True
    stack[0, 0], stack[0, 1], depth = 1, 1, 1
    is_small = n <= FEW
    if not is_small:
        encode_boxes(boxes, n, tree, places, lows, highs, stop)
    while depth > 0 and not stop[0]:  # bound: the walk through the tree
        if is_small:
            found, depth = _all_pairs(boxes, n, pairs), 0
        else:
            found, depth = next_pairs(lows, highs, n, tree, tree_marks, places, stack, depth, pairs)
        for k in range(found):
            i, j = pairs[k, 0], pairs[k, 1]
            b, d = after[i], after[j]
            turn_c, turn_d, bound, length = turns(x, y, i, b, j, d)
            nearest = min(abs(turn_c), abs(turn_d))
            is_one_side = (turn_c > 0.0) == (turn_d > 0.0)
            if is_one_side and nearest > margin * length and nearest > bound:
                continue
            if not boxes_meet(boxes, i, boxes, j):
                continue
            if n_events > room:
                return -1, 0, 0, False
            if b == j or d == i:
                if (b == j and abs(turn_d) > bound) or (d == i and abs(turn_c) > bound):
                    continue  # consecutive edges that are not in line
                n_events, n_crossings = enter_contact(
                    edges, events, n_events, n_crossings, n, parent, marked, rings, i, j
                )
                n_exact += 1
                is_clear = is_clear and not marked[b if b == j else i]  # else they fold
                _put_in_doubt(marks, i, j)
                continue
            turn_a, turn_b, bound_ab, length_cd = turns(x, y, j, d, i, b)
            nearest_ab = min(abs(turn_a), abs(turn_b))
            is_one_side_ab = (turn_a > 0.0) == (turn_b > 0.0) and nearest_ab > bound_ab
            if is_one_side_ab or (is_one_side and nearest > bound):
                if not (is_one_side_ab and nearest_ab > margin * length_cd) and not edges_are_far(edges, i, j, margin):
                    _put_in_doubt(marks, i, j)
                    is_clear = False
                continue
            if nearest > bound and nearest_ab > bound_ab:
                unite(rings, edges.ring[i], edges.ring[j])
                crossing = n + n_crossings
                parent[crossing] = crossing
                turn[n_crossings] = LEFT if turn_a > 0.0 else RIGHT  # the first edge comes from the other's left
                events.first[n_crossings], events.second[n_crossings] = i, j
                _add_crossing(events, n_events, crossing, i, j, turn_a, turn_b, bound_ab, margin * length_cd)
                _add_crossing(events, n_events + 1, crossing, j, i, turn_c, turn_d, bound, margin * length)
                n_events += 2
                n_crossings += 1
                continue
            turn[n_crossings] = UNKNOWN
            n_events, n_crossings = enter_contact(edges, events, n_events, n_crossings, n, parent, marked, rings, i, j)
            n_exact += 1
            _put_in_doubt(marks, i, j)
            is_clear = False
    return n_events, n_crossings, n_exact, is_clear


@merged
def _put_in_doubt(marks: Any, e: int, f: int) -> None:
    marks[e] |= DOUBTFUL
    marks[f] |= DOUBTFUL


@merged
def _add_crossing(
    events: Events, at: int, crossing: int, edge: int, other: int, near: float, far: float, bound: float, reach: float
) -> None:
    """Enter the event at ``at`` of a proper crossing whose signs are sure.

    t = A / (A + B), with A and B off by r at most, is off by r / (A + B), and by three roundings.
    """
    total = abs(near) + abs(far)
    slack = bound / total + 2.0**-50
    events.edge[at], events.point[at], events.other[at] = edge, crossing, other
    events.t[at], events.slack[at], events.reach[at] = abs(near) / total, slack, slack + reach / total


@inline
def _all_pairs(boxes: Any, n: int, pairs: Any) -> int:
    """Write the pairs of boxes that meet, of so few that all fit; return how many."""
    found = 0
    for i in range(n):
        for j in range(i + 1, n):
            pairs[found, 0], pairs[found, 1] = i, j
            found += boxes_meet(boxes, i, boxes, j)
    return found


@merged
def turns(x: Any, y: Any, a: int, b: int, c: int, d: int) -> tuple[float, float, float, float]:
    """Return orient(a, b, c) and orient(a, b, d) in floating point, a bound for the errors of both, and ab's length.

    The length is the sum of both coordinates'.
    """
    i, j, k, m = np.uint64(a), np.uint64(b), np.uint64(c), np.uint64(d)  # no look at whether they count from the end
    ux, uy = x[j] - x[i], y[j] - y[i]
    left, right = ux * (y[k] - y[i]), uy * (x[k] - x[i])
    far_left, far_right = ux * (y[m] - y[i]), uy * (x[m] - x[i])
    size = max(abs(left) + abs(right), abs(far_left) + abs(far_right))
    return left - right, far_left - far_right, BOUND_2D * size + GUARD_2D, abs(ux) + abs(uy)
