"""The pieces of segments on polygons and meshes, compiled.

Where all contacts are proper crossings every one turns the location over, so only the first end's location and the
order of the crossings along the segment matter. Parameters that are surely rounded (crossing_values.py) and differ as
doubles are in their exact order.

A segment that touches in corners and sides, ends on the boundary or runs along edges of the plane is cut as
exact_pieces.py cuts with integers, where signs tell all: contacts are put in order by their parameters; those that
round alike are one point, by their codes (contacts.py), or the segment is left open. From span to span the location
turns over as often as the line beside the segment crosses what it meets.
"""

from __future__ import annotations

from collections import namedtuple
from enum import IntEnum
from typing import Any, Final

import numpy as np

from engine.compiling.jit import allocating, allocating_kernel, called, inline
from engine.segment_clipping.on_boundary.contacts import (
    CROSSED,
    GROUP,
    INSIDE_BEFORE,
    Bit,
    Kind,
    Place,
    are_one,
    axis_of,
    code_of,
    contacts_for,
    edges_waiting,
    gather_edges,
    place_of,
)
from engine.segment_clipping.on_boundary.crossing_values import cross_exactly, cut_at, is_item_safe, parameter_exactly
from engine.segment_clipping.on_boundary.mesh_contacts import blocks_waiting, gather_triangles
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, Outline
from engine.segment_clipping.pieces import Pieces, put_own_end
from engine.types import OPEN, FlagArray, FloatArray, Int8Array, IntArray

SETTLED: Final = 0
"""State of a segment, beside OPEN."""
UNSURE: Final = -1
Crossings = namedtuple("Crossings", "t points faces order codes met")
"""Crossings of one segment, as many as there is room for: t, points and faces of each; codes, met: how it meets which
element, see contacts.py; order: of t."""


@called
def cut_touching(segments: FloatArray, item: int, boundary: Any, contacts: Any, cuts: Crossings) -> int:
    """Make the crossings and touches of a segment, in order along it; return how many, UNSURE where not all is."""
    first, last, n = contacts.offsets[item], contacts.offsets[item + 1], 0
    if not is_item_safe(segments, item) or 2 * (last - first) > cuts.t.size:
        return UNSURE
    for i in range(first, last):
        element, kind = contacts.met[i], contacts.kinds[i]
        if kind == Kind.DEGENERATE or not (boundary.are_safe or is_item_safe(boundary.elements, element)):
            return UNSURE
        cuts.met[n], cuts.faces[n] = element, boundary.faces[element]
        if kind == Kind.ALONG:
            n = _put_stretch(segments, item, boundary.elements, cuts, n)
        else:
            n = _put_place(segments, item, boundary.elements, CROSSED if kind == Kind.PROPER else kind, cuts, n)
        if n == UNSURE:
            return UNSURE
    sort_crossings(cuts, n)
    return n


@called
def _put_place(segments: FloatArray, item: int, elements: FloatArray, code: int, cuts: Crossings, n: int) -> int:
    """Write parameter and point of a crossing or touch of ``cuts.met[n]``; return n + 1, UNSURE where not all is."""
    place, element, dimension = place_of(code), cuts.met[n], segments.shape[2]
    cuts.codes[n] = code
    if Place.START <= place <= Place.END:
        cuts.t[n] = place - Place.START
        for k in range(dimension):
            cuts.points[n, k] = segments[item, place - Place.START, k] + 0.0
        return n + 1
    if place < 3:
        k = axis_of(segments, item)
        cuts.t[n], sure = parameter_exactly(segments[item, 0, k], segments[item, 1, k], elements[element, place, k])
        for k in range(dimension):
            cuts.points[n, k] = elements[element, place, k] + 0.0
        return n + 1 if sure else UNSURE
    cuts.t[n], sure = cut_at(segments, item, elements, element, cuts.points, n)
    if not sure:
        cuts.t[n], sure = cross_exactly(segments, item, elements, element, cuts.points[n])
    return n + 1 if sure else UNSURE


