"""Chains: the stretches of rings between nodes, and the star of chains around each node.

A node is a point where something happens: a crossing, a vertex on another edge, and one vertex of every ring. All
work after this is by chains, however many vertices these have. Half-chain 2 c runs along its ring, 2 c + 1 back;
``h ^ 1`` is the twin. A star lists the half-chains that leave a node, counter-clockwise, beginning after straight
up. A simple node, the crossing of two edges and nothing else, needs none: chain e of the other ring leaves there to the
left of chain c, or to its right, and those are all four.

           e                2 c continues 2 c - 2 straight ahead; to the left of it 2 e leaves, to the right 2 e - 1,
     c-1   |   c            which is chain e - 1 back.
    ------>o------>
           | e-1            Simple nodes have the numbers of their crossings, other nodes those that follow.

Chains that leave a node in one direction coincide as far as the next node: one stands for all, its source mask the
exclusive or of theirs.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

from engine.arrangement.union_find import root_of
from engine.compiling.jit import called, inline, merged
from engine.polygon_overlay.compiled.crossing_signs import Edges, turn_of_edges
from engine.polygon_overlay.compiled.edge_contacts import Events, Turn, Unions
from engine.polygon_overlay.compiled.edge_events import Along
from engine.polygon_overlay.compiled.edge_tree import POLL
from engine.polygon_overlay.compiled.loading import Given
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.types import FlagArray, Int32Array, IntArray

NOT_YET: Final = -1
"""Placeholder of a chain that is not known yet."""

Chains = namedtuple("Chains", "tail head first last mask representative twin at across")
"""The stretches of rings between nodes; half-chain 2 c is chain c along its ring, 2 c + 1 is chain c backwards.

| field | by | meaning |
| --- | --- | --- |
| tail, head, first, last | chain | its end nodes, its first and last edge |
| mask | chain | the exclusive or of its sources |
| representative | chain | the half-chain that stands for half-chain 2 c: itself, unless chains coincide |
| twin | chain | the next of the coinciding chains, or -1 |
| at | edge | the chain at its beginning; the chains after its inner nodes follow one by one |
| across | chain | twice the chain of the other ring that leaves a simple tail, + 1 if to the left; else < 0 |
"""

Stars = namedtuple("Stars", "node_of point starts ends half place")
"""Half-chains around nodes that are not simple.

| field | by | meaning |
| --- | --- | --- |
| node_of | point | its node, or -1; of a simple node the chain that left it first |
| point, starts, ends | node | its point; its half-chains are ``half[starts:ends]`` |
| place | half-chain | its index in ``half`` |
"""

Loose = namedtuple("Loose", "half masks dx dy")
"""Half-chains that leave nodes with a star, ascending, not yet sorted. Scratch: masks, by chain, before coinciding
chains are united; dx, dy: the directions of one star's half-chains, float64."""


@merged
def is_representative(chains: Chains, chain: int) -> bool:
    """Return whether a chain represents itself: no chain of a lower number coincides with it."""
    return chains.representative[chain] == 2 * chain


@merged
def representative_of(chains: Chains, half: int) -> int:
    """Return the half-chain that represents ``half`` and all half-chains that coincide with it: that of the lowest
    chain."""
    return chains.representative[half >> 1] ^ (half & 1)


@merged
def origin(chains: Chains, half: int) -> int:
    """Return the node where a half-chain begins."""
    return chains.head[half >> 1] if half & 1 else chains.tail[half >> 1]


@merged
def across_end(chains: Chains, half: int) -> int:
    """Return the entry of ``chains.across`` for the node where half-chain ``half`` ends: twice the chain of the other
    ring that leaves that node, + 1 if it leaves to the left; negative unless the node is simple (one crossing of two
    rings)."""
    return chains.across[((half ^ 1) + 1) >> 1]


@merged
def to_the_left(across: int, half: int) -> int:
    """Return the half-chain of the other ring that leaves a simple node to the left of half-chain ``half``, which
    arrives there. across: `across_end` of ``half``, not negative."""
    return (across & ~1) - 1 + ((across ^ half) & 1)


@merged
def place_before(chains: Chains, stars: Stars, at: int, half: int) -> int:
    """Return the index in ``stars.half`` of the next half-chain clockwise from that at index ``at``. half: any
    half-chain that leaves the same node."""
    node = origin(chains, half)
    return (at if at > stars.starts[node] else stars.ends[node]) - 1


@merged
def leaving_edge(chains: Chains, half: int) -> int:
    """Return the edge along which a half-chain leaves its origin: the first edge of its chain, or the last if it runs
    back."""
    return chains.last[half >> 1] if half & 1 else chains.first[half >> 1]


@merged
def _node(stars: Stars, n_nodes: int, point: int) -> tuple[int, int]:
    """Return the node at a point, made as number n_nodes if there is none, and the number of nodes then."""
    if stars.node_of[point] < 0:
        stars.node_of[point] = n_nodes
        stars.point[n_nodes], stars.starts[n_nodes], stars.ends[n_nodes] = point, NOT_YET, 0
        n_nodes += 1
    return stars.node_of[point], n_nodes


