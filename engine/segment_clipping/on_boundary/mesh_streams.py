"""Which triangles of a mesh the segments of a group meet: each node is asked about all that reach it, one by one.

A segment by itself goes down a tree from one miss of the cache, and one branch nobody foresees, to the next. Here a
group of segments goes down together:

    inner nodes     the segments that reach a node stand in a list; their answers (`enter_boxes`) are sorted into one
                    list a child, without a branch for each; lists of children wait on a stack
    blocks          what reaches a block waits as a pair of block and segment; pairs are asked (`near_triangles`) in
                    order, the triangles of those that follow are on their way from memory
    triangles       what is left waits likewise for the exact signs (`triangle_contact`)

Answers are those of one segment by itself, sorted by segment afterwards.

The tree (bvh.py) holds float32 boxes in coordinates of its own. A segment is brought there in doubles, cut to what lies
near the tree, and stored as its middle and half in float32; the slack covers what all this rounds:

    middle, w = m - c      2^-24 (S + 2) each, S the largest coordinate (the tree's own are at most 2)
    half, quotients        see `enter_boxes`
    cutting                2^-50 of the segment's coordinates before, in either end

16 * 2^-24 (S + 2) for half widths is more than their sum.

Source: I. Wald, C. Gribble, S. Boulos, A. Kensler, SIMD ray stream tracing, 2007; J. Tsakok, Faster incoherent rays:
multi-BVH ray stream tracing, 2009.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import FlagArray, FloatArray
from engine.jit import allocating, allocating_kernel, called, inline, merged
from engine.lanes.boxes import EMPTY, enter_boxes
from engine.lanes.lanes import lowest_bit, prefetch
from engine.lanes.tracing import LANES
from engine.lanes.triangles import AXES_BEFORE, CORNER_ROWS, longest_axis, near_triangles
from engine.segment_clipping.on_boundary.contacts import APART, NO_ROOM, STOPPED, is_point
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh
from engine.segment_clipping.on_boundary.triangle_contact import corner, triangle_contact
from engine.types import Point3

SLACK: Final = 2.0**-20
CUT_SLACK: Final = 2.0**-45
LIMIT: Final = 4.0
"""Segments are cut to this cube, in coordinates of the tree, that is: far outside of every box."""

_MOST: Final = np.float32(2.0**100)
Way = namedtuple("Way", "middle half inverse slack is_near")
"""A segment in the coordinates of a tree, with its slack, in float32. inverse: 1 / half, at most 2^100, where halves
are far below every slack; is_near: whether it comes near the tree at all."""


@merged
def local_segment(p: Point3, q: Point3, origin: Any, inverse: float, blur: float) -> Way:
    """Return a segment, whose ends are known to `blur` a coordinate, in the coordinates of a tree."""
    ox, oy, oz = origin[0] * inverse, origin[1] * inverse, origin[2] * inverse
    px, py, pz = p.x * inverse - ox, p.y * inverse - oy, p.z * inverse - oz
    dx, dy, dz = q.x * inverse - p.x * inverse, q.y * inverse - p.y * inverse, q.z * inverse - p.z * inverse
    size = max(abs(px), abs(py), abs(pz), abs(px + dx), abs(py + dy), abs(pz + dz))
    start, end, is_near = 0.0, 1.0, True
    cut = CUT_SLACK * (size + 2.0)
    if size > LIMIT and size < 2.0**40:
        for at, step in ((px, dx), (py, dy), (pz, dz)):
            if abs(step) < 2.0**-40:
                is_near &= abs(at) <= LIMIT
                continue
            first, last = (-LIMIT - at) / step, (LIMIT - at) / step
            start, end = max(start, min(first, last)), min(end, max(first, last))
        is_near &= start <= end
        size = LIMIT + 1.0
    middle, length = 0.5 * (start + end), 0.5 * (end - start)
    half: Any = np.float32(length * dx), np.float32(length * dy), np.float32(length * dz)
    x, y, z = np.float32(1.0) / half[0], np.float32(1.0) / half[1], np.float32(1.0) / half[2]
    return Way(
        (np.float32(px + middle * dx), np.float32(py + middle * dy), np.float32(pz + middle * dz)),
        half,
        (min(max(x, -_MOST), _MOST), min(max(y, -_MOST), _MOST), min(max(z, -_MOST), _MOST)),
        np.float32(SLACK * (size + 2.0) + cut + 64.0 * blur * inverse),
        is_near,
    )


@merged
def shear_of(way: Way) -> Any:
    """Return what `near_triangles` takes of a segment: axes, middle, r, s, reach and slack."""
    k, middle, half = longest_axis(way.half), way.middle, way.half
    i, j = AXES_BEFORE[k], AXES_BEFORE[k + 1]
    slack = np.float32(2.0) * way.slack  # 32 u (S + 2) of lanes/triangles.py, and twice what cutting loses
    place = middle[i], middle[j], middle[k]
    return (i, j, k), place, half[i] / half[k], half[j] / half[k], abs(half[k]) + slack, slack


AHEAD: Final = 8
"""Items between the one that memory is asked for and the one worked on."""
_PAIRS: Final = 16
"""Pairs of block and segment that wait at once, for each segment of a full group: more than one list adds."""
_TRIANGLES: Final = 4096
"""Triangles that wait at once: should all need exact signs, a few milliseconds."""
_SEGMENT: Final = (1 << 16) - 1
_BITS: Final = (1 << LANES) - 1


class Streams(NamedTuple):
    """Room for a group of segments."""

    numbers: Any
    """(m, 16) float32: middle, inverse and slack of a `Way`; then middle, r, s, reach and slack of `near_triangles`."""
    axes: Any
    """(m,) the longest axis."""
    members: Any
    """The lists, one after another: segments."""
    found: Any
    """(m,) the answers of a node to its list."""
    entered: Any
    """(1, 8), see `enter_boxes`."""
    stack: Any
    """(n, 3) nodes that wait, begin and end of their lists."""
    pairs: Any
    """Blocks and segments that wait, later with the bits of the block's triangles."""
    waiting: Any
    """Triangles and segments that wait."""
    owners: Any
    """Of each contact its segment."""
    found_met: Any
    found_kinds: Any
    """Contacts in the order in which they are found."""
    met: Any
    kinds: Any
    """The same by segment."""
    offsets: Any
    """(m + 1,) where those of each segment begin."""


