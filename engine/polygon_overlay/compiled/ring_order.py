"""Canonical order of rounded rings, in which they are written with the sources of vertices and the provenance of rings.

Pieces are in order of their shells, holes after their shell; each ring begins at its lexicographically smallest vertex
(x, then y), and rings are compared vertex by vertex from there.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from engine.compiling.jit import inline, merged
from engine.polygon_overlay.compiled.chain_rings import Rings
from engine.polygon_overlay.compiled.clearance import Rounded
from engine.polygon_overlay.compiled.crossing_signs import turn_of_edges
from engine.polygon_overlay.compiled.edge_tree import OFTEN, POLL, RUN, box_contains
from engine.polygon_overlay.compiled.loading import LEFT_OUT
from engine.polygon_overlay.compiled.ring_nesting import NO_ROOM, write_evidence
from engine.predicates.orientation import orient2d
from engine.types import UNDECIDED, FlagArray, FloatArray, Int32Array, Point2

Output = namedtuple("Output", "vertices sources rings pieces evidence")
"""Results, pair after pair: vertices (m, 2) float64; sources (m, 2) int32; offsets of rings into vertices and of pieces
into rings, (n + 1,) int64; evidence (m, 2) int64, rows (ring, source ring)."""

Ranking = namedtuple("Ranking", "start x y is_hole piece order spare")
"""By ring: start, x, y, index and coordinates of its first vertex; is_hole; piece, rank of its piece. order: the rings
in canonical order; spare: scratch."""


@inline
def _is_before(rings: Rings, ranking: Ranking, rounded: Rounded, i: int, j: int) -> bool:
    """Return whether ring i precedes ring j in canonical order: by piece, the shell before holes, then
    lexicographically by the doubles of each vertex. rounded: these doubles."""
    x, y = rounded.x, rounded.y
    if ranking.piece[i] != ranking.piece[j]:
        return ranking.piece[i] < ranking.piece[j]
    if ranking.is_hole[i] != ranking.is_hole[j]:
        return ranking.is_hole[i] < ranking.is_hole[j]
    if ranking.x[i] != ranking.x[j]:
        return ranking.x[i] < ranking.x[j]
    if ranking.y[i] != ranking.y[j]:
        return ranking.y[i] < ranking.y[j]
    p, q = ranking.start[i], ranking.start[j]
    n, m = rings.offset[i + 1] - rings.offset[i], rings.offset[j + 1] - rings.offset[j]
    for _ in range(min(n, m)):
        if x[p] != x[q]:
            return x[p] < x[q]
        if y[p] != y[q]:
            return y[p] < y[q]
        p = p + 1 if p + 1 < rings.offset[i + 1] else rings.offset[i]
        q = q + 1 if q + 1 < rings.offset[j + 1] else rings.offset[j]
    return n < m


@inline
def _sort(rings: Rings, ranking: Ranking, rounded: Rounded, n: int, is_by_piece: bool, stop: FlagArray) -> None:
    """Sort the first n rings of ``ranking.order`` into canonical order, by merging runs of doubling length.
    is_by_piece: the rings are of several pieces; if False, all are shells, and the x of their first vertices decides
    nearly always."""
    order, spare, first_x = ranking.order, ranking.spare, ranking.x
    width = 1
    while width < n:  # bound: log n turns
        for low in range(0, n - width, 2 * width):
            middle, high = low + width, min(low + 2 * width, n)
            if low & POLL == 0 and stop[0]:
                return
            if not _is_before(rings, ranking, rounded, order[middle], order[middle - 1]):
                continue
            i, j = low, middle
            for k in range(low, high):
                if k & POLL == 0 and stop[0]:
                    return
                p, q = order[i if i < middle else low], order[j if j < high else low]
                if i >= middle or j >= high:
                    takes_second = i >= middle
                elif is_by_piece or first_x[p] == first_x[q]:
                    takes_second = _is_before(rings, ranking, rounded, q, p)
                else:
                    takes_second = first_x[q] < first_x[p]
                spare[k] = q if takes_second else p
                i += not takes_second
                j += takes_second
            for k in range(low, high):
                order[k] = spare[k]
        width *= 2


@inline
def find_shells(rings: Rings, n_rings: int, rounded: Rounded, ranking: Ranking, widest: Any, boxes: FloatArray) -> bool:
    """Fill ``ranking.is_hole`` for rings whose orientation rounding may have changed; return False if a region has not
    exactly one possible shell.

    Rounding is monotone, so the rounded box of a shell contains those of its holes: the shell of a region is the only
    ring whose box contains all others and equals none. widest, boxes: scratch by region, by ring.
    """
    x, y = rounded.x, rounded.y
    for ring in range(n_rings):
        x_min = y_min = np.inf
        x_max = y_max = -np.inf
        for k in range(rings.offset[ring], rings.offset[ring + 1]):
            x_min, x_max = min(x_min, x[k]), max(x_max, x[k])
            y_min, y_max = min(y_min, y[k]), max(y_max, y[k])
        boxes[ring, 0], boxes[ring, 1], boxes[ring, 2], boxes[ring, 3] = x_min, x_max, y_min, y_max
        widest[rings.region[ring]] = ring
    for ring in range(n_rings):
        if box_contains(boxes, ring, boxes, widest[rings.region[ring]]):
            widest[rings.region[ring]] = ring
    for ring in range(n_rings):
        shell = widest[rings.region[ring]]
        if ring != shell and (not box_contains(boxes, shell, boxes, ring) or box_contains(boxes, ring, boxes, shell)):
            return False
        ranking.is_hole[ring] = ring != shell
    return True


@inline
def rank_rings(
    rings: Rings, n_rings: int, rounded: Rounded, ranking: Ranking, is_valid: bool, piece_of: Int32Array,
    boxes: FloatArray, stop: FlagArray,
) -> int:  # fmt: skip
    """Fill ``ranking``, with the rings in canonical order; return the number of pieces, or -1 if a region has not
    exactly one proven shell or ``stop`` is set. rounded: the doubles of their points; is_valid: rounding is proven to
    preserve the topology of the rings. piece_of, boxes: scratch by region, by ring."""
    if not is_valid and not find_shells(rings, n_rings, rounded, ranking, piece_of, boxes):
        return -1
    n_pieces = 0
    for ring in range(n_rings):
        if ring & OFTEN == 0 and stop[0]:
            return -1
        turn = _turn_at_first(rings, ring, rounded, ranking, stop)
        if is_valid:
            ranking.is_hole[ring] = turn < 0
        ranking.piece[ring] = 0
        piece_of[rings.region[ring]] = -1
        if turn > 0 if is_valid else not ranking.is_hole[ring]:
            ranking.order[n_pieces] = ring
            n_pieces += 1
    if n_rings == 1:
        return n_pieces if n_pieces == 1 else -1
    _sort(rings, ranking, rounded, n_pieces, False, stop)
    if stop[0]:
        return -1
    for k in range(n_pieces):
        region = rings.region[ranking.order[k]]
        if piece_of[region] >= 0:
            return -1
        piece_of[region] = k
    for ring in range(n_rings):
        ranking.piece[ring] = piece_of[rings.region[ring]]
        if ranking.piece[ring] < 0:
            return -1
    if n_pieces < n_rings:
        for ring in range(n_rings):
            ranking.order[ring] = ring
        _sort(rings, ranking, rounded, n_rings, True, stop)
    return n_pieces


@inline
def _turn_at_first(rings: Rings, ring: int, rounded: Rounded, ranking: Ranking, stop: FlagArray) -> int:
    """Write to ``ranking`` the index and coordinates of the smallest vertex (x, then y) of a ring; return the sign of
    the ring's turn there (1 left, -1 right), 0 also if it is not decided or stopped."""
    x, y = rounded.x, rounded.y
    first, last = rings.offset[ring], rings.offset[ring + 1]
    low = first
    for k in range(first + 1, last):
        if k & POLL == 0 and stop[0]:
            return 0
        if x[k] < x[low] or (x[k] == x[low] and y[k] < y[low]):
            low = k
    ranking.start[ring], ranking.x[ring], ranking.y[ring] = low, x[low], y[low]
    before, after = (low if low > first else last) - 1, low + 1 if low + 1 < last else first
    turn = orient2d(Point2(x[before], y[before]), Point2(x[low], y[low]), Point2(x[after], y[after]))
    return 0 if turn == UNDECIDED else turn