@inline
def _put_stretch(segments: FloatArray, item: int, elements: FloatArray, cuts: Crossings, n: int) -> int:
    """Write where a segment begins to run along an edge of its line, and where it ends to; as `_put_place` does."""
    k, element, face = axis_of(segments, item), cuts.met[n], cuts.faces[n]
    p, q = segments[item, 0, k], segments[item, 1, k]
    rises = q > p
    near = 0 if (elements[element, 1, k] > elements[element, 0, k]) == rises else 1
    a, b = elements[element, near, k], elements[element, 1 - near, k]
    begin = Place.START if (a <= p if rises else a >= p) else near
    end = Place.END if (b >= q if rises else b <= q) else 1 - near
    if b == p or a == q:  # case: one point
        return _put_place(
            segments, item, elements, code_of(Place.START if b == p else Place.END, False) | Bit.ALONG, cuts, n
        )
    n = _put_place(segments, item, elements, code_of(begin, False) | Bit.ALONG | Bit.BEGINS, cuts, n)
    if n == UNSURE:
        return UNSURE
    cuts.met[n], cuts.faces[n] = element, face
    return _put_place(segments, item, elements, code_of(end, False) | Bit.ALONG | Bit.CEASES, cuts, n)


class Before(IntEnum):
    """Where the line beside a segment is before its first contact."""

    OUTSIDE = 0
    INSIDE = 1
    ANYWHERE = -1
    """It does not matter, unless there is a span off the boundary."""
    UNKNOWN = -2
    """Contacts round alike that are not one."""


@inline
def _is_in_before(elements: FloatArray, cuts: Crossings, n: int, of_p: int, of_q: int) -> int:
    """Return where the line beside the segment is before the first of n contacts, see `Before`."""
    begin, turns = 0, False
    for place in range(n):
        i, first = cuts.order[place], cuts.order[begin]
        if cuts.t[i] != cuts.t[first]:
            begin = place
        elif i != first and not are_one(elements, cuts.met[first], cuts.codes[first], cuts.met[i], cuts.codes[i]):
            return Before.UNKNOWN
        turns ^= (cuts.codes[i] & Bit.CROSSES != 0) & (place_of(cuts.codes[i]) != Place.END)
    if of_p != 0:
        return int(of_p > 0)
    if n == 0 or place_of(cuts.codes[cuts.order[0]]) != Place.START:
        return Before.UNKNOWN
    if abs(of_q) == INSIDE_BEFORE:
        return int(of_q > 0)
    return Before.ANYWHERE if of_q == 0 else int((of_q > 0) ^ turns)


@inline
def _put_node(
    out: Pieces, row: int, end: int, segments: FloatArray, item: int, cuts: Crossings, i: int, face: int
) -> None:
    """Write an end of a piece at a contact; where the segment itself begins or ends there, as its own end."""
    if place_of(cuts.codes[i]) == Place.START + end:
        put_own_end(out, row, end, segments, item, segments.shape[2] == 2)
        return
    out.t[row, end], out.faces[row, end] = cuts.t[i], face
    for k in range(segments.shape[2]):
        out.ends[end, row, k] = cuts.points[i, k]


