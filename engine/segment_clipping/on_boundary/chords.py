"""Segments with both ends on the boundary: the location just before the second end, which says where the rest is.

The line from a point m beside the segment, at a known location, to the second end q is another segment of the same
boundary: from span to span its location turns over where it crosses elements, so it is known up to q. Near q only
elements that hold q are met. Where p and m, the first end and that point, are strictly on one side of the line or plane
of each, none lies between the two directions from q: both segments are at one location there.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrays import BoolArray, FlagArray, FloatArray, Int8Array, IntArray
from engine.compiling.direct import entry_of
from engine.compiling.jit import kernel
from engine.containment.locators import Locator
from engine.predicates.orientation import orient2d, orient3d
from engine.predicates.vectors import as_point2
from engine.running.budget import Budget
from engine.segment_clipping.on_boundary.contacts import NO_ROOM, Bit, Kind, Place, find_contacts_2d
from engine.segment_clipping.on_boundary.mesh_contacts import find_contacts_3d
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, Outline
from engine.segment_clipping.on_boundary.triangle_contact import corner, triangle_at

INSIDE_BEFORE: Final = 2
OUTSIDE_BEFORE: Final = -2
"""Location of the second end that says where the line beside the segment is before its first contact."""
_AT_END: Final = 2 * Place.END + 5
"""The code of what is crossed there; one less, of what is not."""
_AT_ONCE: Final = 64
"""Chords whose contacts are held together."""
_PLACES: Final = (0.5, 0.3125, 0.8125)
"""Where along a segment a point beside it is tried; the next where one is on the boundary, or elements part it."""


def look_before(
    segments: FloatArray, locations: Int8Array, boundary: Outline | Mesh, locator: Locator, budget: Budget
) -> None:
    """Set the second of locations (n, 2) where both are 0 and it can be told, see `INSIDE_BEFORE`."""
    if not boundary.are_safe:  # signs of the line beside the segment are exact only then
        return
    chords = np.flatnonzero((locations == 0).all(axis=1))
    for begin in range(0, len(chords), _AT_ONCE):
        some = chords[begin : begin + _AT_ONCE]
        locations[some, 1] = _before(segments[some], boundary, locator, budget)


def _before(segments: FloatArray, boundary: Outline | Mesh, locator: Locator, budget: Budget) -> Int8Array:
    """Return what `look_before` sets for chords (n, 2, dim), 0 where it cannot be told."""
    found = np.zeros(len(segments), np.int8)
    is_odd, is_left, met, owners = _turns(segments, boundary, budget)
    for place in _PLACES:
        if not is_left.any():
            break
        inner = segments.copy()
        inner[:, 0] = (1.0 - place) * segments[:, 0] + place * segments[:, 1]
        locator.fill(inner[:, 0].copy(), of_inner := np.empty(len(segments), np.int8), budget)
        turns_odd, is_told, _, _ = _turns(inner, boundary, budget)
        entry_of(leave_parted)(boundary.elements, met, owners, segments, inner, is_told)
        is_told &= is_left & (of_inner != 0)
        is_in = (of_inner > 0) ^ turns_odd ^ is_odd
        found[is_told] = np.where(is_in, INSIDE_BEFORE, OUTSIDE_BEFORE)[is_told]
        is_left &= ~is_told
    return found


def _turns(
    segments: FloatArray, boundary: Outline | Mesh, budget: Budget
) -> tuple[BoolArray, BoolArray, IntArray, IntArray]:
    """Return of each segment whether the location turns over an odd number of times before its end, and whether that is
    sure and no edge runs there; then the elements that hold its end, and whose they are."""
    met, kinds, offsets = contacts_with(segments, boundary, budget)
    owners = np.repeat(np.arange(len(segments)), np.diff(offsets))
    holds_end = kinds | Bit.CROSSES == _AT_END
    turning = owners[(kinds & Bit.CROSSES != 0) & ~holds_end]
    is_sure = np.ones(len(segments), np.bool_)
    is_sure[owners[kinds == Kind.DEGENERATE]] = False
    along = np.flatnonzero(kinds == Kind.ALONG)
    edges, ends = boundary.elements[met[along]], segments[owners[along], 1]
    reaches = ((edges.min(axis=1) <= ends) & (ends <= edges.max(axis=1))).all(axis=1)
    is_sure[owners[along[reaches]]] = False
    is_odd = np.bincount(turning, minlength=len(segments)) & 1 == 1
    return is_odd, is_sure, met[holds_end], owners[holds_end]


@kernel
def leave_parted(
    elements: FloatArray, met: IntArray, owners: IntArray, segments: FloatArray, inner: FloatArray, is_told: BoolArray
) -> None:
    """Set is_told (n,) False where an element met does not have the first ends of a segment and of the one beside it
    strictly on one side."""
    for place in range(met.size):
        element, item = met[place], owners[place]
        if elements.shape[1] == 2:
            a, b = as_point2(elements[element], 0), as_point2(elements[element], 1)
            side = orient2d(a, b, as_point2(segments[item], 0))
            other = orient2d(a, b, as_point2(inner[item], 0))
        else:
            c, d, e = triangle_at(elements, element)
            side, other = orient3d(c, d, e, corner(segments, item, 0)), orient3d(c, d, e, corner(inner, item, 0))
        if side != other or abs(side) != 1:
            is_told[item] = False


_LEAST_ROOM: Final = 1 << 8
"""Contacts looked for at once, beside a few for each segment; doubled where there are more."""
_EACH: Final = 8


def contacts_with(
    segments: FloatArray, boundary: Outline | Mesh, budget: Budget
) -> tuple[IntArray, FlagArray, IntArray]:
    """Return the elements that segments (n, 2, dim) may meet, GROUP at most, and how; offsets (n + 1,) of each."""
    kernel: Any = find_contacts_3d if isinstance(boundary, Mesh) else find_contacts_2d
    room, found = _LEAST_ROOM + _EACH * len(segments), NO_ROOM
    met, kinds, offsets = np.zeros(0, np.int64), np.zeros(0, np.uint8), np.zeros(0, np.int64)
    while found == NO_ROOM:  # bound: room is doubled, and a segment meets an element once
        found, met, kinds, offsets = entry_of(kernel)(segments, boundary, budget.flag, room)
        budget.check()
        room *= 2
    return met[:found], kinds[:found], offsets[: len(segments) + 1]
