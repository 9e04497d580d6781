"""Pieces of segments in polygons and meshes, compiled.

If all contacts of a segment are proper crossings, each flips the location, so the location of the first end and the
order of the crossings decide. Parameters that are certainly rounded (crossing_values.py) and differ as doubles are in
their exact order.

A segment that touches corners and sides, ends on the boundary or runs along edges of the plane is cut like in
exact_pieces.py, if signs suffice: contacts are sorted by parameter; those that round alike must be one point, by their
codes (contacts.py), else the segment stays OPEN. From span to span the location flips once for each element that the
perturbed line crosses (simulation of simplicity).
"""

from __future__ import annotations

from collections import namedtuple
from enum import IntEnum
from typing import Any, Final

import numpy as np

from engine.compiling.jit import allocating, allocating_kernel, called, inline, kernel
from engine.segment_clipping.on_boundary.contacts import (
    CROSSED,
    GROUP,
    INSIDE_BEFORE,
    OUTSIDE_BEFORE,
    Bit,
    Contacts,
    Kind,
    Place,
    allocate_contacts,
    append_edges,
    are_same_point,
    axis_of,
    decode_place,
    edge_stack,
    gather_edges,
)
from engine.segment_clipping.on_boundary.crossing_values import (
    are_at_one_parameter,
    cross_exactly,
    cut_at,
    is_item_safe,
    parameter_exactly,
)
from engine.segment_clipping.on_boundary.mesh_contacts import append_contacts, gather_triangles, traversal_buffers
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, Outline
from engine.segment_clipping.on_boundary.triangle_contacts import corner
from engine.segment_clipping.pieces import Pieces, put_own_end
from engine.types import OPEN, FlagArray, FloatArray, Int8Array, IntArray

_WHOLE: Final = 2 * Place.START + 4 | Bit.ALONG | Bit.BEGINS
_WHOLE_TOO: Final = 2 * Place.END + 4 | Bit.ALONG | Bit.CEASES
"""Codes of the two contacts of an element along which a segment runs as a whole."""
SETTLED: Final = 0
"""State of a segment, besides OPEN."""
UNSURE: Final = -1
"""Returned instead of a number or row if something is undecided."""
Crossings = namedtuple("Crossings", "t points faces order codes met")
"""Crossings of one segment, by contact. t, points, faces: parameter, point, face; codes, met: kind of contact
(contacts.py) and element; order: the contacts sorted by t."""


@called
def cut_touching(segments: FloatArray, item: int, boundary: Any, contacts: Any, cuts: Crossings) -> int:
    """Compute the contacts of segment ``item`` into `cuts`, sorted along it; return their number, UNSURE if one is
    undecided. boundary: `Outline` or `Mesh`; contacts: filled by `gather_edges` or `gather_triangles`."""
    first, last, n = contacts.offsets[item], contacts.offsets[item + 1], 0
    if not is_item_safe(segments, item) or last - first > cuts.t.size:
        return UNSURE
    for i in range(first, last):
        element, kind = contacts.met[i], contacts.kinds[i]
        if kind == Kind.DEGENERATE or not (boundary.are_safe or is_item_safe(boundary.elements, element)):
            return UNSURE
        cuts.met[n], cuts.faces[n] = element, boundary.faces[element]
        n = _write_contact(segments, item, boundary.elements, CROSSED if kind == Kind.PROPER else kind, cuts, n)
        if n == UNSURE:
            return UNSURE
    sort_crossings(cuts, n)
    return n if _mark_points(segments, item, boundary.elements, cuts, n) else UNSURE


@inline
def _mark_points(segments: FloatArray, item: int, elements: FloatArray, cuts: Crossings, n: int) -> bool:
    """Mark those of n sorted contacts of segment ``item`` that are not in the point of the one before with `Bit.LATER`;
    return False if some that round alike may be different points."""
    begin = 0
    for place in range(1, n):
        i, first = cuts.order[place], cuts.order[begin]
        if cuts.t[i] != cuts.t[first]:
            begin = place
            cuts.codes[i] |= Bit.LATER
            continue
        met, code, other, its = cuts.met[first], cuts.codes[first], cuts.met[i], cuts.codes[i]
        if not are_same_point(elements, met, code, other, its) and not are_at_one_parameter(
            segments, item, elements, met, code, other, its
        ):
            return False
    return True


