"""Boundary rings of the selected regions, traced over chains; a fast path for two simple rings that only cross.

Source of both walks: K. Weiler, P. Atherton, Hidden surface removal using polygon area sorting, 1977; G. Greiner,
K. Hormann, Efficient clipping of arbitrary polygons, 1998.

`walk_rings` follows the rules of arrangement/rings.py: a walk stays around its own region, is cut into simple rings
where it passes a node twice, and lists the points where the boundary turns or rings meet.

`walk_crossings` alternates between two simple rings with only proper crossings (Greiner-Hormann). At every crossing two
of the four stretches bound the result, one of each ring, if an odd number of the three kinds of faces is selected: so
the boundary switches rings at every crossing. Intersections and differences of two discs are parts without holes; their
union is one part, bounded by all rings.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

from engine.arrangement.union_find import root_of, unite
from engine.compiling.jit import inline, merged
from engine.polygon_overlay.compiled.chain_faces import Faces
from engine.polygon_overlay.compiled.chains import (
    Chains,
    Stars,
    across_end,
    is_representative,
    leaving_edge,
    origin,
    place_before,
    to_the_left,
)
from engine.polygon_overlay.compiled.crossing_signs import Edges, orient, turn_of_edges
from engine.polygon_overlay.compiled.edge_contacts import Contacts, Events, Turn
from engine.polygon_overlay.compiled.edge_events import Along
from engine.polygon_overlay.compiled.edge_tree import BENT, POLL, RUN
from engine.polygon_overlay.compiled.loading import Given
from engine.polygon_overlay.compiled.ring_nesting import FloodFill, record_adjacent_regions
from engine.types import FlagArray, Int32Array

BOUNDS: Final = 1
INSIDE: Final = 2
SEEN: Final = 4
FORKED: Final = 8
"""Bits of the state of a half-chain:

| bit | meaning |
| --- | --- |
| BOUNDS | its chain bounds a region |
| INSIDE | its own face is in the result |
| SEEN | it was walked |
| FORKED | rings meet where it begins |
"""
MEETS: Final = 1
Rings = namedtuple("Rings", "point edge meets offset region")
"""Boundary rings.

