"""Compiled overlays of many pairs of polygons, from flat arrays to flat arrays.

    edges -> noding -> events along edges -> chains -> stars -> faces, labels -> boundary rings -> rounding

The steps are those of overlay.py on chains instead of single edges, so that after noding the work follows the number of
crossings. Decisions are exact throughout. Outcomes of a pair (`PairStatus`, or OPEN):

| status | meaning |
| --- | --- |
| DONE | the rounded rings are proven valid |
| MAY_CROSS | rounding came within the margin of clearance.py: the rings are arranged again (ring_nesting.py) |
| OPEN | exact fallback: a coordinate out of range (crossing_signs.py), a sign in doubt, a point not rounded, no shell |

Fast paths: two convex rings (convex.py), two simple rings with only proper crossings (`walk_crossings`). Scratch comes
from the caller, who gives more and calls again where it does not suffice: nothing here allocates.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple

from engine.compiling.jit import kernel, merged
from engine.polygon_overlay.compiled.chain_faces import join_faces, number_cycles
from engine.polygon_overlay.compiled.chain_rings import (
    has_only_proper_crossings,
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
from engine.polygon_overlay.compiled.ring_nesting import (
    NO_ROOM,
    Nesting,
    Rule,
    group_provenance_by_region,
    propagate_labels,
)
from engine.polygon_overlay.compiled.ring_order import (
    Filled,
    has_room,
    rank_rings,
    write_component_ids,
    write_convex,
    write_provenance,
    write_rings,
)
from engine.polygon_overlay.compiled.workspace import Outcomes, Workspace, output_at, workspace_at
from engine.predicates.expansion import LARGEST
from engine.types import OPEN, FlagArray, IntArray

FINISHED: Final = 0
NEEDS_CONTACTS: Final = 1
"""The pair at which the kernel stopped has more contacts than fit the scratch."""
NEEDS_OUTPUT: Final = 2
"""The pair at which the kernel stopped has more vertices or rings than fit the output."""


class PairStatus(IntEnum):
    """Outcome of a pair that is not OPEN. DONE: its rounded rings are proven valid; MAY_CROSS: they may cross."""

    DONE = 0
    MAY_CROSS = 1


class _Span(NamedTuple):
    """The numbers of a pair's rings: first .. first_end - 1 of its subject, second .. second_end - 1 of its clip."""

    first: int
    first_end: int
    second: int
    second_end: int


class _Arrangement(NamedTuple):
    """Counts of a pair. n_boundary: boundary rings; n_points: their points; n_exact: edge pairs decided exactly;
    is_clear: clearance.py proves that rounding preserves the topology; n_contacts: the scratch that the pair needs; if
    it exceeds what there is, the pair failed."""

    n_boundary: int
    n_points: int
    n_crossings: int
    n_exact: int
    is_clear: bool
    n_contacts: int


_NONE: Final = _Arrangement(0, 0, 0, 0, False, 0)


@merged
def _intersect_convex(
    w: Workspace, subjects: RingArrays, clips: RingArrays, span: _Span, stop: FlagArray
) -> tuple[int, int, float]:
    """Intersect the two rings of a pair, if both are convex; return the number of points, written to the `Workspace` w,
    or GENERAL; the index of the smallest point (x, then y); and the largest displacement by rounding."""
    first, second = span.first, span.second
    return intersect_convex(
        subjects.vertices[subjects.offsets[first] : subjects.offsets[first + 1]],
        clips.vertices[clips.offsets[second] : clips.offsets[second + 1]], w.given,
        Passages(w.unions.points, w.stars.node_of),
        Points(w.rounded.x, w.rounded.y, w.rings.point, w.tree.places), stop,
    )  # fmt: skip


