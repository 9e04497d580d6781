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

from engine.jit import called, inline, kernel
from engine.segment_clipping.box_tree import DEEPEST
from engine.segment_clipping.contacts import GROUP, PROPER, gather_edges
from engine.segment_clipping.crossing_values import cut_at, is_item_safe, line_values, plane_values
from engine.segment_clipping.mesh_streams import gather_contacts, streams_for
from engine.types import UNDECIDED

SETTLED: Final = 0
OPEN: Final = 1
"""Exact arithmetic must cut the segment."""
UNLOCATED: Final = 2
"""The location of the first end must be told."""


class Crossings(NamedTuple):
    """The crossings of a group of segments, those of each in a row; as many of each array as there is room for."""

    t: Any
    points: Any
    order: Any


class Rows(NamedTuple):
    """Where pieces are written, see `SegmentPieces`."""

    source: Any
    start: Any
    end: Any
    t: Any
    faces: Any


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
    return Crossings(np.empty(n), np.empty((n, dimension)), np.empty(n, np.int64))


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
    segments: Any,
    item: int,
    source: int,
    is_inside: bool,
    cuts: Crossings,
    first: int,
    n: int,
    met: Any,
    faces: Any,
    row: int,
    out: Rows,
) -> int:
    """Write the pieces between n crossings to the rows of `out` from `row` on; return the row after them."""
    if is_inside:
        out.source[row], out.t[row, 0], out.faces[row, 0] = source, 0.0, -1
        for k in range(segments.shape[2]):
            out.start[row, k] = segments[item, 0, k] + 0.0
    for place in range(first, first + n):
        i = cuts.order[place]
        if is_inside:
            out.t[row, 1], out.faces[row, 1] = cuts.t[i], faces[met[i]]
            for k in range(segments.shape[2]):
                out.end[row, k] = cuts.points[i, k]
            row += 1
        else:
            out.source[row], out.t[row, 0], out.faces[row, 0] = source, cuts.t[i], faces[met[i]]
            for k in range(segments.shape[2]):
                out.start[row, k] = cuts.points[i, k]
        is_inside = not is_inside
    if is_inside:
        out.t[row, 1], out.faces[row, 1] = 1.0, -1
        for k in range(segments.shape[2]):
            out.end[row, k] = segments[item, 1, k] + 0.0
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


@inline
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


@called
def cut_group(
    group: Group,
    chosen: Any,
    first: int,
    last: int,
    elements: Any,
    are_safe: bool,
    faces: Any,
    offsets: Any,
    met: Any,
    kinds: Any,
    cuts: Crossings,
    stop: Any,
    out: Rows,
    row: int,
    state: Any,
) -> tuple[int, int]:
    """Cut the chosen segments first .. last - 1, a group, at their contacts; return the place reached, and the row.

    are_safe: whether all elements surely are (`is_item_safe`). Stops short where there is no room in `out`, or
    `stop` is set. See `cut_on_outline`.
    """
    segments, dimension = group.segments, group.segments.shape[2]
    for place in range(first, last):
        item = place - first
        location, turns = group.locations[item], group.turns[item]
        begin, end = offsets[item], offsets[item + 1]
        found = end - begin
        if turns >= 0:
            location = 1 if (turns // 2 + (found if turns % 2 == 1 else 0)) % 2 == 1 else -1
        state[place] = OPEN
        if stop[0]:
            return place, row
        if not all_proper(kinds, begin, end) or (found > 0 and location == 0):
            continue
        if location == UNDECIDED:
            state[place] = UNLOCATED
            continue
        if row + found // 2 + 1 > out.source.size:
            return place, row
        sure = found == 0 or is_item_safe(segments, item)
        for i in range(begin, end):
            element = met[i]
            if not (sure and (are_safe or is_item_safe(elements, element))):
                sure = False
                break
            if dimension == 2:
                at_p, along = line_values(elements, element, segments, item)
            else:
                at_p, along = plane_values(elements, element, segments, item)
            cuts.t[i], sure = cut_at(segments, item, elements, element, at_p, along, cuts.points, i)
        if sure and sort_crossings(cuts, begin, found):
            row = emit(segments, item, chosen[place], location >= 0, cuts, begin, found, met, faces, row, out)
            state[place] = SETTLED
    return last, row


@kernel
def cut_on_outline(
    segments: Any, chosen: Any, locations: Any, outline: Any, stop: Any, out: Rows, state: Any, n: Any
) -> None:
    """Cut the ``chosen`` of some segments (n, 2, 2) float64 on a polygon, as far as double-doubles and filters go.

    chosen: (m,) int64. locations: (m,) int8 of their first ends, UNDECIDED where they are not known. outline: see
    `Outline`. stop: one uint8, polled. state: (m,) uint8, SETTLED, OPEN or UNLOCATED. n: the place in `chosen` to begin
    with, afterwards where to go on, short of the end where there is no room; how many rows are filled; and for how many
    contacts of a group of segments there is to be room.
    """
    size, last, row = group_size(chosen.size - n[0]), n[0], 0
    group, cuts = group_for(size, 2), crossings_for(n[2], 2)
    met, kinds, offsets = np.empty(n[2], np.int64), np.empty(n[2], np.uint8), np.empty(size + 1, np.int64)
    stack = np.empty(DEEPEST, np.int64)
    n[1] = 0
    while last < chosen.size:
        first, last = last, min(last + size, chosen.size)
        n_ways = load_group(group, segments, chosen, locations, outline.beyond, first, last)
        reached, n_items = gather_edges(group.ways, 0, n_ways, outline, stop, stack, met, kinds, offsets), last - first
        if reached == n_ways:
            count_turns(group, n_ways, offsets, kinds)
            reached = gather_edges(group.segments, 0, n_items, outline, stop, stack, met, kinds, offsets) + n_ways
        if reached < n_ways + n_items:
            n[2] *= 2
            return
        n[0], row = cut_group(
            group,
            chosen,
            first,
            last,
            outline.elements,
            outline.are_safe,
            outline.faces,
            offsets,
            met,
            kinds,
            cuts,
            stop,
            out,
            row,
            state,
        )
        n[1] = row
        if n[0] < last:
            return


@kernel
def cut_on_mesh(
    segments: Any, chosen: Any, locations: Any, mesh: Any, stop: Any, out: Rows, state: Any, n: Any
) -> None:
    """Cut the ``chosen`` of some segments (n, 2, 3) float64 on a polyhedron, `Mesh`: see `cut_on_outline`."""
    size, last, row = group_size(chosen.size - n[0]), n[0], 0
    group, streams, cuts = group_for(size, 3), streams_for(mesh, size, n[2]), crossings_for(n[2], 3)
    n[1] = 0
    while last < chosen.size:
        first, last = last, min(last + size, chosen.size)
        n_ways = load_group(group, segments, chosen, locations, mesh.beyond, first, last)
        found = gather_contacts(streams, mesh, group.ways, n_ways, stop)
        if found >= 0:
            count_turns(group, n_ways, streams.offsets, streams.kinds)
            found = gather_contacts(streams, mesh, group.segments, last - first, stop)
        if found < 0:
            n[2] *= 2
            return
        n[0], row = cut_group(
            group,
            chosen,
            first,
            last,
            mesh.elements,
            mesh.are_safe,
            mesh.faces,
            streams.offsets,
            streams.met,
            streams.kinds,
            cuts,
            stop,
            out,
            row,
            state,
        )
        n[1] = row
        if n[0] < last:
            return