| field | by | meaning |
| --- | --- | --- |
| point | point | its united point, ring after ring |
| edge | point | the edge along which the ring continues |
| meets | point | MEETS: rings meet here; RUN: points up to the next are left out |
| offset, region | ring | where it begins; a number of the region that it bounds |
"""

Walk = namedtuple("Walk", "path place")
"""Scratch of a walk. path: its half-chains in order; place: by node where rings meet, its index in ``path``, -1 if not
on it."""


@inline
def mark_boundary(chains: Chains, faces: Faces, n_chains: int, stop: FlagArray) -> None:
    """Fill ``faces.state`` with the bits BOUNDS and INSIDE of each half-chain, from ``faces.inside``, the parts of the
    result to which the faces on its two sides belong."""
    cycle, inside, state = faces.cycle, faces.inside, faces.state
    for chain in range(n_chains):
        if chain & POLL == 0 and stop[0]:
            return
        state[2 * chain] = state[2 * chain + 1] = 0
        if is_representative(chains, chain):
            left, right = inside[cycle[2 * chain]], inside[cycle[2 * chain + 1]]
            state[2 * chain] = BOUNDS * (left != right) | INSIDE * (left != 0)
            state[2 * chain + 1] = BOUNDS * (left != right) | INSIDE * (right != 0)


@inline
def join_regions(
    chains: Chains, stars: Stars, faces: Faces, is_named: bool, sizes: tuple[int, int, int], stop: FlagArray
) -> None:
    """Unite faces that no boundary chain separates, in ``faces.regions``, and count in ``faces.fan`` the boundary
    chains at each node that is not simple. ``faces.state`` is filled by `mark_boundary`. is_named: unite faces outside
    the result too, for provenance. sizes: the numbers of chains, simple nodes and all nodes."""
    n_chains, n_simple, n_nodes = sizes
    cycle, state = faces.cycle, faces.state
    for chain in range(n_chains):
        if chain & POLL == 0 and stop[0]:
            return
        if state[2 * chain] & BOUNDS == 0 and (
            is_representative(chains, chain) if is_named else state[2 * chain] & INSIDE
        ):
            unite(faces.regions, cycle[2 * chain], cycle[2 * chain + 1])
    for node in range(n_simple, n_nodes):
        if node & POLL == 0 and stop[0]:
            return
        n = 0
        for k in range(stars.starts[node], stars.ends[node]):
            n += state[stars.half[k]] & BOUNDS
        faces.fan[node] = n


@merged
def _is_forked(chains: Chains, faces: Faces, half: int) -> bool:
    """Return whether more than two boundary chains meet in the node where the boundary half-chain ``half`` begins."""
    across = across_end(chains, half ^ 1)
    if across < 0:
        return faces.fan[origin(chains, half)] > 2
    ahead, back = across & ~1, (across & ~1) - 1
    return faces.state[ahead] & faces.state[back] & BOUNDS != 0  # an even number is on the boundary


@merged
def _next_boundary_edge(chains: Chains, stars: Stars, faces: Faces, half: int) -> tuple[int, bool]:
    """Return the boundary half-chain that follows ``half`` around the region to its left, and whether rings meet in the
    node between the two: more than two boundary chains do (`_is_forked`)."""
    state, across = faces.state, across_end(chains, half)
    if across >= 0:
        left, ahead = to_the_left(across, half), half + 2 - 4 * (half & 1)
        if state[left] & BOUNDS:
            return left, state[ahead] & BOUNDS != 0
        return ahead if state[ahead] & BOUNDS else to_the_left(across, half ^ 1), False
    twin = half ^ 1
    at = stars.place[twin]
    while True:  # bound: once around the star; the twin itself is on the boundary
        at = place_before(chains, stars, at, twin)
        if state[stars.half[at]] & BOUNDS:
            return stars.half[at], faces.fan[origin(chains, twin)] > 2


@merged
def emit_point(rings: Rings, at: int, point: int, edge: int, turns: bool, meets: int) -> int:
    """Write a point to ``rings`` at index ``at`` if turns is True; return the next index. point, edge, meets: what is
    written to the fields of these names (`Rings`). turns: the boundary turns there."""
    if not turns:
        return at
    rings.point[at], rings.edge[at], rings.meets[at] = point, edge, meets
    return at + 1


@merged
def emit_vertex(edges: Edges, marks: FlagArray, v: int, edge: int, rings: Rings, at: int) -> int:
    """Write input vertex v to ``rings`` at index ``at`` if the boundary turns at v; return the next index. edge: the
    edge at v along which the boundary continues. marks: by edge its bits BENT and RUN."""
    turns = marks[v] & BENT != 0 or orient(edges, edges.before[v], v, edges.after[v]) != 0
    return emit_point(rings, at, v, edge, turns, marks[edge] & RUN)


@inline
def _emit_ring(
    edges: Edges, chains: Chains, points: Int32Array, state: FlagArray, marks: FlagArray, path: Int32Array, first: int,
    last: int, rings: Rings, n_points: int, sizes: tuple[int, int, int, int], stop: FlagArray,
) -> int:  # fmt: skip
    """Append to ``rings`` the points at which a boundary ring turns, after the n_points there; return their number
    then. The ring is that of the half-chains ``path[first:last]``. points: by node its point; state: by half-chain its
    bits; marks: by edge its bits BENT and RUN. sizes: the numbers of chains, nodes, vertices and simple nodes."""
    _, _, n, n_simple = sizes
    edge = leaving_edge(chains, path[last - 1] ^ 1)
    for k in range(first, last):
        if k & POLL == 0 and stop[0]:
            return n_points
        half = path[k]
        node, before, edge = origin(chains, half), edge, leaving_edge(chains, half)
        is_simple, meets = node < n_simple, MEETS * (state[half] & FORKED != 0)
        turns = meets != 0 or (edge != before and (is_simple or turn_of_edges(edges, before, edge) != 0))
        point = n + node if is_simple else points[node]
        n_points = emit_point(rings, n_points, point, edge, turns, meets)
        is_back, end = half & 1, leaving_edge(chains, half ^ 1)
        while edge != end:  # bound: the vertices of the chain
            if edge & POLL == 0 and stop[0]:
                return n_points
            v = edge if is_back else edges.after[edge]
            edge = edges.before[v] if is_back else v
            n_points = emit_vertex(edges, marks, v, edge, rings, n_points)
    return n_points


@inline
def walk_rings(
    edges: Edges, chains: Chains, stars: Stars, faces: Faces, marks: FlagArray, walk: Walk, rings: Rings,
    flood: FloodFill, is_named: bool, sizes: tuple[int, int, int, int], stop: FlagArray,
) -> tuple[int, int]:  # fmt: skip
    """Trace the boundary rings of all regions inside; return the numbers of rings and points, written to ``rings``.

    is_named: also record in ``flood`` the regions on the other side of each ring. marks: by edge, BENT if the ring
    certainly turns at the edge's first vertex, RUN if the edge replaces several. sizes: the numbers of chains, nodes,
    vertices and simple nodes. walk: scratch.
    """
    n_chains, n_nodes, _, _ = sizes
    state, path, place = faces.state, walk.path, walk.place
    place[:n_nodes] = -1
    rings.offset[0] = 0
    n_rings = n_points = 0
    for start in range(2 * n_chains):
        if state[start] & (BOUNDS | INSIDE | SEEN) != BOUNDS | INSIDE:
            continue
        if stop[0]:
            return n_rings, n_points
        half, depth, is_closed, is_forked = start, 0, False, _is_forked(chains, faces, start)
        # invariant: a node of more than two boundary chains where path[k] begins has place k, no other is on the path
        while not is_closed:  # bound: each turn marks one half-chain, but for the last
            if depth & POLL == 0 and stop[0]:
                return n_rings, n_points
            is_closed = state[half] & SEEN != 0
            first = 0 if is_closed else place[origin(chains, half)] if is_forked else -1
            if first >= 0:  # a ring, cut off where the walk passes a node twice
                n_points = _emit_ring(
                    edges, chains, stars.point, state, marks, path, first, depth, rings, n_points, sizes, stop
                )
                if is_named:
                    record_adjacent_regions(faces, flood, path, first, depth, n_rings)
                rings.region[n_rings] = root_of(faces.regions, faces.cycle[path[first]])
                n_rings += 1
                rings.offset[n_rings] = n_points
                for k in range(first, depth):
                    if state[path[k]] & FORKED:
                        place[origin(chains, path[k])] = -1
                depth = first
            if not is_closed:
                state[half] |= SEEN | FORKED * is_forked
                if is_forked:
                    place[origin(chains, half)] = depth
                path[depth] = half
                depth += 1
                half, is_forked = _next_boundary_edge(chains, stars, faces, half)
    return n_rings, n_points


@inline
def has_only_proper_crossings(
    given: Given, events: Events, contacts: Contacts, n_rings: int, selected: FlagArray
) -> bool:
    """Return whether `walk_crossings` may trace the result: two simple rings of different polygons, whose contacts, one
    or more, are all proper crossings proven by floats, and an odd number of the labels 1, 2, 3 is in ``selected``."""
    if (
        n_rings != 2
        or contacts.n_exact > 0
        or contacts.n_crossings == 0
        or selected[1] ^ selected[2] ^ selected[3] != 1
    ):
        return False
    ring, is_simple = given.edges.ring, given.masks[0] != given.masks[1]
    for c in range(contacts.n_crossings):
        is_simple &= (ring[events.first[c]] != ring[events.second[c]]) & (events.turn[c] != Turn.NOT_SIMPLE)
    return is_simple


@merged
def _turns_left(given: Given, ring: int) -> bool:
    """Return whether a ring is counter-clockwise."""
    top = given.tops[ring]
    return orient(given.edges, given.edges.before[top], top, given.edges.after[top]) > 0


@inline
def _follow_to_crossing(
    edges: Edges, events: Events, along: Along, place: Int32Array, marks: FlagArray, event: int, is_forward: bool,
    rings: Rings, n: int, stop: FlagArray,
) -> tuple[int, int]:  # fmt: skip
    """Append to ``rings``, after its n points, a crossing and the vertices of its ring up to the next crossing; return
    the event of that next crossing and the new number of points. event: that of the first crossing on the edge that the
    walk follows. is_forward: the walk follows the ring's direction. place: by event its index in ``along.order``."""
    edge, at = events.edge[event], place[event]
    n = emit_point(rings, n, events.point[event], edge, True, 0)
    step = 1 if is_forward else -1
    at += step
    while at == along.starts[edge + 1] if is_forward else at < along.starts[edge]:  # bound: the vertices of the ring
        if edge & POLL == 0 and stop[0]:
            break
        v = edges.after[edge] if is_forward else edge
        edge = v if is_forward else edges.before[v]
        n = emit_vertex(edges, marks, v, edge, rings, n)
        at = along.starts[edge] if is_forward else along.starts[edge + 1] - 1
    return along.order[at], n


