"""The pieces of a segment that touches a boundary in corners and sides, ends on it, or runs along edges of the plane.

What exact_pieces.py does with integers, where signs tell all: contacts are put in order by their parameters, which are
surely rounded; those that round alike are one point, by their codes (contacts.py), or the segment is left open. From
span to span the location turns over as often as the line beside the segment crosses what it meets.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray, Int8Array
from engine.compiling.jit import allocating, called, inline
from engine.segment_clipping.on_boundary.chords import INSIDE_BEFORE
from engine.segment_clipping.on_boundary.contacts import CROSSED, Bit, Kind, Place, are_one, axis_of, code_of, place_of
from engine.segment_clipping.on_boundary.crossing_values import cross_exactly, cut_at, is_item_safe, parameter_exactly
from engine.segment_clipping.pieces import Pieces, put_own_end

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


@inline
def _is_in_before(elements: FloatArray, cuts: Crossings, n: int, of_p: int, of_q: int) -> int:
    """Return whether the line beside the segment is inside before the first of n contacts, -1 where that does not
    matter unless there is a span off the boundary; -2 where contacts round alike that are not one."""
    begin, turns = 0, False
    for place in range(n):
        i, first = cuts.order[place], cuts.order[begin]
        if cuts.t[i] != cuts.t[first]:
            begin = place
        elif i != first and not are_one(elements, cuts.met[first], cuts.codes[first], cuts.met[i], cuts.codes[i]):
            return -2
        turns ^= (cuts.codes[i] & Bit.CROSSES != 0) & (place_of(cuts.codes[i]) != Place.END)
    if of_p != 0:
        return int(of_p > 0)
    if n == 0 or place_of(cuts.codes[cuts.order[0]]) != Place.START:
        return -2
    if abs(of_q) == INSIDE_BEFORE:
        return int(of_q > 0)
    return -1 if of_q == 0 else int((of_q > 0) ^ turns)


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
    if is_in == -2:
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
        if is_in < 0 and n_along == 0 and not is_last:
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