class Filled(NamedTuple):
    """Numbers of vertices, rings, pieces and evidence rows written so far."""

    n_vertices: int
    n_rings: int
    n_pieces: int
    n_evidence: int


@merged
def has_room(output: Output, filled: Filled, n_vertices: int, n_rings: int) -> bool:
    """Return whether n_vertices more vertices and n_rings more rings fit the output, of which ``filled`` is taken."""
    return (filled.n_vertices + n_vertices <= output.vertices.shape[0]) & (
        filled.n_rings + n_rings < output.rings.shape[0]
    )


@merged
def write_convex(w: Any, m: int, low: int, output: Output, filled: Filled) -> None:
    """Append the ring of m points that `intersect_convex` left in the `Workspace` w, beginning at its point ``low``, to
    the output, of which ``filled`` is taken. Caller guarantees room."""
    i = low
    for k in range(filled.n_vertices, filled.n_vertices + m):
        output.vertices[k, 0], output.vertices[k, 1] = w.rounded.x[i], w.rounded.y[i]
        output.sources[k, 0], output.sources[k, 1] = w.rings.point[i], w.tree.places[i]
        i = i + 1 if i + 1 < m else 0
    output.rings[filled.n_rings + 1] = filled.n_vertices + m
    output.pieces[filled.n_pieces + 1] = filled.n_rings + 1