@inline
def walk_crossings(
    given: Given, events: Events, along: Along, place: Int32Array, marks: FlagArray, selected: FlagArray,
    n_crossings: int, rings: Rings, stop: FlagArray,
) -> tuple[int, int]:  # fmt: skip
    """Trace the boundary rings of two simple rings that only cross properly (`has_only_proper_crossings`); return the
    numbers of rings and points, written to ``rings``. Crossing c has the events 2 c, on its first edge, and 2 c + 1, on
    its second. selected: by label 0 .. 3 whether it is in the result. marks: by edge its bits BENT and RUN. place:
    scratch, one entry an event. ``events.turn`` is overwritten."""
    edges, ring = given.edges, given.edges.ring
    for k in range(2 * n_crossings):
        place[along.order[k]] = k
    is_within, is_other_within = (
        selected[2] != selected[3],
        selected[1] != selected[3],
    )  # which stretches bound: those in the other
    is_left, is_other_left = _turns_left(given, 0), _turns_left(given, 1)
    is_forward = is_left == (selected[3 if is_within else 1] != 0)
    is_other_forward = is_other_left == (selected[3 if is_other_within else 2] != 0)
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
            event, n_points = _follow_to_crossing(
                edges, events, along, place, marks, event, is_forward, rings, n_points, stop
            )
            event, n_points = _follow_to_crossing(
                edges, events, along, place, marks, event ^ 1, is_other_forward, rings, n_points, stop
            )
            event ^= 1
        rings.region[n_rings] = 0 if selected[1] & selected[2] else n_rings
        n_rings += 1
        rings.offset[n_rings] = n_points
    return n_rings, n_points