@called
def emit_touching(
    segments: FloatArray, item: int, source: int, ends: Int8Array, elements: FloatArray, cuts: Crossings, n: int,
    out: Pieces, row: int,
) -> int:  # fmt: skip
    """Write the pieces between n contacts to the rows of `out` from `row` on, n + 1 at most; return the row after them,
    or UNSURE. ends: (2,) int8 locations of the segment's ends, the second where the first is 0 at least, or what
    `look_before` sets."""
    is_in, turned, n_along, is_open, place = _is_in_before(elements, cuts, n, ends[0], ends[1]), 0, 0, ends[0] > 0, 0
    if is_in == Before.UNKNOWN:
        return UNSURE
    if is_open:
        out.source[row] = source
        put_own_end(out, row, 0, segments, item, segments.shape[2] == 2)
    while place < n:  # bound: each turn passes a contact
        first, best, face = cuts.order[place], 2 * Bit.ALONG, -1
        while place < n and cuts.t[cuts.order[place]] == cuts.t[first]:
            i = cuts.order[place]
            code, place = cuts.codes[i], place + 1
            turned ^= code & Bit.CROSSES
            n_along += (1 if code & Bit.BEGINS else 0) - (1 if code & Bit.CEASES else 0)
            if code & Bit.ALONG < best or (code & Bit.ALONG == best and cuts.faces[i] < face):
                best, face = code & Bit.ALONG, cuts.faces[i]
        is_last = place_of(cuts.codes[first]) == Place.END
        if is_in == Before.ANYWHERE and n_along == 0 and not is_last:
            return UNSURE
        if not is_open:
            out.source[row] = source
            _put_node(out, row, 0, segments, item, cuts, first, face)
        is_open = not is_last and (n_along > 0 or (is_in ^ turned) == 1)
        if not is_open:
            _put_node(out, row, 1, segments, item, cuts, first, face)
            row += 1
    if is_open:
        put_own_end(out, row, 1, segments, item, segments.shape[2] == 2)
        row += 1
    return row


@allocating
def crossings_for(n: int, dimension: int) -> Crossings:
    """Return room for n contacts."""
    return Crossings(
        np.empty(n), np.empty((n, dimension)), np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64),
        np.empty(n, np.int64),
    )  # fmt: skip


@inline
def sort_crossings(cuts: Crossings, n: int) -> bool:
    """Set the order of the first n crossings by t; False where two are equal."""
    t, order = cuts.t, cuts.order
    for i in range(n):
        order[i] = i
    gap = n // 2
    while gap > 0:  # bound: gap is halved; Shell's sort, n^1.5 steps
        for i in range(gap, n):
            moved, j = order[i], i
            while j >= gap and t[order[j - gap]] > t[moved]:
                order[j] = order[j - gap]
                j -= gap
            order[j] = moved
        gap //= 2
    differ = True
    for i in range(1, n):
        differ &= t[order[i - 1]] != t[order[i]]
    return differ


