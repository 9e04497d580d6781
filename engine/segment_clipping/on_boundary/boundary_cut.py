"""The pieces of segments on polygons and meshes, compiled; above all of those whose contacts are all proper crossings.

Every crossing turns the location over, so only the first end's location and the order of the crossings along the
segment matter. Parameters that are surely rounded (crossing_values.py) and differ as doubles are in their exact order.
A segment that touches, or with a coordinate that may round either way, is cut by touching_cut.py; what that leaves open
by exact_pieces.py.
"""

from __future__ import annotations

from typing import Any, Final

from engine.arrays import FlagArray, FloatArray, Int8Array, IntArray
from engine.compiling.jit import allocating_kernel, called, inline
from engine.segment_clipping.on_boundary.contacts import GROUP, Kind, edge_contacts_for, gather_edges
from engine.segment_clipping.on_boundary.crossing_values import cut_at, is_item_safe
from engine.segment_clipping.on_boundary.mesh_contacts import gather_triangles, mesh_contacts_for
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, Outline
from engine.segment_clipping.on_boundary.touching_cut import (
    UNSURE,
    Crossings,
    crossings_for,
    cut_touching,
    emit_touching,
    sort_crossings,
)
from engine.segment_clipping.pieces import Pieces, put_own_end
from engine.types import OPEN

SETTLED: Final = 0
"""State of a segment, beside OPEN."""


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
    contacts, cuts, last = edge_contacts_for(size, n[2]), crossings_for(2 * n[2], 2), n[0]
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
    contacts, cuts, last = mesh_contacts_for(size, n[2]), crossings_for(2 * n[2], 3), n[0]
    n[1], found = 0, 0
    while n[0] == last < locations.shape[0] and found >= 0:
        last = min(n[0] + size, locations.shape[0])
        group = segments[n[0] : last]
        found = gather_triangles(contacts, mesh, group, group.shape[0], stop)
        if found >= 0:
            n[0], n[1] = cut_group(group, locations, n[0], mesh, contacts, cuts, stop, out, n[1], state)
    n[2] *= 2 if found < 0 else 1