@allocating
def streams_for(mesh: Mesh, n_segments: int, n_contacts: int) -> Streams:
    """Return room for groups of so many segments at most, and so many contacts of a group."""
    n_pairs = _PAIRS * n_segments
    return Streams(
        np.empty((n_segments, 16), np.float32), np.empty(n_segments, np.int64),
        np.empty(n_segments * (1 + LANES * mesh.n_levels), np.int32), np.empty(n_segments, np.int64),
        np.empty((1, LANES), np.float32), np.empty((LANES * mesh.n_levels + 1, 3), np.int64),
        np.empty(n_pairs, np.int64), np.empty(_TRIANGLES, np.int64),
        np.empty(n_contacts, np.int32), np.empty(n_contacts, np.int64), np.empty(n_contacts, np.uint8),
        np.empty(n_contacts, np.int64), np.empty(n_contacts, np.uint8), np.empty(n_segments + 1, np.int64),
    )  # fmt: skip


@inline
def _load(streams: Streams, mesh: Mesh, segments: FloatArray, n: int) -> int:
    """Bring the first n of some segments (m, 2, 3) to the tree; list those that come near it, return how many."""
    n_near = 0
    for item in range(n):
        way = local_segment(corner(segments, item, 0), corner(segments, item, 1), mesh.origin, mesh.inverse, 0.0)
        axes, middle, r, s, reach, slack = shear_of(way)
        row, streams.axes[item] = streams.numbers[item], axes[2]
        row[0], row[1], row[2] = way.middle
        row[3], row[4], row[5] = way.inverse
        row[6], (row[7], row[8], row[9]) = way.slack, middle
        row[10], row[11], row[12], row[13] = r, s, reach, slack
        streams.members[n_near] = item
        n_near += way.is_near and not is_point(segments[item])
    return n_near


@inline
def _settle_pairs(
    streams: Streams, mesh: Mesh, segments: FloatArray, n_pairs: int, n_contacts: int, stop: FlagArray
) -> int:
    """Append the contacts of the pairs that wait; return how many there are then, or what `gather_contacts` does."""
    corners, pairs, waiting = mesh.corners, streams.pairs, streams.waiting
    n_kept = 0
    for place in range(n_pairs):
        coming = (pairs[min(place + AHEAD, n_pairs - 1)] >> 16) * (CORNER_ROWS * LANES)
        for line in range(0, CORNER_ROWS * LANES, 16):
            prefetch(corners, coming + line)
        pair = pairs[place]
        item, block = pair & _SEGMENT, pair >> 16
        row, k = streams.numbers[item], streams.axes[item]
        bits = near_triangles(
            corners, block, AXES_BEFORE[k], AXES_BEFORE[k + 1], k, (row[7], row[8], row[9]), row[10], row[11], row[12],
            row[13],
        )  # fmt: skip
        pairs[n_kept] = (pair << LANES) | bits
        n_kept += bits != 0
    place = 0
    while place < n_kept:
        n_waiting = 0
        while place < n_kept and n_waiting + LANES <= waiting.size:
            pair = pairs[place]
            bits, item, block = pair & _BITS, (pair >> LANES) & _SEGMENT, pair >> (16 + LANES)
            place += 1
            while bits != 0:
                below = mesh.child[mesh.n_inner + block, lowest_bit(bits)]
                bits &= bits - 1
                if below != EMPTY:
                    waiting[n_waiting] = ((-1 - below) << 16) | item
                    n_waiting += 1
        n_contacts = _settle_triangles(streams, mesh, segments, n_waiting, n_contacts)
        if n_contacts < 0:
            break
        if stop[0]:
            return STOPPED
    return n_contacts