@merged
def _link_crossing(events: Events, chains: Chains, stars: Stars, point: int, crossing: int, chain: int, e: int) -> None:
    """Record that chain ``chain`` leaves the simple node of crossing ``crossing``, point ``point``, along edge e. The
    second such call for a node fills ``chains.across`` of both chains."""
    other = stars.node_of[point]
    if other < 0:  # here for the first time
        stars.node_of[point] = chain
        return
    goes_left = (events.turn[crossing] == Turn.LEFT) == (events.first[crossing] == e)
    chains.across[chain], chains.across[other] = 2 * other + goes_left, 2 * chain + 1 - goes_left


@merged
def _begin_chain(chains: Chains, chain: int, node: int, edge: int, mask: int) -> None:
    chains.tail[chain], chains.first[chain], chains.mask[chain], chains.across[chain] = node, edge, mask, NOT_YET


@inline
def build_chains(
    given: Given, events: Events, along: Along, unions: Unions, chains: Chains, stars: Stars, loose: Int32Array,
    sizes: tuple[int, int, int], stop: FlagArray,
) -> tuple[int, int, int]:  # fmt: skip
    """Cut every ring at its nodes into chains, beginning at its top, the last vertex (x, then y); return the numbers of
    nodes, of chains, and of half-chains in ``loose``.

    On entry ``unions.is_node`` includes the tops, and ``stars.node_of`` is -1 everywhere. loose: filled with the
    half-chains that leave nodes with a star, whose ``stars.starts`` is NOT_YET. sizes: the numbers of vertices, rings
    and crossings.
    """
    edges, (n, n_rings, n_crossings) = given.edges, sizes
    n_nodes, n_chains, n_loose = n_crossings, 0, 0
    for ring in range(n_rings):
        top, mask = given.tops[ring], given.masks[ring]
        node, n_nodes = _node(stars, n_nodes, root_of(unions.points, top))
        loose[n_loose] = 2 * n_chains
        n_loose += 1
        _begin_chain(chains, n_chains, node, top, mask)
        e = top
        while True:  # bound: once around the ring
            if stop[0]:
                return n_nodes, n_chains, n_loose
            chains.at[e] = n_chains
            before = -1
            for k in range(along.starts[e], along.starts[e + 1]):
                point = events.point[along.order[k]]
                is_simple = point >= n and events.turn[point - n] != Turn.NOT_SIMPLE
                if is_simple:
                    node = point - n
                else:
                    node, n_nodes = _node(stars, n_nodes, root_of(unions.points, point))
                    if node == before:
                        continue
                    loose[n_loose], loose[n_loose + 1] = 2 * n_chains + 1, 2 * n_chains + 2
                    n_loose += 2
                before = node
                chains.head[n_chains], chains.last[n_chains] = node, e
                n_chains += 1
                _begin_chain(chains, n_chains, node, e, mask)
                if is_simple:
                    _link_crossing(events, chains, stars, point, node, n_chains, e)
            e = edges.after[e]
            if unions.is_node[e]:
                node, n_nodes = _node(stars, n_nodes, root_of(unions.points, e))
                chains.head[n_chains], chains.last[n_chains] = node, edges.before[e]
                loose[n_loose] = 2 * n_chains + 1
                n_loose += 1
                n_chains += 1
                if e == top:
                    break
                loose[n_loose] = 2 * n_chains
                n_loose += 1
                _begin_chain(chains, n_chains, node, e, mask)
    for chain in range(n_chains):
        chains.representative[chain], chains.twin[chain] = 2 * chain, -1
    chains.across[n_chains] = NOT_YET
    return n_nodes, n_chains, n_loose


@inline
def _half_turn(edges: Edges, edge: int, is_back: int) -> int:
    """Return 0 if an edge, or its reverse if is_back is 1, points left (dx < 0) or straight up, else 1: right or
    straight down."""
    x, y = edges.x, edges.y
    a, b = edge, edges.after[edge]
    if is_back:
        a, b = b, a
    if x[b] != x[a]:
        return 0 if x[b] < x[a] else 1
    return 0 if y[b] > y[a] else 1


@called
def _compare_directions(edges: Edges, chains: Chains, g: int, h: int) -> int:
    """Return -1, 0 or 1: counter-clockwise from straight up (included), half-chain g leaves their common node before h,
    in the same direction, or after it. Exact."""
    e, f = leaving_edge(chains, g), leaving_edge(chains, h)
    half_g, half_h = _half_turn(edges, e, g & 1), _half_turn(edges, f, h & 1)
    if half_g != half_h:
        return -1 if half_g < half_h else 1
    turn = turn_of_edges(edges, e, f)
    return turn if (g ^ h) & 1 else -turn


