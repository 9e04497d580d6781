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
from engine.segment_clipping.boundary_cut import OPEN, SETTLED, UNLOCATED, Rows, cut_on_mesh, cut_on_outline
from engine.segment_clipping.contacts import GROUP, PROPER, find_contacts_2d
from engine.segment_clipping.decide_then_cut import PieceRows
from engine.segment_clipping.exact_pieces import pieces_of
from engine.segment_clipping.exact_segments import Piece
from engine.segment_clipping.mesh_contacts import is_clear
from engine.segment_clipping.mesh_streams import find_mesh_contacts
from engine.segment_clipping.prepared_boundary import Mesh, Outline, boundary_of
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.types import UNDECIDED

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
) -> PieceRows:
    """Return the pieces of ``segments[first:last]``, (n, 2, dim) float64, in order of source and t."""
    boundary = boundary_of(region)
    chosen = np.arange(first, last)
    locations = np.full(len(chosen), UNDECIDED, np.int8)
    if locator is not None and len(chosen):
        locator.fill(segments[first:last, 0].copy(), locations, budget)
    parts, state = _settle(segments, chosen, locations, boundary, budget)
    left = np.flatnonzero(state != SETTLED)
    if not len(left):
        return _joined(parts, 0, 0)
    locator_of(region).fill(segments[chosen[left], 0], locations_left := np.empty(len(left), np.int8), budget)
    unlocated = state[left] == UNLOCATED
    again = chosen[left[unlocated]]
    more, state_again = _settle(segments, again, locations_left[unlocated], boundary, budget)
    is_open = ~unlocated
    is_open[unlocated] = state_again != SETTLED
    parts += more
    parts.append(_exact(segments, chosen[left[is_open]], locations_left[is_open], region, boundary, budget))
    return _joined(parts, len(left), int(is_open.sum()))


def _joined(parts: list[Rows], n_beyond: int, n_rational: int) -> PieceRows:
    """Return the rows of some parts by source; pieces of one segment stand together in one part."""
    if len(parts) == 1:
        return PieceRows(*parts[0], n_beyond, n_rational)
    rows = Rows(*(np.concatenate(arrays) for arrays in zip(*parts)))
    if (rows.source[1:] < rows.source[:-1]).any():
        order = np.argsort(rows.source, kind="stable")
        rows = Rows(*(array[order] for array in rows))
    return PieceRows(*rows, n_beyond, n_rational)


def _settle(
    segments: FloatArray, chosen: IntArray, locations: Int8Array, boundary: Outline | Mesh, budget: Budget
) -> tuple[list[Rows], FlagArray]:
    """Return the pieces of those chosen segments that the kernel settles, and the state of each."""
    state = np.full(len(chosen), OPEN, np.uint8)
    kernel: Any = cut_on_mesh if isinstance(boundary, Mesh) else cut_on_outline
    parts, room = [], _LEAST_ROOM + len(chosen)
    done = np.array([0, 0, _LEAST_ROOM + _CONTACTS * min(GROUP, len(chosen))])
    while done[0] < len(chosen):
        reached, rows = int(done[0]), _rows(room, segments.shape[2])
        with np.errstate(all="ignore"):  # uncompiled kernels: overflow is looked at by their filters
            kernel(segments, chosen, locations, boundary, budget.flag, rows, state, done)
        budget.check()
        if done[0] == reached:
            room *= 2  # of rows, if not of contacts
        parts.append(Rows(*(array[: done[1]] for array in rows)))
    return parts or [_rows(0, segments.shape[2])], state


def _rows(n: int, dimension: int) -> Rows:
    """Return room for n pieces."""
    ends = np.empty((2, n, dimension))
    return Rows(np.empty(n, np.int64), ends[0], ends[1], np.empty((n, 2)), np.empty((n, 2), np.int64))


def _exact(
    segments: FloatArray,
    chosen: IntArray,
    locations: Int8Array,
    region: Polygon | Polyhedron,
    boundary: Outline | Mesh,
    budget: Budget,
) -> Rows:
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
    dimension = segments.shape[2]
    return Rows(
        np.array(sources, np.int64),
        _points(pieces, 1, dimension),
        _points(pieces, 2, dimension),
        _points(pieces, 0, 2),
        np.array([piece.faces for piece in pieces], np.int64).reshape(-1, 2),
    )


def _points(pieces: list[Piece], field: int, width: int) -> FloatArray:
    return np.array([piece[field] for piece in pieces], np.float64).reshape(-1, width) + 0.0


def _contacts(segments: FloatArray, boundary: Outline | Mesh, budget: Budget) -> tuple[IntArray, IntArray, FlagArray]:
    """Return the offsets (n + 1,) of each segment's contacts, their elements, and their kinds."""
    kernel: Any = find_mesh_contacts if isinstance(boundary, Mesh) else find_contacts_2d
    last = len(segments)
    room, done = max(_LEAST_ROOM, 8 * last), 0
    ends, elements, kinds = [np.zeros(1, np.int64)], [np.zeros(0, np.int64)], [np.zeros(0, np.uint8)]
    while done < last:
        met, kind, offsets = np.empty(room, np.int64), np.empty(room, np.uint8), np.empty(last - done + 1, np.int64)
        with np.errstate(all="ignore"):
            reached = kernel(segments, done, last, boundary, budget.flag, met, kind, offsets)
        budget.check()
        if reached == done:
            room *= 2
            continue
        found = int(offsets[reached - done])
        ends.append(ends[-1][-1] + offsets[1 : reached - done + 1])
        elements.append(met[:found])
        kinds.append(kind[:found])
        done = reached
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