@inline
def group_size(n: int) -> int:
    """Return the size of the groups, all about as large, that n segments are cut in."""
    n_groups = max(1, (n + GROUP - 1) // GROUP)
    return (n + n_groups - 1) // n_groups


@inline
def emit(
    segments: FloatArray, item: int, source: int, is_inside: bool, cuts: Crossings, n: int, out: Pieces, row: int
) -> int:
    """Write the pieces between n crossings to the rows of `out` from `row` on; return the row after them."""
    is_flat, end = segments.shape[2] == 2, 1 if is_inside else 0
    if is_inside:
        out.source[row] = source
        put_own_end(out, row, 0, segments, item, is_flat)
    for place in range(n):
        i = cuts.order[place]
        out.source[row], out.t[row, end], out.faces[row, end] = source, cuts.t[i], cuts.faces[i]
        for k in range(segments.shape[2]):
            out.ends[end, row, k] = cuts.points[i, k]
        row, end = row + end, 1 - end
    if end == 1:
        put_own_end(out, row, 1, segments, item, is_flat)
        row += 1
    return row


@inline
def all_proper(kinds: FlagArray, first: int, last: int) -> bool:
    """Tell whether some contacts are proper crossings."""
    are_proper = True
    for i in range(first, last):
        are_proper &= kinds[i] == Kind.PROPER
    return are_proper


@inline
def cut_segment(segments: FloatArray, item: int, boundary: Any, contacts: Any, cuts: Crossings) -> bool:
    """Make the crossings of a segment, in order along it; False where not all is surely rounded, or two are one."""
    first, last = contacts.offsets[item], contacts.offsets[item + 1]
    if first < last and not is_item_safe(segments, item):
        return False
    for i in range(first, last):
        element = contacts.met[i]
        if not (boundary.are_safe or is_item_safe(boundary.elements, element)):
            return False
        place = i - first
        cuts.faces[place] = boundary.faces[element]
        cuts.t[place], is_sure = cut_at(segments, item, boundary.elements, element, cuts.points, place)
        if not is_sure:
            return False
    return sort_crossings(cuts, last - first)


@called
def cut_group(
    segments: FloatArray, locations: Int8Array, first: int, boundary: Any, contacts: Any, cuts: Crossings,
    stop: FlagArray, out: Pieces, row: int, state: FlagArray,
) -> tuple[int, int]:  # fmt: skip
    """Cut the segments of a group, those from `first` on, at their contacts; return the place reached, and the row.

    Stops short where there is no room in `out`, or `stop` is set. See `cut_on_outline`.
    """
    for item in range(segments.shape[0]):
        begin, end, place = contacts.offsets[item], contacts.offsets[item + 1], first + item
        state[place] = OPEN
        if stop[0] or row + (end - begin) // 2 + 1 > out.source.size:
            return place, row
        is_plain = all_proper(contacts.kinds, begin, end) and (end == begin or locations[place, 0] != 0)
        if is_plain and cut_segment(segments, item, boundary, contacts, cuts):
            row = emit(segments, item, place, locations[place, 0] >= 0, cuts, end - begin, out, row)
            state[place] = SETTLED
            continue
        n = cut_touching(segments, item, boundary, contacts, cuts)
        if n >= 0 and row + n + 1 > out.source.size:
            return place, row
        reached = UNSURE
        if n >= 0:
            reached = emit_touching(segments, item, place, locations[place], boundary.elements, cuts, n, out, row)
        if reached != UNSURE:
            row, state[place] = reached, SETTLED
    return first + segments.shape[0], row


@allocating_kernel
def cut_on_outline(
    segments: FloatArray, locations: Int8Array, outline: Outline, stop: FlagArray, out: Pieces, state: FlagArray,
    n: IntArray,
) -> None:  # fmt: skip
    """Cut segments (m, 2, 2) float64 on a polygon, as far as double-doubles and filters go.

    locations: (m, 2) int8 of their ends, the second where the first is 0 at least. outline: see `Outline`. stop: one
    uint8, polled. out: their source is their place. state: (m,) uint8, SETTLED or OPEN. n: the place to begin with,
    afterwards where to go on, short of the end where there is no room; how many rows are filled; and for how many
    contacts of a group there is to be room.
    """
    size = group_size(locations.shape[0] - n[0])
    contacts, cuts, last = contacts_for(size, n[2], edges_waiting()), crossings_for(2 * n[2], 2), n[0]
    n[1], found = 0, 0
    while n[0] == last < locations.shape[0] and found >= 0:  # bound: every turn takes a group
        last = min(n[0] + size, locations.shape[0])
        group = segments[n[0] : last]
        found = gather_edges(contacts, outline, group, group.shape[0], stop)
        if found >= 0:
            n[0], n[1] = cut_group(group, locations, n[0], outline, contacts, cuts, stop, out, n[1], state)
    n[2] *= 2 if found < 0 else 1


@allocating_kernel
def cut_on_mesh(
    segments: FloatArray, locations: Int8Array, mesh: Mesh, stop: FlagArray, out: Pieces, state: FlagArray, n: IntArray
) -> None:
    """Cut segments (m, 2, 3) float64 on a polyhedron, `Mesh`: see `cut_on_outline`."""
    size = group_size(locations.shape[0] - n[0])
    contacts, cuts, last = contacts_for(size, n[2], blocks_waiting()), crossings_for(2 * n[2], 3), n[0]
    n[1], found = 0, 0
    while n[0] == last < locations.shape[0] and found >= 0:
        last = min(n[0] + size, locations.shape[0])
        group = segments[n[0] : last]
        found = gather_triangles(contacts, mesh, group, group.shape[0], stop)
        if found >= 0:
            n[0], n[1] = cut_group(group, locations, n[0], mesh, contacts, cuts, stop, out, n[1], state)
    n[2] *= 2 if found < 0 else 1
