"""Segments on polygons and polyhedra: contacts by a box tree, pieces between them; several for each segment.

The locator of the region tells the location of each first end. A kernel cuts segments at what they cross
(boundary_cut.py) and touch (touching_cut.py); what it leaves, those in the plane of a face above all, is cut in exact
arithmetic (exact_pieces.py). Zero-length segments are points.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrays import FlagArray, FloatArray, Int8Array, IntArray
from engine.compiling.direct import entry_of
from engine.containment.at_once import located_at_once
from engine.containment.locators import Locator, locator_of
from engine.running.budget import UNLIMITED, Budget
from engine.running.parallel import Progress, run_chunks
from engine.segment_clipping.decide_then_cut import Clipped
from engine.segment_clipping.on_boundary.boundary_cut import SETTLED, cut_on_mesh, cut_on_outline
from engine.segment_clipping.on_boundary.chords import look_before
from engine.segment_clipping.on_boundary.contacts import GROUP
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, Outline, boundary_of
from engine.segment_clipping.pieces import Pieces, completed, first_of, joined, room_for
from engine.segment_clipping.profiles import settled
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
"""Of a piece, in its part and joined."""
_FEW_PIECES: Final = 4
"""Of each of a few segments, for which there is room at first."""
_CONTACT_BYTES: Final = 60
"""Of a contact, while a kernel runs."""
_FIRST_CHUNK: Final = 16
"""Segments, one of which may cross everything."""


def clip_on_boundary(
    segments: FloatArray, region: Polygon | Polyhedron, budget: Budget, workers: int | None, progress: Progress | None
) -> Clipped:
    """Return the pieces of segments (n, 2, dim) float64, not yet looked at for NaN.

    Raises: NotFiniteError.
    """
    check_finite(segments, ("segments",))
    chunks: dict[int, tuple[Pieces, IntArray]] = {}
    locator = locator_of(region).chosen(len(segments), budget)

    def chunk(first: int, last: int) -> None:
        chunks[first] = clip_chunk(segments, first, last, region, locator, budget)

    least = len(segments) if locator.is_long else _FIRST_CHUNK
    run_chunks(chunk, len(segments), budget=budget, workers=workers, progress=progress, first_chunk=least)
    parts = [chunks[first] for first in sorted(chunks)] or [clip_chunk(segments, 0, 0, region, locator, budget)]
    pieces, left = zip(*parts)
    n_left = sum(map(len, left))
    return joined(pieces), n_left, n_left


def _kernel_of(boundary: Outline | Mesh) -> Any:
    return cut_on_mesh if isinstance(boundary, Mesh) else cut_on_outline


def clip_few(segments: FloatArray, region: Bounded, boundary: Outline | Mesh) -> Pieces | None:
    """Return the pieces of a few segments, (n, 2, dim) float64, not yet looked at for NaN, in a third of the time that
    the general way takes; None where one is left open or begins on the boundary."""
    n, _, dimension = segments.shape
    found = located_at_once(segments[:, 0].copy(), region) if np.isfinite(segments).all() else None
    if found is None or not found[0].all():
        return None
    locations, state = np.zeros((n, 2), np.int8), np.empty(n, np.uint8)
    locations[:, 0] = found[0]
    pieces, done = room_for(_FEW_PIECES * n, dimension), np.array([0, 0, _LEAST_ROOM])
    entry_of(_kernel_of(boundary))(segments, locations, boundary, UNLIMITED.flag, pieces, state, done)
    reached, m, _ = done.tolist()
    return first_of(pieces, m) if reached == n and not state.any() else None


def clip_chunk(
    segments: FloatArray, first: int, last: int, region: Bounded, locator: Locator, budget: Budget
) -> tuple[Pieces, IntArray]:
    """Return the pieces of ``segments[first:last]``, (n, 2, dim) float64, in order of source and t, and which of them
    were cut in exact arithmetic."""
    boundary, part = boundary_of(region), segments[first:last]
    locations = _locations_of(part, boundary, locator, budget)
    parts, state = cut_at_crossings(part, locations, boundary, budget)
    left = np.flatnonzero(state != SETTLED)
    if len(left):
        locations[np.abs(locations) > 1] = 0
        parts.append(settled(part, left, region, None, budget, locations[left].tolist()))
    pieces = completed(parts) if len(left) else joined(parts) if len(parts) > 1 else parts[0]
    return pieces._replace(source=pieces.source + first), left


def _locations_of(segments: FloatArray, boundary: Outline | Mesh, locator: Locator, budget: Budget) -> Int8Array:
    """Return the locations (n, 2) of the ends of segments, of the second where the first is on the boundary; where both
    are, what `look_before` sets."""
    locations = np.zeros((len(segments), 2), np.int8)
    locator.fill(segments[:, 0].copy(), first := np.empty(len(segments), np.int8), budget)
    locations[:, 0] = first
    on_boundary = np.flatnonzero(first == 0)
    if len(on_boundary):
        locator.fill(segments[on_boundary, 1], second := np.empty(len(on_boundary), np.int8), budget)
        locations[on_boundary, 1] = second
        look_before(segments, locations, boundary, locator, budget)
    return locations


def cut_at_crossings(
    segments: FloatArray, locations: Int8Array, boundary: Outline | Mesh, budget: Budget
) -> tuple[list[Pieces], FlagArray]:
    """Return the pieces of those segments that the kernel settles, and the state of each."""
    n = len(segments)
    state = np.full(n, OPEN, np.uint8)
    kernel, parts, room = _kernel_of(boundary), [], _LEAST_ROOM + n
    done = np.array([0, 0, _LEAST_ROOM + _CONTACTS * min(GROUP, n)])
    counted = least = int(done[2])
    while done[0] < n:
        reached, pieces = int(done[0]), room_for(room, segments.shape[2])
        entry_of(kernel)(segments, locations, boundary, budget.flag, pieces, state, done)
        budget.check()
        if done[0] == reached:
            room *= 2  # of rows, if not of contacts
        m, n_contacts = int(done[1]), int(done[2])
        budget.take(_BYTES * m + _CONTACT_BYTES * (n_contacts - counted))
        counted = n_contacts
        parts.append(first_of(pieces, m))
    if counted > least:
        budget.take(_CONTACT_BYTES * (least - counted))
    return parts or [room_for(0, segments.shape[2])], state
