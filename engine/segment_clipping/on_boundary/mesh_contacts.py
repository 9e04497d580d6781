"""Contacts of a segment with the triangles of a mesh: one traversal for clipping and for scenes.

The segment descends a tree of boxes (descent.py). Blocks of triangles that it reaches are queued, and so are the
triangles that `near_triangles` leaves of them, so that their cache lines are fetched together. A filter, then exact
signs decide each triangle.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.compiling.jit import allocating, allocating_kernel, called, entry_of, inline
from engine.lanes.boxes import EMPTY
from engine.lanes.faces import near_triangles
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
from engine.segment_clipping.on_boundary.descent import (
    allocate_descent,
    begin_descent,
    descend,
    local_segment,
    segment_before,
    shear_of,
)
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, Outline
from engine.segment_clipping.on_boundary.triangle_contacts import corner, triangle_contact
from engine.types import FlagArray, FloatArray, IntArray, Point3

_ROOM: Final = 512
"""Capacity of the queues of blocks, and of triangles."""

Waiting = namedtuple("Waiting", "descent blocks triangles")
"""Scratch of one traversal: its `Descent`; blocks, triangles: int64, at least 2 * LANES each."""


@allocating
def traversal_buffers() -> Waiting:
    """Allocate the scratch of one traversal."""
    return Waiting(allocate_descent(), np.empty(_ROOM, np.int64), np.empty(_ROOM, np.int64))


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
    """Append the contacts of a segment with the triangles of n leaves, queued in `waiting`, to met (elements) and
    kinds, after the n_met there; return their number then, or NO_ROOM. ends: (p, q, blur, is_before); shear: `shear_of`
    the segment; is_any: one contact is enough, in row 0."""
    (i, j, k), place, r, s, reach, slack = shear
    n_waiting = 0
    for turn in range(n):
        block = waiting.blocks[turn] - mesh.n_inner
        bits = near_triangles(mesh.corners, block, i, j, k, place, r, s, reach, slack)
        while bits != 0:
            below = mesh.child[waiting.blocks[turn], lowest_bit(bits)]
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
    if is_before:
        way = segment_before(p, q, mesh.origin, mesh.inverse, blur)
    else:
        way = local_segment(p, q, mesh.origin, mesh.inverse, blur)
    shear, ends, is_over = shear_of(way), (p, q, blur, is_before), False
    if way.is_near:
        begin_descent(waiting.descent)
    while way.is_near and not is_over:  # bound: each turn takes a leaf
        n_blocks = descend(mesh, way, False, np.float32(1.0), waiting.descent, waiting.blocks)
        n_met = _append_blocks(mesh, ends, shear, is_any, waiting, n_blocks, met, kinds, n_met)
        is_over = n_blocks == 0 or is_answered(is_any, n_met, kinds)
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