@called
def _unite_twins(edges: Edges, chains: Chains, star: Int32Array, first: int, last: int, masks: IntArray) -> int:
    """Replace each group of coinciding half-chains in the sorted ``star[first:last]`` by that of the lowest chain;
    return the new end of the star. ``chains.mask`` of that chain becomes the exclusive or of ``masks`` (by chain) over
    the group; ``representative`` and ``twin`` are set. The node at the other end chooses the same chain."""
    n_unique = at = first
    while at < last:  # bound: each turn passes one group
        stop = at + 1
        while stop < last and _compare_directions(edges, chains, star[at], star[stop]) == 0:
            stop += 1
        chosen, mask = star[at], 0
        for k in range(at, stop):
            mask ^= masks[star[k] >> 1]
            if star[k] >> 1 < chosen >> 1:
                chosen = star[k]
        chains.mask[chosen >> 1] = mask
        before = chosen >> 1
        for k in range(at, stop):
            chain = star[k] >> 1
            chains.representative[chain] = chosen ^ (star[k] & 1)
            if chain != chosen >> 1:
                chains.twin[before] = before = chain
        chains.twin[before] = -1
        star[n_unique] = chosen
        n_unique += 1
        at = stop
    return n_unique


@inline
def _group_loose(
    chains: Chains, stars: Stars, loose: Loose, n_simple: int, n_nodes: int, n_loose: int, stop: FlagArray
) -> None:
    """Bucket the n_loose half-chains ``loose.half`` by their origin: fill ``stars.half``, ``starts`` and ``ends`` of
    nodes n_simple .. n_nodes - 1, unsorted within a node. ``loose.masks`` becomes a copy of ``chains.mask``."""
    starts, ends = stars.starts, stars.ends
    for k in range(n_loose):
        if k & POLL == 0 and stop[0]:
            return
        chain = loose.half[k] >> 1
        loose.masks[chain] = chains.mask[chain]
        ends[origin(chains, loose.half[k])] += 1
    end = 0
    for node in range(n_simple, n_nodes):
        if node & POLL == 0 and stop[0]:
            return
        starts[node], end = end, end + ends[node]
        ends[node] = starts[node]
    for k in range(n_loose):
        if k & POLL == 0 and stop[0]:
            return
        node = origin(chains, loose.half[k])
        stars.half[ends[node]] = loose.half[k]
        ends[node] += 1


@inline
def _sort_star(edges: Edges, chains: Chains, star: Int32Array, loose: Loose, first: int, last: int) -> bool:
    """Sort the half-chains ``star[first:last]`` of a node counter-clockwise, from straight up on; return whether two of
    them have the same direction."""
    x, y, dx, dy = edges.x, edges.y, loose.dx, loose.dy
    has_twins = False
    for k in range(first, last):
        edge = leaving_edge(chains, star[k])
        ahead = edges.after[edge]
        sign = -1.0 if star[k] & 1 else 1.0
        dx[k - first], dy[k - first] = sign * (x[ahead] - x[edge]), sign * (y[ahead] - y[edge])
    for k in range(first + 1, last):  # insertion: four half-chains nearly always
        moving, ux, uy = star[k], dx[k - first], dy[k - first]
        at = k
        while at > first:
            vx, vy = dx[at - 1 - first], dy[at - 1 - first]
            u_is_left, v_is_left = ux < 0.0 or (ux == 0.0 and uy > 0.0), vx < 0.0 or (vx == 0.0 and vy > 0.0)
            left, right = vx * uy, vy * ux
            turn = left - right
            if u_is_left != v_is_left:
                side = -1 if v_is_left else 1
            elif abs(turn) > BOUND_2D * (abs(left) + abs(right)) + GUARD_2D:  # see turn_of_edges
                side = -1 if turn > 0.0 else 1
            else:
                side = _compare_directions(edges, chains, star[at - 1], moving)
                has_twins = has_twins or side == 0
            if side <= 0:
                break
            star[at], dx[at - first], dy[at - first] = star[at - 1], vx, vy
            at -= 1
        star[at], dx[at - first], dy[at - first] = moving, ux, uy
    return has_twins


@inline
def build_stars(
    edges: Edges, chains: Chains, stars: Stars, loose: Loose, n_simple: int, n_nodes: int, n_loose: int, stop: FlagArray
) -> None:
    """Fill the stars of nodes n_simple .. n_nodes - 1 from the n_loose half-chains ``loose.half``: sorted
    counter-clockwise from straight up on, with one representative for half-chains that coincide."""
    _group_loose(chains, stars, loose, n_simple, n_nodes, n_loose, stop)
    star = stars.half
    for node in range(n_simple, n_nodes):
        first, last = stars.starts[node], stars.ends[node]
        if stop[0]:
            return
        if _sort_star(edges, chains, star, loose, first, last):
            last = stars.ends[node] = _unite_twins(edges, chains, star, first, last, loose.masks)
        for k in range(first, last):
            stars.place[star[k]] = k