@merged
def _source_of(w: Any, n: int, i: int) -> tuple[int, int]:
    """Return the row of ``sources`` for point i of the rings in the `Workspace` w, encoded as in the table of
    `overlay_pairs`. n: number of input vertices."""
    point, edge, origins = w.rings.point[i], w.rings.edge[i], w.given.origins
    if point >= n:
        first, second = w.events.first[point - n], w.events.second[point - n]
        is_beside = edge == first or (edge != second and turn_of_edges(w.given.edges, edge, first) == 0)
        return origins[edge], origins[second if is_beside else first]
    if w.rings.meets[i] & RUN:
        return origins[point], LEFT_OUT
    return origins[point], -1 if edge == point else LEFT_OUT - 1 - origins[edge]


@merged
def write_rings(w: Any, n: int, n_boundary: int, output: Output, filled: Filled, stop: FlagArray) -> None:
    """Append the n_boundary rings in the `Workspace` w to the output in canonical order. n: number of input vertices;
    filled: what of the output is taken. Caller guarantees room."""
    n_out, n_pieces = filled.n_vertices, filled.n_pieces
    for k in range(n_boundary):
        ring = w.ranking.order[k] if n_boundary > 1 else 0
        first, last = w.rings.offset[ring], w.rings.offset[ring + 1]
        i = w.ranking.start[ring]
        for _ in range(last - first):
            if n_out & POLL == 0 and stop[0]:
                return
            output.vertices[n_out, 0], output.vertices[n_out, 1] = w.rounded.x[i], w.rounded.y[i]
            output.sources[n_out, 0], output.sources[n_out, 1] = _source_of(w, n, i)
            n_out += 1
            i = i + 1 if i + 1 < last else first
        output.rings[filled.n_rings + k + 1] = n_out
        is_hole = w.ranking.is_hole[ring]
        n_pieces += int(not is_hole)
        output.pieces[n_pieces] = filled.n_rings + k + 1


@merged
def write_provenance(w: Any, n_boundary: int, first: int, output: Output, filled: Filled) -> int:
    """Append the evidence rows (ring, source ring) of the n_boundary rings in the `Workspace` w to the output; return
    the number of rows then, or NO_ROOM. first: number of the pair's first source ring."""
    n = filled.n_evidence
    for k in range(n_boundary):
        ring = w.ranking.order[k] if n_boundary > 1 else 0
        is_hole, region = w.ranking.is_hole[ring] != 0, w.rings.region[ring]
        n = write_evidence(w.flood, ring, region, is_hole, filled.n_rings + k, first, output.evidence, n)
        if n == NO_ROOM:
            return n
    return n


@merged
def write_component_ids(w: Any, n_boundary: int, output: Output, filled: Filled) -> int:
    """Write to ``output.evidence`` a row (ring, part of the result that it bounds) for each of the n_boundary rings in
    the `Workspace` w; return the number of rings in the output then."""
    for k in range(n_boundary):
        ring = w.ranking.order[k] if n_boundary > 1 else 0
        at = filled.n_rings + k
        output.evidence[at, 0], output.evidence[at, 1] = at, w.faces.inside[w.rings.region[ring]]
    return filled.n_rings + n_boundary