@merged
def _load_pair(
    w: Workspace, subjects: RingArrays, clips: RingArrays, span: _Span, common: Box, selected: FlagArray,
    is_named: bool, stop: FlagArray,
) -> tuple[int, int, bool]:  # fmt: skip
    """Load both polygons of a pair into ``w.given``; return the numbers of vertices and rings, and whether coordinates
    are 0, infinitesimal or SMALLEST and above. span: their rings; common: the intersection of their boxes, outside of
    which stretches are shortened where the result has no part. is_named: the mask of a ring is its number, not the bit
    of its polygon."""
    first, second = subjects.offsets[span.first], clips.offsets[span.second]
    n_subject = subjects.offsets[span.first_end] - first
    n, n_rings, is_in_range = load_rings(
        subjects, span.first, span.first_end, 1, is_named, -first, EVERYTHING if selected[1] else common, w.given,
        0, 0, stop,
    )  # fmt: skip
    n, n_rings, is_clip_in_range = load_rings(
        clips, span.second, span.second_end, 2, False, n_subject - second, EVERYTHING if selected[2] else common,
        w.given, n, n_rings, stop,
    )  # fmt: skip
    return n, n_rings, is_in_range and is_clip_in_range


@merged
def _arrange(w: Workspace, loaded: Loaded, selected: FlagArray, nesting: Nesting, stop: FlagArray) -> _Arrangement:
    """Node a loaded pair, label its faces and trace its boundary rings into ``w.rings``; return the counts. selected:
    by label the part of the result, 0 outside. The result is invalid if ``stop`` is set, or a sign is in doubt."""
    n, n_rings, edges = loaded.n, loaded.n_rings, w.given.edges
    margin = CLEARANCE * loaded.largest
    is_clear = fill_boxes(edges, n, margin, w.tree, stop) > margin
    mark_runs(edges, w.tree.places, loaded.n_runs, w.tree)
    if n > FEW:
        build_tree(w.tree, n, stop)
    contacts = find_contacts(edges, n, n_rings, margin, w.events, w.unions, w.tree, stop)
    room = w.along.order.shape[0] - 9
    if stop[0] or contacts.n_events < 0:
        return _Arrangement(0, 0, 0, 0, False, room + 1)
    n_contacts = contacts.n_events  # chains and nodes: one for each event, and each vertex that is a node
    for ring in range(n_rings):
        w.unions.is_node[w.given.tops[ring]] = 1
    for i in range(n):
        n_contacts += int(w.unions.is_node[i] != 0)
    if n_contacts > room:
        return _Arrangement(0, 0, 0, 0, False, n_contacts)
    are_clear = sort_events(edges, w.events, w.along, w.unions, n, contacts.n_events, stop)
    if stop[0] or edges.doubts[0] != 0:
        return _NONE
    if nesting.rule == Rule.PAIR and has_only_proper_crossings(w.given, w.events, contacts, n_rings, selected):
        n_boundary, n_points = walk_crossings(
            w.given, w.events, w.along, w.chains.at, w.tree.marks, selected, contacts.n_crossings, w.rings, stop
        )
    else:
        n_boundary, n_points = _arrange_chains(w, loaded, selected, nesting, contacts, stop)
    if n_boundary == NO_ROOM:
        return _Arrangement(0, 0, 0, 0, False, room + 1)
    is_clear = is_clear and contacts.are_far and are_clear and corners_are_clear(edges, n, w.along, margin, stop)
    return _Arrangement(n_boundary, n_points, contacts.n_crossings, contacts.n_exact, is_clear, n_contacts)


