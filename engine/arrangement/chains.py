r"""Chains: the stretches of rings between nodes, and the star of chains around each node.

A node is a point where something happens: a crossing, a vertex on another edge, and one vertex of every ring. All
work after this is by chains, however many vertices these have. Half-chain 2 c runs along its ring, 2 c + 1 back;
``h ^ 1`` is the twin. A star lists the half-chains that leave a node, counter-clockwise, beginning after straight
up. Chains that leave a node in one direction coincide as far as the next node: one stands for all, its source mask
the exclusive or of theirs.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from engine.arrangement.crossing_signs import Edges, turn_of_edges
from engine.arrangement.edge_contacts import POLL, Events, root_of
from engine.jit import called, inline, merged
from engine.predicates.orientation import BOUND_2D, GUARD_2D


class Chains(NamedTuple):
    """By chain: node at its tail and head, its first and last edge, the mask of its sources, and the half-chain that
    stands for its half-chain 2 c (itself, unless chains coincide)."""

    tail: Any
    head: Any
    first: Any
    last: Any
    mask: Any
    stands: Any


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
def leaving_edge(chains: Chains, half: int) -> int:
    """Return the edge along which a half-chain leaves its node."""
    return chains.last[half >> 1] if half & 1 else chains.first[half >> 1]


@merged
def _node(node_of: Any, nodes: Any, n_nodes: int, point: int) -> tuple[int, int]:
    """Return the number of the node at a united point, and how many nodes there are then."""
    if node_of[point] < 0:
        node_of[point] = n_nodes
        nodes[n_nodes] = point
        n_nodes += 1
    return node_of[point], n_nodes


@inline
def build_chains(
    edges: Edges, events: Events, parent: Any, marked: Any, starts: Any, order: Any,
    ring_tops: Any, ring_masks: Any, n_rings: int, node_of: Any, nodes: Any, chains: Chains, chain_at: Any, stop: Any,
) -> tuple[int, int]:  # fmt: skip
    """Walk every ring from its top vertex and cut it at its nodes; return the numbers of nodes and chains.

    marked: vertices that are nodes, the tops among them. node_of: (n_points,) int64, -1 on entry. chain_at: for each
    edge the chain at its beginning; the chains after the nodes inside it follow one by one.
    """
    n_nodes = n_chains = 0
    for ring in range(n_rings):
        top = ring_tops[ring]
        at, n_nodes = _node(node_of, nodes, n_nodes, root_of(parent, top))
        chains.tail[n_chains], chains.first[n_chains], chains.mask[n_chains] = at, top, ring_masks[ring]
        e = top
        while True:  # bound: once around the ring
            if stop[0]:
                return n_nodes, n_chains
            chain_at[e] = n_chains
            before = -1
            for k in range(starts[e], starts[e + 1]):
                at, n_nodes = _node(node_of, nodes, n_nodes, root_of(parent, events.point[order[k]]))
                if at == before:
                    continue
                before = at
                chains.head[n_chains], chains.last[n_chains] = at, e
                n_chains += 1
                chains.tail[n_chains], chains.first[n_chains], chains.mask[n_chains] = at, e, ring_masks[ring]
            e = edges.after[e]
            if marked[e]:
                at, n_nodes = _node(node_of, nodes, n_nodes, root_of(parent, e))
                chains.head[n_chains], chains.last[n_chains] = at, edges.before[e]
                n_chains += 1
                if e == top:
                    break
                chains.tail[n_chains], chains.first[n_chains], chains.mask[n_chains] = at, e, ring_masks[ring]
    for chain in range(n_chains):
        chains.stands[chain] = 2 * chain
    return n_nodes, n_chains


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


@inline
def build_stars(
    edges: Edges, chains: Chains, n_nodes: int, n_chains: int, starts: Any, ends: Any, star: Any, place: Any,
    masks: Any, dx: Any, dy: Any, stop: Any,
) -> None:  # fmt: skip
    """Fill the stars: half-chains ``star[starts[i]:ends[i]]`` leave node i, counter-clockwise; each stands for itself.

    starts: (n_nodes + 1,), ends: (n_nodes,), star: (2 n_chains,) int64. place: for each half-chain its index in
    ``star``. masks: (n_chains,) the masks as they were before. dx, dy: (2 n_chains,) float64, scratch.
    """
    x, y = edges.x, edges.y
    starts[: n_nodes + 1] = 0
    for chain in range(n_chains):
        masks[chain] = chains.mask[chain]
        if chain & POLL == 0 and stop[0]:
            return
        starts[chains.tail[chain] + 1] += 1
        starts[chains.head[chain] + 1] += 1
    for node in range(n_nodes):
        starts[node + 1] += starts[node]
    for half in range(2 * n_chains - 1, -1, -1):
        if half & POLL == 0 and stop[0]:
            return
        node = origin(chains, half)
        starts[node + 1] -= 1
        star[starts[node + 1]] = half
    for node in range(n_nodes):
        starts[node] = starts[node + 1]
    starts[n_nodes] = 2 * n_chains
    for node in range(n_nodes):
        first, last = starts[node], starts[node + 1]
        if stop[0]:
            return
        has_twins = False
        ends[node] = last
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
        if has_twins:
            ends[node] = _unite_twins(edges, chains, star, first, last, masks)
        for k in range(first, ends[node]):
            place[star[k]] = k


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
        for k in range(at, stop):
            chains.stands[star[k] >> 1] = chosen ^ (star[k] & 1)
        star[kept] = chosen
        kept += 1
        at = stop
    return kept
