"""Contacts of a segment with the triangles of a mesh: one traversal for clipping and for scenes.

The segment descends a tree of boxes (bvh.py). Blocks of triangles that it reaches are queued, and so are the triangles
that `near_triangles` leaves of them, so that their cache lines are fetched together. A filter, then exact signs decide
each triangle.

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
from typing import Any, Final

import numpy as np

from engine.bounding.bvh import STACK, WIDTH
from engine.compiling.jit import allocating, allocating_kernel, called, entry_of, inline, merged
from engine.lanes.boxes import BOX_ROWS, EMPTY, enter_boxes
from engine.lanes.faces import AXES_BEFORE, CORNER_ROWS, longest_axis, near_triangles
from engine.lanes.lanes import lowest_bit, prefetch
from engine.lanes.tracing import LANES
from engine.running.budget import Budget
from engine.segment_clipping.on_boundary.contacts import (
    CODE_BITS,
    NO_ROOM,
    Contacts,
    Kind,
    allocate_contacts,
    are_same,
    find_contacts_2d,
)
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, Outline
from engine.segment_clipping.on_boundary.triangle_contacts import corner, triangle_contact
from engine.types import FlagArray, FloatArray, IntArray, Point3

SLACK: Final = 2.0**-20
CUT_SLACK: Final = 2.0**-45
LIMIT: Final = 4.0
"""Half side of the cube, in tree coordinates, to which segments are cut: far outside of every box."""

_MOST: Final = np.float32(2.0**100)
Way = namedtuple("Way", "middle half inverse slack is_near")
"""A segment in tree coordinates, float32: middle +- half, and its slack. inverse: 1 / half, at most 2^100, where halves
are far below every slack; is_near: whether it comes near the tree."""


@merged
def local_segment(p: Point3, q: Point3, origin: Any, inverse: Any, blur: float) -> Way:
    """Return segment p q in tree coordinates, by axis (x - origin) * inverse, as a `Way`. blur: error of each
    coordinate of p and q."""
    ix, iy, iz = inverse[0], inverse[1], inverse[2]
    px, py, pz = p.x * ix - origin[0] * ix, p.y * iy - origin[1] * iy, p.z * iz - origin[2] * iz
    dx, dy, dz = q.x * ix - p.x * ix, q.y * iy - p.y * iy, q.z * iz - p.z * iz
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
        np.float32(SLACK * (size + 2.0) + cut + 64.0 * blur * max(ix, iy, iz)),
        is_near,
    )


@inline
def far_end(start: Point3, way: Point3, is_ray: bool) -> Point3:
    """Return where a line from `start` ends, in tree coordinates: of a ray a point beyond every box, which is no number
    where its direction is 0, or beyond doubles."""
    size, length = max(abs(start.x), abs(start.y), abs(start.z)), max(abs(way.x), abs(way.y), abs(way.z))
    reach = 1.0
    if is_ray:
        reach = (size + 4.0 * LIMIT) / length if length > 0.0 else np.inf
    return Point3(start.x + reach * way.x, start.y + reach * way.y, start.z + reach * way.z)


@merged
def _segment_before(p: Point3, q: Point3, origin: Any, inverse: Any, blur: float) -> Way:
    """Return the line p q before p, from beyond the tree if p is near it, as a `Way`. Its far end is rounded in tree
    coordinates, far below the slack; of a tiny mesh far from the origin it would be lost in the caller's."""
    x, y, z = (q.x - p.x) * inverse[0], (q.y - p.y) * inverse[1], (q.z - p.z) * inverse[2]
    end = Point3(
        p.x * inverse[0] - origin[0] * inverse[0],
        p.y * inverse[1] - origin[1] * inverse[1],
        p.z * inverse[2] - origin[2] * inverse[2],
    )
    reach = 4.0 * LIMIT / max(abs(x), abs(y), abs(z))
    start = Point3(end.x - reach * x, end.y - reach * y, end.z - reach * z)
    return local_segment(start, end, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), blur * max(inverse[0], inverse[1], inverse[2]))


@merged
def shear_of(way: Way) -> Any:
    """Return the arguments of `near_triangles` for a segment: the axes (i, j, k), k the one along which it is longest;
    its middle on these; the slopes r and s; reach; slack."""
    k, middle, half = longest_axis(way.half), way.middle, way.half
    i, j = AXES_BEFORE[k], AXES_BEFORE[k + 1]
    slack = np.float32(2.0) * way.slack  # 32 u (S + 2) of lanes/faces.py, and twice what cutting loses
    place = middle[i], middle[j], middle[k]
    return (i, j, k), place, half[i] / half[k], half[j] / half[k], abs(half[k]) + slack, slack


_ROOM: Final = 512
"""Capacity of the queues of blocks, and of triangles."""

Waiting = namedtuple("Waiting", "stack entered blocks triangles")
"""Scratch of one traversal: stack (STACK,) int32 nodes; entered (1, WIDTH) float32, see `enter_boxes`; blocks,
triangles: int64, at least 2 * LANES each."""


@allocating
def traversal_buffers() -> Waiting:
    """Allocate the scratch of one traversal."""
    return Waiting(
        np.empty(STACK, np.int32),
        np.empty((1, WIDTH), np.float32),
        np.empty(_ROOM, np.int64),
        np.empty(_ROOM, np.int64),
    )


@inline
def is_answered(is_any: bool, n_met: int, kinds: IntArray | FlagArray) -> bool:
    """Return whether a traversal may end: n_met is NO_ROOM, or `is_any` and the contact in row 0 is decided."""
    return n_met < 0 or (is_any and n_met > 0 and kinds[0] != Kind.DEGENERATE)