@merged
def _arrange_chains(
    w: Workspace, loaded: Loaded, selected: FlagArray, nesting: Nesting, contacts: Contacts, stop: FlagArray
) -> tuple[int, int]:
    """Trace the boundary rings of a noded pair into ``w.rings`` by chains and faces; return the number of rings, or
    NO_ROOM, and of points. contacts: the result of noding; selected: by label the part of the result. If ``stop`` is
    set, the result is invalid."""
    n, n_rings, edges, n_crossings = loaded.n, loaded.n_rings, w.given.edges, contacts.n_crossings
    w.stars.node_of[: n + n_crossings] = -1
    n_nodes, n_chains, n_loose = build_chains(
        w.given, w.events, w.along, w.unions, w.chains, w.stars, w.loose.half, (n, n_rings, n_crossings), stop
    )
    if stop[0]:
        return 0, 0
    build_stars(edges, w.chains, w.stars, w.loose, n_crossings, n_nodes, n_loose, stop)
    if stop[0] or edges.doubts[0] != 0:  # what follows takes the order of edges for granted
        return 0, 0
    n_cycles = number_cycles(w.chains, w.stars, w.faces.cycle, n_chains, stop)
    if stop[0]:
        return 0, 0
    join_faces(w, w.rings.point, (n, n_cycles, loaded.n_runs), stop)
    if stop[0] or edges.doubts[0] != 0:
        return 0, 0
    has_provenance = nesting.rule == Rule.AGAIN
    n_entries = propagate_labels(w.given, w.chains, w.faces, nesting, w.flood, selected, (n_chains, n_cycles), stop)
    if n_entries == NO_ROOM:
        return NO_ROOM, 0
    mark_boundary(w.chains, w.faces, n_chains, stop)
    join_regions(w.chains, w.stars, w.faces, nesting.rule != Rule.PAIR, (n_chains, n_crossings, n_nodes), stop)
    if has_provenance:
        group_provenance_by_region(w.faces, w.flood, n_entries, n_cycles, nesting.shells.shape[0], stop)
    if stop[0]:
        return 0, 0
    return walk_rings(
        edges, w.chains, w.stars, w.faces, w.tree.marks, w.walk, w.rings, w.flood, has_provenance,
        (n_chains, n_nodes, n, n_crossings), stop,
    )  # fmt: skip


@merged
def _round(w: Workspace, n: int, arranged: _Arrangement, is_part: bool, stop: FlagArray) -> tuple[float, bool]:
    """Round the points of the rings into ``w.rounded``; return the largest displacement, or LOST, and whether the
    rounded rings are proven valid. n: number of input vertices; is_part: the rule is PART."""
    rings, rounded, n_boundary, n_points = w.rings, w.rounded, arranged.n_boundary, arranged.n_points
    farthest = round_points(w.given.edges, w.events, rings.point, n, arranged.n_crossings, n_points, rounded, stop)
    if farthest <= 0.0:
        return farthest, farthest == 0.0 and (arranged.is_clear or not is_part)
    is_valid = not has_straight_point(rings, n_boundary, rounded, stop) and (
        arranged.is_clear
        or (not is_part
        and certify(rings, n_boundary, n_points, rounded, w.tree, w.chains.at, w.stars.node_of, stop))
    )  # fmt: skip
    return farthest, is_valid


@merged
def _progress(pair: int, needs: int, filled: Filled, n_left_out: int) -> tuple[int, int, int, int, int, int, int]:
    """Return the results of `overlay_pairs` in their order: (pair, needs, numbers of vertices, rings, pieces and
    evidence rows in ``filled``, number of vertices left out)."""
    n_vertices, n_rings, n_pieces, n_evidence = filled
    return pair, needs, n_vertices, n_rings, n_pieces, n_evidence, n_left_out


