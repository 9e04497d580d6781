"""Overlays compiled: many pairs of polygons from flat arrays to flat arrays, without the interpreter.

    edges -> contacts -> events along edges -> chains -> stars -> faces, labels -> boundary rings -> doubles

The steps are those of overlay.py on chains instead of single edges, so that after the contacts the work follows the
number of crossings. What lies outside of the other polygon's box and cannot be in the result is cut short at once:
vertices that follow each other beyond one side of the common box give way to the first and the last of them, which
moves the boundary there only. Decisions are exact throughout. A pair is left OPEN, for the path in Python integers,
where

- a coordinate is neither zero nor within 2^-120 .. 2^120, so that expansions might lose bits;
- a coordinate of the result cannot be rounded from double-doubles and exact signs;
- rounding came so near another edge that ring_certificate.py cannot vouch for the rounded rings.

Scratch arrays come from the caller, who gives more and calls again where they do not suffice: code that allocates
takes most of its compiler's time.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrangement.chain_faces import NOTHING, edge_above, half_below, join, number_cycles
from engine.arrangement.chain_rings import Rings, choose_boundary, walk_rings
from engine.arrangement.chains import Chains, build_chains, build_stars
from engine.arrangement.crossing_signs import Edges
from engine.arrangement.edge_contacts import Events, enter_contact, root_of, unite
from engine.arrangement.edge_events import sort_events
from engine.arrangement.edge_tree import (
    ANYWHERE,
    DEEPEST,
    LEAF,
    PORTION,
    WANTED,
    boxes_meet,
    build_tree,
    heading,
    next_pairs,
)
from engine.arrangement.ring_certificate import certify
from engine.arrangement.ring_order import Ranking, rank_rings
from engine.arrangement.rounded_crossings import LOST, round_crossing
from engine.clipping.cut_point import is_safe
from engine.jit import inline, kernel, merged
from engine.predicates.orientation import BOUND_2D, GUARD_2D

DONE: Final = 0
OPEN: Final = 1
FINISHED: Final = 0
NEEDS_CONTACTS: Final = 1
"""The pair reached has more contacts than there is scratch for."""
NEEDS_OUTPUT: Final = 2
"""The pair reached has more vertices or rings than the output has room for."""
_FEW: Final = 40
"""Edges up to which all pairs of boxes are looked at: fewer steps than a tree."""
_UNKNOWN: Final = -2.0
"""Error of a crossing that is not rounded yet."""


class Workspace(NamedTuple):
    """Scratch of one chunk.

    By vertex of a pair: edges, origins, chain_at, starts. By ring: tops, masks, rings, highest. By contact: events,
    order, nodes, chains and what follows from them. points, node_of, marked: by vertex and contact.
    """

    edges: Edges
    origins: Any
    chain_at: Any
    starts: Any
    marked: Any
    tops: Any
    masks: Any
    rings: Any
    highest: Any
    boxes: Any
    marks: Any
    tree: Any
    tree_marks: Any
    places: Any
    stack: Any
    pairs: Any
    points: Any
    node_of: Any
    events: Events
    order: Any
    nodes: Any
    chains: Chains
    masks_before: Any
    star_starts: Any
    star_ends: Any
    star: Any
    place: Any
    cycle: Any
    following: Any
    joined: Any
    label: Any
    regions: Any
    inside: Any
    bounds: Any
    seen: Any
    fan: Any
    path: Any
    path_place: Any
    found: Rings
    crossing_x: Any
    crossing_y: Any
    crossing_error: Any
    x: Any
    y: Any
    moved: Any
    ranking: Ranking


def workspace_for(n_vertices: int, n_rings: int, n_contacts: int) -> Workspace:
    """Return scratch for pairs of up to so many vertices, rings and contacts."""
    n, k = n_vertices + 1, n_contacts + 8
    m = n + 2 * k  # points of all boundary rings: every vertex once, every end of a chain on two sides
    n_leaves = 1
    while n_leaves * LEAF < m:  # bound: 60 doublings
        n_leaves *= 2

    def ints(size: int) -> Any:
        return np.empty(size, np.int64)

    def octets(size: int) -> Any:
        return np.empty(size, np.uint8)

    return Workspace(
        edges=Edges(np.empty(n), np.empty(n), ints(n), ints(n), ints(n)),
        origins=ints(n),
        chain_at=ints(m),
        starts=ints(n + 1),
        marked=octets(n),
        tops=ints(n_rings + 1),
        masks=ints(n_rings + 1),
        rings=ints(n_rings + 1),
        highest=ints(n_rings + 1),
        boxes=np.empty((m, 4)),
        marks=octets(m),
        tree=np.empty((2 * n_leaves, 4)),
        tree_marks=octets(2 * n_leaves),
        places=ints(m),
        stack=np.empty((DEEPEST, 2), np.int64),
        pairs=np.empty((PORTION, 2), np.int64),
        points=ints(n + k),
        node_of=ints(n + k),
        events=Events(ints(k), ints(k), ints(k), np.empty(k), np.empty(k), ints(k), ints(k)),
        order=ints(k),
        nodes=ints(k),
        chains=Chains(ints(k), ints(k), ints(k), ints(k), ints(k), ints(k)),
        masks_before=ints(k),
        star_starts=ints(k + 1),
        star_ends=ints(k),
        star=ints(2 * k),
        place=ints(2 * k),
        cycle=ints(2 * k),
        following=ints(2 * k),
        joined=ints(2 * k + 1),
        label=ints(2 * k + 1),
        regions=ints(2 * k + 1),
        inside=octets(2 * k + 1),
        bounds=octets(k),
        seen=octets(2 * k),
        fan=ints(k),
        path=ints(2 * k),
        path_place=ints(k),
        found=Rings(ints(m), octets(m), ints(k + 1), ints(k)),
        crossing_x=np.empty(k),
        crossing_y=np.empty(k),
        crossing_error=np.empty(k),
        x=np.empty(m),
        y=np.empty(m),
        moved=octets(m),
        ranking=Ranking(ints(k), np.empty(k), octets(k), ints(k), ints(k), ints(k)),
    )


@inline
def _load(
    vertices: Any, offsets: Any, first_ring: int, last_ring: int, mask: int, base: int, edges: Edges, origins: Any,
    tops: Any, masks: Any, box: tuple[float, float, float, float], n: int, n_rings: int,
) -> tuple[int, int, bool]:  # fmt: skip
    """Append rings without repeated points; return the numbers of vertices and rings, and whether all are in range.

    base: what is added to the number of a vertex in ``origins``. box: x_min, x_max, y_min, y_max; of vertices beyond
    one of its sides, one after another, only the first and the last count.
    """
    x_min, x_max, y_min, y_max = box
    x, y = edges.x, edges.y
    safe = True
    for ring in range(first_ring, last_ring):
        start = n
        sides = sides_before = 0  # of the last vertex and of the one before it: which sides of the box it is beyond
        for k in range(offsets[ring], offsets[ring + 1]):
            px, py = vertices[k, 0], vertices[k, 1]
            safe = safe and is_safe(px) and is_safe(py)
            if n > start and x[n - 1] == px and y[n - 1] == py:
                continue
            beyond = 1 * (px < x_min) + 2 * (px > x_max) + 4 * (py < y_min) + 8 * (py > y_max)
            if beyond & sides & sides_before:  # a triangle beyond that side changes no label in the box
                n -= 1
                if x[n - 1] == px and y[n - 1] == py:
                    origins[n - 1] = base + k  # the next edge begins here
                    sides, sides_before = sides_before, 0
                    continue
            else:
                sides_before = sides
            sides = beyond
            x[n], y[n], origins[n] = px, py, base + k
            n += 1
        while n > start + 1 and x[n - 1] == x[start] and y[n - 1] == y[start]:
            n -= 1
        if n - start < 3:  # a point, or an edge there and back
            n = start
            continue
        top = start
        for k in range(start, n):
            edges.after[k], edges.before[k], edges.ring[k] = k + 1, k - 1, n_rings
            if x[k] > x[top] or (x[k] == x[top] and y[k] > y[top]):
                top = k
        edges.after[n - 1], edges.before[start] = start, n - 1
        tops[n_rings], masks[n_rings] = top, mask
        n_rings += 1
    return n, n_rings, safe


@inline
def _box_of(vertices: Any, first: int, last: int) -> tuple[float, float, float, float]:
    """Return x_min, x_max, y_min, y_max of some vertices; inverted where there is none."""
    x_min = y_min = np.inf
    x_max = y_max = -np.inf
    for k in range(first, last):
        px, py = vertices[k, 0], vertices[k, 1]
        x_min, x_max = min(x_min, px), max(x_max, px)
        y_min, y_max = min(y_min, py), max(y_max, py)
    return x_min, x_max, y_min, y_max


@inline
def _find_contacts(
    edges: Edges, n: int, n_rings: int, events: Events, parent: Any, marked: Any, rings: Any, boxes: Any, marks: Any,
    tree: Any, tree_marks: Any, places: Any, stack: Any, pairs: Any, stop: Any,
) -> tuple[int, int, int]:  # fmt: skip
    """Enter all contacts; return the numbers of events (-1: no room), crossings and pairs beyond the filter."""
    for i in range(n):
        parent[i] = i
    marked[:n] = 0
    for ring in range(n_rings):
        rings[ring] = ring
    room = min(events.edge.shape[0] - 4, 2 * (events.first.shape[0] - 1))
    x, y, after = edges.x, edges.y, edges.after
    n_events = n_crossings = n_exact = 0
    stack[0, 0], stack[0, 1], depth = 1, 1, 1
    is_small = n <= _FEW
    while depth > 0 and not stop[0]:  # bound: the walk through the tree
        if is_small:
            found, depth = _all_pairs(boxes, n, pairs), 0
        else:
            found, depth = next_pairs(boxes, marks, n, tree, tree_marks, places, stack, depth, pairs)
        for k in range(found):
            i, j = pairs[k, 0], pairs[k, 1]
            b, d = after[i], after[j]
            turn_c, turn_d, bound = _turns(x, y, np.uint64(i), np.uint64(b), np.uint64(j), np.uint64(d))
            sure = abs(turn_c) > bound and abs(turn_d) > bound
            if (
                (sure and (turn_c > 0.0) == (turn_d > 0.0))
                or (b == j and abs(turn_d) > bound)
                or (d == i and abs(turn_c) > bound)
            ):
                continue  # both ends on one side, or consecutive edges that are not in line
            turn_a, turn_b, bound_ab = _turns(x, y, np.uint64(j), np.uint64(d), np.uint64(i), np.uint64(b))
            sure_ab = abs(turn_a) > bound_ab and abs(turn_b) > bound_ab
            if sure_ab and (turn_a > 0.0) == (turn_b > 0.0):
                continue
            if n_events > room:
                return -1, 0, 0
            if sure and sure_ab:
                unite(rings, edges.ring[i], edges.ring[j])
                n_events = _add_crossing(
                    events, n_events, n_crossings, n, parent, i, j, turn_a, turn_b, bound_ab, turn_c, turn_d, bound
                )
                n_crossings += 1
                continue
            n_events, n_crossings = enter_contact(edges, events, n_events, n_crossings, n, parent, marked, rings, i, j)
            n_exact += 1
    return n_events, n_crossings, n_exact


@merged
def _add_crossing(
    events: Events, n_events: int, n_crossings: int, n: int, parent: Any, e: int, f: int, turn_a: float, turn_b: float,
    bound_ab: float, turn_c: float, turn_d: float, bound_cd: float,
) -> int:  # fmt: skip
    """Enter a proper crossing whose signs are sure; return the number of events.

    t = A / (A + B), with A and B off by r at most, is off by r / (A + B), and by three roundings.
    """
    crossing = n + n_crossings
    parent[crossing] = crossing
    events.first[n_crossings], events.second[n_crossings] = e, f
    for edge, other, near, far, bound in ((e, f, turn_a, turn_b, bound_ab), (f, e, turn_c, turn_d, bound_cd)):
        total = abs(near) + abs(far)
        events.edge[n_events], events.point[n_events], events.other[n_events] = edge, crossing, other
        events.t[n_events], events.slack[n_events] = abs(near) / total, bound / total + 2.0**-50
        n_events += 1
    return n_events


@inline
def _all_pairs(boxes: Any, n: int, pairs: Any) -> int:
    """Write the pairs of boxes that meet, of so few that all fit; return how many."""
    found = 0
    for i in range(n):
        for j in range(i + 1, n):
            pairs[found, 0], pairs[found, 1] = i, j
            found += boxes_meet(boxes, i, boxes, j)
    return found


@merged
def _turns(x: Any, y: Any, a: int, b: int, c: int, d: int) -> tuple[float, float, float]:
    """Return orient(a, b, c) and orient(a, b, d) in floating point, and a bound for the errors of both."""
    ux, uy = x[b] - x[a], y[b] - y[a]
    left, right = ux * (y[c] - y[a]), uy * (x[c] - x[a])
    far_left, far_right = ux * (y[d] - y[a]), uy * (x[d] - x[a])
    size = max(abs(left) + abs(right), abs(far_left) + abs(far_right))
    return left - right, far_left - far_right, BOUND_2D * size + GUARD_2D


@inline
def _join_faces(
    edges: Edges, events: Events, chains: Chains, n: int, n_rings: int, rings: Any, tops: Any, highest: Any,
    node_of: Any, points: Any, starts: Any, order: Any, chain_at: Any, star: Any, star_ends: Any, cycle: Any,
    n_cycles: int, tree: Any, places: Any, stack: Any, joined: Any, label: Any, regions: Any, stop: Any,
) -> None:  # fmt: skip
    """Join the outer cycle of each component of rings to the face it lies in; n_cycles is the unbounded face."""
    x, y = edges.x, edges.y
    for i in range(n_cycles + 1):
        joined[i] = regions[i] = i
        label[i] = 0
    for ring in range(n_rings):
        highest[ring] = -1
    for ring in range(n_rings):
        root, top = root_of(rings, ring), tops[ring]
        best = highest[root]
        if best < 0 or x[top] > x[best] or (x[top] == x[best] and y[top] > y[best]):
            highest[root] = top
    for ring in range(n_rings):
        top = highest[ring]
        if top < 0:
            continue
        if stop[0]:
            return
        node = node_of[root_of(points, top)]
        outer = cycle[star[star_ends[node] - 1]]
        beyond = n_cycles
        above = edge_above(edges, top, n, tree, places, n > _FEW, stack)
        if above != NOTHING:
            beyond = cycle[half_below(edges, events, chains, starts, order, points, chain_at, above, top, n)]
        join(joined, label, outer, beyond, 0)
        unite(regions, outer, beyond)


@inline
def _round_points(w: Workspace, n: int, n_crossings: int, n_points: int) -> tuple[float, float]:
    """Round the points of all rings; return the largest coordinate, and how far a point moved or LOST."""
    x, y, error = w.edges.x, w.edges.y, w.crossing_error
    error[:n_crossings] = _UNKNOWN
    farthest = largest = 0.0
    lost = False
    for k in range(n_points):
        point = w.found.point[k]
        if point < n:
            w.x[k], w.y[k], w.moved[k] = x[point] + 0.0, y[point] + 0.0, 0
        else:
            c = point - n
            if error[c] == _UNKNOWN:
                cx, cy, ex, ey = round_crossing(w.edges, w.events.first[c], w.events.second[c])
                lost = lost or ex < 0.0 or ey < 0.0
                w.crossing_x[c], w.crossing_y[c] = cx, cy
                error[c] = np.sqrt(ex * ex + ey * ey) * (1.0 + 2.0**-50)  # two squares, their sum, a root
                farthest = max(farthest, error[c])
            w.x[k], w.y[k], w.moved[k] = w.crossing_x[c], w.crossing_y[c], error[c] > 0.0
        largest = max(largest, abs(w.x[k]), abs(w.y[k]))
    return largest, LOST if lost else farthest


@inline
def _write(
    w: Workspace, n: int, n_found: int, vertices: Any, sources: Any, sizes: Any, pieces: Any, n_out: int, n_rings: int,
    n_pieces: int,
) -> None:  # fmt: skip
    """Append the rings in their order to the output, from its entries n_out, n_rings and n_pieces on."""
    n_pieces -= 1
    for k in range(n_found):
        ring = w.ranking.order[k] if n_found > 1 else 0
        first, last = w.found.offset[ring], w.found.offset[ring + 1]
        i = w.ranking.start[ring]
        for _ in range(last - first):
            point = w.found.point[i]
            vertices[n_out, 0], vertices[n_out, 1] = w.x[i], w.y[i]
            if point < n:
                sources[n_out, 0], sources[n_out, 1] = w.origins[point], -1
            else:
                sources[n_out, 0] = w.origins[w.events.first[point - n]]
                sources[n_out, 1] = w.origins[w.events.second[point - n]]
            n_out += 1
            i = i + 1 if i + 1 < last else first
        sizes[n_rings + k] = last - first
        if w.ranking.is_hole[ring]:
            pieces[n_pieces] += 1
        else:
            n_pieces += 1
            pieces[n_pieces] = 1


@kernel
def overlay_pairs(
    subjects: Any, subject_rings: Any, subject_items: Any, clips: Any, clip_rings: Any, clip_items: Any,
    first_item: int, last_item: int, begin: int, kept: Any, stop: Any, w: Workspace,
    status: Any, counts: Any, displacement: Any, vertices: Any, sources: Any, sizes: Any, pieces: Any,
) -> tuple[int, int, int, int, int]:  # fmt: skip
    """Overlay the pairs ``begin`` .. ``last_item - 1`` of those from ``first_item`` on.

    subjects, clips: (n, 2) float64 vertices; subject_rings, clip_rings: where each ring begins, and its end;
    subject_items, clip_items: the first ring of each polygon, and the end of the last one's. kept: (4,) uint8 by label.
    Fills, by pair from first_item on: status, (pairs,) int8, DONE or OPEN; counts, (pairs, 4) int64: pieces, rings,
    vertices, pairs of edges beyond the filter; displacement, (pairs,) float64: how far rounding moved a vertex at most.
    Fills, pair after pair from the beginning: vertices (m, 2) float64, sources (m, 2) int64, sizes (vertices by ring)
    and pieces (rings by piece).
    A source is the input vertex and -1, or the first vertices of the two edges that cross; clip vertices are counted
    after those of all subjects.
    Returns the pair reached, FINISHED or what is needed to go on with it, and numbers of vertices, rings, pieces.
    """
    edges, events, chains, found = w.edges, w.events, w.chains, w.found
    x, y, after = edges.x, edges.y, edges.after
    room = w.order.shape[0] - 8
    n_out = n_out_rings = n_out_pieces = 0
    for at in range(begin, last_item):
        item = at - first_item
        status[item], displacement[item] = OPEN, 0.0
        counts[item, 0] = counts[item, 1] = counts[item, 2] = counts[item, 3] = 0
        if stop[0]:
            break
        first, first_end = subject_items[at], subject_items[at + 1]
        second, second_end = clip_items[at], clip_items[at + 1]
        x0, x1, y0, y1 = _box_of(subjects, subject_rings[first], subject_rings[first_end])
        u0, u1, v0, v1 = _box_of(clips, clip_rings[second], clip_rings[second_end])
        common = max(x0, u0), min(x1, u1), max(y0, v0), min(y1, v1)
        whole = -np.inf, np.inf, -np.inf, np.inf
        n, n_rings, safe = _load(
            subjects, subject_rings, first, first_end, 1, 0, edges, w.origins, w.tops, w.masks,
            whole if kept[1] else common, 0, 0,
        )  # fmt: skip
        n, n_rings, also_safe = _load(
            clips, clip_rings, second, second_end, 2, subjects.shape[0], edges, w.origins, w.tops, w.masks,
            whole if kept[2] else common, n, n_rings,
        )  # fmt: skip
        if not (safe and also_safe):
            continue
        for i in range(n):
            j = after[i]
            w.boxes[i, 0], w.boxes[i, 1] = min(x[i], x[j]), max(x[i], x[j])
            w.boxes[i, 2], w.boxes[i, 3] = min(y[i], y[j]), max(y[i], y[j])
            w.marks[i] = WANTED | (heading(x[j] - x[i], y[j] - y[i]) if j == i + 1 else ANYWHERE)
        if n > _FEW:
            build_tree(w.boxes, w.marks, n, w.tree, w.tree_marks, w.places)
        n_events, n_crossings, n_exact = _find_contacts(
            edges, n, n_rings, events, w.points, w.marked, w.rings, w.boxes, w.marks, w.tree, w.tree_marks, w.places,
            w.stack, w.pairs, stop,
        )  # fmt: skip
        most = n_events  # chains and nodes: one for each event, and each vertex that is a node
        if n_events >= 0:
            for ring in range(n_rings):
                w.marked[w.tops[ring]] = 1
            for i in range(n):
                most += w.marked[i]
        if n_events < 0 or most > room:
            return at, NEEDS_CONTACTS, n_out, n_out_rings, n_out_pieces
        sort_events(edges, events, n, n_events, w.points, w.starts, w.order, stop)
        w.node_of[: n + n_crossings] = -1
        n_nodes, n_chains = build_chains(
            edges, events, w.points, w.marked, w.starts, w.order, w.tops, w.masks, n_rings, w.node_of, w.nodes, chains,
            w.chain_at,
        )  # fmt: skip
        build_stars(
            edges, chains, n_nodes, n_chains, w.star_starts, w.star_ends, w.star, w.place, w.masks_before, w.x, w.y,
            stop,
        )  # fmt: skip
        if stop[0]:
            break
        n_cycles = number_cycles(
            chains, n_chains, w.star_starts, w.star_ends, w.star, w.place, w.cycle, w.following, stop
        )
        if stop[0]:
            break
        _join_faces(
            edges, events, chains, n, n_rings, w.rings, w.tops, w.highest, w.node_of, w.points, w.starts, w.order,
            w.chain_at, w.star, w.star_ends, w.cycle, n_cycles, w.tree, w.places, w.stack, w.joined, w.label, w.regions,
            stop,
        )  # fmt: skip
        choose_boundary(
            chains, n_chains, w.cycle, n_cycles, kept, w.star_starts, n_nodes, w.joined, w.label, w.regions, w.inside,
            w.bounds, w.fan,
        )  # fmt: skip
        n_found, m = walk_rings(
            edges, chains, n_chains, w.nodes, n_nodes, w.cycle, w.inside, w.regions, w.star_starts, w.star_ends, w.star,
            w.place, w.bounds, w.fan, w.seen, w.path, w.path_place, found, stop,
        )  # fmt: skip
        if stop[0]:
            break
        largest, moved_by = _round_points(w, n, n_crossings, m)
        if moved_by == LOST:
            continue
        if moved_by > 0.0 and not certify(
            found, n_found, m, w.x, w.y, w.moved, largest, w.boxes, w.marks, w.chain_at, w.tree, w.tree_marks, w.places,
            w.stack, w.pairs, stop,
        ):  # fmt: skip
            continue
        n_pieces = rank_rings(found, n_found, w.x, w.y, w.ranking, w.label)
        if n_pieces < 0:
            continue
        if n_out + m > vertices.shape[0] or n_out_rings + n_found > sizes.shape[0]:
            counts[item, 1], counts[item, 2] = n_found, m
            return at, NEEDS_OUTPUT, n_out, n_out_rings, n_out_pieces
        _write(w, n, n_found, vertices, sources, sizes, pieces, n_out, n_out_rings, n_out_pieces)
        n_out, n_out_rings, n_out_pieces = n_out + m, n_out_rings + n_found, n_out_pieces + n_pieces
        counts[item, 0], counts[item, 1], counts[item, 2], counts[item, 3] = n_pieces, n_found, m, n_exact
        displacement[item] = moved_by
        status[item] = DONE
    return last_item, FINISHED, n_out, n_out_rings, n_out_pieces
