"""Clips segments to polygons and polyhedra: contacts by a box tree, then the pieces between them, maybe several a
segment.

The locator of the region locates each first end. A kernel cuts segments at crossings and touches (boundary_cut.py);
what it leaves OPEN, above all segments in the plane of a face, goes to the exact fallback (exact_pieces.py).
Zero-length segments are points.
"""

from __future__ import annotations

from typing import Any, Final, cast

import numpy as np

from engine.compiling.jit import entry_of
from engine.containment.locate import locate_small_batch
from engine.containment.locators import Locator, locator_of, polyhedron_by
from engine.containment.policy import Choice
from engine.running.budget import UNLIMITED, Budget
from engine.running.parallel import Progress, run_chunks
from engine.segment_clipping.decide_then_cut import FEW, Clipped, Plan
from engine.segment_clipping.on_boundary.boundary_cut import cut_on_mesh, cut_on_outline
from engine.segment_clipping.on_boundary.contacts import GROUP
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, Outline, boundary_of
from engine.segment_clipping.pieces import Pieces, allocate_pieces, first_of, in_order_of_source, joined
from engine.segment_clipping.profiles import clip_exactly
from engine.solids.checks import check_finite
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.primitives import Triangle
from engine.types import FlagArray, FloatArray, Int8Array, IntArray

Bounded = Polygon | Polyhedron | Triangle
"""Solids with a boundary of edges or triangles; triangles only in 2D."""
_LEAST_ROOM: Final = 1 << 8
"""Smallest capacity for contacts, or pieces; doubled if one segment needs more."""
_CONTACTS: Final = 4
"""Capacity for contacts for each segment of a group; doubled likewise."""
_BYTES: Final = 180
"""Memory counted for a piece, in its part and joined."""
_MOST_FEW: Final = 1 << 10
_CONTACTS_OF_FEW: Final = 1 << 16
"""Limits of a batch that runs as one chunk: _MOST_FEW segments, and at most so many contacts."""
_CONTACT_BYTES: Final = 60
"""Memory of a contact while a kernel runs."""
_FIRST_CHUNK: Final = 16
"""Segments of the first chunk; one of them may cross everything."""


def on_boundary(region: Polygon | Polyhedron) -> Plan:
    """Return the clipping plan of a polygon or polyhedron."""
    return Plan("box_tree", clip_on_boundary, max(FEW, min(_MOST_FEW, _CONTACTS_OF_FEW // len(region.vertices))))


def clip_on_boundary(
    segments: FloatArray, region: Bounded, _: Plan, budget: Budget, workers: int | None, progress: Progress | None
) -> Clipped:
    """Return the pieces of segments in a polygon or polyhedron, the number of segments beyond the filter, and of those
    decided in rationals."""
    if len(segments) > _MOST_FEW or not np.isfinite(segments).all():
        check_finite(segments, ("segments",))
    if budget is UNLIMITED or not len(segments):
        few_pieces, open_ones = clip_chunk(segments, 0, len(segments), region, None, budget)
        return few_pieces, len(open_ones), len(open_ones)
    chunks: dict[int, tuple[Pieces, IntArray]] = {}
    locator = locator_of(region).chosen(len(segments), budget)
    if locator.is_long and len(segments) > _MOST_FEW:  # each chunk would pass over all faces
        locator = polyhedron_by(cast("Polyhedron", region), Choice.LISTS, budget)

    def chunk(first: int, last: int) -> None:
        chunks[first] = clip_chunk(segments, first, last, region, locator, budget)

    least = len(segments) if locator.is_long else _FIRST_CHUNK
    run_chunks(chunk, len(segments), budget=budget, workers=workers, progress=progress, first_chunk=least)
    pieces, left = zip(*(chunks[first] for first in sorted(chunks)))
    n_left = sum(map(len, left))
    return joined(pieces, budget, workers), n_left, n_left


def clip_chunk(
    segments: FloatArray, first: int, last: int, region: Bounded, locator: Locator | None, budget: Budget
) -> tuple[Pieces, IntArray]:
    """Return the pieces of ``segments[first:last]``, (n, 2, dim) float64, sorted, and the segments that took the exact
    fallback, counted from `first`. locator: of the region; None for a small batch, whose first ends are located on the
    fast path."""
    boundary, part = region.cached("clipping_boundary") or boundary_of(region), segments[first:last]
    points, locations = part[:, 0].copy(), np.zeros((last - first, 2), np.int8)
    at_once = locate_small_batch(points, region) if locator is None else None
    if at_once is None:
        locator = locator or locator_of(region).chosen(len(points), budget)
        locator.fill(points, of_starts := np.empty(len(points), np.int8), budget)
    else:
        of_starts = at_once[0]
    locations[:, 0] = of_starts
    if np.count_nonzero(of_starts) < len(points):
        on_it = np.flatnonzero(of_starts == 0)
        locator = locator or locator_of(region)
        locator.fill(part[on_it, 1], of_ends := np.empty(len(on_it), np.int8), budget)
        locations[on_it, 1] = of_ends
    parts, state = cut_at_crossings(part, locations, boundary, budget)
    left = state.nonzero()[0]  # not SETTLED
    if len(left):
        locations[np.abs(locations) > 1] = 0
        parts.append(clip_exactly(part, left, region, None, budget, locations[left].tolist()))
    pieces = in_order_of_source(parts) if len(left) else joined(parts) if len(parts) > 1 else parts[0]
    return (pieces._replace(source=pieces.source + first) if first else pieces), left


def cut_at_crossings(
    segments: FloatArray, locations: Int8Array, boundary: Outline | Mesh, budget: Budget
) -> tuple[list[Pieces], FlagArray]:
    """Return the pieces of the segments (n, 2, dim) that the kernel decides, in several arrays, and by segment its
    state (SETTLED, OPEN). locations (n, 2): see `cut_on_outline`."""
    n, _, dimension = segments.shape
    cut: Any = cut_on_mesh if isinstance(boundary, Mesh) else cut_on_outline
    room, least, reached, parts = _LEAST_ROOM + n, _LEAST_ROOM + _CONTACTS * min(GROUP, n), 0, []
    counted, done, state = least, np.array([0, 0, least]), np.empty(n, np.uint8)
    while reached < n:
        before, pieces = reached, allocate_pieces(room, dimension)
        entry_of(cut)(segments, locations, boundary, budget.flag, pieces, state, done)
        reached, m, n_contacts = done.tolist()
        if reached == before:
            room *= 2  # of rows, if not of contacts
        if budget is not UNLIMITED:
            budget.check()
            budget.take(_BYTES * m + _CONTACT_BYTES * (n_contacts - counted))
        counted = n_contacts
        parts.append(first_of(pieces, m))
    if counted > least:
        budget.take(_CONTACT_BYTES * (least - counted))
    return parts or [allocate_pieces(0, dimension)], state
