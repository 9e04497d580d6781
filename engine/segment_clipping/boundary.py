"""Segments on polygons and polyhedra: contacts by a box tree, pieces between them; several for each segment.

A kernel cuts the segments that meet the boundary in proper crossings only (boundary_cut.py). Where a location is
wanted that parity leaves open, the locator of the region tells it; what meets the boundary otherwise, in an edge, a
vertex, a face, is cut in exact arithmetic (exact_pieces.py). Zero-length segments are points.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any, Final

import numpy as np

from engine.arrays import FlagArray, FloatArray, Int8Array, IntArray
from engine.containment.locators import Locator, locator_of
from engine.containment.rational_locate import rational_location
from engine.parallel import Budget
from engine.segment_clipping.boundary_cut import NEEDS_LOCATION, SETTLED, cut_on_mesh, cut_on_outline
from engine.segment_clipping.contacts import GROUP, NO_ROOM, PROPER, find_contacts_2d
from engine.segment_clipping.decide_then_cut import Clipped
from engine.segment_clipping.exact_pieces import pieces_of
from engine.segment_clipping.exact_segments import Piece
from engine.segment_clipping.mesh_contacts import is_clear
from engine.segment_clipping.mesh_streams import find_mesh_contacts
from engine.segment_clipping.pieces import Pieces, joined, room_for
from engine.segment_clipping.prepared_boundary import Mesh, Outline, boundary_of
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.types import OPEN, UNDECIDED

_LEAST_ROOM: Final = 1 << 8
"""Contacts, or pieces, looked for at once; doubled where one segment has more."""
_CONTACTS: Final = 4
"""Of each segment of a group; likewise."""


def locator_for(region: Polygon | Polyhedron, n_segments: int, budget: Budget) -> Locator | None:
    """Return what locates the first ends of so many segments faster than their own parity does, if there is such."""
    chosen = locator_of(region).chosen(n_segments, budget)
    return chosen if chosen.method in _FAST else None


_FAST: Final = ("segment_parity", "ring_cells")


def clip_chunk(
    segments: FloatArray,
    first: int,
    last: int,
    region: Polygon | Polyhedron,
    locator: Locator | None,
    budget: Budget,
) -> Clipped:
    """Return the pieces of ``segments[first:last]``, (n, 2, dim) float64, in order of source and t."""
    boundary = boundary_of(region)
    chosen = np.arange(first, last)
    locations = np.full(len(chosen), UNDECIDED, np.int8)
    if locator is not None and len(chosen):
        locator.fill(segments[first:last, 0].copy(), locations, budget)
    parts, state = _settle(segments, chosen, locations, boundary, budget)
    left = np.flatnonzero(state != SETTLED)
    if not len(left):
        return parts[0] if len(parts) == 1 else joined(parts), 0, 0
    locator_of(region).fill(segments[chosen[left], 0], locations_left := np.empty(len(left), np.int8), budget)
    unlocated = state[left] == NEEDS_LOCATION
    again = chosen[left[unlocated]]
    more, state_again = _settle(segments, again, locations_left[unlocated], boundary, budget)
    is_open = ~unlocated
    is_open[unlocated] = state_again != SETTLED
    parts += more
    parts.append(_exact(segments, chosen[left[is_open]], locations_left[is_open], region, boundary, budget))
    pieces = joined(parts)
    order = np.argsort(pieces.source, kind="stable")  # pieces of one segment stand together in one part
    pieces = Pieces(pieces.source[order], pieces.ends[:, order], pieces.t[order], pieces.faces[order])
    return pieces, len(left), int(is_open.sum())


def _settle(
    segments: FloatArray, chosen: IntArray, locations: Int8Array, boundary: Outline | Mesh, budget: Budget
) -> tuple[list[Pieces], FlagArray]:
    """Return the pieces of those chosen segments that the kernel settles, and the state of each."""
    state = np.full(len(chosen), OPEN, np.uint8)
    kernel: Any = cut_on_mesh if isinstance(boundary, Mesh) else cut_on_outline
    parts, room = [], _LEAST_ROOM + len(chosen)
    done = np.array([0, 0, _LEAST_ROOM + _CONTACTS * min(GROUP, len(chosen))])
    while done[0] < len(chosen):
        reached, pieces = int(done[0]), room_for(room, segments.shape[2])
        with np.errstate(all="ignore"):  # uncompiled kernels: overflow is looked at by their filters
            kernel(segments, chosen, locations, boundary, budget.flag, pieces, state, done)
        budget.check()
        if done[0] == reached:
            room *= 2  # of rows, if not of contacts
        m = int(done[1])
        parts.append(Pieces(pieces.source[:m], pieces.ends[:, :m], pieces.t[:m], pieces.faces[:m]))
    return parts or [room_for(0, segments.shape[2])], state


def _exact(
    segments: FloatArray,
    chosen: IntArray,
    locations: Int8Array,
    region: Polygon | Polyhedron,
    boundary: Outline | Mesh,
    budget: Budget,
) -> Pieces:
    """Return the pieces of the chosen segments by exact arithmetic."""
    part = segments[chosen]
    offsets, elements, kinds = _contacts(part, boundary, budget)
    sources: list[int] = []
    pieces: list[Piece] = []
    for i, segment in enumerate(part):
        budget.check()
        mine = slice(offsets[i], offsets[i + 1])
        if (segment[0] == segment[1]).all():  # a point: its location says it all
            found = []
            if locations[i] >= 0:
                found = [Piece((0.0, 1.0), segment[0].tolist(), segment[1].tolist(), (-1, -1))]
        else:
            found = _pieces(segment, elements[mine], kinds[mine], int(locations[i]), region, boundary, budget)
        sources += [int(chosen[i])] * len(found)
        pieces += found
    ends = np.array([(piece.start, piece.end) for piece in pieces], np.float64).reshape(-1, 2, segments.shape[2]) + 0.0
    return Pieces(
        np.array(sources, np.int64),
        np.ascontiguousarray(ends.swapaxes(0, 1)),
        np.array([piece.t for piece in pieces], np.float64).reshape(-1, 2) + 0.0,
        np.array([piece.faces for piece in pieces], np.int64).reshape(-1, 2),
    )


def _contacts(segments: FloatArray, boundary: Outline | Mesh, budget: Budget) -> tuple[IntArray, IntArray, FlagArray]:
    """Return the offsets (n + 1,) of each segment's contacts, their elements, and their kinds."""
    kernel: Any = find_mesh_contacts if isinstance(boundary, Mesh) else find_contacts_2d
    ends, elements, kinds = [np.zeros(1, np.int64)], [np.zeros(0, np.int64)], [np.zeros(0, np.uint8)]
    for first in range(0, len(segments), GROUP):
        room, found = _LEAST_ROOM + 8 * min(GROUP, len(segments)), NO_ROOM
        while found == NO_ROOM:  # bound: room is doubled, and a segment meets an element once
            with np.errstate(all="ignore"):
                found, met, kind, offsets = kernel(segments[first : first + GROUP], boundary, budget.flag, room)
            budget.check()
            room *= 2
        ends.append(ends[-1][-1] + offsets[1:])
        elements.append(met[:found])
        kinds.append(kind[:found])
    return np.concatenate(ends), np.concatenate(elements), np.concatenate(kinds)


