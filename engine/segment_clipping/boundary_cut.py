"""The pieces of segments whose contacts are all proper crossings, compiled: the common case on meshes and polygons.

Every crossing turns the location over, so only the first end's location and the order of the crossings along the
segment matter. Parameters that are surely rounded (crossing_values.py) and differ as doubles are in their exact order.
A segment with two crossings that round alike, or a coordinate that may round either way, is left open for
exact_pieces.py. The location of an end that is not known is the parity of its crossings on the way to the nearest side
of the boundary's box: the same kind of segment.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.jit import bare, inline, kernel
from engine.segment_clipping.contacts import GROUP, PROPER, edge_contacts_for, gather_edges
from engine.segment_clipping.crossing_values import cut_at, is_item_safe, line_values, plane_values
from engine.segment_clipping.mesh_streams import gather_contacts, streams_for
from engine.segment_clipping.pieces import Pieces, put_own_end
from engine.types import OPEN, UNDECIDED

SETTLED: Final = 0
NEEDS_LOCATION: Final = 1
"""States of a segment, beside OPEN: the location of the first end must be told."""


class Crossings(NamedTuple):
    """The crossings of a group of segments, those of each in a row; as many of each array as there is room for."""

    t: Any
    points: Any
    faces: Any
    order: Any


class Group(NamedTuple):
    """Segments that are cut together, and what is known of their first ends."""

    segments: Any
    """(m, 2, dim)"""
    locations: Any
    """(m,) of first ends, UNDECIDED where they are not known yet."""
    turns: Any
    """(m,) where those follow from parity: twice how often the location turns over on the way out, and 1 more where
    that begins at the last end; else -1."""
    ways: Any
    """(n, 2, dim) ways from an end out of the boundary's box."""
    askers: Any
    """(n, 2) for each way the place of its segment in the group, and at which end it begins."""


