"""Faces of chains: cycles of half-chains, joined where several bound one face.

The face of a half-chain lies to its left. Two cycles of one face are joined by a vertical ray (stab) from the last
vertex (x, then y) of each component of rings: straight up, an infinitesimal step to the right, to the next edge above.
That vertex belongs to the input, so the ray decides about doubles.

A component lies in a face of another only if its box lies in the other's box. Where no box contains its own it is in
the unbounded face. Else the ray looks among the edges of components whose boxes do; what is left out encloses nothing
here: disjoint connected sets of which none separates two points do not separate them together (S. Janiszewski, Sur les
coupures du plan, 1913). Were the edge hit enclosed by one of those, its box would contain this component's.

    .-----------------------.
    |  []   []   []   []    |     windows in a wall: each ray meets edges of the wall, not of other windows
    |  []   []   []   []    |
    '-----------------------'
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.arrangement.union_find import root_of, unite
from engine.compiling.jit import inline, merged
from engine.polygon_overlay.compiled.chains import (
    Chains,
    Stars,
    across_end,
    is_representative,
    place_before,
    representative_of,
    to_the_left,
)
from engine.polygon_overlay.compiled.crossing_signs import (
    Edges,
    crossing_against,
    doubt_zero,
    exact_weight,
    flushed,
    orient,
    turn_of_edges,
)
from engine.polygon_overlay.compiled.edge_contacts import Events
from engine.polygon_overlay.compiled.edge_events import Along
from engine.polygon_overlay.compiled.edge_tree import (
    LEAF,
    OFTEN,
    POLL,
    RUN,
    BoxTree,
    box_contains,
    build_tree,
    leaves_of,
    push_children,
)
from engine.predicates.error_free import two_diff, workspace
from engine.predicates.expansion import add_scaled, sign
from engine.types import FlagArray, FloatArray, Int32Array, IntArray

NOTHING: Final = -1

Faces = namedtuple("Faces", "cycle joined regions inside state fan")
"""Faces and regions, as forests of cycles; entry n_cycles is the unbounded face.

