"""Components of rings, each joined to the face it lies in: by boxes first, by the edge above it where these hold it.

A component lies in a face of another only if its box lies in the other's. Where no box holds its own it is in the
unbounded face. Else the edge above its last vertex is looked for, among those of the components whose boxes do: what is
left out encloses nothing here. It is apart from these, and disjoint connected sets of which none keeps two points apart
do not keep them apart together (S. Janiszewski, Sur les coupures du plan, 1913). Were the edge found enclosed by one
of them, its box would hold that edge's component's, and so this one's.

    .-----------------------.
    |  []   []   []   []    |     windows in a wall: each looks at the wall's edges, none at other windows
    |  []   []   []   []    |
    '-----------------------'
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.arrangement.union_find import root_of, unite
from engine.arrays import FlagArray, Int32Array, IntArray
from engine.jit import inline
from engine.polygon_overlay.compiled.boundary.chain_faces import NOTHING, edge_above, half_below
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_tree import LEAF, OFTEN, POLL, RUN, BoxTree, box_holds, build_tree, leaves_of
from engine.polygon_overlay.compiled.loading import Given

_HOLDS: Final = 1
_IS_OPEN: Final = 2
"""States of a component: its box holds another's; the edge above it is not known yet."""

Components = namedtuple("Components", "highest following first ring state")
"""By ring: highest: of the one that stands for a component its last vertex (rightmost, then highest), of others -1;
following: the next ring of the component, or -1; first: its first vertex. By number of component: ring, state."""


@inline
def _find_components(given: Given, rings: IntArray, n: int, n_rings: int, components: Components) -> int:
    """Fill ``components``; return how many."""
    edges = given.edges
    x, y, highest, following = edges.x, edges.y, components.highest, components.following
    k = n_components = 0
    while k < n:  # bound: each turn passes one ring
        components.first[edges.ring[k]] = k
        k = edges.before[k] + 1
    for ring in range(n_rings):
        root, top = root_of(rings, ring), given.tops[ring]
        if root == ring:  # invariant: the first of its component
            components.ring[n_components], components.state[n_components] = ring, 0
            highest[ring], following[ring] = top, -1
            n_components += 1
            continue
        highest[ring], following[ring] = -1, following[root]
        following[root], best = ring, highest[root]
        if x[top] > x[best] or (x[top] == x[best] and y[top] > y[best]):
            highest[root] = top
    return n_components


@inline
def _box_of(edges: Edges, components: Components, k: int) -> tuple[float, float, float, float]:
    """Return the box of component k, of the vertices that are there."""
    x, y, ring = edges.x, edges.y, components.ring[k]
    x_min = y_min = float("inf")
    x_max = y_max = float("-inf")
    while ring >= 0:  # bound: the rings of the component
        first = components.first[ring]
        for v in range(first, edges.before[first] + 1):
            x_min, x_max, y_min, y_max = min(x_min, x[v]), max(x_max, x[v]), min(y_min, y[v]), max(y_max, y[v])
        ring = components.following[ring]
    return x_min, x_max, y_min, y_max


@inline
def _look_in_boxes(components: Components, k: int, n: int, tree: BoxTree) -> None:
    """Mark the components whose boxes hold that of component k, and k if there are any."""
    stack, n_leaves, boxes, state = tree.stack, leaves_of(n), tree.boxes, components.state
    stack[0, 0], depth = 1, 1
    while depth > 0:  # bound: each node enters the stack once
        depth -= 1
        node = stack[depth, 0]
        if not box_holds(tree.nodes, node, boxes, k):
            continue
        if node < n_leaves:
            stack[depth, 0], stack[depth + 1, 0] = 2 * node + 1, 2 * node
            depth += 2
            continue
        first = LEAF * (node - n_leaves)
        for place in range(first, min(first + LEAF, n)):
            other = tree.places[place]
            if other != k and box_holds(boxes, other, boxes, k):
                state[other] |= _HOLDS
                state[k] |= _IS_OPEN


@inline
def _gather_edges(edges: Edges, components: Components, n: int, tree: BoxTree, names: Int32Array) -> int:
    """Fill ``names`` and ``boxes`` with the edges of all components that hold another; return how many."""
    x, y, boxes = edges.x, edges.y, tree.boxes
    m = 0
    for k in range(n):
        ring = components.ring[k] if components.state[k] & _HOLDS else -1
        while ring >= 0:  # bound: the rings of the component
            first = components.first[ring]
            for e in range(first, edges.before[first] + 1):
                if tree.marks[e] & RUN:
                    continue
                b = edges.after[e]
                names[m] = e
                boxes[m, 0], boxes[m, 1] = min(x[e], x[b]), max(x[e], x[b])
                boxes[m, 2], boxes[m, 3] = min(y[e], y[b]), max(y[e], y[b])
                m += 1
            ring = components.following[ring]
    return m


@inline
def join_faces(w: Any, names: Int32Array, sizes: tuple[int, int, int, int], stop: FlagArray) -> None:
    """Join the outer cycle of each component of rings to the face it lies in.

    w: the `Workspace`, whose tree is scratch, but for its marks: RUN of the edges that stand for many; caller
    guarantees that none of these is next above another component. names: scratch by point. sizes: the numbers of
    vertices, rings, cycles and runs.
    """
    n, n_rings, n_cycles, n_runs = sizes
    given, tree, faces, components, stars = w.given, w.tree, w.faces, w.components, w.stars
    for i in range(n_cycles + 1):
        if i & POLL == 0 and stop[0]:
            return
        faces.joined[i] = faces.regions[i] = i
    edges, boxes, points, m = given.edges, tree.boxes, w.unions.points, 0
    n_components = _find_components(given, w.unions.rings, n, n_rings, components)
    if n_components > 1:
        for k in range(n_components):
            boxes[k, 0], boxes[k, 1], boxes[k, 2], boxes[k, 3] = _box_of(edges, components, k)
            if n_runs > 0:  # what is left out may be anywhere
                boxes[k, 0] = boxes[k, 2] = -np.inf
                boxes[k, 1] = boxes[k, 3] = np.inf
        build_tree(tree, n_components, stop)
        for place in range(n_components):  # order: neighbours in the plane look at the same nodes
            if stop[0]:
                return
            _look_in_boxes(components, tree.places[place], n_components, tree)
        m = _gather_edges(edges, components, n_components, tree, names)
    if m > 0:
        build_tree(tree, m, stop)
    for k in range(n_components):
        if k & OFTEN == 0 and stop[0]:
            return
        top, beyond, above = components.highest[components.ring[k]], n_cycles, NOTHING
        if components.state[k] & _IS_OPEN:
            above = edge_above(edges, tree, names, top, m)
        if above != NOTHING:
            beyond = faces.cycle[half_below(edges, w.events, w.along, points, w.chains, above, top)]
        outer = faces.cycle[stars.half[stars.ends[stars.node_of[root_of(points, top)]] - 1]]
        unite(faces.joined, outer, beyond)
        unite(faces.regions, outer, beyond)
