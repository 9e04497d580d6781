"""Segments on polygons and polyhedra: contacts by a box tree, pieces between them; several for each segment.

The locator of the region tells the location of each first end. A kernel cuts the segments that meet the boundary in
proper crossings only (boundary_cut.py); what meets it otherwise, in an edge, a vertex, a face, is cut in exact
arithmetic (exact_pieces.py). Zero-length segments are points.
"""

from __future__ import annotations

from functools import partial
from typing import Any, Final

import numpy as np

from engine.arrays import FlagArray, FloatArray, Int8Array, IntArray
from engine.containment.locators import Locator, locator_of
from engine.containment.rational_locate import rational_location
from engine.direct import entry_of
from engine.parallel import Budget, Progress, run_chunks
from engine.segment_clipping.boundary_cut import SETTLED, cut_on_mesh, cut_on_outline
from engine.segment_clipping.contacts import GROUP, NO_ROOM, find_contacts_2d
from engine.segment_clipping.decide_then_cut import Clipped
from engine.segment_clipping.exact_pieces import pieces_of
from engine.segment_clipping.exact_segments import Piece
from engine.segment_clipping.mesh_streams import find_mesh_contacts
from engine.segment_clipping.pieces import Pieces, joined, room_for
from engine.segment_clipping.prepared_boundary import Mesh, Outline, boundary_of
from engine.solids.checks import check_finite
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.triangle import Triangle
from engine.types import OPEN

Bounded = Polygon | Polyhedron | Triangle
"""What a boundary bounds; triangles of the plane."""
_LEAST_ROOM: Final = 1 << 8
"""Contacts, or pieces, looked for at once; doubled where one segment has more."""
_CONTACTS: Final = 4
"""Of each segment of a group; likewise."""
_BYTES: Final = 180
_BYTES_EXACT: Final = 1000
"""Of a piece, in its part and joined; as Python holds it."""


def clip_on_boundary(
    segments: FloatArray, region: Polygon | Polyhedron, budget: Budget, workers: int | None, progress: Progress | None
) -> Clipped:
    """Return the pieces of segments (n, 2, dim) float64, not yet looked at for NaN.

    Raises: NotFiniteError.
    """
    check_finite(segments, ("segments",))
    chunks: dict[int, Clipped] = {}
    locator = locator_of(region).chosen(len(segments), budget)

    def chunk(first: int, last: int) -> None:
        chunks[first] = clip_chunk(segments, first, last, region, locator, budget)

    run_chunks(chunk, len(segments), budget=budget, workers=workers, progress=progress, first_chunk=16)
    parts = [chunks[first] for first in sorted(chunks)] or [clip_chunk(segments, 0, 0, region, locator, budget)]
    pieces, n_beyond, n_rational = zip(*parts)
    return joined(pieces), sum(n_beyond), sum(n_rational)


def clip_chunk(
    segments: FloatArray, first: int, last: int, region: Bounded, locator: Locator, budget: Budget
) -> Clipped:
    """Return the pieces of ``segments[first:last]``, (n, 2, dim) float64, in order of source and t."""
    boundary, part = boundary_of(region), segments[first:last]
    locations = np.empty(len(part), np.int8)
    locator.fill(part[:, 0].copy(), locations, budget)
    parts, state = cut_at_crossings(part, locations, boundary, budget)
    left = np.flatnonzero(state != SETTLED)
    if len(left):
        parts.append(_exact(part, left, locations[left], region, boundary, budget))
    pieces = parts[0] if len(parts) == 1 else joined(parts)
    source, ends, t, faces = pieces
    if len(left):
        order = np.argsort(source, kind="stable")  # pieces of one segment stand together in one part
        source, ends, t, faces = source[order], ends[:, order], t[order], faces[order]
    return Pieces(source + first, ends, t, faces), len(left), len(left)


