r"""Chains: the stretches of rings between nodes, and the star of chains around each node.

A node is a point where something happens: a crossing, a vertex on another edge, and one vertex of every ring. All
work after this is by chains, however many vertices these have. Half-chain 2 c runs along its ring, 2 c + 1 back;
``h ^ 1`` is the twin. A star lists the half-chains that leave a node, counter-clockwise, beginning after straight
up; at a simple node, the crossing of two edges and nothing else, it begins with one half-chain of the first edge, and
four places are all that it has. Chains that leave a node in one direction coincide as far as the next node: one stands
for all, its source mask the exclusive or of theirs.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from engine.jit import called, inline, merged
from engine.polygon_overlay.compiled.crossing_signs import Edges, turn_of_edges
from engine.polygon_overlay.compiled.edge_contacts import LEFT, POLL, UNKNOWN, Events, root_of
from engine.predicates.orientation import BOUND_2D, GUARD_2D

NOT_YET: Final = -1
"""In a star, in the place of a half-chain that is not known yet."""


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
def place_before(chains: Chains, n_simple: int, starts: Any, ends: Any, at: int, half: int) -> int:
    """Return the place before ``at`` in the star of the node where half-chain ``half`` begins, around its end."""
    if at < 4 * n_simple:
        return at - 1 if at & 3 else at + 3
    node = origin(chains, half)
    return (at if at > starts[node] else ends[node]) - 1


@merged
def leaving_edge(chains: Chains, half: int) -> int:
    """Return the edge along which a half-chain leaves its node."""
    return chains.last[half >> 1] if half & 1 else chains.first[half >> 1]


@merged
def _node(node_of: Any, nodes: Any, starts: Any, ends: Any, n_nodes: int, point: int) -> tuple[int, int]:
    """Return the number of the node at a united point, and how many nodes there are then."""
    if node_of[point] < 0:
        node_of[point] = n_nodes
        nodes[n_nodes], starts[n_nodes], ends[n_nodes] = point, NOT_YET, 0
        n_nodes += 1
    return node_of[point], n_nodes


@inline
def _pass_crossing(
    events: Events, n: int, turn: Any, node_of: Any, nodes: Any, n_nodes: int, n_simple: int, point: int, e: int,
    n_chains: int, star_starts: Any, star_ends: Any, star: Any, place: Any,
) -> tuple[int, int, int]:  # fmt: skip
    """Enter the two half-chains that leave a simple node along edge e; return the node, how many there are, how many
    of them simple.

             2nd              The first edge's take the places 0 and 2; from the left of it, counter-clockwise, the
              1               second's forward half-chain is at 1, from its right at 3.
        1st 2 + 0 ->  1st
              3
    """
    node = node_of[point]
    crossing = point - n
    if node < 0:  # here for the first time
        node, first = n_nodes, 4 * n_simple
        node_of[point], nodes[node], star_starts[node], star_ends[node] = node, point, first, first + 4
        n_nodes += 1
        n_simple += 1
        is_first = events.first[crossing] == e
        star[first] = NOT_YET
    else:
        first = star_starts[node]
        is_first = star[first] == NOT_YET
    forward = first if is_first else first + (1 if turn[crossing] == LEFT else 3)
    back = first + ((forward - first + 2) & 3)
    star[forward], place[2 * n_chains + 2] = 2 * n_chains + 2, forward
    star[back], place[2 * n_chains + 1] = 2 * n_chains + 1, back
    return node, n_nodes, n_simple


@inline
def build_chains(
    edges: Edges, events: Events, n: int, parent: Any, turn: Any, marked: Any, starts: Any, order: Any,
    ring_tops: Any, ring_masks: Any, n_rings: int, node_of: Any, nodes: Any, chains: Chains, chain_at: Any,
    star_starts: Any, star_ends: Any, star: Any, place: Any, loose: Any, stop: Any,
) -> tuple[int, int, int, int]:  # fmt: skip
    """Walk every ring from its top vertex and cut it at its nodes, and fill the stars of simple nodes.

    marked: vertices that are nodes, the tops among them. node_of: (n_points,), -1 on entry. chain_at: for each edge the
    chain at its beginning; the chains after the nodes inside it follow one by one. turn: by crossing. Simple nodes have
    the first places in ``star``; ``loose`` gets the half-chains that leave other nodes, whose stars begin NOT_YET.
    Returns the numbers of nodes, simple nodes, chains and loose half-chains.
    """
    n_nodes = n_simple = n_chains = n_loose = 0
    for ring in range(n_rings):
        top = ring_tops[ring]
        at, n_nodes = _node(node_of, nodes, star_starts, star_ends, n_nodes, root_of(parent, top))
        loose[n_loose] = 2 * n_chains
        n_loose += 1
        chains.tail[n_chains], chains.first[n_chains], chains.mask[n_chains] = at, top, ring_masks[ring]
        e = top
        while True:  # bound: once around the ring
            if stop[0]:
                return n_nodes, n_simple, n_chains, n_loose
            chain_at[e] = n_chains
            before = -1
            for k in range(starts[e], starts[e + 1]):
                point = events.point[order[k]]
                if point >= n and turn[point - n] != UNKNOWN:
                    at, n_nodes, n_simple = _pass_crossing(
                        events, n, turn, node_of, nodes, n_nodes, n_simple, point, e, n_chains,
                        star_starts, star_ends, star, place,
                    )  # fmt: skip
                else:
                    at, n_nodes = _node(node_of, nodes, star_starts, star_ends, n_nodes, root_of(parent, point))
                    if at == before:
                        continue
                    loose[n_loose], loose[n_loose + 1] = 2 * n_chains + 1, 2 * n_chains + 2
                    n_loose += 2
                before = at
                chains.head[n_chains], chains.last[n_chains] = at, e
                n_chains += 1
                chains.tail[n_chains], chains.first[n_chains], chains.mask[n_chains] = at, e, ring_masks[ring]
            e = edges.after[e]
            if marked[e]:
                at, n_nodes = _node(node_of, nodes, star_starts, star_ends, n_nodes, root_of(parent, e))
                chains.head[n_chains], chains.last[n_chains] = at, edges.before[e]
                loose[n_loose] = 2 * n_chains + 1
                n_loose += 1
                n_chains += 1
                if e == top:
                    break
                loose[n_loose] = 2 * n_chains
                n_loose += 1
                chains.tail[n_chains], chains.first[n_chains], chains.mask[n_chains] = at, e, ring_masks[ring]
    for chain in range(n_chains):
        chains.stands[chain] = 2 * chain
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


@inline
def build_stars(
    edges: Edges, chains: Chains, n_nodes: int, n_simple: int, loose: Any, n_loose: int, starts: Any,
    ends: Any, star: Any, place: Any, masks: Any, dx: Any, dy: Any, stop: Any,
) -> None:  # fmt: skip
    """Fill the other stars: half-chains ``star[starts[i]:ends[i]]`` leave node i; each stands for itself.

    starts, ends: (n_nodes,), star: (2 n_chains,), those of simple nodes filled already. place: for each half-chain its
    index in ``star``. loose: (n_loose,) the half-chains that leave other nodes, ascending. masks: (n_chains,) the masks
    as they were before. dx, dy: (2 n_chains,) float64, scratch.
    """
    x, y = edges.x, edges.y
    for k in range(n_loose):
        if k & POLL == 0 and stop[0]:
            return
        chain = loose[k] >> 1
        masks[chain] = chains.mask[chain]
        ends[origin(chains, loose[k])] += 1
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
        node = origin(chains, loose[k])
        star[ends[node]] = loose[k]
        ends[node] += 1
    for node in range(n_nodes):
        first, last = starts[node], ends[node]
        if first < 4 * n_simple:
            continue
        if stop[0]:
            return
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