@called
def _write_contact(segments: FloatArray, item: int, elements: FloatArray, code: int, cuts: Crossings, n: int) -> int:
    """Write parameter and point of the contact of segment ``item`` with element ``cuts.met[n]`` as entry n of `cuts`;
    return n + 1, or UNSURE if they are not proven nearest doubles. code: of the contact (contacts.py)."""
    place, element, dimension = decode_place(code), cuts.met[n], segments.shape[2]
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
    cuts.t[n], sure = cut_at(segments, item, elements, element, code, cuts.points, n)
    if not sure:
        cuts.t[n], sure = cross_exactly(segments, item, elements, element, code, cuts.points[n])
    return n + 1 if sure else UNSURE


class Before(IntEnum):
    """Location of the perturbed line before the first contact of a segment."""

    OUTSIDE = 0
    INSIDE = 1
    ANYWHERE = -1
    """Not needed: no span is off the boundary."""
    UNKNOWN = -2
    """Undecided."""


@inline
def _location_before(cuts: Crossings, n: int, of_p: int, of_q: int) -> int:
    """Return the location (`Before`) of the perturbed line before the first of n sorted contacts of a segment. of_p,
    of_q: locations of its ends, of_q as `emit_touching` takes it."""
    turns = False
    for i in cuts.order[:n]:
        turns ^= (cuts.codes[i] & Bit.CROSSES != 0) & (decode_place(cuts.codes[i]) != Place.END)
    if of_p != 0:
        return int(of_p > 0)
    if n == 0 or decode_place(cuts.codes[cuts.order[0]]) != Place.START:
        return Before.UNKNOWN
    if abs(of_q) == INSIDE_BEFORE:
        return int(of_q > 0)
    return Before.ANYWHERE if of_q == 0 else int((of_q > 0) ^ turns)


@inline
def _write_end(
    out: Pieces, row: int, end: int, segments: FloatArray, item: int, cuts: Crossings, i: int, face: int
) -> None:
    """Write contact i of `cuts`, on face `face`, as end 0 or 1 of the piece in row `row`; a contact at that end of the
    segment becomes the segment's own end, face -1."""
    if decode_place(cuts.codes[i]) == Place.START + end:
        put_own_end(out, row, end, segments, item, segments.shape[2] == 2)
        return
    out.t[row, end], out.faces[row, end] = cuts.t[i], face
    for k in range(segments.shape[2]):
        out.ends[end, row, k] = cuts.points[i, k]


@called
def emit_touching(
    segments: FloatArray, item: int, source: int, of_points: int, ends: Int8Array, cuts: Crossings, n: int, out: Pieces,
    row: int,
) -> int:  # fmt: skip
    """Write the pieces between n contacts, marked with `Bit.LATER`, at most n + 1, to `out` from `row` on; return the
    next row, or UNSURE. source, of_points: what is written as source of pieces that are longer than a point, and of the
    others. ends: (2,) int8 locations of the segment's ends; the second counts only if the first is on the boundary, and
    may be INSIDE_BEFORE or OUTSIDE_BEFORE."""
    is_in, turned, n_along, is_open, place = _location_before(cuts, n, ends[0], ends[1]), 0, 0, ends[0] > 0, 0
    if is_in == Before.UNKNOWN:
        return UNSURE
    if is_open:
        out.source[row] = source
        put_own_end(out, row, 0, segments, item, segments.shape[2] == 2)
    while place < n:  # bound: each turn passes a contact
        first, best, face = cuts.order[place], 2 * Bit.ALONG, -1
        while place < n and (cuts.order[place] == first or cuts.codes[cuts.order[place]] & Bit.LATER == 0):
            i = cuts.order[place]
            code, place = cuts.codes[i], place + 1
            turned ^= code & Bit.CROSSES
            n_along += (1 if code & Bit.BEGINS else 0) - (1 if code & Bit.CEASES else 0)
            if code & Bit.ALONG < best or (code & Bit.ALONG == best and cuts.faces[i] < face):
                best, face = code & Bit.ALONG, cuts.faces[i]
        is_last = decode_place(cuts.codes[first]) == Place.END
        if is_in == Before.ANYWHERE and n_along == 0 and not is_last:
            return UNSURE
        was_open = is_open
        if not was_open:
            out.source[row] = source
            _write_end(out, row, 0, segments, item, cuts, first, face)
        is_open = not is_last and (n_along > 0 or (is_in ^ turned) == 1)
        if not is_open:
            out.source[row] = source if was_open else of_points
            _write_end(out, row, 1, segments, item, cuts, first, face)
            row += 1
    if is_open:
        put_own_end(out, row, 1, segments, item, segments.shape[2] == 2)
        row += 1
    return row