def cut_at_crossings(
    segments: FloatArray, locations: Int8Array, boundary: Outline | Mesh, budget: Budget
) -> tuple[list[Pieces], FlagArray]:
    """Return the pieces of those segments that the kernel settles, and the state of each."""
    n = len(segments)
    state = np.full(n, OPEN, np.uint8)
    kernel: Any = cut_on_mesh if isinstance(boundary, Mesh) else cut_on_outline
    parts, room = [], _LEAST_ROOM + n
    done = np.array([0, 0, _LEAST_ROOM + _CONTACTS * min(GROUP, n)])
    while done[0] < n:
        reached, pieces = int(done[0]), room_for(room, segments.shape[2])
        entry_of(kernel)(segments, locations, boundary, budget.flag, pieces, state, done)
        budget.check()
        if done[0] == reached:
            room *= 2  # of rows, if not of contacts
        m = int(done[1])
        budget.take(_BYTES * m)
        parts.append(Pieces(pieces.source[:m], pieces.ends[:, :m], pieces.t[:m], pieces.faces[:m]))
    return parts or [room_for(0, segments.shape[2])], state


def _exact(
    segments: FloatArray,
    chosen: IntArray,
    locations: Int8Array,
    region: Bounded,
    boundary: Outline | Mesh,
    budget: Budget,
) -> Pieces:
    """Return the pieces of the chosen segments by exact arithmetic; locations: of their first ends."""
    part = segments[chosen]
    offsets, elements = elements_met(part, boundary, budget)
    last_locations, on_boundary = np.zeros_like(locations), np.flatnonzero(locations == 0)
    locator_of(region).fill(part[on_boundary, 1], found := np.empty(len(on_boundary), np.int8), budget)
    last_locations[on_boundary] = found
    locate = partial(rational_location, solid=region, check=budget.check)
    sources: list[int] = []
    pieces: list[Piece] = []
    for i, (at_start, at_end) in enumerate(zip(locations.tolist(), last_locations.tolist())):
        budget.check()
        p, q = part[i].tolist()
        if p == q:  # a point: its location says it all
            found_here = [Piece((0.0, 1.0), p, q, (-1, -1))] * (at_start >= 0)
        else:
            mine = elements[offsets[i] : offsets[i + 1]]
            near = list(zip(boundary.faces[mine].tolist(), boundary.elements[mine].tolist()))
            found_here = list(pieces_of(p, q, near, (at_start, at_end), locate, budget.check))
        sources += [int(chosen[i])] * len(found_here)
        pieces += found_here
        budget.take(_BYTES_EXACT * len(found_here))
    ends = np.array([(piece.start, piece.end) for piece in pieces], np.float64).reshape(-1, 2, segments.shape[2]) + 0.0
    return Pieces(
        np.array(sources, np.int64),
        np.ascontiguousarray(ends.swapaxes(0, 1)),
        np.array([piece.t for piece in pieces], np.float64).reshape(-1, 2) + 0.0,
        np.array([piece.faces for piece in pieces], np.int64).reshape(-1, 2),
    )


def elements_met(segments: FloatArray, boundary: Outline | Mesh, budget: Budget) -> tuple[IntArray, IntArray]:
    """Return the offsets (n + 1,) of each segment's contacts, and their elements."""
    kernel: Any = find_mesh_contacts if isinstance(boundary, Mesh) else find_contacts_2d
    ends, elements = [np.zeros(1, np.int64)], [np.zeros(0, np.int64)]
    for first in range(0, len(segments), GROUP):
        room, found = _LEAST_ROOM + 8 * min(GROUP, len(segments)), NO_ROOM
        while found == NO_ROOM:  # bound: room is doubled, and a segment meets an element once
            found, met, _, offsets = entry_of(kernel)(segments[first : first + GROUP], boundary, budget.flag, room)
            budget.check()
            room *= 2
        ends.append(ends[-1][-1] + offsets[1:])
        elements.append(met[:found])
    return np.concatenate(ends), np.concatenate(elements)
