"""Overlays compiled: many pairs of polygons from flat arrays to flat arrays, without the interpreter.

    edges -> contacts -> events along edges -> chains -> stars -> faces, labels -> boundary rings -> doubles

The steps are those of overlay.py on chains instead of single edges, so that after the contacts the work follows the
number of crossings. Decisions are exact throughout. A pair is left OPEN, for the path in Python integers, where

- a coordinate is neither zero nor within 2^-120 .. 2^120, so that expansions might lose bits;
- a coordinate of the result cannot be rounded from double-doubles and exact signs;
- it has rings of which rounding left no sure shell.

A pair is left UNVOUCHED where rounding came so near another edge that neither clearance.py nor ring_certificate.py
vouches for the rounded rings, or put a vertex on the line of its neighbours: its rounded rings may cross. They come
back as another pair then, each ring a source of its own (ring_labels.py).

The intersection of two convex rings is convex.py's where floating point is sure of all that it asks.

Scratch arrays come from the caller, who gives more and calls again where they do not suffice: nothing here allocates,
so nothing counts references to arrays.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.jit import bare_kernel, inline
from engine.polygon_overlay.compiled.chain_faces import NOTHING, edge_above, half_below, join, number_cycles
from engine.polygon_overlay.compiled.chain_rings import choose_boundary, walk_rings
from engine.polygon_overlay.compiled.chains import Chains, build_chains, build_stars
from engine.polygon_overlay.compiled.clearance import CLEARANCE, corners_are_clear
from engine.polygon_overlay.compiled.convex import UNSETTLED, Passages, intersect_convex
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_contacts import OFTEN, POLL, Events, root_of, unite
from engine.polygon_overlay.compiled.edge_crossings import FEW, find_contacts
from engine.polygon_overlay.compiled.edge_events import sort_events
from engine.polygon_overlay.compiled.edge_tree import RUN, build_tree
from engine.polygon_overlay.compiled.expanding import LEFT_OUT, count_left_out
from engine.polygon_overlay.compiled.loading import box_of, fill_boxes, load_rings, magnitude, mark_runs, mark_short
from engine.polygon_overlay.compiled.ring_certificate import certify, has_straight_point
from engine.polygon_overlay.compiled.ring_labels import RingLabels
from engine.polygon_overlay.compiled.ring_order import rank_rings
from engine.polygon_overlay.compiled.rounded_crossings import LOST, round_crossing
from engine.polygon_overlay.compiled.workspace import Buffers, Workspace, rows_of
from engine.predicates.ranges import LARGEST

DONE: Final = 0
OPEN: Final = 1
UNVOUCHED: Final = 2
FINISHED: Final = 0
NEEDS_CONTACTS: Final = 1
"""The pair reached has more contacts than there is scratch for."""
NEEDS_OUTPUT: Final = 2
"""The pair reached has more vertices or rings than the output has room for."""
_UNKNOWN: Final = -2.0
"""Error of a crossing that is not rounded yet."""


@inline
def _join_faces(
    edges: Edges, events: Events, chains: Chains, n: int, n_rings: int, rings: Any, tops: Any, highest: Any,
    node_of: Any, points: Any, starts: Any, order: Any, chain_at: Any, star: Any, star_ends: Any, cycle: Any,
    n_cycles: int, marks: Any, tree: Any, places: Any, stack: Any, joined: Any, label: Any, regions: Any, stop: Any,
) -> None:  # fmt: skip
    """Join the outer cycle of each component of rings to the face it lies in; n_cycles is the unbounded face."""
    x, y = edges.x, edges.y
    for i in range(n_cycles + 1):
        if i & POLL == 0 and stop[0]:
            return
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
        above = edge_above(edges, top, n, marks, tree, places, n > FEW, stack)
        if above != NOTHING:
            beyond = cycle[half_below(edges, events, chains, starts, order, points, chain_at, above, top, n)]
        join(joined, label, outer, beyond, 0)
        unite(regions, outer, beyond)


@inline
def _round_points(w: Workspace, n: int, n_crossings: int, n_points: int, stop: Any) -> float:
    """Round the points of all rings; return how far a point moved, or LOST."""
    x, y, error = w.edges.x, w.edges.y, w.crossing_error
    error[:n_crossings] = _UNKNOWN
    farthest = 0.0
    lost = False
    for k in range(n_points):
        if k & OFTEN == 0 and stop[0]:
            return LOST
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
    return LOST if lost else farthest


@inline
def _write(
    w: Workspace, n: int, n_found: int, labels: RingLabels, vertices: Any, sources: Any, rings: Any, pieces: Any,
    evidence: Any, n_out: int, n_rings: int, n_pieces: int, stop: Any,
) -> None:  # fmt: skip
    """Append the rings in their order to the output, from its entries n_out, n_rings and n_pieces on."""
    for k in range(n_found):
        ring = w.ranking.order[k] if n_found > 1 else 0
        first, last = w.found.offset[ring], w.found.offset[ring + 1]
        i = w.ranking.start[ring]
        for _ in range(last - first):
            if n_out & POLL == 0 and stop[0]:
                return
            point = w.found.point[i]
            vertices[n_out, 0], vertices[n_out, 1] = w.x[i], w.y[i]
            if point < n:
                sources[n_out, 0], sources[n_out, 1] = w.origins[point], LEFT_OUT if w.found.meets[i] & RUN else -1
            else:
                sources[n_out, 0] = w.origins[w.events.first[point - n]]
                sources[n_out, 1] = w.origins[w.events.second[point - n]]
            n_out += 1
            i = i + 1 if i + 1 < last else first
        rings[n_rings + k + 1] = n_out
        if labels.shells.shape[0] > 0:
            is_hole = w.ranking.is_hole[ring]
            evidence[n_rings + k] = labels.beyond[ring] if is_hole else labels.gathered[w.found.region[ring]]
        n_pieces += int(not w.ranking.is_hole[ring])
        pieces[n_pieces] = n_rings + k + 1


@inline
def _write_ring(w: Workspace, m: int, low: int, vertices: Any, sources: Any, n_out: int) -> None:
    """Append the ring that intersect_convex left, from its point ``low`` on."""
    i = low
    for k in range(n_out, n_out + m):
        vertices[k, 0], vertices[k, 1] = w.x[i], w.y[i]
        sources[k, 0], sources[k, 1] = w.found.point[i], w.places[i]
        i = i + 1 if i + 1 < m else 0


@bare_kernel
def overlay_pairs(
    subjects: Any, subject_rings: Any, subject_items: Any, clips: Any, clip_rings: Any, clip_items: Any,
    first_item: int, last_item: int, begin: int, n_loaded: int, n_loaded_rings: int, n_runs: int, extent: float,
    kept: Any, bits: Any, shells: Any, stop: Any, buffers: Buffers,
    status: Any, counts: Any, displacement: Any, vertices: Any, sources: Any, rings: Any, pieces: Any, evidence: Any,
) -> tuple[int, int, int, int, int, int, int]:  # fmt: skip
    """Overlay the pairs ``begin`` .. ``last_item - 1`` of those from ``first_item`` on.

    subjects, clips: (n, 2) float64 vertices; subject_rings, clip_rings: where each ring begins, and its end;
    subject_items, clip_items: the first ring of each polygon, and the end of the last one's. kept: (4,) uint8 by label.
    bits, shells: empty; or, for rounded rings as subjects, no clips, and kept all but the first, by ring its bit, and
    by bit that of its shell (ring_labels.py): those of a single pair, or of many of which each ring has a bit of its
    own, counted from the pair's first ring, one pair after another.
    Fills, by pair from first_item on: status, (pairs,) int8; counts, (pairs, 4) int64: pieces, rings, vertices, pairs
    of edges beyond the filter; displacement, (pairs,) float64: how far rounding moved a vertex at most.
    Fills, pair after pair from the beginning: vertices (m, 2) float64, sources (m, 2) int32; int64, from their second
    entries on, the first of which are zero: rings, where each ends, and pieces, the end of each one's rings; with
    shells also evidence, by ring int64.
    A source is the input vertex and -1, or the first vertices of the two edges that cross; clip vertices are counted
    after those of all subjects. The input vertex and LEFT_OUT where the vertices up to the next source are left out.
    n_loaded, n_loaded_rings, n_runs, extent: what reduce_pair returned for the only pair; no vertices, no such pair.
    Returns the pair reached, FINISHED or what is needed to go on with it, numbers of vertices, rings, pieces, how many
    contacts there was scratch used for at most, and how many vertices are left out.
    """
    w = rows_of(buffers)
    edges, events, chains, found = w.edges, w.events, w.chains, w.found
    room = w.order.shape[0] - 9
    is_intersection = not (kept[0] or kept[1] or kept[2])
    n_out = n_out_rings = n_out_pieces = used = n_left_out = 0
    most_rings = evidence.shape[0]
    n, n_rings, largest = n_loaded, n_loaded_rings, extent
    for at in range(begin, last_item):
        item = at - first_item
        status[item], displacement[item] = OPEN, 0.0
        counts[item, 0] = counts[item, 1] = counts[item, 2] = counts[item, 3] = 0
        if stop[0]:
            break
        first, first_end = subject_items[at], subject_items[at + 1]
        labels = RingLabels(shells[first:first_end], w.gathered, w.beyond)
        if n_loaded == 0:
            second, second_end = clip_items[at], clip_items[at + 1]
            x0, x1, y0, y1 = box_of(subjects, subject_rings[first], subject_rings[first_end])
            u0, u1, v0, v1 = box_of(clips, clip_rings[second], clip_rings[second_end])
            common = max(x0, u0), min(x1, u1), max(y0, v0), min(y1, v1)
            if is_intersection and (common[0] > common[1] or common[2] > common[3]):
                status[item] = DONE
                continue
            if is_intersection and first_end - first == 1 and second_end - second == 1:
                m, low, moved_by = intersect_convex(
                    subjects, subject_rings[first], subject_rings[first_end],
                    clips, clip_rings[second], clip_rings[second_end], subjects.shape[0],
                    edges, w.origins, Passages(w.points, w.node_of), found.point, w.places, w.x, w.y, stop,
                )  # fmt: skip
                if m != UNSETTLED:
                    if n_out + m > vertices.shape[0] or n_out_rings + 1 > most_rings:
                        counts[item, 1], counts[item, 2] = 1, m
                        return at, NEEDS_OUTPUT, n_out, n_out_rings, n_out_pieces, used, 0
                    if m > 0:
                        _write_ring(w, m, low, vertices, sources, n_out)
                        n_out, n_out_rings, n_out_pieces = n_out + m, n_out_rings + 1, n_out_pieces + 1
                        rings[n_out_rings], pieces[n_out_pieces] = n_out, n_out_rings
                        counts[item, 0], counts[item, 1], counts[item, 2] = 1, 1, m
                    displacement[item] = moved_by
                    status[item] = DONE
                    continue
            whole = -np.inf, np.inf, -np.inf, np.inf
            n, n_rings, safe = load_rings(
                subjects, subject_rings, first, first_end, 1, bits, 0, edges, w.origins, w.tops, w.masks,
                whole if kept[1] else common, 0, 0, stop,
            )  # fmt: skip
            n, n_rings, also_safe = load_rings(
                clips, clip_rings, second, second_end, 2, bits, subjects.shape[0], edges, w.origins, w.tops, w.masks,
                whole if kept[2] else common, n, n_rings, stop,
            )  # fmt: skip
            largest = max(magnitude(x0, x1, y0, y1), magnitude(u0, u1, v0, v1))
            if not (safe and also_safe and largest <= LARGEST):
                continue
        margin = CLEARANCE * largest
        is_clear = fill_boxes(edges, n, margin, w.boxes, w.marks, stop) > margin
        mark_runs(edges, w.places, n_runs, w.boxes, w.marks)
        if not is_clear:
            mark_short(edges, n, margin, w.marks)
        if n > FEW:
            build_tree(w.boxes, w.marks, n, w.tree, w.tree_marks, w.places, stop)
        n_events, n_crossings, n_exact, are_far = find_contacts(
            edges, n, n_rings, margin, events, w.turn, w.points, w.marked, w.rings, w.boxes, w.marks, w.tree,
            w.tree_marks, w.places, w.lows, w.highs, w.stack, w.pairs, stop,
        )  # fmt: skip
        if stop[0]:
            break
        most = n_events  # chains and nodes: one for each event, and each vertex that is a node
        if n_events >= 0:
            for ring in range(n_rings):
                w.marked[w.tops[ring]] = 1
            for i in range(n):
                most += int(w.marked[i])
        if n_events < 0 or most > room:
            return at, NEEDS_CONTACTS, n_out, n_out_rings, n_out_pieces, room, 0
        used = max(used, most)
        are_clear = sort_events(
            edges, events, n, n_events, w.points, w.starts, w.order, w.crossing_x, w.crossing_y, w.nodes, w.turn,
            w.marks, stop,
        )  # fmt: skip
        if stop[0]:
            break
        corners_clear = corners_are_clear(edges, n, w.starts, w.crossing_x, margin, w.marks, stop)
        is_clear = is_clear and are_far and are_clear and corners_clear
        w.node_of[: n + n_crossings] = -1
        n_nodes, n_simple, n_chains, n_loose = build_chains(
            edges, events, n, w.points, w.turn, w.marked, w.starts, w.order, w.tops, w.masks, n_rings, w.node_of,
            w.nodes, chains, w.chain_at, w.star_starts, w.star_ends, w.star, w.place, w.following, stop,
        )  # fmt: skip
        if stop[0]:
            break
        build_stars(
            edges, chains, n_nodes, n_simple, w.following, n_loose, w.star_starts, w.star_ends, w.star, w.place,
            w.masks_before, w.x, w.y, stop,
        )  # fmt: skip
        if stop[0]:
            break
        n_cycles = number_cycles(
            chains, n_chains, n_simple, w.star_starts, w.star_ends, w.star, w.place, w.cycle, w.following, stop
        )
        if stop[0]:
            break
        _join_faces(
            edges, events, chains, n, n_rings, w.rings, w.tops, w.highest, w.node_of, w.points, w.starts, w.order,
            w.chain_at, w.star, w.star_ends, w.cycle, n_cycles, w.marks, w.tree, w.places, w.stack, w.joined, w.label,
            w.regions, stop,
        )  # fmt: skip
        choose_boundary(
            chains, n_chains, w.cycle, n_cycles, kept, w.star_starts, n_nodes, w.joined, w.label, w.regions, w.inside,
            w.bounds, w.fan, labels, stop,
        )  # fmt: skip
        if stop[0]:
            break
        n_found, m = walk_rings(
            edges, chains, n_chains, w.nodes, n_nodes, n_simple, w.cycle, w.inside, w.regions, w.star_starts,
            w.star_ends, w.star, w.place, w.bounds, w.fan, w.marks, w.seen, w.path, w.path_place, found, labels, stop,
        )  # fmt: skip
        if stop[0]:
            break
        moved_by = _round_points(w, n, n_crossings, m, stop)
        if moved_by == LOST:
            continue
        is_valid = True
        if moved_by > 0.0:
            is_valid = not has_straight_point(found, n_found, w.x, w.y, w.moved, stop) and (
                is_clear
                or certify(
                    found, n_found, m, w.x, w.y, w.moved, w.boxes, w.marks, w.chain_at, w.node_of, w.tree, w.tree_marks,
                    w.places, w.lows, w.highs, w.stack, w.pairs, stop,
                )
            )  # fmt: skip
        n_pieces = rank_rings(found, n_found, w.x, w.y, w.ranking, is_valid, w.label, w.boxes, stop)
        if n_pieces < 0:
            continue
        if n_out + m > vertices.shape[0] or n_out_rings + n_found > most_rings:
            counts[item, 1], counts[item, 2] = n_found, m
            return at, NEEDS_OUTPUT, n_out, n_out_rings, n_out_pieces, used, 0
        _write(
            w, n, n_found, labels, vertices, sources, rings, pieces, evidence, n_out, n_out_rings, n_out_pieces, stop
        )  # fmt: skip
        if stop[0]:
            break
        if n_runs > 0:
            for ring in range(n_found):
                n_left_out += count_left_out(sources, rings[ring], rings[ring + 1])
        n_out, n_out_rings, n_out_pieces = n_out + m, n_out_rings + n_found, n_out_pieces + n_pieces
        counts[item, 0], counts[item, 1], counts[item, 2], counts[item, 3] = n_pieces, n_found, m, n_exact
        displacement[item] = moved_by
        status[item] = DONE if is_valid else UNVOUCHED
    return last_item, FINISHED, n_out, n_out_rings, n_out_pieces, used, n_left_out