@inline
def _needs_location_before(contacts: Any, item: int, ends: Int8Array) -> bool:
    """Return whether segment ``item`` is a chord, both ends on the boundary (ends (2,) are 0), that does not run along
    one element as a whole."""
    is_chord = ends[0] == 0 and ends[1] == 0
    for i in range(contacts.offsets[item], contacts.offsets[item + 1] if is_chord else 0):
        is_chord &= contacts.kinds[i] != _WHOLE or contacts.kinds[i + 1] != _WHOLE_TOO
    return is_chord


@inline
def _location_before_ends(cuts: Crossings, n: int) -> int:
    """Return INSIDE_BEFORE or OUTSIDE_BEFORE for the n crossings of the perturbed line before a segment, the kinds of
    which are in cuts.codes; 0 if one is undecided or there is no room for them."""
    is_sure = n >= 0
    for i in range(n):
        is_sure &= cuts.codes[i] == Kind.PROPER
    return 0 if not is_sure else INSIDE_BEFORE if n & 1 == 1 else OUTSIDE_BEFORE


@allocating
def allocate_crossings(n: int, dimension: int) -> Crossings:
    """Allocate arrays for n contacts, uninitialised."""
    return Crossings(
        np.empty(n), np.empty((n, dimension)), np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64),
        np.empty(n, np.int64),
    )  # fmt: skip


