r"""Chains: the stretches of rings between nodes, and the star of chains around each node.

A node is a point where something happens: a crossing, a vertex on another edge, and one vertex of every ring. All
work after this is by chains, however many vertices these have. Half-chain 2 c runs along its ring, 2 c + 1 back;
``h ^ 1`` is the twin. A star lists the half-chains that leave a node, counter-clockwise, beginning after straight
up; at a simple node, the crossing of two edges and nothing else, it begins with one half-chain of the first edge, and
four places are all that it has. Chains that leave a node in one direction coincide as far as the next node: one stands
for all, its source mask the exclusive or of theirs.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

from engine.arrangement.union_find import root_of
from engine.jit import called, inline, merged
from engine.polygon_overlay.compiled.crossing_signs import Edges, turn_of_edges
from engine.polygon_overlay.compiled.edge_contacts import LEFT, NOT_SIMPLE, Events, Unions
from engine.polygon_overlay.compiled.edge_events import Along
from engine.polygon_overlay.compiled.edge_tree import POLL
from engine.polygon_overlay.compiled.loading import Given
from engine.predicates.orientation import BOUND_2D, GUARD_2D

NOT_YET: Final = -1
"""In a star, in the place of a half-chain that is not known yet."""

Chains = namedtuple("Chains", "tail head first last mask stands twin at")
"""By chain: node at its tail and head, its first and last edge, the mask of its sources, and the half-chain that stands
for its half-chain 2 c (itself, unless chains coincide). twin: the next of the chains that one stands for, or -1. at:
for each edge the chain at its beginning; the chains after the nodes inside it follow one by one."""

Stars = namedtuple("Stars", "node_of point starts ends half place")
"""Half-chains around nodes. node_of: by point its node, or -1; by node its point, and where its half-chains begin and
end in ``half``; place: by half-chain its index there. Simple nodes have the first places, four each."""

Loose = namedtuple("Loose", "half masks dx dy")
"""Half-chains that leave nodes that are not simple, ascending, to be sorted into stars. Scratch: masks, by chain those
from before chains are united; dx, dy: directions of a star's half-chains, float64."""


@merged
def is_live(chains: Chains, chain: int) -> bool:
    """Tell whether a chain stands for itself."""
    return chains.stands[chain] == 2 * chain


@merged
def standing(chains: Chains, half: int) -> int:
    """Return the half-chain that stands for `half`."""
    return chains.stands[half >> 1] ^ (half & 1)


@merged
def origin(chains: Chains, half: int) -> int:
    """Return the node where a half-chain begins."""
    return chains.head[half >> 1] if half & 1 else chains.tail[half >> 1]


@merged
def place_before(chains: Chains, stars: Stars, n_simple: int, at: int, half: int) -> int:
    """Return the place before ``at`` in the star of the node where half-chain ``half`` begins, around its end."""
    if at < 4 * n_simple:
        return at - 1 if at & 3 else at + 3
    node = origin(chains, half)
    return (at if at > stars.starts[node] else stars.ends[node]) - 1


@merged
def leaving_edge(chains: Chains, half: int) -> int:
    """Return the edge along which a half-chain leaves its node."""
    return chains.last[half >> 1] if half & 1 else chains.first[half >> 1]


@merged
def _node(stars: Stars, n_nodes: int, point: int) -> tuple[int, int]:
    """Return the number of the node at a united point, and how many nodes there are then."""
    if stars.node_of[point] < 0:
        stars.node_of[point] = n_nodes
        stars.point[n_nodes], stars.starts[n_nodes], stars.ends[n_nodes] = point, NOT_YET, 0
        n_nodes += 1
    return stars.node_of[point], n_nodes


@inline
def _pass_crossing(
    events: Events, stars: Stars, n: int, n_nodes: int, n_simple: int, n_chains: int, point: int, e: int
) -> tuple[int, int, int]:
    """Enter the two half-chains that leave a simple node along edge e; return the node, how many there are, how many
    of them simple.

             2nd              The first edge's take the places 0 and 2; from the left of it, counter-clockwise, the
              1               second's forward half-chain is at 1, from its right at 3.
        1st 2 + 0 ->  1st
              3
    """
    star, place = stars.half, stars.place
    node = stars.node_of[point]
    crossing = point - n
    if node < 0:  # here for the first time
        node, first = n_nodes, 4 * n_simple
        stars.node_of[point], stars.point[node] = node, point
        stars.starts[node], stars.ends[node] = first, first + 4
        n_nodes += 1
        n_simple += 1
        is_first = events.first[crossing] == e
        star[first] = NOT_YET
    else:
        first = stars.starts[node]
        is_first = star[first] == NOT_YET
    forward = first if is_first else first + (1 if events.turn[crossing] == LEFT else 3)
    back = first + ((forward - first + 2) & 3)
    star[forward], place[2 * n_chains + 2] = 2 * n_chains + 2, forward
    star[back], place[2 * n_chains + 1] = 2 * n_chains + 1, back
    return node, n_nodes, n_simple


@merged
def _begin_chain(chains: Chains, chain: int, node: int, edge: int, mask: int) -> None:
    chains.tail[chain], chains.first[chain], chains.mask[chain] = node, edge, mask


