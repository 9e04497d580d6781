"""Faces of chains.

The face of a half-chain lies to its left. A cycle of half-chains is one part of the boundary of a face; two parts of
one face are joined by a stab from the last vertex (rightmost, then topmost) of each component of rings: straight up, an
infinitesimal step to its right, to the next edge above. That vertex belongs to the input, so the stab decides about
doubles.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

from engine.arrangement.union_find import root_of
from engine.arrays import FlagArray, Int32Array
from engine.compiling.jit import inline, merged
from engine.polygon_overlay.compiled.boundary.chains import (
    Chains,
    Stars,
    across_end,
    is_live,
    place_before,
    standing,
    to_the_left,
)
from engine.polygon_overlay.compiled.crossing_signs import Edges, crossing_against, exact_weight, orient, turn_of_edges
from engine.polygon_overlay.compiled.edge_contacts import Events
from engine.polygon_overlay.compiled.edge_events import Along
from engine.polygon_overlay.compiled.edge_tree import LEAF, POLL, BoxTree, leaves_of, push_children
from engine.predicates.error_free import two_diff, workspace
from engine.predicates.expansion import add_scaled, sign

NOTHING: Final = -1

Faces = namedtuple("Faces", "cycle joined regions inside state fan")
"""By half-chain: cycle, or -1 where another half-chain stands for it; state: bits of chain_rings.py. By cycle, of
which entry n_cycles is the unbounded face: joined, a forest of those of one face; regions, of those of one region of
the result; inside: the part of the result that it is in, or 0. fan: by node that is not simple, how many chains bound
a region."""


@merged
def _following(chains: Chains, stars: Stars, half: int) -> int:
    """Return the half-chain that goes on around the face of ``half``."""
    across = across_end(chains, half)
    if across >= 0:
        return to_the_left(across, half)
    twin = half ^ 1
    return stars.half[place_before(chains, stars, stars.place[twin], twin)]


@inline
def number_cycles(chains: Chains, stars: Stars, cycle: Int32Array, n_chains: int, stop: FlagArray) -> int:
    """Fill ``cycle``, by half-chain; return how many cycles."""
    cycle[: 2 * n_chains] = -1
    n_cycles = 0
    for first in range(2 * n_chains):
        if cycle[first] < 0 and is_live(chains, first >> 1):
            if stop[0]:
                return n_cycles
            half = first
            steps = 0
            while cycle[half] < 0:  # bound: each turn numbers one half-chain
                steps += 1
                if steps & POLL == 0 and stop[0]:
                    return n_cycles
                cycle[half] = n_cycles
                half = _following(chains, stars, half)
            n_cycles += 1
    return n_cycles


@inline
def _is_nearer(edges: Edges, v: int, e: int, f: int) -> bool:
    """Tell whether edge e is nearer to v than f, straight up and a step to the right; both are above v there."""
    x = edges.x
    a, b = (e, edges.after[e]) if x[e] < x[edges.after[e]] else (edges.after[e], e)
    c, d = (f, edges.after[f]) if x[f] < x[edges.after[f]] else (edges.after[f], f)
    side = _compare_heights(edges, v, a, b, c, d)
    if side != 0:
        return side < 0
    turn = turn_of_edges(edges, e, f)  # equal here: the one that falls more, or rises less, is nearer to the right
    return (turn if (a == e) == (c == f) else -turn) > 0


@inline
def _compare_heights(edges: Edges, v: int, a: int, b: int, c: int, d: int) -> int:
    """Return the sign of the height of ab above v less that of cd; that of ab is -orient(a, b, v) / (x_b - x_a)."""
    x = edges.x
    first, second, total = workspace(16), workspace(16), workspace(128)  # 2 * 16 * 2 components for each product
    n, m = exact_weight(edges, a, b, v, first), exact_weight(edges, c, d, v, second)
    wide, tail = two_diff(x[c], x[d])  # negative: heights are minus the weights
    k = add_scaled(total, 0, first, n, wide)
    if tail != 0.0:
        k = add_scaled(total, k, first, n, tail)
    wide, tail = two_diff(x[b], x[a])
    k = add_scaled(total, k, second, m, wide)
    if tail != 0.0:
        k = add_scaled(total, k, second, m, tail)
    return sign(total, k)


@merged
def _test_edge(edges: Edges, v: int, e: int, nearest: int) -> int:
    """Return e if it is above v and nearer than ``nearest``, else ``nearest``."""
    x = edges.x
    b = edges.after[e]
    if (x[e] <= x[v]) == (x[b] <= x[v]):  # it does not pass from there to the right of there
        return nearest
    side = orient(edges, e, b, v) if x[e] < x[b] else orient(edges, b, e, v)
    if side >= 0:
        return nearest
    return e if nearest < 0 or _is_nearer(edges, v, e, nearest) else nearest


@inline
def edge_above(edges: Edges, tree: BoxTree, names: Int32Array, v: int, n: int) -> int:
    """Return the edge next above vertex v, a step to its right, or NOTHING; no edge of its component is there.

    tree: of n edges, ``names`` their numbers. Edges that begin or pass through v are not above it: caller guarantees
    that none does to the right.
    """
    nearest = NOTHING
    n_leaves = leaves_of(n)
    nodes, stack, x, y = tree.nodes, tree.stack, edges.x[v], edges.y[v]
    stack[0, 0], depth = 1, 1
    while depth > 0:  # bound: each node enters the stack once
        depth -= 1
        node = stack[depth, 0]
        if nodes[node, 0] > x or nodes[node, 1] <= x or nodes[node, 3] < y:
            continue
        if nearest >= 0 and nodes[node, 2] > max(edges.y[nearest], edges.y[edges.after[nearest]]):
            continue
        if node < n_leaves:
            depth = push_children(tree, node, depth)
            continue
        first = LEAF * (node - n_leaves)
        for place in range(first, min(first + LEAF, n)):
            nearest = _test_edge(edges, v, names[tree.places[place]], nearest)
    return nearest


@inline
def half_below(edges: Edges, events: Events, along: Along, points: Int32Array, chains: Chains, e: int, v: int) -> int:
    """Return the half-chain whose face is below edge e, right of vertex v. points: forest of those that are one."""
    x = edges.x
    runs_right = x[e] < x[edges.after[e]]
    chain, before = chains.at[e], NOTHING
    for k in range(along.starts[e], along.starts[e + 1]):  # linear: once a component, and ends at v
        point, other = events.point[along.order[k]], events.other[along.order[k]]
        root = root_of(points, point)
        if other < 0:
            side = 1 if x[point] > x[v] else -1 if x[point] < x[v] else 0
        else:
            side = crossing_against(edges, e, other, 0, x[v], 0.0)
        if side > 0 if runs_right else side <= 0:
            break
        if root != before:
            chain += 1
            before = root
    half = 2 * chain + 1 if runs_right else 2 * chain
    return standing(chains, half)