@inline
def _settle_triangles(streams: Streams, mesh: Mesh, segments: FloatArray, n_waiting: int, n_contacts: int) -> int:
    """Append the contacts of the triangles that wait, as `_settle_pairs` does."""
    waiting = streams.waiting
    for place in range(n_waiting):
        coming = waiting[min(place + AHEAD, n_waiting - 1)] >> 16
        prefetch(mesh.elements, coming * 9)
        prefetch(mesh.elements, coming * 9 + 8)
        prefetch(mesh.faces, coming)
        item, element = waiting[place] & _SEGMENT, waiting[place] >> 16
        kind = triangle_contact(mesh.elements, element, segments, item)
        if kind != APART:
            if n_contacts == streams.owners.size:
                return NO_ROOM
            streams.owners[n_contacts], streams.found_met[n_contacts] = item, element
            streams.found_kinds[n_contacts] = kind
            n_contacts += 1
    return n_contacts


@inline
def _by_segment(streams: Streams, n: int, n_contacts: int) -> None:
    """Sort contacts by segment, those of one stay in order."""
    offsets = streams.offsets
    offsets[: n + 1] = 0
    for contact in range(n_contacts):
        offsets[streams.owners[contact] + 1] += 1
    for item in range(n):
        offsets[item + 1] += offsets[item]
    for contact in range(n_contacts - 1, -1, -1):
        item = streams.owners[contact]
        offsets[item + 1] -= 1
        place = offsets[item + 1]
        streams.met[place], streams.kinds[place] = streams.found_met[contact], streams.found_kinds[contact]
    for item in range(n):
        offsets[item] = offsets[item + 1]
    offsets[n] = n_contacts


@called
def gather_contacts(streams: Streams, mesh: Mesh, segments: FloatArray, n: int, stop: FlagArray) -> int:
    """Fill met, kinds and offsets with the contacts of the first n of some segments (m, 2, 3); return how many.

    Those of no length have none. NO_ROOM where they have no room, STOPPED where `stop` (one uint8) is set.
    """
    members, found, stack, pairs = streams.members, streams.found, streams.stack, streams.pairs
    n_near = _load(streams, mesh, segments, n)
    n_pairs, n_contacts, depth, last = 0, 0, 0, np.float32(1.0)
    if mesh.n_inner == 0:
        for place in range(n_near):
            pairs[place] = members[place]
        n_pairs = n_near
    elif n_near > 0:
        stack[0, 0], stack[0, 1], stack[0, 2], depth = 0, 0, n_near, 1
    while depth > 0:  # bound: each node enters the stack once
        if stop[0]:
            return STOPPED
        depth -= 1
        node, begin, end = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        if n_pairs + LANES * (end - begin) > pairs.size:
            n_contacts = _settle_pairs(streams, mesh, segments, n_pairs, n_contacts, stop)
            n_pairs = 0
            if n_contacts < 0:
                return n_contacts
        union = 0
        for place in range(begin, end):
            row = streams.numbers[members[place]]
            bits = enter_boxes(
                mesh.boxes, node, (row[0], row[1], row[2]), (row[3], row[4], row[5]), row[6], last, streams.entered
            )
            found[place - begin] = bits
            union |= bits
        top = end
        while union != 0:
            lane = lowest_bit(union)
            union &= union - 1
            below = mesh.child[node, lane]
            if below == EMPTY:  # case: a segment of no numbers, which nothing separates
                continue
            if below >= mesh.n_inner:
                block = (below - mesh.n_inner) << 16
                for place in range(begin, end):
                    pairs[n_pairs] = block | members[place]
                    n_pairs += (found[place - begin] >> lane) & 1
                continue
            first = top
            for place in range(begin, end):
                members[top] = members[place]
                top += (found[place - begin] >> lane) & 1
            stack[depth, 0], stack[depth, 1], stack[depth, 2] = below, first, top
            depth += 1
            prefetch(mesh.child, below * LANES)
            for line in range(0, 6 * LANES, 16):
                prefetch(mesh.boxes, below * (6 * LANES) + line)
    n_contacts = _settle_pairs(streams, mesh, segments, n_pairs, n_contacts, stop)
    if n_contacts >= 0:
        _by_segment(streams, n, n_contacts)
    return n_contacts


@allocating_kernel
def find_mesh_contacts(segments: FloatArray, mesh: Mesh, stop: FlagArray, room: int) -> tuple[int, Any, Any, Any]:
    """Return the contacts of segments (n, 2, 3) float64, GROUP at most, with triangles: see `find_contacts_2d`."""
    streams = streams_for(mesh, segments.shape[0], room)
    found = gather_contacts(streams, mesh, segments, segments.shape[0], stop)
    return found, streams.met, streams.kinds, streams.offsets
