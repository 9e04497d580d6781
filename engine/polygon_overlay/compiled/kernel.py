"""Overlays compiled: many pairs of polygons from flat arrays to flat arrays, without the interpreter.

    edges -> contacts -> events along edges -> chains -> stars -> faces, labels -> boundary rings -> doubles

The steps are those of overlay.py on chains instead of single edges, so that after the contacts the work follows the
number of crossings. Decisions are exact throughout. A pair is left OPEN, for the path in Python integers, where

- a coordinate is neither zero nor within 2^-120 .. 2^120, so that expansions might lose bits;
- a coordinate of the result cannot be rounded from double-doubles and exact signs;
- it has rings of which rounding left no sure shell.

A pair is left MAY_CROSS where rounding came so near another edge that clearance.py does not
vouch for the rounded rings, or put a vertex on the line of its neighbours: its rounded rings may cross. They come
back as another pair then, each ring a source of its own (ring_nesting.py).

The intersection of two convex rings is convex.py's where floating point is sure of all that it asks; two rings that
only cross each other are walked by `walk_crossings`, from the events on.

Scratch arrays come from the caller, who gives more and calls again where they do not suffice: nothing here allocates,
so nothing counts references to arrays.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple

from engine.compiling.jit import kernel, merged
from engine.polygon_overlay.compiled.chain_faces import join_faces, number_cycles
from engine.polygon_overlay.compiled.chain_rings import (
    do_nothing_but_cross,
    join_regions,
    mark_boundary,
    walk_crossings,
    walk_rings,
)
from engine.polygon_overlay.compiled.chains import build_chains, build_stars
from engine.polygon_overlay.compiled.clearance import (
    CLEARANCE,
    LOST,
    certify,
    corners_are_clear,
    has_straight_point,
    round_points,
)
from engine.polygon_overlay.compiled.convex import GENERAL, Passages, Points, intersect_convex
from engine.polygon_overlay.compiled.edge_contacts import Contacts, find_contacts
from engine.polygon_overlay.compiled.edge_events import sort_events
from engine.polygon_overlay.compiled.edge_tree import FEW, build_tree
from engine.polygon_overlay.compiled.loading import (
    EVERYTHING,
    Box,
    Loaded,
    RingArrays,
    box_of,
    common_box,
    fill_boxes,
    is_empty,
    load_rings,
    magnitude,
    mark_runs,
)
from engine.polygon_overlay.compiled.reducing import count_left_out
from engine.polygon_overlay.compiled.ring_nesting import NO_ROOM, Nesting, Rule, gather_evidence, spread_sources
from engine.polygon_overlay.compiled.ring_order import (
    Filled,
    has_room,
    rank_rings,
    tell_evidence,
    tell_parts,
    write_convex,
    write_rings,
)
from engine.polygon_overlay.compiled.workspace import Outcomes, Workspace, output_at, rows_of
from engine.predicates.expansion import LARGEST
from engine.types import OPEN, FlagArray, IntArray

FINISHED: Final = 0
NEEDS_CONTACTS: Final = 1
"""The pair reached has more contacts than there is scratch for."""
NEEDS_OUTPUT: Final = 2
"""The pair reached has more vertices or rings than the output has room for."""


class PairStatus(IntEnum):
    """What became of a pair, if it is not OPEN."""

    DONE = 0
    MAY_CROSS = 1


class _Span(NamedTuple):
    """The rings of a pair: of its subject first .. first_end - 1, of its clip second .. second_end - 1."""

    first: int
    first_end: int
    second: int
    second_end: int


class _Arranged(NamedTuple):
    """What was found of a pair: boundary rings and their points, crossings, pairs of edges left to exact signs, whether
    clearance.py vouches for all; n_contacts: those that there must be scratch for, more than there is if it failed."""

    n_found: int
    n_points: int
    n_crossings: int
    n_exact: int
    is_clear: bool
    n_contacts: int


_NONE: Final = _Arranged(0, 0, 0, 0, False, 0)


@merged
def _intersect_convex(
    w: Workspace, subjects: RingArrays, clips: RingArrays, span: _Span, stop: FlagArray
) -> tuple[int, int, float]:
    """Intersect the only ring of each polygon, where both are convex; returns as `intersect_convex`."""
    first, second = span.first, span.second
    return intersect_convex(
        subjects.vertices[subjects.offsets[first] : subjects.offsets[first + 1]],
        clips.vertices[clips.offsets[second] : clips.offsets[second + 1]], w.given,
        Passages(w.unions.points, w.stars.node_of),
        Points(w.rounded.x, w.rounded.y, w.found.point, w.tree.places), stop,
    )  # fmt: skip


@merged
def _load_pair(
    w: Workspace, subjects: RingArrays, clips: RingArrays, span: _Span, common: Box, kept: FlagArray, is_named: bool,
    stop: FlagArray,
) -> tuple[int, int, bool]:  # fmt: skip
    """Load the rings of both polygons; return the numbers of vertices and rings, and whether none is too small."""
    first, second = subjects.offsets[span.first], clips.offsets[span.second]
    n_subject = subjects.offsets[span.first_end] - first
    n, n_rings, safe = load_rings(
        subjects, span.first, span.first_end, 1, is_named, -first, EVERYTHING if kept[1] else common, w.given,
        0, 0, stop,
    )  # fmt: skip
    n, n_rings, also_safe = load_rings(
        clips, span.second, span.second_end, 2, False, n_subject - second, EVERYTHING if kept[2] else common, w.given,
        n, n_rings, stop,
    )  # fmt: skip
    return n, n_rings, safe and also_safe


@merged
def _arrange(w: Workspace, loaded: Loaded, kept: FlagArray, nesting: Nesting, stop: FlagArray) -> _Arranged:
    """Find the boundary rings of a pair that is loaded. Where the call is to end, nothing found is right."""
    n, n_rings, edges = loaded.n, loaded.n_rings, w.given.edges
    margin = CLEARANCE * loaded.largest
    is_clear = fill_boxes(edges, n, margin, w.tree, stop) > margin
    mark_runs(edges, w.tree.places, loaded.n_runs, w.tree)
    if n > FEW:
        build_tree(w.tree, n, stop)
    contacts = find_contacts(edges, n, n_rings, margin, w.events, w.unions, w.tree, stop)
    room = w.along.order.shape[0] - 9
    if stop[0] or contacts.n_events < 0:
        return _Arranged(0, 0, 0, 0, False, room + 1)
    n_contacts = contacts.n_events  # chains and nodes: one for each event, and each vertex that is a node
    for ring in range(n_rings):
        w.unions.is_node[w.given.tops[ring]] = 1
    for i in range(n):
        n_contacts += int(w.unions.is_node[i] != 0)
    if n_contacts > room:
        return _Arranged(0, 0, 0, 0, False, n_contacts)
    are_clear = sort_events(edges, w.events, w.along, w.unions, n, contacts.n_events, stop)
    if stop[0]:
        return _NONE
    if nesting.rule == Rule.PAIR and do_nothing_but_cross(w.given, w.events, contacts, n_rings, kept):
        n_found, n_points = walk_crossings(
            w.given, w.events, w.along, w.chains.at, w.tree.marks, kept, contacts.n_crossings, w.found, stop
        )
    else:
        n_found, n_points = _arrange_chains(w, loaded, kept, nesting, contacts, stop)
    if n_found == NO_ROOM:
        return _Arranged(0, 0, 0, 0, False, room + 1)
    is_clear = is_clear and contacts.are_far and are_clear and corners_are_clear(edges, n, w.along, margin, stop)
    return _Arranged(n_found, n_points, contacts.n_crossings, contacts.n_exact, is_clear, n_contacts)


@merged
def _arrange_chains(
    w: Workspace, loaded: Loaded, kept: FlagArray, nesting: Nesting, contacts: Contacts, stop: FlagArray
) -> tuple[int, int]:
    """Find the boundary rings of whatever its contacts are; return their number, or NO_ROOM, and that of their points.

    Where the call is to end, nothing found is right.
    """
    n, n_rings, edges, n_crossings = loaded.n, loaded.n_rings, w.given.edges, contacts.n_crossings
    w.stars.node_of[: n + n_crossings] = -1
    n_nodes, n_chains, n_loose = build_chains(
        w.given, w.events, w.along, w.unions, w.chains, w.stars, w.loose.half, (n, n_rings, n_crossings), stop
    )
    if stop[0]:
        return 0, 0
    build_stars(edges, w.chains, w.stars, w.loose, n_crossings, n_nodes, n_loose, stop)
    if stop[0]:
        return 0, 0
    n_cycles = number_cycles(w.chains, w.stars, w.faces.cycle, n_chains, stop)
    if stop[0]:
        return 0, 0
    join_faces(w, w.found.point, (n, n_cycles, loaded.n_runs), stop)
    if stop[0]:
        return 0, 0
    tells = nesting.rule == Rule.AGAIN
    n_entries = spread_sources(w.given, w.chains, w.faces, nesting, w.holders, kept, (n_chains, n_cycles), stop)
    if n_entries == NO_ROOM:
        return NO_ROOM, 0
    mark_boundary(w.chains, w.faces, n_chains, stop)
    join_regions(w.chains, w.stars, w.faces, nesting.rule != Rule.PAIR, (n_chains, n_crossings, n_nodes), stop)
    if tells:
        gather_evidence(w.faces, w.holders, n_entries, n_cycles, nesting.shells.shape[0], stop)
    if stop[0]:
        return 0, 0
    return walk_rings(
        edges, w.chains, w.stars, w.faces, w.tree.marks, w.walk, w.found, w.holders, tells,
        (n_chains, n_nodes, n, n_crossings), stop,
    )  # fmt: skip


@merged
def _round(w: Workspace, n: int, arranged: _Arranged, stop: FlagArray) -> tuple[float, bool]:
    """Round the points of the rings; return how far one moved, or LOST, and whether the rings are surely valid."""
    found, rounded, n_found, n_points = w.found, w.rounded, arranged.n_found, arranged.n_points
    farthest = round_points(w.given.edges, w.events, found.point, n, arranged.n_crossings, n_points, rounded, stop)
    if farthest <= 0.0:
        return farthest, farthest == 0.0
    is_valid = not has_straight_point(found, n_found, rounded, stop) and (
        arranged.is_clear
        or certify(found, n_found, n_points, rounded, w.tree, w.chains.at, w.stars.node_of, stop)
    )  # fmt: skip
    return farthest, is_valid


@merged
def _ended(pair: int, needs: int, filled: Filled, n_left_out: int) -> tuple[int, int, int, int, int, int, int]:
    n_vertices, n_rings, n_pieces, n_evidence = filled
    return pair, needs, n_vertices, n_rings, n_pieces, n_evidence, n_left_out


@kernel
def overlay_pairs(
    subjects: RingArrays, subject_items: IntArray, clips: RingArrays, clip_items: IntArray, begin: int, reduced: Loaded,
    kept: FlagArray, nesting: Nesting, stop: FlagArray, words: IntArray, outcomes: Outcomes,
) -> tuple[int, int, int, int, int, int, int]:  # fmt: skip
    """Overlay the pairs from ``begin`` on; fill outcomes, by pair, and the output of words from its beginning.

    subject_items, clip_items: the first ring of each polygon, and the end of the last one's.
    kept: (4,) uint8 by label (bit 0: in the subject, bit 1: in the clip), of more than one part where some are above 1.
    nesting: of the rule PAIR; without clips, and kept all but the first, of the rings of subjects (ring_nesting.py).
    reduced: what reduce_pair returned for the only pair; no vertices, no such pair.
    words: of a `Scratch`. stop: one uint8, polled.

    Returns the pair reached, FINISHED or what is needed to go on with it, the numbers of vertices, rings, pieces and
    rows of evidence written, and how many vertices are left out.

    Output (`Output`), row by row:

        vertices   (n, 2) float64   vertices of boundary rings
        sources    (n, 2) int32     where each comes from, see below
        rings      (r,) int64       offsets of rings into vertices
        pieces     (p,) int64       offsets of pieces into rings
        evidence   (e, 2) int64     by the rule AGAIN, of each ring the rings it comes from, counted from the pair's
                                    first; where kept is above 1, of each ring its number and its part

    A row of sources, edges named by their first vertices, vertices counted from the pair's first, clips after subjects:

        v, -1        input vertex v; the ring goes on along an edge of v
        v, -3 - e    input vertex v; the ring goes on along edge e
        v, LEFT_OUT  input vertex v; the vertices up to the next source are left out
        e, f         where edges e and f cross; the ring goes on along e
    """
    w, output = rows_of(words), output_at(words)
    is_intersection = not (kept[0] or kept[1] or kept[2])
    filled = Filled(0, 0, 0, 0)
    n_left_out = 0
    status, counts, displacement = outcomes.status, outcomes.counts, outcomes.displacement
    for pair in range(begin, status.shape[0]):
        status[pair], displacement[pair] = OPEN, 0.0
        counts[pair, 0] = counts[pair, 1] = counts[pair, 2] = counts[pair, 3] = 0
        if stop[0]:
            break
        span = _Span(subject_items[pair], subject_items[pair + 1], clip_items[pair], clip_items[pair + 1])
        loaded = reduced
        if reduced.n == 0:
            subject_box = box_of(subjects.vertices, subjects.offsets[span.first], subjects.offsets[span.first_end])
            clip_box = box_of(clips.vertices, clips.offsets[span.second], clips.offsets[span.second_end])
            common = common_box(subject_box, clip_box)
            if is_intersection and is_empty(common):
                status[pair] = PairStatus.DONE
                continue
            if is_intersection and span.first_end - span.first == 1 and span.second_end - span.second == 1:
                m, low, moved_by = _intersect_convex(w, subjects, clips, span, stop)
                if m != GENERAL:
                    if not has_room(output, filled, m, 1):
                        counts[pair, 1], counts[pair, 2] = 1, m
                        return _ended(pair, NEEDS_OUTPUT, filled, 0)
                    if m > 0:
                        write_convex(w, m, low, output, filled)
                        filled = Filled(filled.n_vertices + m, filled.n_rings + 1, filled.n_pieces + 1, 0)
                        counts[pair, 0], counts[pair, 1], counts[pair, 2] = 1, 1, m
                    status[pair], displacement[pair] = PairStatus.DONE, moved_by
                    continue
            n, n_rings, safe = _load_pair(w, subjects, clips, span, common, kept, nesting.rule != Rule.PAIR, stop)
            loaded = Loaded(n, n_rings, 0, max(magnitude(subject_box), magnitude(clip_box)))
            if not (safe and loaded.largest <= LARGEST):
                continue
        first, end = span.first, span.first_end
        own = Nesting(nesting.shells[first:end], nesting.sizes[first:end], nesting.rule)
        arranged = _arrange(w, loaded, kept, own, stop)
        if stop[0]:
            break
        if arranged.n_contacts > w.along.order.shape[0] - 9:
            return _ended(pair, NEEDS_CONTACTS, filled, 0)
        moved_by, is_valid = _round(w, loaded.n, arranged, stop)
        if moved_by == LOST:
            continue
        n_found, m = arranged.n_found, arranged.n_points
        n_pieces = rank_rings(w.found, n_found, w.rounded, w.ranking, is_valid, w.faces.joined, w.tree.boxes, stop)
        if stop[0]:
            break
        if n_pieces < 0:
            continue
        if not has_room(output, filled, m, n_found):
            counts[pair, 1], counts[pair, 2] = n_found, m
            return _ended(pair, NEEDS_OUTPUT, filled, 0)
        n_evidence = 0
        if nesting.rule == Rule.AGAIN:
            n_evidence = tell_evidence(w, n_found, span.first, output, filled)
        elif kept[3] > 1:
            n_evidence = tell_parts(w, n_found, output, filled)
        if n_evidence == NO_ROOM:
            counts[pair, 2] = 2 * output.vertices.shape[0]
            return _ended(pair, NEEDS_OUTPUT, filled, 0)
        write_rings(w, loaded.n, n_found, output, filled, stop)
        if stop[0]:
            break
        if loaded.n_runs > 0:
            for ring in range(n_found):
                n_left_out += count_left_out(output.sources, output.rings[ring], output.rings[ring + 1])
        filled = Filled(filled.n_vertices + m, filled.n_rings + n_found, filled.n_pieces + n_pieces, n_evidence)
        counts[pair, 0], counts[pair, 1], counts[pair, 2], counts[pair, 3] = n_pieces, n_found, m, arranged.n_exact
        status[pair], displacement[pair] = (PairStatus.DONE if is_valid else PairStatus.MAY_CROSS), moved_by
    return _ended(status.shape[0], FINISHED, filled, n_left_out)
