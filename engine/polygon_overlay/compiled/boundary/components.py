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
from engine.arrays import FlagArray, FloatArray, Int32Array, IntArray
from engine.compiling.jit import inline
from engine.polygon_overlay.compiled.boundary.chain_faces import NOTHING, edge_above, half_below
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_tree import LEAF, OFTEN, POLL, RUN, BoxTree, box_holds, build_tree, leaves_of

_HOLDS: Final = 1
_IS_OPEN: Final = 2
"""States of a component: its box holds another's; the edge above it is not known yet."""

Components = namedtuple("Components", "highest number state")
"""By component: highest, its last vertex (rightmost, then highest); state. number: by ring its component."""


@inline
def _find_components(
    edges: Edges, tops: IntArray, rings: IntArray, n: int, components: Components, boxes: FloatArray
) -> int:
    """Fill ``components``, and the box of each, of the vertices that are there; return how many."""
    x, y, highest, number = edges.x, edges.y, components.highest, components.number
    n_components, at = 0, 0
    while at < n:  # bound: each turn passes one ring
        ring, last = edges.ring[at], edges.before[at]
        root, top = root_of(rings, ring), tops[ring]
        if root == ring:  # invariant: the first of its component
            k, n_components = n_components, n_components + 1
            components.state[k], highest[k] = 0, top
            x_min = y_min = np.inf
            x_max = y_max = -np.inf
        else:
            k = number[root]
            x_min, x_max, y_min, y_max = boxes[k, 0], boxes[k, 1], boxes[k, 2], boxes[k, 3]
        number[ring] = k
        if x[top] > x[highest[k]] or (x[top] == x[highest[k]] and y[top] > y[highest[k]]):
            highest[k] = top
        for v in range(at, last + 1):
            x_min, x_max, y_min, y_max = min(x_min, x[v]), max(x_max, x[v]), min(y_min, y[v]), max(y_max, y[v])
        boxes[k, 0], boxes[k, 1], boxes[k, 2], boxes[k, 3] = x_min, x_max, y_min, y_max
        at = last + 1
    return n_components


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
    for e in range(n):
        if not components.state[components.number[edges.ring[e]]] & _HOLDS or tree.marks[e] & RUN:
            continue
        b = edges.after[e]
        names[m] = e
        boxes[m, 0], boxes[m, 1] = min(x[e], x[b]), max(x[e], x[b])
        boxes[m, 2], boxes[m, 3] = min(y[e], y[b]), max(y[e], y[b])
        m += 1
    return m


@inline
def join_faces(w: Any, names: Int32Array, sizes: tuple[int, int, int], stop: FlagArray) -> None:
    """Join the outer cycle of each component of rings to the face it lies in.

    w: the `Workspace`, whose tree is scratch, but for its marks: RUN of the edges that stand for many; caller
    guarantees that none of these is next above another component. names: scratch by point. sizes: the numbers of
    vertices, cycles and runs.
    """
    n, n_cycles, n_runs = sizes
    given, tree, faces, components, stars = w.given, w.tree, w.faces, w.components, w.stars
    for i in range(n_cycles + 1):
        if i & POLL == 0 and stop[0]:
            return
        faces.joined[i] = faces.regions[i] = i
    edges, boxes, points, m = given.edges, tree.boxes, w.unions.points, 0
    n_components = _find_components(edges, given.tops, w.unions.rings, n, components, boxes)
    if n_components > 1:
        for k in range(n_components if n_runs > 0 else 0):  # what is left out may be anywhere
            boxes[k, 0] = boxes[k, 2] = -np.inf
            boxes[k, 1] = boxes[k, 3] = np.inf
        build_tree(tree, n_components, stop)
        for place in range(n_components):  # order: neighbours in the plane look at the same nodes
            if stop[0]:
                return
            _look_in_boxes(components, tree.places[place], n_components, tree)
        m = _gather_edges(edges, components, n, tree, names)
    if m > 0:
        build_tree(tree, m, stop)
    for k in range(n_components):
        if k & OFTEN == 0 and stop[0]:
            return
        top, beyond, above = components.highest[k], n_cycles, NOTHING
        if components.state[k] & _IS_OPEN:
            above = edge_above(edges, tree, names, top, m)
        if above != NOTHING:
            beyond = faces.cycle[half_below(edges, w.events, w.along, points, w.chains, above, top)]
        outer = faces.cycle[stars.half[stars.ends[stars.node_of[root_of(points, top)]] - 1]]
        unite(faces.joined, outer, beyond)
        unite(faces.regions, outer, beyond)
