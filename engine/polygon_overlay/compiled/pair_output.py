"""What a pair leaves in the output: its rings in their order, the source of each vertex, and evidence about rings.

Nothing here decides: rings come ranked (ring_order.py) and rounded (rounded_crossings.py).
"""

from __future__ import annotations

from typing import Any, NamedTuple

from engine.jit import merged
from engine.polygon_overlay.compiled.crossing_signs import turn_of_edges
from engine.polygon_overlay.compiled.edge_tree import POLL, RUN
from engine.polygon_overlay.compiled.loading import LEFT_OUT
from engine.polygon_overlay.compiled.ring_nesting import NO_ROOM, write_evidence
from engine.polygon_overlay.compiled.workspace import Output, Workspace


class Filled(NamedTuple):
    """How much output there is."""

    n_vertices: int
    n_rings: int
    n_pieces: int
    n_evidence: int


@merged
def has_room(output: Output, filled: Filled, n_vertices: int, n_rings: int) -> bool:
    """Tell whether so much more fits into the output."""
    return (filled.n_vertices + n_vertices <= output.vertices.shape[0]) & (
        filled.n_rings + n_rings < output.rings.shape[0]
    )


@merged
def write_convex(w: Workspace, m: int, low: int, output: Output, filled: Filled) -> None:
    """Append the ring that `_intersect_convex` left, from its point ``low`` on."""
    i = low
    for k in range(filled.n_vertices, filled.n_vertices + m):
        output.vertices[k, 0], output.vertices[k, 1] = w.rounded.x[i], w.rounded.y[i]
        output.sources[k, 0], output.sources[k, 1] = w.found.point[i], w.tree.places[i]
        i = i + 1 if i + 1 < m else 0
    output.rings[filled.n_rings + 1] = filled.n_vertices + m
    output.pieces[filled.n_pieces + 1] = filled.n_rings + 1


@merged
def _source_of(w: Workspace, n: int, i: int) -> tuple[int, int]:
    """Return the source of point i of the rings, as `overlay_pairs` tells it."""
    point, edge, origins = w.found.point[i], w.found.edge[i], w.given.origins
    if point >= n:
        first, second = w.events.first[point - n], w.events.second[point - n]
        is_beside = edge == first or (edge != second and turn_of_edges(w.given.edges, edge, first) == 0)
        return origins[edge], origins[second if is_beside else first]
    if w.found.meets[i] & RUN:
        return origins[point], LEFT_OUT
    return origins[point], -1 if edge == point else LEFT_OUT - 1 - origins[edge]


@merged
def write_rings(w: Workspace, n: int, n_found: int, output: Output, filled: Filled, stop: Any) -> None:
    """Append the rings in their order to the output."""
    n_out, n_pieces = filled.n_vertices, filled.n_pieces
    for k in range(n_found):
        ring = w.ranking.order[k] if n_found > 1 else 0
        first, last = w.found.offset[ring], w.found.offset[ring + 1]
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
def tell_evidence(w: Workspace, n_found: int, first: int, output: Output, filled: Filled) -> int:
    """Append the evidence of the rings to the output; return how much there is then, or NO_ROOM."""
    n = filled.n_evidence
    for k in range(n_found):
        ring = w.ranking.order[k] if n_found > 1 else 0
        is_hole, region = w.ranking.is_hole[ring] != 0, w.found.region[ring]
        n = write_evidence(w.holders, ring, region, is_hole, filled.n_rings + k, first, output.evidence, n)
        if n == NO_ROOM:
            return n
    return n


@merged
def tell_parts(w: Workspace, n_found: int, output: Output, filled: Filled) -> int:
    """Append of each ring the part of the result that it bounds; return how many rings there are then."""
    for k in range(n_found):
        ring = w.ranking.order[k] if n_found > 1 else 0
        at = filled.n_rings + k
        output.evidence[at, 0], output.evidence[at, 1] = at, w.faces.inside[w.found.region[ring]]
    return filled.n_rings + n_found