@kernel
def overlay_pairs(
    subjects: RingArrays, subject_items: IntArray, clips: RingArrays, clip_items: IntArray, begin: int, reduced: Loaded,
    selected: FlagArray, nesting: Nesting, stop: FlagArray, addresses: IntArray, outcomes: Outcomes,
) -> tuple[int, int, int, int, int, int, int]:  # fmt: skip
    """Overlay the pairs from ``begin`` on; fill ``outcomes`` by pair, and the output from its beginning.

    Returns the pair reached; FINISHED, NEEDS_CONTACTS or NEEDS_OUTPUT (more room is needed for that pair); the numbers
    of vertices, rings, pieces and evidence rows written; and the number of vertices left out.

    | parameter | meaning |
    | --- | --- |
    | subject_items, clip_items | (n + 1,) int64, the first ring of each polygon, and the end |
    | reduced | result of `reduce_pair` for the only pair; without vertices: not reduced |
    | selected | (4,) uint8, by label (bit 0: in the subject, bit 1: in the clip) the part of the result, 0: outside |
    | nesting | fill rule; all but PAIR take the rings of subjects, no clips, and all labels selected but the first |
    | stop | (1,) uint8, polled |
    | addresses | of a `Scratch` |

    | output | dtype, shape | meaning |
    | --- | --- | --- |
    | vertices, sources | float64 (n, 2), int32 (n, 2) | vertices of boundary rings, and the source of each |
    | rings, pieces | int64 (r,), int64 (p,) | offsets of rings into vertices, of pieces into rings |
    | evidence | int64 (e, 2) | rule AGAIN: a ring and its source ring; several parts: a ring and its part |

    | row of sources | meaning; vertices are numbered within the pair, subject first, edges by their first vertices |
    | --- | --- |
    | v, -1 | input vertex v; the ring continues along an edge of v |
    | v, -3 - e | input vertex v; the ring continues along edge e |
    | v, LEFT_OUT | input vertex v; the vertices up to the next source are left out |
    | e, f | the crossing of edges e and f; the ring continues along e |
    """
    w, output = workspace_at(addresses), output_at(addresses)
    is_intersection = not (selected[0] or selected[1] or selected[2])
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
                        return _progress(pair, NEEDS_OUTPUT, filled, 0)
                    if m > 0:
                        write_convex(w, m, low, output, filled)
                        filled = Filled(filled.n_vertices + m, filled.n_rings + 1, filled.n_pieces + 1, 0)
                        counts[pair, 0], counts[pair, 1], counts[pair, 2] = 1, 1, m
                    status[pair], displacement[pair] = PairStatus.DONE, moved_by
                    continue
            n, n_rings, is_in_range = _load_pair(
                w, subjects, clips, span, common, selected, nesting.rule != Rule.PAIR, stop
            )
            loaded = Loaded(n, n_rings, 0, max(magnitude(subject_box), magnitude(clip_box)))
            if not (is_in_range and loaded.largest <= LARGEST):
                continue
        first, end = span.first, span.first_end
        own = Nesting(nesting.shells[first:end], nesting.sizes[first:end], nesting.rule)
        w.given.edges.doubts[0] = 0
        arranged = _arrange(w, loaded, selected, own, stop)
        if stop[0]:
            break
        if arranged.n_contacts > w.along.order.shape[0] - 9:
            return _progress(pair, NEEDS_CONTACTS, filled, 0)
        if w.given.edges.doubts[0] != 0:
            continue
        moved_by, is_valid = _round(w, loaded.n, arranged, nesting.rule == Rule.PART, stop)
        if moved_by == LOST:
            continue
        n_boundary, m = arranged.n_boundary, arranged.n_points
        n_pieces = rank_rings(w.rings, n_boundary, w.rounded, w.ranking, is_valid, w.faces.joined, w.tree.boxes, stop)
        if stop[0]:
            break
        if n_pieces < 0:
            continue
        if not has_room(output, filled, m, n_boundary):
            counts[pair, 1], counts[pair, 2] = n_boundary, m
            return _progress(pair, NEEDS_OUTPUT, filled, 0)
        n_evidence = 0
        if nesting.rule == Rule.AGAIN:
            n_evidence = write_provenance(w, n_boundary, span.first, output, filled)
        elif selected[3] > 1:
            n_evidence = write_component_ids(w, n_boundary, output, filled)
        if n_evidence == NO_ROOM:
            counts[pair, 2] = 2 * output.vertices.shape[0]
            return _progress(pair, NEEDS_OUTPUT, filled, 0)
        write_rings(w, loaded.n, n_boundary, output, filled, stop)
        if stop[0]:
            break
        if w.given.edges.doubts[0] != 0:  # of signs that chains, faces, rounding and sources asked for
            continue
        if loaded.n_runs > 0:
            for ring in range(n_boundary):
                n_left_out += count_left_out(output.sources, output.rings[ring], output.rings[ring + 1])
        filled = Filled(filled.n_vertices + m, filled.n_rings + n_boundary, filled.n_pieces + n_pieces, n_evidence)
        counts[pair, 0], counts[pair, 1], counts[pair, 2], counts[pair, 3] = n_pieces, n_boundary, m, arranged.n_exact
        status[pair], displacement[pair] = (PairStatus.DONE if is_valid else PairStatus.MAY_CROSS), moved_by
    return _progress(status.shape[0], FINISHED, filled, n_left_out)
