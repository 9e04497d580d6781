"""Boundary rings of two simple rings that only cross each other: walked from crossing to crossing, without chains.

At every crossing two of the four stretches bound the result, one of each ring, if the operation keeps an odd number of
the three kinds of faces. So there is nothing to choose: the boundary goes along the first ring until that crosses the
second, along the second until that crosses the first. The rings are those of chain_rings.py, in another order.

What two discs whose rims cross have in common, and what one has alone, falls into parts without holes: on the sphere
the rest of it hangs together. Their union is one part, whose boundary all rings are.
"""

from __future__ import annotations

from engine.arrays import FlagArray, Int32Array
from engine.compiling.jit import inline, merged
from engine.polygon_overlay.compiled.boundary.chain_rings import Rings, pass_point, pass_vertex
from engine.polygon_overlay.compiled.crossing_signs import Edges, orient
from engine.polygon_overlay.compiled.edge_contacts import Contacts, Events, Turn
from engine.polygon_overlay.compiled.edge_events import Along
from engine.polygon_overlay.compiled.edge_tree import POLL
from engine.polygon_overlay.compiled.loading import Given


@inline
def do_nothing_but_cross(given: Given, events: Events, contacts: Contacts, n_rings: int, kept: FlagArray) -> bool:
    """Tell whether two rings, one of each polygon, are simple and cross in simple nodes, and the rule above holds."""
    if n_rings != 2 or contacts.n_exact > 0 or contacts.n_crossings == 0 or kept[1] ^ kept[2] ^ kept[3] != 1:
        return False
    ring, is_simple = given.edges.ring, given.masks[0] != given.masks[1]
    for c in range(contacts.n_crossings):
        is_simple &= (ring[events.first[c]] != ring[events.second[c]]) & (events.turn[c] != Turn.NOT_SIMPLE)
    return is_simple


@merged
def _turns_left(given: Given, ring: int) -> bool:
    top = given.tops[ring]
    return orient(given.edges, given.edges.before[top], top, given.edges.after[top]) > 0


@inline
def _follow(
    edges: Edges, events: Events, along: Along, place: Int32Array, marks: FlagArray, event: int, is_forward: bool,
    rings: Rings, n: int, stop: FlagArray,
) -> tuple[int, int]:  # fmt: skip
    """Write the crossing of an event, and the vertices from there to the next of its ring; return that, and how many
    points there are then."""
    edge, at = events.edge[event], place[event]
    n = pass_point(rings, n, events.point[event], edge, True, 0)
    step = 1 if is_forward else -1
    at += step
    while at == along.starts[edge + 1] if is_forward else at < along.starts[edge]:  # bound: the vertices of the ring
        if edge & POLL == 0 and stop[0]:
            break
        v = edges.after[edge] if is_forward else edge
        edge = v if is_forward else edges.before[v]
        n = pass_vertex(edges, marks, v, edge, rings, n)
        at = along.starts[edge] if is_forward else along.starts[edge + 1] - 1
    return along.order[at], n


@inline
def walk_crossings(
    given: Given, events: Events, along: Along, place: Int32Array, marks: FlagArray, kept: FlagArray, n_crossings: int,
    rings: Rings, stop: FlagArray,
) -> tuple[int, int]:  # fmt: skip
    """Write the boundary rings of two rings that `do_nothing_but_cross`; return how many, and how many points.

    Crossing c has the events 2 c, of its first edge, and 2 c + 1. place: scratch by event. events.turn is used up.
    """
    edges, ring = given.edges, given.edges.ring
    for k in range(2 * n_crossings):
        place[along.order[k]] = k
    is_within, is_other_within = kept[2] != kept[3], kept[1] != kept[3]  # which stretches bound: those in the other
    is_left, is_other_left = _turns_left(given, 0), _turns_left(given, 1)
    is_forward = is_left == (kept[3 if is_within else 1] != 0)
    is_other_forward = is_other_left == (kept[3 if is_other_within else 2] != 0)
    n_rings = n_points = 0
    rings.offset[0] = 0
    for c in range(n_crossings):
        is_second = ring[events.first[c]] != 0
        goes_right = (events.turn[c] == Turn.LEFT) != is_second  # the first ring, as it was given, to the other's right
        enters = (goes_right != is_other_left) == is_forward
        if events.turn[c] == Turn.NOT_SIMPLE or enters != is_within:
            continue
        event = 2 * c + is_second
        while events.turn[event >> 1] != Turn.NOT_SIMPLE:  # bound: each turn passes one crossing
            if stop[0]:
                return n_rings, n_points
            events.turn[event >> 1] = Turn.NOT_SIMPLE
            event, n_points = _follow(edges, events, along, place, marks, event, is_forward, rings, n_points, stop)
            event, n_points = _follow(
                edges, events, along, place, marks, event ^ 1, is_other_forward, rings, n_points, stop
            )
            event ^= 1
        rings.region[n_rings] = 0 if kept[1] & kept[2] else n_rings
        n_rings += 1
        rings.offset[n_rings] = n_points
    return n_rings, n_points
