"""Which triangles of a mesh a segment meets, and how: one traversal for clipping and for scenes.

The segment goes down a tree of boxes (bvh.py). Blocks of triangles that it reaches wait in a list, and so do the
triangles that `near_triangles` leaves of them, so that their lines of memory are fetched side by side. A filter, then
exact signs (triangle_contact.py) decide on each triangle.

The tree holds float32 boxes in coordinates of its own. A segment is brought there in doubles, cut to what lies
near the tree, and stored as its middle and half in float32; the slack covers what all this rounds:

    middle, w = m - c      2^-24 (S + 2) each, S the largest coordinate (the tree's own are at most 2)
    half, quotients        see `enter_boxes`
    cutting                2^-50 of the segment's coordinates before, in either end

16 * 2^-24 (S + 2) for half widths is more than their sum.

Source: I. Wald, C. Benthin, S. Boulos, Getting rid of packets: efficient SIMD single-ray traversal using
multi-branching BVHs, 2008.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import FlagArray, FloatArray, IntArray
from engine.bounding.bvh import STACK, WIDTH
from engine.compiling.jit import allocating, allocating_kernel, called, inline, merged
from engine.lanes.boxes import BOX_ROWS, EMPTY, enter_boxes
from engine.lanes.lanes import lowest_bit, prefetch
from engine.lanes.tracing import LANES
from engine.lanes.triangles import AXES_BEFORE, CORNER_ROWS, longest_axis, near_triangles
from engine.segment_clipping.on_boundary.contacts import NO_ROOM, STOPPED, Kind, is_point
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


_ROOM: Final = 512
"""Blocks, and triangles, that wait at once."""

Waiting = namedtuple("Waiting", "stack entered blocks triangles")
"""Room for one traversal. stack: (STACK,) int32 nodes; entered: (1, WIDTH) float32, see `enter_boxes`; blocks,
triangles: int64, at least 2 * LANES each."""


class MeshContacts(NamedTuple):
    """Room for the contacts of a group of segments: triangles and kinds one segment after another, and offsets."""

    met: Any
    kinds: Any
    offsets: Any
    """(m + 1,) where those of each segment begin."""
    waiting: Waiting


@allocating
def mesh_contacts_for(n_segments: int, n_contacts: int) -> MeshContacts:
    """Return room for groups of so many segments at most, and so many contacts of a group."""
    return MeshContacts(
        np.empty(n_contacts, np.int64), np.empty(n_contacts, np.uint8), np.empty(n_segments + 1, np.int64),
        Waiting(
            np.empty(STACK, np.int32), np.empty((1, WIDTH), np.float32), np.empty(_ROOM, np.int64),
            np.empty(_ROOM, np.int64),
        ),
    )  # fmt: skip


@inline
def is_answered(is_any: bool, n_met: int, kinds: IntArray | FlagArray) -> bool:
    """Tell whether a traversal may end: there is no room, or one contact is enough and is decided."""
    return n_met < 0 or (is_any and n_met > 0 and kinds[0] != Kind.DEGENERATE)


@inline
def _append_triangles(
    mesh: Any, ends: Any, is_any: bool, triangles: IntArray, n: int, met: IntArray, kinds: Any, n_met: int
) -> int:
    """Append the contacts with n triangles that wait; see `append_contacts`."""
    p, q, blur = ends
    for place in range(n):
        element = triangles[place]
        kind = triangle_contact(mesh.elements, element, p, q, blur)
        if kind == Kind.APART:
            continue
        row = 0 if is_any else n_met
        if row == met.size:
            return NO_ROOM
        prefetch(mesh.faces, element)
        met[row], kinds[row], n_met = element, kind, row + 1
        if is_answered(is_any, n_met, kinds):
            break
    return n_met


@inline
def _append_blocks(
    mesh: Any, ends: Any, shear: Any, is_any: bool, waiting: Waiting, n: int, met: IntArray, kinds: Any, n_met: int
) -> int:
    """Append the contacts with the triangles of n blocks that wait; see `append_contacts`. shear: of `shear_of`."""
    (i, j, k), place, r, s, reach, slack = shear
    n_waiting = 0
    for turn in range(n):
        block = waiting.blocks[turn]
        bits = near_triangles(mesh.corners, block, i, j, k, place, r, s, reach, slack)
        while bits != 0:
            below = mesh.child[mesh.n_inner + block, lowest_bit(bits)]
            bits &= bits - 1
            if below != EMPTY:
                waiting.triangles[n_waiting] = -1 - below
                n_waiting += 1
                prefetch(mesh.elements, (-1 - below) * 9)
                prefetch(mesh.elements, (-1 - below) * 9 + 8)
        if n_waiting + LANES > waiting.triangles.size or turn == n - 1:
            n_met = _append_triangles(mesh, ends, is_any, waiting.triangles, n_waiting, met, kinds, n_met)
            n_waiting = 0
            if is_answered(is_any, n_met, kinds):
                break
    return n_met


@inline
def append_contacts(
    mesh: Any, p: Point3, q: Point3, blur: float, is_any: bool, waiting: Waiting, met: IntArray, kinds: Any, n_met: int
) -> int:
    """Append the triangles that a segment meets to met, how to kinds; return how many these are then, or NO_ROOM.

    p and q are known to `blur` a coordinate; where that is above 0, what a filter cannot decide is Kind.DEGENERATE.
    is_any: one contact is enough, and stands in the first row; it is Kind.DEGENERATE only where no other is decided.
    """
    stack, blocks = waiting.stack, waiting.blocks
    way, last = local_segment(p, q, mesh.origin, mesh.inverse, blur), np.float32(1.0)
    shear, ends, n_blocks, depth = shear_of(way), (p, q, blur), 0, int(way.is_near)
    stack[0], blocks[0] = 0, 0
    if mesh.n_inner == 0:
        depth, n_blocks = 0, depth
    while depth > 0 or n_blocks > 0:  # bound: each node enters the stack once
        if depth > 0:
            depth -= 1
            node = stack[depth]
            bits = enter_boxes(mesh.boxes, node, way.middle, way.inverse, way.slack, last, waiting.entered)
            while bits != 0:
                below = mesh.child[node, lowest_bit(bits)]
                bits &= bits - 1
                if below < 0:  # case: numbers that are none, which nothing separates
                    continue
                prefetch(mesh.child, below * WIDTH)
                if below >= mesh.n_inner:
                    blocks[n_blocks] = below - mesh.n_inner
                    n_blocks += 1
                    for line in range(0, CORNER_ROWS * LANES, 16):
                        prefetch(mesh.corners, (below - mesh.n_inner) * (CORNER_ROWS * LANES) + line)
                else:
                    stack[depth] = below
                    depth += 1
                    for line in range(0, BOX_ROWS * WIDTH, 16):
                        prefetch(mesh.boxes, below * (BOX_ROWS * WIDTH) + line)
        if depth == 0 or n_blocks + WIDTH > blocks.size:
            n_met, n_blocks = _append_blocks(mesh, ends, shear, is_any, waiting, n_blocks, met, kinds, n_met), 0
            if is_answered(is_any, n_met, kinds):
                break
    return n_met


@called
def gather_triangles(contacts: MeshContacts, mesh: Mesh, segments: FloatArray, n: int, stop: FlagArray) -> int:
    """Fill met, kinds and offsets with the contacts of the first n of some segments (m, 2, 3): see `gather_edges`."""
    n_met = 0
    contacts.offsets[0] = 0
    for i in range(n):
        if not is_point(segments[i]):
            p, q = corner(segments, i, 0), corner(segments, i, 1)
            n_met = append_contacts(mesh, p, q, 0.0, False, contacts.waiting, contacts.met, contacts.kinds, n_met)
        contacts.offsets[i + 1] = n_met
        if n_met < 0:
            return NO_ROOM
        if stop[0]:
            return STOPPED
    return n_met


@allocating_kernel
def find_contacts_3d(segments: FloatArray, mesh: Mesh, stop: FlagArray, room: int) -> tuple[int, Any, Any, Any]:
    """Return the contacts of segments (n, 2, 3) float64, GROUP at most, with triangles: see `find_contacts_2d`."""
    contacts = mesh_contacts_for(segments.shape[0], room)
    n_met = gather_triangles(contacts, mesh, segments, segments.shape[0], stop)
    return n_met, contacts.met, contacts.kinds, contacts.offsets