def _pieces(
    segment: FloatArray,
    elements: IntArray,
    kinds: FlagArray,
    location: int,
    region: Polygon | Polyhedron,
    boundary: Outline | Mesh,
    budget: Budget,
) -> list[Piece]:
    corners = boundary.elements[elements].tolist()

    def locate(point: list[Fraction]) -> int:
        near = _near_point(point, boundary, budget) if isinstance(boundary, Mesh) else None
        if near is None:
            return rational_location(point, region, None, budget.check)
        found = np.empty(1, np.int8)
        locator_of(region).fill(near[None], found, budget)
        return int(found[0])

    return pieces_of(
        segment[0].tolist(),
        segment[1].tolist(),
        list(zip(boundary.faces[elements].tolist(), corners)),
        bool((kinds == PROPER).all()),
        location,
        locate,
    )


def _near_point(point: list[Fraction], boundary: Mesh, budget: Budget) -> FloatArray | None:
    """Return a point of doubles that lies as `point` does, as nothing of the boundary is between them; else None."""
    try:
        middle = np.array([float(x) for x in point])
    except OverflowError:
        return None
    with np.errstate(over="ignore"):
        low, high = np.nextafter(middle, -np.inf), np.nextafter(middle, np.inf)
    is_known = np.array([x == y for x, y in zip(point, middle.tolist())])
    low[is_known], high[is_known] = middle[is_known], middle[is_known]
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        return None
    corners = np.array(np.meshgrid(*zip(low, high), indexing="ij")).reshape(3, 8).T.copy()
    with np.errstate(all="ignore"):
        if not is_known.all() and not is_clear(corners, boundary, budget.flag):
            return None
    return middle
