"""Overlays compiled: many pairs of polygons from flat arrays to flat arrays, without the interpreter.

    edges -> contacts -> events along edges -> chains -> stars -> faces, labels -> boundary rings -> doubles

The steps are those of overlay.py on chains instead of single edges, so that after the contacts the work follows the
number of crossings. Decisions are exact throughout. A pair is left OPEN, for the path in Python integers, where

- a coordinate is neither zero nor within 2^-120 .. 2^120, so that expansions might lose bits;
- a coordinate of the result cannot be rounded from double-doubles and exact signs;
- rounding came so near another edge that ring_certificate.py cannot vouch for the rounded rings.

Scratch arrays live as long as a chunk and grow when a pair needs more.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrangement.chain_faces import NOTHING, edge_above, half_below, join, number_cycles
from engine.arrangement.chain_rings import Rings, choose_boundary, walk_rings
from engine.arrangement.chains import Chains, build_chains, build_stars
from engine.arrangement.crossing_signs import Edges
from engine.arrangement.edge_contacts import Events, enter_contact, root_of, unite
from engine.arrangement.edge_events import sort_events
from engine.arrangement.edge_tree import DEEPEST, PORTION, boxes_meet, build_tree, leaves_of, next_pairs
from engine.arrangement.ring_certificate import certify
from engine.arrangement.ring_order import Ranking, rank_rings
from engine.arrangement.rounded_crossings import round_crossing
from engine.clipping.cut_point import is_safe
from engine.jit import inline, kernel, merged
from engine.predicates.orientation import BOUND_2D, GUARD_2D

DONE: Final = 0
OPEN: Final = 1
_FEW: Final = 40
"""Edges up to which all pairs of boxes are looked at: fewer steps than a tree."""


@inline
def _ints(array: Any, size: int) -> Any:
    """Return `array` if it has room for `size` numbers, else a new one."""
    return array if array.shape[0] >= size else np.empty(size + size // 2, np.int64)


@inline
def _floats(array: Any, size: int) -> Any:
    return array if array.shape[0] >= size else np.empty(size + size // 2)


@inline
def _bytes(array: Any, size: int) -> Any:
    return array if array.shape[0] >= size else np.empty(size + size // 2, np.uint8)


@inline
def _boxes(array: Any, size: int) -> Any:
    return array if array.shape[0] >= size else np.empty((size + size // 2, 4))


@inline
def _load(
    vertices: Any, offsets: Any, first_ring: int, last_ring: int, mask: int, base: int, edges: Edges, origins: Any,
    tops: Any, masks: Any, n: int, n_rings: int,
) -> tuple[int, int, bool]:  # fmt: skip
    """Append rings without repeated points; return the numbers of vertices and rings, and whether all are in range.

    base: what is added to the number of a vertex in ``origins``.
    """
    x, y = edges.x, edges.y
    safe = True
    for ring in range(first_ring, last_ring):
        start = n
        for k in range(offsets[ring], offsets[ring + 1]):
            px, py = vertices[k, 0], vertices[k, 1]
            safe = safe and is_safe(px) and is_safe(py)
            if n > start and x[n - 1] == px and y[n - 1] == py:
                continue
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
            turn_c, turn_d, bound = _turns(x, y, i, b, j, d)
            sure = abs(turn_c) > bound and abs(turn_d) > bound
            if (
                (sure and (turn_c > 0.0) == (turn_d > 0.0))
                or (b == j and abs(turn_d) > bound)
                or (d == i and abs(turn_c) > bound)
            ):
                continue  # both ends on one side, or consecutive edges that are not in line
            turn_a, turn_b, bound_ab = _turns(x, y, j, d, i, b)
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


@kernel
def overlay_pairs(
    subjects: Any, subject_rings: Any, subject_items: Any, clips: Any, clip_rings: Any, clip_items: Any,
    first_item: int, last_item: int, kept: Any, stop: Any,
    status: Any, counts: Any, displacement: Any,
) -> Any:  # fmt: skip
    """Overlay the pairs ``first_item`` .. ``last_item - 1``.

    subjects, clips: (n, 2) float64 vertices; subject_rings, clip_rings: where each ring begins, and its end;
    subject_items, clip_items: the first ring of each polygon, and the end of the last one's. kept: (4,) uint8 by label.
    Fills, by pair from first_item on: status, (pairs,) int8, DONE or OPEN; counts, (pairs, 4) int64: pieces, rings,
    vertices, pairs of edges beyond the filter; displacement, (pairs,) float64: how far rounding moved a vertex at most.
    Returns vertices (m, 2) float64, sources (m, 2) int64, ring sizes and rings by piece, all pairs one after another. A
    source is the input vertex and -1, or the first vertices of the two edges that cross; clip vertices are counted
    after those of all subjects.
    """
    x, y = np.empty(64), np.empty(64)
    after, before, ring_of = np.empty(64, np.int64), np.empty(64, np.int64), np.empty(64, np.int64)
    origins, tops, masks, rings, highest = after.copy(), after.copy(), after.copy(), after.copy(), after.copy()
    boxes, marks, tree, tree_marks = (
        np.empty((64, 4)),
        np.empty(64, np.uint8),
        np.empty((64, 4)),
        np.empty(64, np.uint8),
    )
    places = after.copy()
    stack, pairs = np.empty((DEEPEST, 2), np.int64), np.empty((PORTION, 2), np.int64)
    points, marked, chain_at, starts = after.copy(), np.empty(64, np.uint8), after.copy(), after.copy()
    capacity = 128
    event_edge, event_point = np.empty(capacity, np.int64), np.empty(capacity, np.int64)
    event_other, event_t, event_slack = np.empty(capacity, np.int64), np.empty(capacity), np.empty(capacity)
    crossing_first, crossing_second = np.empty(capacity, np.int64), np.empty(capacity, np.int64)
    order, node_of, nodes = after.copy(), after.copy(), after.copy()
    tail, head, first, last = after.copy(), after.copy(), after.copy(), after.copy()
    mask, stands, masks_before = after.copy(), after.copy(), after.copy()
    star_starts, star_ends, star, place = after.copy(), after.copy(), after.copy(), after.copy()
    cycle, following, joined, label, regions = after.copy(), after.copy(), after.copy(), after.copy(), after.copy()
    inside, bounds, seen = np.empty(64, np.uint8), np.empty(64, np.uint8), np.empty(64, np.uint8)
    fan, path, path_place = after.copy(), after.copy(), after.copy()
    ring_point, ring_offset, ring_region = after.copy(), after.copy(), after.copy()
    ring_meets = np.empty(64, np.uint8)
    crossing_x, crossing_y, crossing_error = np.empty(64), np.empty(64), np.empty(64)
    px, py, moved = np.empty(64), np.empty(64), np.empty(64, np.uint8)
    rank_start, rank_hole, rank_piece = after.copy(), np.empty(64, np.uint8), after.copy()
    rank_order, rank_spare, rank_x = after.copy(), after.copy(), np.empty(64)
    n_items = last_item - first_item
    out_vertices, out_sources = np.empty((16 * n_items + 64, 2)), np.empty((16 * n_items + 64, 2), np.int64)
    out_sizes, out_pieces = np.empty(2 * n_items + 64, np.int64), np.empty(2 * n_items + 64, np.int64)
    n_out = n_out_rings = n_out_pieces = 0
    n_subject_vertices = subjects.shape[0]

    for item in range(n_items):
        at = first_item + item
        status[item], displacement[item] = OPEN, 0.0
        counts[item, 0] = counts[item, 1] = counts[item, 2] = counts[item, 3] = 0
        if stop[0]:
            break
        s_first, s_last, c_first, c_last = (
            subject_items[at], subject_items[at + 1], clip_items[at], clip_items[at + 1]
        )  # fmt: skip
        room = subject_rings[s_last] - subject_rings[s_first] + clip_rings[c_last] - clip_rings[c_first] + 1
        ring_room = s_last - s_first + c_last - c_first + 1
        x, y, after, before = _floats(x, room), _floats(y, room), _ints(after, room), _ints(before, room)
        ring_of, origins = _ints(ring_of, room), _ints(origins, room)
        tops, masks, rings, highest = (
            _ints(tops, ring_room), _ints(masks, ring_room), _ints(rings, ring_room), _ints(highest, ring_room)
        )  # fmt: skip
        edges = Edges(x, y, after, before, ring_of)
        n, n_rings, safe = _load(
            subjects, subject_rings, s_first, s_last, 1, 0, edges, origins, tops, masks, 0, 0
        )  # fmt: skip
        n, n_rings, also_safe = _load(
            clips, clip_rings, c_first, c_last, 2, n_subject_vertices, edges, origins, tops, masks, n, n_rings
        )
        if not (safe and also_safe):
            continue

        boxes, marks = _boxes(boxes, n), _bytes(marks, n)
        for i in range(n):
            j = after[i]
            boxes[i, 0], boxes[i, 1] = min(x[i], x[j]), max(x[i], x[j])
            boxes[i, 2], boxes[i, 3] = min(y[i], y[j]), max(y[i], y[j])
            marks[i] = 1
        if n > _FEW:
            tree, tree_marks = _boxes(tree, 2 * leaves_of(n)), _bytes(tree_marks, 2 * leaves_of(n))
            places = _ints(places, n)
            build_tree(boxes, marks, n, tree, tree_marks, places)
        marked = _bytes(marked, n)
        n_events = n_crossings = n_exact = 0
        for _ in range(60):  # bound: the room grows fourfold each time
            points = _ints(points, n + capacity)
            events = Events(
                event_edge, event_point, event_other, event_t, event_slack, crossing_first, crossing_second
            )  # fmt: skip
            n_events, n_crossings, n_exact = _find_contacts(
                edges, n, n_rings, events, points, marked, rings, boxes, marks, tree, tree_marks, places,
                stack, pairs, stop,
            )  # fmt: skip
            if n_events >= 0:
                break
            capacity = 4 * max(capacity, n // 4)
            event_edge, event_point = np.empty(capacity, np.int64), np.empty(capacity, np.int64)
            event_other, event_t, event_slack = np.empty(capacity, np.int64), np.empty(capacity), np.empty(capacity)
            crossing_first, crossing_second = np.empty(capacity, np.int64), np.empty(capacity, np.int64)
        events = Events(event_edge, event_point, event_other, event_t, event_slack, crossing_first, crossing_second)
        n_points = n + n_crossings
        starts, order, chain_at = _ints(starts, n + 1), _ints(order, n_events), _ints(chain_at, n)
        sort_events(edges, events, n, n_events, points, starts, order, stop)

        n_marked = n_events
        for ring in range(n_rings):
            marked[tops[ring]] = 1
        for i in range(n):
            n_marked += marked[i]
        node_of, nodes = _ints(node_of, n_points), _ints(nodes, n_marked)
        node_of[:n_points] = -1
        most = n_marked + 1  # chains, and nodes
        tail, head, first, last = _ints(tail, most), _ints(head, most), _ints(first, most), _ints(last, most)
        mask, stands, masks_before = _ints(mask, most), _ints(stands, most), _ints(masks_before, most)
        chains = Chains(tail, head, first, last, mask, stands)
        n_nodes, n_chains = build_chains(
            edges, events, points, marked, starts, order, tops, masks, n_rings, node_of, nodes, chains, chain_at
        )
        star_starts, star_ends = _ints(star_starts, n_nodes + 1), _ints(star_ends, n_nodes)
        star, place = _ints(star, 2 * n_chains), _ints(place, 2 * n_chains)
        px, py = _floats(px, 2 * n_chains), _floats(py, 2 * n_chains)
        build_stars(edges, chains, n_nodes, n_chains, star_starts, star_ends, star, place, masks_before, px, py, stop)

        cycle, following = _ints(cycle, 2 * n_chains), _ints(following, 2 * n_chains)
        if stop[0]:
            break
        n_cycles = number_cycles(chains, n_chains, star_starts, star_ends, star, place, cycle, following, stop)
        joined, label = _ints(joined, n_cycles + 1), _ints(label, n_cycles + 1)
        regions, inside = _ints(regions, n_cycles + 1), _bytes(inside, n_cycles + 1)
        if stop[0]:
            break
        _join_faces(
            edges, events, chains, n, n_rings, rings, tops, highest, node_of, points, starts, order, chain_at, star,
            star_ends, cycle, n_cycles, tree, places, stack, joined, label, regions, stop,
        )  # fmt: skip
        bounds, fan, seen = _bytes(bounds, n_chains), _ints(fan, n_nodes), _bytes(seen, 2 * n_chains)
        choose_boundary(
            chains, n_chains, cycle, n_cycles, kept, star_starts, n_nodes, joined, label, regions, inside, bounds, fan
        )
        path, path_place = _ints(path, 2 * n_chains), _ints(path_place, n_nodes)
        ring_point, ring_offset = _ints(ring_point, n + 2 * n_chains), _ints(ring_offset, n_chains + 1)
        ring_region, ring_meets = _ints(ring_region, n_chains), _bytes(ring_meets, n + 2 * n_chains)
        found = Rings(ring_point, ring_meets, ring_offset, ring_region)
        n_found, m = walk_rings(
            edges, chains, n_chains, nodes, n_nodes, cycle, inside, regions, star_starts, star_ends, star, place,
            bounds, fan, seen, path, path_place, found, stop,
        )  # fmt: skip
        if stop[0]:
            break

        px, py, moved = _floats(px, m), _floats(py, m), _bytes(moved, m)
        crossing_x, crossing_y = _floats(crossing_x, n_crossings), _floats(crossing_y, n_crossings)
        crossing_error = _floats(crossing_error, n_crossings)
        crossing_error[:n_crossings] = -2.0
        farthest = largest = 0.0
        lost = any_moved = False
        for k in range(m):
            point = ring_point[k]
            if point < n:
                px[k], py[k], moved[k] = x[point] + 0.0, y[point] + 0.0, 0
            else:
                c = point - n
                if crossing_error[c] == -2.0:
                    cx, cy, ex, ey = round_crossing(edges, crossing_first[c], crossing_second[c])
                    lost = lost or ex < 0.0 or ey < 0.0
                    # two squares, their sum, a root: each rounded once
                    crossing_x[c], crossing_y[c] = cx, cy
                    crossing_error[c] = np.sqrt(ex * ex + ey * ey) * (1.0 + 2.0**-50)
                    farthest = max(farthest, crossing_error[c])
                px[k], py[k], moved[k] = crossing_x[c], crossing_y[c], crossing_error[c] > 0.0
                any_moved = any_moved or crossing_error[c] > 0.0
            largest = max(largest, abs(px[k]), abs(py[k]))
        if lost:
            continue
        if any_moved:
            boxes, marks, chain_at = _boxes(boxes, m), _bytes(marks, m), _ints(chain_at, m)
            if m > _FEW:
                tree, tree_marks = _boxes(tree, 2 * leaves_of(m)), _bytes(tree_marks, 2 * leaves_of(m))
                places = _ints(places, m)
            if not certify(
                found, n_found, m, px, py, moved, largest, boxes, marks, chain_at, tree, tree_marks, places, stack,
                pairs, stop,
            ):  # fmt: skip
                continue
        rank_start, rank_hole, rank_piece = (
            _ints(rank_start, n_found), _bytes(rank_hole, n_found), _ints(rank_piece, n_found)
        )  # fmt: skip
        rank_order, rank_spare = _ints(rank_order, n_found + 1), _ints(rank_spare, n_found)
        rank_order[0] = 0
        rank_x = _floats(rank_x, n_found)
        ranking = Ranking(rank_start, rank_x, rank_hole, rank_piece, rank_order, rank_spare)
        n_pieces = rank_rings(found, n_found, px, py, ranking, label)
        if n_pieces < 0:
            continue

        if n_out + m > out_vertices.shape[0]:
            wider, more = np.empty((2 * (n_out + m), 2)), np.empty((2 * (n_out + m), 2), np.int64)
            wider[:n_out], more[:n_out] = out_vertices[:n_out], out_sources[:n_out]
            out_vertices, out_sources = wider, more
        if n_out_rings + n_found > out_sizes.shape[0]:
            sizes, by_piece = (
                np.empty(2 * (n_out_rings + n_found), np.int64),
                np.empty(2 * (n_out_rings + n_found), np.int64),
            )
            sizes[:n_out_rings], by_piece[:n_out_pieces] = out_sizes[:n_out_rings], out_pieces[:n_out_pieces]
            out_sizes, out_pieces = sizes, by_piece
        for k in range(n_found):
            ring = rank_order[k]
            start, stop_at = ring_offset[ring], ring_offset[ring + 1]
            i = rank_start[ring]
            for _ in range(stop_at - start):
                point = ring_point[i]
                out_vertices[n_out, 0], out_vertices[n_out, 1] = px[i], py[i]
                if point < n:
                    out_sources[n_out, 0], out_sources[n_out, 1] = origins[point], -1
                else:
                    out_sources[n_out, 0] = origins[crossing_first[point - n]]
                    out_sources[n_out, 1] = origins[crossing_second[point - n]]
                n_out += 1
                i = i + 1 if i + 1 < stop_at else start
            out_sizes[n_out_rings] = stop_at - start
            n_out_rings += 1
            if rank_hole[ring]:
                out_pieces[n_out_pieces - 1] += 1
            else:
                out_pieces[n_out_pieces] = 1
                n_out_pieces += 1
        counts[item, 0], counts[item, 1], counts[item, 2], counts[item, 3] = n_pieces, n_found, m, n_exact
        displacement[item] = farthest
        status[item] = DONE
    return out_vertices[:n_out], out_sources[:n_out], out_sizes[:n_out_rings], out_pieces[:n_out_pieces]