@inline
def sort_crossings(cuts: Crossings, n: int) -> bool:
    """Sort the first n crossings by t into ``cuts.order``; return False if two of them have equal doubles t."""
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
    """Return the size of equal groups, of at most about `GROUP`, into which n segments are split."""
    n_groups = max(1, (n + GROUP - 1) // GROUP)
    return (n + n_groups - 1) // n_groups


@inline
def emit(
    segments: FloatArray, item: int, source: int, is_inside: bool, cuts: Crossings, n: int, out: Pieces, row: int
) -> int:
    """Write the pieces between n sorted proper crossings to `out` from `row` on; return the next row. source: number of
    the segment; is_inside: its first end is inside."""
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
    """Return whether contacts first .. last - 1 are all proper crossings, by their kinds (`Kind` or code)."""
    are_proper = True
    for i in range(first, last):
        are_proper &= kinds[i] == Kind.PROPER
    return are_proper


@inline
def cut_segment(segments: FloatArray, item: int, boundary: Any, contacts: Any, cuts: Crossings) -> bool:
    """Compute the crossings of segment ``item`` into `cuts`, sorted; return False if one is not proven, or two have
    equal doubles t. Caller guarantees that all its contacts are proper crossings."""
    first, last = contacts.offsets[item], contacts.offsets[item + 1]
    if first < last and not is_item_safe(segments, item):
        return False
    for i in range(first, last):
        element = contacts.met[i]
        if not (boundary.are_safe or is_item_safe(boundary.elements, element)):
            return False
        place = i - first
        cuts.faces[place] = boundary.faces[element]
        cuts.t[place], is_sure = cut_at(segments, item, boundary.elements, element, CROSSED, cuts.points, place)
        if not is_sure:
            return False
    return sort_crossings(cuts, last - first)


@called
def cut_group(
    segments: FloatArray, locations: Int8Array, first: int, boundary: Any, contacts: Any, cuts: Crossings,
    stop: FlagArray, out: Pieces, row: int, state: FlagArray,
) -> tuple[int, int]:  # fmt: skip
    """Cut the segments of a group at their contacts; return the next segment and the next row of `out`. first: number
    of the group's first segment; cuts: scratch; the others: see `cut_on_outline`. Stops early if `out` is full or
    `stop` is set."""
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
            reached = emit_touching(segments, item, place, place, locations[place], cuts, n, out, row)
        if reached != UNSURE:
            row, state[place] = reached, SETTLED
    return first + segments.shape[0], row


@kernel
def emit_contacts(
    segments: FloatArray, source: IntArray, contacts: Crossings, is_closed: bool, ends: Int8Array, out: Pieces,
    state: FlagArray,
) -> int:  # fmt: skip
    """Write the pieces of segments (m, 2, 3) on a mesh to `out`; return their number. source: of each contact, sorted,
    ordered and marked along each; ends (2,): scratch. state (m,): OPEN for those left out, else whether the perturbed
    line is inside before the first contact, which is not asked of what is not closed; out: 0, or OPEN. A piece of one
    point has the source -1 - item. Caller guarantees room for each contact and segment."""
    row, begin = 0, 0
    for item in range(segments.shape[0]):
        end = begin
        while end < source.size and source[end] == item:
            contacts.codes[end] &= -1 if is_closed else -1 - Bit.CROSSES
            end += 1
        n, some, is_in = end - begin, slice(begin, end), is_closed and state[item] != 0
        begin = end
        if state[item] == OPEN:
            continue
        cuts = Crossings(
            contacts.t[some], contacts.points[some], contacts.faces[some], contacts.order[:n], contacts.codes[some],
            contacts.met[some],
        )  # fmt: skip
        ends[0], ends[1] = (1 if is_in else -1), (INSIDE_BEFORE if is_in else OUTSIDE_BEFORE)
        if n > 0 and decode_place(cuts.codes[0]) == Place.START:
            ends[0] = 0
        reached = emit_touching(segments, item, item, -1 - item, ends, cuts, n, out, row)
        state[item] = OPEN if reached == UNSURE else SETTLED
        row = row if reached == UNSURE else reached
    return row


@allocating_kernel
def cut_on_outline(
    segments: FloatArray, locations: Int8Array, outline: Outline, stop: FlagArray, out: Pieces, state: FlagArray,
    n: IntArray,
) -> None:  # fmt: skip
    """Clip segments (m, 2, 2) float64 to a polygon as far as filters and double-doubles decide.

    | argument | content |
    |---|---|
    | locations (m, 2) int8 | of their ends, the second only if the first is on the boundary; overwritten if both are |
    | outline | see `Outline` |
    | stop (1,) uint8 | polled |
    | out | pieces; their source is the index of the segment |
    | state (m,) uint8 | out: SETTLED or OPEN |
    | n (3,) int64 | in and out: next segment (less than m if `out` is full), rows filled, capacity for contacts |
    """
    size = group_size(locations.shape[0] - n[0])
    contacts, cuts = allocate_contacts(size, n[2], edge_stack()), allocate_crossings(n[2], 2)
    last, n_ready, n[1] = n[0], 1, 0
    while n[0] == last < locations.shape[0] and n_ready > 0:  # bound: every turn takes a segment
        group = segments[last : last + size]
        n_ready = gather_edges(contacts, outline, group, group.shape[0], stop)
        for item in range(n_ready):
            if _needs_location_before(contacts, item, locations[last + item]):
                room = Contacts(cuts.met, cuts.codes, contacts.offsets, contacts.waiting)
                locations[last + item, 1] = _location_before_ends(
                    cuts, append_edges(room, outline, group[item], True, 0)
                )
        n[0], n[1] = cut_group(group[:n_ready], locations, last, outline, contacts, cuts, stop, out, n[1], state)
        last += n_ready
    n[2] *= 2 if n_ready == 0 else 1


@allocating_kernel
def cut_on_mesh(
    segments: FloatArray, locations: Int8Array, mesh: Mesh, stop: FlagArray, out: Pieces, state: FlagArray,
    n: IntArray,
) -> None:  # fmt: skip
    """Clip segments (m, 2, 3) float64 to a polyhedron; arguments and results as in `cut_on_outline`, its table."""
    size = group_size(locations.shape[0] - n[0])
    contacts, cuts = allocate_contacts(size, n[2], traversal_buffers()), allocate_crossings(n[2], 3)
    last, n_ready, n[1] = n[0], 1, 0
    while n[0] == last < locations.shape[0] and n_ready > 0:
        group = segments[last : last + size]
        n_ready = gather_triangles(contacts, mesh, group, group.shape[0], 0.0, stop)
        for item in range(n_ready):
            if _needs_location_before(contacts, item, locations[last + item]):
                p, q, waiting = corner(group, item, 0), corner(group, item, 1), contacts.waiting
                n_before = append_contacts(mesh, p, q, 0.0, False, True, waiting, cuts.met, cuts.codes, 0)
                locations[last + item, 1] = _location_before_ends(cuts, n_before)
        n[0], n[1] = cut_group(group[:n_ready], locations, last, mesh, contacts, cuts, stop, out, n[1], state)
        last += n_ready
    n[2] *= 2 if n_ready == 0 else 1