@inline
def build_chains(
    given: Given, events: Events, along: Along, unions: Unions, chains: Chains, stars: Stars, loose: Any, n: int,
    n_rings: int, stop: Any,
) -> tuple[int, int, int, int]:  # fmt: skip
    """Walk every ring from its top vertex and cut it at its nodes, and fill the stars of simple nodes.

    unions.is_node: the tops among them. stars.node_of: -1 on entry. ``loose`` gets the half-chains that leave other
    nodes, whose stars begin NOT_YET. Returns the numbers of nodes, simple nodes, chains and loose half-chains.
    """
    edges = given.edges
    n_nodes = n_simple = n_chains = n_loose = 0
    for ring in range(n_rings):
        top, mask = given.tops[ring], given.masks[ring]
        node, n_nodes = _node(stars, n_nodes, root_of(unions.points, top))
        loose[n_loose] = 2 * n_chains
        n_loose += 1
        _begin_chain(chains, n_chains, node, top, mask)
        e = top
        while True:  # bound: once around the ring
            if stop[0]:
                return n_nodes, n_simple, n_chains, n_loose
            chains.at[e] = n_chains
            before = -1
            for k in range(along.starts[e], along.starts[e + 1]):
                point = events.point[along.order[k]]
                if point >= n and events.turn[point - n] != NOT_SIMPLE:
                    node, n_nodes, n_simple = _pass_crossing(events, stars, n, n_nodes, n_simple, n_chains, point, e)
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
        chains.stands[chain], chains.twin[chain] = 2 * chain, -1
    return n_nodes, n_simple, n_chains, n_loose


@inline
def _half_turn(edges: Edges, edge: int, is_back: int) -> int:
    """Return 0 for directions from straight up over left to just before straight down, 1 for the others."""
    x, y = edges.x, edges.y
    a, b = edge, edges.after[edge]
    if is_back:
        a, b = b, a
    if x[b] != x[a]:
        return 0 if x[b] < x[a] else 1
    return 0 if y[b] > y[a] else 1


@called
def _compare_directions(edges: Edges, chains: Chains, g: int, h: int) -> int:
    """Return -1, 0 or 1 as half-chain g leaves before, with or after h, counter-clockwise from straight up."""
    e, f = leaving_edge(chains, g), leaving_edge(chains, h)
    half_g, half_h = _half_turn(edges, e, g & 1), _half_turn(edges, f, h & 1)
    if half_g != half_h:
        return -1 if half_g < half_h else 1
    turn = turn_of_edges(edges, e, f)
    return turn if (g ^ h) & 1 else -turn


@called
def _unite_twins(edges: Edges, chains: Chains, star: Any, first: int, last: int, masks: Any) -> int:
    """Let the lowest chain of each direction stand for all, and close the gaps; return where the star then ends.

    The other end of coinciding chains finds the same chains together, so it chooses the same one.
    """
    kept = at = first
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
            chains.stands[chain] = chosen ^ (star[k] & 1)
            if chain != chosen >> 1:
                chains.twin[before] = before = chain
        chains.twin[before] = -1
        star[kept] = chosen
        kept += 1
        at = stop
    return kept


@inline
def _group_loose(
    chains: Chains, stars: Stars, loose: Loose, n_nodes: int, n_simple: int, n_loose: int, stop: Any
) -> None:
    """Put the loose half-chains of each node together, behind those of simple nodes, in any order."""
    starts, ends = stars.starts, stars.ends
    for k in range(n_loose):
        if k & POLL == 0 and stop[0]:
            return
        chain = loose.half[k] >> 1
        loose.masks[chain] = chains.mask[chain]
        ends[origin(chains, loose.half[k])] += 1
    end = 4 * n_simple
    for node in range(n_nodes):
        if node & POLL == 0 and stop[0]:
            return
        if starts[node] == NOT_YET:
            starts[node], end = end, end + ends[node]
            ends[node] = starts[node]
    for k in range(n_loose):
        if k & POLL == 0 and stop[0]:
            return
        node = origin(chains, loose.half[k])
        stars.half[ends[node]] = loose.half[k]
        ends[node] += 1


@inline
def _sort_star(edges: Edges, chains: Chains, star: Any, loose: Loose, first: int, last: int) -> bool:
    """Sort the half-chains ``star[first:last]`` by direction; tell whether some leave in the same."""
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
    edges: Edges, chains: Chains, stars: Stars, loose: Loose, n_nodes: int, n_simple: int, n_loose: int, stop: Any
) -> None:
    """Fill the stars of nodes that are not simple; of chains that coincide one is left, which stands for all."""
    _group_loose(chains, stars, loose, n_nodes, n_simple, n_loose, stop)
    star = stars.half
    for node in range(n_nodes):
        first, last = stars.starts[node], stars.ends[node]
        if first < 4 * n_simple:
            continue
        if stop[0]:
            return
        if _sort_star(edges, chains, star, loose, first, last):
            last = stars.ends[node] = _unite_twins(edges, chains, star, first, last, loose.masks)
        for k in range(first, last):
            stars.place[star[k]] = k