@inline
def group_size(n: int) -> int:
    """Return the size of the groups, all about as large, that n segments are cut in."""
    n_groups = max(1, (n + GROUP - 1) // GROUP)
    return (n + n_groups - 1) // n_groups


@inline
def group_for(size: int, dimension: int) -> Group:
    """Return room for a group of so many segments."""
    shape = (size, 2, dimension)
    return Group(
        np.empty(shape),
        np.empty(size, np.int8),
        np.empty(size, np.int64),
        np.empty(shape),
        np.empty((size, 2), np.int64),
    )


@inline
def crossings_for(n: int, dimension: int) -> Crossings:
    """Return room for n contacts."""
    return Crossings(np.empty(n), np.empty((n, dimension)), np.empty(n, np.int64), np.empty(n, np.int64))


@inline
def sort_crossings(cuts: Crossings, first: int, n: int) -> bool:
    """Set the order of n crossings from `first` on by t; False where two are equal."""
    t, order = cuts.t, cuts.order
    for i in range(first, first + n):
        order[i] = i
    gap = n // 2
    while gap > 0:  # bound: gap is halved; Shell's sort, n^1.5 steps
        for i in range(first + gap, first + n):
            moved, j = order[i], i
            while j >= first + gap and t[order[j - gap]] > t[moved]:
                order[j] = order[j - gap]
                j -= gap
            order[j] = moved
        gap //= 2
    differ = True
    for i in range(first + 1, first + n):
        differ &= t[order[i - 1]] != t[order[i]]
    return differ


@inline
def emit(
    segments: Any, item: int, source: int, is_inside: bool, cuts: Crossings, first: int, n: int, out: Pieces, row: int
) -> int:
    """Write the pieces between n crossings to the rows of `out` from `row` on; return the row after them."""
    is_flat, end = segments.shape[2] == 2, 1 if is_inside else 0
    if is_inside:
        out.source[row] = source
        put_own_end(out, row, 0, segments, item, is_flat)
    for place in range(first, first + n):
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
def all_proper(kinds: Any, first: int, last: int) -> bool:
    """Tell whether some contacts are proper crossings."""
    are_proper = True
    for i in range(first, last):
        are_proper &= kinds[i] == PROPER
    return are_proper


@inline
def way_out(segment: Any, beyond: Any, way: Any) -> int:
    """Set `way` (2, dim) to the shortest way, along an axis, from an end of a segment to a side of the boundary's box.

    Returns the end (0 or 1); -1 and -2 where the end 0 or 1 lies outside: its location is known; -3 where no way has a
    length that a double holds.
    """
    shortest, nearest, axis, target = np.inf, -3, 0, 0.0
    for end in range(2):
        for k in range(segment.shape[1]):
            x, low, high = segment[end, k], beyond[0, k], beyond[1, k]
            if x <= low or x >= high:
                return -1 - end
            if x - low < shortest:
                shortest, nearest, axis, target = x - low, end, k, low
            if high - x < shortest:
                shortest, nearest, axis, target = high - x, end, k, high
    for k in range(segment.shape[1]):
        way[0, k] = way[1, k] = segment[max(nearest, 0), k]
    way[1, axis] = target
    return nearest


@bare
def load_group(group: Group, segments: Any, chosen: Any, locations: Any, beyond: Any, first: int, last: int) -> int:
    """Load the chosen segments first .. last - 1, and ways out where the first end is not known; return how many.

    beyond: see `Mesh`.
    """
    n_ways = 0
    for place in range(first, last):
        item, segment = place - first, segments[chosen[place]]
        for k in range(segment.shape[1]):
            group.segments[item, 0, k], group.segments[item, 1, k] = segment[0, k], segment[1, k]
        group.locations[item], group.turns[item] = locations[place], -1
        if locations[place] == UNDECIDED:
            end = way_out(segment, beyond, group.ways[n_ways])
            if end >= 0:
                group.askers[n_ways, 0], group.askers[n_ways, 1] = item, end
                n_ways += 1
            elif end == -1:
                group.locations[item] = -1
            elif end == -2:
                group.turns[item] = 1
    return n_ways


@inline
def count_turns(group: Group, n_ways: int, offsets: Any, kinds: Any) -> None:
    """Count how often the location turns over on each way, where all its contacts, at these offsets, are proper."""
    for way in range(n_ways):
        if all_proper(kinds, offsets[way], offsets[way + 1]):
            group.turns[group.askers[way, 0]] = 2 * (offsets[way + 1] - offsets[way]) + group.askers[way, 1]


@inline
def location_of(group: Group, item: int, n_crossings: int) -> int:
    """Return the location of a first end, from parity where that is known, else UNDECIDED."""
    turns = group.turns[item]
    if turns < 0:
        return int(group.locations[item])
    return 1 if (turns // 2 + (n_crossings if turns % 2 == 1 else 0)) % 2 == 1 else -1


@inline
def cut_segment(segments: Any, item: int, boundary: Any, contacts: Any, cuts: Crossings) -> bool:
    """Make the crossings of a segment, in order along it; False where not all is surely rounded, or two are one."""
    first, last = contacts.offsets[item], contacts.offsets[item + 1]
    if first < last and not is_item_safe(segments, item):
        return False
    for i in range(first, last):
        element = contacts.met[i]
        if not (boundary.are_safe or is_item_safe(boundary.elements, element)):
            return False
        if segments.shape[2] == 2:
            at_p, along = line_values(boundary.elements, element, segments, item)
        else:
            at_p, along = plane_values(boundary.elements, element, segments, item)
        cuts.faces[i] = boundary.faces[element]
        cuts.t[i], is_sure = cut_at(segments, item, boundary.elements, element, at_p, along, cuts.points, i)
        if not is_sure:
            return False
    return sort_crossings(cuts, first, last - first)


@bare
def cut_group(
    group: Group,
    chosen: Any,
    first: int,
    last: int,
    boundary: Any,
    contacts: Any,
    cuts: Crossings,
    stop: Any,
    out: Pieces,
    row: int,
    state: Any,
) -> tuple[int, int]:
    """Cut the chosen segments first .. last - 1, a group, at their contacts; return the place reached, and the row.

    Stops short where there is no room in `out`, or `stop` is set. See `cut_on_outline`.
    """
    for place in range(first, last):
        item = place - first
        begin, end = contacts.offsets[item], contacts.offsets[item + 1]
        location = location_of(group, item, end - begin)
        state[place] = OPEN
        if stop[0]:
            return place, row
        if not all_proper(contacts.kinds, begin, end) or (end > begin and location == 0):
            continue
        if location == UNDECIDED:
            state[place] = NEEDS_LOCATION
            continue
        if row + (end - begin) // 2 + 1 > out.source.size:
            return place, row
        if cut_segment(group.segments, item, boundary, contacts, cuts):
            row = emit(group.segments, item, chosen[place], location >= 0, cuts, begin, end - begin, out, row)
            state[place] = SETTLED
    return last, row


@kernel
def cut_on_outline(
    segments: Any, chosen: Any, locations: Any, outline: Any, stop: Any, out: Pieces, state: Any, n: Any
) -> None:
    """Cut the ``chosen`` of some segments (n, 2, 2) float64 on a polygon, as far as double-doubles and filters go.

    chosen: (m,) int64. locations: (m,) int8 of their first ends, UNDECIDED where they are not known. outline: see
    `Outline`. stop: one uint8, polled. state: (m,) uint8, SETTLED, NEEDS_LOCATION or OPEN. n: the place in `chosen` to
    begin with, afterwards where to go on, short of the end where there is no room; how many rows are filled; and for
    how many contacts of a group of segments there is to be room.
    """
    size = group_size(chosen.size - n[0])
    contacts = edge_contacts_for(size, n[2])
    group, cuts, last = group_for(size, 2), crossings_for(n[2], 2), n[0]
    n[1] = 0
    while last < chosen.size:  # bound: every turn takes a group
        first, last = last, min(last + size, chosen.size)
        n_ways = load_group(group, segments, chosen, locations, outline.beyond, first, last)
        found = gather_edges(contacts, outline, group.ways, n_ways, stop)
        if found >= 0:
            count_turns(group, n_ways, contacts.offsets, contacts.kinds)
            found = gather_edges(contacts, outline, group.segments, last - first, stop)
        if found < 0:
            n[2] *= 2
            return
        n[0], n[1] = cut_group(group, chosen, first, last, outline, contacts, cuts, stop, out, n[1], state)
        if n[0] < last:
            return


@kernel
def cut_on_mesh(
    segments: Any, chosen: Any, locations: Any, mesh: Any, stop: Any, out: Pieces, state: Any, n: Any
) -> None:
    """Cut the ``chosen`` of some segments (n, 2, 3) float64 on a polyhedron, `Mesh`: see `cut_on_outline`."""
    size = group_size(chosen.size - n[0])
    streams = streams_for(mesh, size, n[2])
    group, cuts, last = group_for(size, 3), crossings_for(n[2], 3), n[0]
    n[1] = 0
    while last < chosen.size:  # bound: every turn takes a group
        first, last = last, min(last + size, chosen.size)
        n_ways = load_group(group, segments, chosen, locations, mesh.beyond, first, last)
        found = gather_contacts(streams, mesh, group.ways, n_ways, stop)
        if found >= 0:
            count_turns(group, n_ways, streams.offsets, streams.kinds)
            found = gather_contacts(streams, mesh, group.segments, last - first, stop)
        if found < 0:
            n[2] *= 2
            return
        n[0], n[1] = cut_group(group, chosen, first, last, mesh, streams, cuts, stop, out, n[1], state)
        if n[0] < last:
            return