@inline
def _append_triangles(
    mesh: Any, ends: Any, is_any: bool, triangles: IntArray, n: int, met: IntArray, kinds: Any, n_met: int
) -> int:
    """Append the contacts of a segment with triangles[:n] to met (elements) and kinds, after the n_met there; return
    their number then, or NO_ROOM. mesh: the `Mesh`; ends: (p, q, blur, is_before); is_any: one contact is enough, in
    row 0."""
    p, q, blur, is_before = ends
    for place in range(n):
        element = triangles[place]
        kind = triangle_contact(mesh.elements, element, p, q, blur, is_before)
        while kind != Kind.APART:  # bound: two codes
            row = 0 if is_any else n_met
            if row == met.size:
                return NO_ROOM
            prefetch(mesh.faces, element)
            met[row], kinds[row], n_met = element, kind & ((1 << CODE_BITS) - 1), row + 1
            kind >>= CODE_BITS
        if is_answered(is_any, n_met, kinds):
            break
    return n_met


@inline
def _append_blocks(
    mesh: Any, ends: Any, shear: Any, is_any: bool, waiting: Waiting, n: int, met: IntArray, kinds: Any, n_met: int
) -> int:
    """Append the contacts of a segment with the triangles of n leaf blocks, queued in `waiting`, to met (elements) and
    kinds, after the n_met there; return their number then, or NO_ROOM. ends: (p, q, blur, is_before); shear: `shear_of`
    the segment; is_any: one contact is enough, in row 0."""
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
    mesh: Any, p: Point3, q: Point3, blur: float, is_any: bool, is_before: bool, waiting: Waiting, met: IntArray,
    kinds: Any, n_met: int,
) -> int:  # fmt: skip
    """Append the contacts of segment p q with the triangles of a `Mesh` to met (elements) and kinds, after the n_met
    there; return their number then, or NO_ROOM. blur: error of each coordinate of p and q; if above 0, what the filter
    leaves open is Kind.DEGENERATE. is_any: one contact is enough, in row 0; it is Kind.DEGENERATE only if no other is
    decided. is_before: see `exact_contact`. waiting: scratch."""
    stack, blocks, last = waiting.stack, waiting.blocks, np.float32(1.0)
    if is_before:
        way = _segment_before(p, q, mesh.origin, mesh.inverse, blur)
    else:
        way = local_segment(p, q, mesh.origin, mesh.inverse, blur)
    shear, ends, n_blocks, depth = shear_of(way), (p, q, blur, is_before), 0, int(way.is_near)
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
def gather_triangles(contacts: Contacts, mesh: Mesh, segments: FloatArray, n: int, blur: float, stop: FlagArray) -> int:
    """Fill `contacts` with those of the first n of segments (m, 2, 3) and the triangles of a `Mesh`; return the number
    of segments for which there is room. blur: as in `append_contacts`. Ends early if `stop` (one uint8) is set."""
    n_met = 0
    contacts.offsets[0] = 0
    for i in range(n):
        if not are_same(segments[i], 0, segments[i], 1):
            p, q = corner(segments, i, 0), corner(segments, i, 1)
            n_met = append_contacts(
                mesh, p, q, blur, False, False, contacts.waiting, contacts.met, contacts.kinds, n_met
            )
        contacts.offsets[i + 1] = n_met
        if n_met < 0 or stop[0]:
            return i
    return n


@allocating_kernel
def find_contacts_3d(
    segments: FloatArray, mesh: Mesh, blur: float, stop: FlagArray, room: int
) -> tuple[int, Any, Any, Any]:
    """Return (number, met, kinds, offsets): the contacts of at most GROUP segments (n, 2, 3) float64 with triangles,
    segment by segment. blur: as in `append_contacts`; met int64: the elements; kinds uint8: `Kind` or code; offsets (n
    + 1,) of segments. The number is NO_ROOM if there are more than `room`, or `stop` (one uint8) is set."""
    n, contacts = segments.shape[0], allocate_contacts(segments.shape[0], room, traversal_buffers())
    n_met = contacts.offsets[n] if gather_triangles(contacts, mesh, segments, n, blur, stop) == n else NO_ROOM
    return n_met, contacts.met, contacts.kinds, contacts.offsets


_LEAST_CONTACTS: Final = 1 << 10
"""Smallest capacity for contacts, plus `_EACH` for each segment; doubled if there are more."""
_EACH: Final = 8


def contacts_with(
    segments: FloatArray, boundary: Outline | Mesh, budget: Budget, blur: float = 0.0
) -> tuple[IntArray, FlagArray, IntArray]:
    """Return (met, kinds, offsets) for segments (n <= GROUP, 2, dim): the elements that each meets or may meet, segment
    by segment; the `Kind` or code of each contact; and the offsets (n + 1,) of segments. blur: error of each coordinate
    of the segments, 0.0 in the plane."""
    is_flat = not isinstance(boundary, Mesh)
    kernel: Any = find_contacts_2d if is_flat else find_contacts_3d
    read = (segments, boundary) if is_flat else (segments, boundary, blur)
    room, n_contacts = _LEAST_CONTACTS + _EACH * len(segments), NO_ROOM
    met, kinds, offsets = np.zeros(0, np.int64), np.zeros(0, np.uint8), np.zeros(0, np.int64)
    while n_contacts == NO_ROOM:  # bound: room is doubled, and a segment meets an element once
        n_contacts, met, kinds, offsets = entry_of(kernel)(*read, budget.flag, room)
        budget.check()
        room *= 2
    return met[:n_contacts], kinds[:n_contacts], offsets[: len(segments) + 1]