| field | by | meaning |
| --- | --- | --- |
| cycle | half-chain | its cycle, -1 if another half-chain represents it |
| state | half-chain | bits of chain_rings.py |
| joined, regions | cycle | forests of the cycles of one face, of one region of the result |
| inside | cycle | the part of the result that it belongs to, or 0 |
| fan | node that is not simple | how many of its chains bound a region |
"""


@merged
def _following(chains: Chains, stars: Stars, half: int) -> int:
    """Return the half-chain that comes after ``half`` around the face to its left. Half-chain 2 c runs along chain c, 2
    c + 1 back."""
    across = across_end(chains, half)
    if across >= 0:
        return to_the_left(across, half)
    twin = half ^ 1
    return stars.half[place_before(chains, stars, stars.place[twin], twin)]


@inline
def number_cycles(chains: Chains, stars: Stars, cycle: Int32Array, n_chains: int, stop: FlagArray) -> int:
    """Number the cycles of half-chains around faces: fill ``cycle``, by half-chain the number of its cycle, or -1 where
    another chain represents its chain. Returns the number of cycles."""
    cycle[: 2 * n_chains] = -1
    n_cycles = 0
    for first in range(2 * n_chains):
        if cycle[first] < 0 and is_representative(chains, first >> 1):
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
    """Return whether the ray from vertex v straight up, an infinitesimal step to the right of v, meets edge e before
    edge f. Exact. Caller guarantees that it meets both."""
    x = edges.x
    a, b = (e, edges.after[e]) if x[e] < x[edges.after[e]] else (edges.after[e], e)
    c, d = (f, edges.after[f]) if x[f] < x[edges.after[f]] else (edges.after[f], f)
    side = doubt_zero(edges, _compare_heights(edges, v, a, b, c, d), e, f, v)
    if side != 0:
        return side < 0
    turn = turn_of_edges(edges, e, f)  # equal here: the one that falls more, or rises less, is nearer to the right
    return (turn if (a == e) == (c == f) else -turn) > 0


@inline
def _compare_heights(edges: Edges, v: int, a: int, b: int, c: int, d: int) -> int:
    """Return the exact sign of ``height(ab) - height(cd)``, the heights above vertex v at which the vertical line
    through v meets edges ab and cd: ``height(ab) = -orient(a, b, v) / (x_b - x_a)``; 0 also where an infinitesimal
    decides. a, b, c, d: vertices; caller guarantees x_a < x_b, x_c < x_d."""
    x = edges.x
    first, second, total = workspace(16), workspace(16), workspace(128)  # 2 * 16 * 2 components for each product
    n, m = exact_weight(edges, a, b, v, first), exact_weight(edges, c, d, v, second)
    wide, tail = two_diff(flushed(x[c]), flushed(x[d]))  # negative: heights are minus the weights
    k = add_scaled(total, 0, first, n, wide)
    if tail != 0.0:
        k = add_scaled(total, k, first, n, tail)
    wide, tail = two_diff(flushed(x[b]), flushed(x[a]))
    k = add_scaled(total, k, second, m, wide)
    if tail != 0.0:
        k = add_scaled(total, k, second, m, tail)
    return sign(total, k)


@merged
def _test_edge(edges: Edges, v: int, e: int, nearest: int) -> int:
    """Return edge e if the ray up from vertex v meets it before edge ``nearest`` (NOTHING: none so far), else
    ``nearest``."""
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
    """Return the first edge that a ray from vertex v straight up, an infinitesimal step to the right of v, meets among
    n edges, or NOTHING. tree: over the boxes of these edges, box k that of edge ``names[k]``. Caller guarantees that v
    is the last vertex (x, then y) of its component, so that no edge of it passes to the right of v."""
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
    """Return the half-chain along edge e that has the face below e to its left, at the place just right of vertex v; of
    coinciding ones, the representative. points: union-find forest of equal points."""
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
    return representative_of(chains, half)


_ENCLOSES: Final = 1
_IS_UNKNOWN: Final = 2
"""Bits of the state of a component: its box contains another component's box; the edge above it is still to be
computed."""

Components = namedtuple("Components", "highest number state")
"""Connected components of rings. highest, state: by component its last vertex (x, then y) and the bits above; number:
by ring its component.
"""


@inline
def _find_components(
    edges: Edges, tops: IntArray, rings: IntArray, n: int, components: Components, boxes: FloatArray
) -> int:
    """Group rings into connected components: fill ``components``, and ``boxes`` with the box of each component; return
    the number of components. tops: by ring its last vertex (x, then y). rings: union-find forest of rings that touch.
    n: number of vertices."""
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
def _mark_enclosing_boxes(components: Components, k: int, n: int, tree: BoxTree) -> None:
    """Set _ENCLOSES on each component whose box contains the box of component k, and _IS_UNKNOWN on k if there is one.
    n: number of components; tree: over their boxes."""
    stack, n_leaves, boxes, state = tree.stack, leaves_of(n), tree.boxes, components.state
    stack[0, 0], depth = 1, 1
    while depth > 0:  # bound: each node enters the stack once
        depth -= 1
        node = stack[depth, 0]
        if not box_contains(tree.nodes, node, boxes, k):
            continue
        if node < n_leaves:
            stack[depth, 0], stack[depth + 1, 0] = 2 * node + 1, 2 * node
            depth += 2
            continue
        first = LEAF * (node - n_leaves)
        for place in range(first, min(first + LEAF, n)):
            other = tree.places[place]
            if other != k and box_contains(boxes, other, boxes, k):
                state[other] |= _ENCLOSES
                state[k] |= _IS_UNKNOWN


@inline
def _gather_edges(edges: Edges, components: Components, n: int, tree: BoxTree, names: Int32Array) -> int:
    """Write to ``names`` those of the n edges whose component is marked _ENCLOSES (but for RUN edges), and to
    ``tree.boxes`` their boxes; return how many they are."""
    x, y, boxes = edges.x, edges.y, tree.boxes
    m = 0
    for e in range(n):
        if not components.state[components.number[edges.ring[e]]] & _ENCLOSES or tree.marks[e] & RUN:
            continue
        b = edges.after[e]
        names[m] = e
        boxes[m, 0], boxes[m, 1] = min(x[e], x[b]), max(x[e], x[b])
        boxes[m, 2], boxes[m, 3] = min(y[e], y[b]), max(y[e], y[b])
        m += 1
    return m


@inline
def join_faces(w: Any, names: Int32Array, sizes: tuple[int, int, int], stop: FlagArray) -> None:
    """Unite, in ``faces.joined`` and ``faces.regions``, the outer cycle of each component of rings with a cycle of the
    face that the component lies in. w: the `Workspace`; its tree is overwritten, but for the marks. names: scratch, one
    entry a point. sizes: the numbers of vertices, cycles and RUN edges."""
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
        for place in range(n_components):  # order: neighbours in the plane visit the same nodes
            if stop[0]:
                return
            _mark_enclosing_boxes(components, tree.places[place], n_components, tree)
        m = _gather_edges(edges, components, n, tree, names)
    if m > 0:
        build_tree(tree, m, stop)
    for k in range(n_components):
        if k & OFTEN == 0 and stop[0]:
            return
        top, beyond, above = components.highest[k], n_cycles, NOTHING
        if components.state[k] & _IS_UNKNOWN:
            above = edge_above(edges, tree, names, top, m)
        if above != NOTHING:
            beyond = faces.cycle[half_below(edges, w.events, w.along, points, w.chains, above, top)]
        outer = faces.cycle[stars.half[stars.ends[stars.node_of[root_of(points, top)]] - 1]]
        unite(faces.joined, outer, beyond)
        unite(faces.regions, outer, beyond)
