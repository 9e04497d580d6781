"""Which bodies of a tree of boxes does a segment, or a box, come near; compiled. In the plane z is 0.

Room for the work on one segment at a time in a scene, kept by each thread: one array, whose parts have names.
"""

from __future__ import annotations

import threading
from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.bounding.bvh import STACK, WIDTH, Bvh
from engine.compiling.jit import inline, kernel, merged
from engine.lanes.boxes import BOX_ROWS, EMPTY, enter_boxes, inside_box
from engine.lanes.lanes import array_at, lowest_bit
from engine.segment_clipping.on_boundary.boundary_cut import Crossings
from engine.segment_clipping.on_boundary.mesh_contacts import Way, local_segment
from engine.segment_clipping.pieces import Pieces, point_of
from engine.types import FloatArray, Int32Array, IntArray, Point3

MOST_MET: Final = 512
"""Triangles that a segment crosses; with more it is UNDECIDED."""

_here: Final = threading.local()
_MOST_KEPT: Final = 1 << 14
"""Bodies of a scene whose room is kept: some 800 kB a thread."""

Scratch = namedtuple("Scratch", "stack cuts room waiting keys entered best found depths near")
"""Room for the work on one segment. stack: of one body, cuts: its `Crossings`, room: its pieces, the
last row for the first of them all. waiting, keys: nodes and bodies to be asked, and where they are entered; entered
(1, 8), of one node. best: where the first piece begins; found: the body it lies in, and whether another may begin there
too. depths: how many nodes and bodies of a tree wait, and how many of those without a place in it. near: bodies."""
_SIZES: Final = (
    STACK // 2, MOST_MET, MOST_MET, 3 * MOST_MET, MOST_MET, MOST_MET, MOST_MET + 1, 6 * MOST_MET + 6, 2 * MOST_MET + 2,
    2 * MOST_MET + 2, STACK // 2, STACK // 2, WIDTH // 2, 1, 2, 2, MOST_MET,
)  # fmt: skip
"""Words of the arrays of a `Scratch`, in order, but for `near`."""
_AT: Final = tuple(8 * (2 + sum(_SIZES[:k])) for k in range(len(_SIZES) + 1))
"""Where these begin, in bytes."""


def scratch_for(n_bodies: int) -> IntArray:
    """Return room for the work on one segment at a time (`scratch_at`); each thread keeps its own."""
    found: IntArray | None = getattr(_here, "scratch", None)
    if found is None or found[1] <= n_bodies:
        found = np.empty(_AT[-1] // 8 + n_bodies + 1, np.int64)
        found[:2] = found.ctypes.data, n_bodies + 1
        if n_bodies <= _MOST_KEPT:
            _here.scratch = found
    return found


@merged
def scratch_at(words: IntArray) -> Scratch:
    """Return the arrays that `scratch_for` has room for."""
    at, m = words[0], MOST_MET
    cuts = Crossings(
        array_at(at + _AT[2], (m,), np.float64), array_at(at + _AT[3], (m, 3), np.float64),
        array_at(at + _AT[4], (m,), np.int64), array_at(at + _AT[5], (m,), np.int64),
        array_at(at + _AT[16], (m,), np.int64), array_at(at + _AT[1], (m,), np.int64),
    )  # fmt: skip
    room = Pieces(
        array_at(at + _AT[6], (m + 1,), np.int64), array_at(at + _AT[7], (2, m + 1, 3), np.float64),
        array_at(at + _AT[8], (m + 1, 2), np.float64), array_at(at + _AT[9], (m + 1, 2), np.int64),
    )  # fmt: skip
    return Scratch(
        array_at(at + _AT[0], (STACK,), np.int32), cuts, room,
        array_at(at + _AT[10], (STACK,), np.int32), array_at(at + _AT[11], (STACK,), np.float32),
        array_at(at + _AT[12], (1, WIDTH), np.float32), array_at(at + _AT[13], (1,), np.float64),
        array_at(at + _AT[14], (2,), np.int64), array_at(at + _AT[15], (2,), np.int64),
        array_at(at + _AT[17], (words[1],), np.int64),
    )  # fmt: skip


BodyTree = namedtuple("BodyTree", "low high tree inverse bounded listed")
"""The boxes of bodies, low and high (n, dimension), infinite where they may have no bounds; a `Bvh` over those that are
bounded, where they are not few, 1 / its scale, and which body is where in it; the others, looked at one by one."""
Where = namedtuple("Where", "together moved names")
"""Where the bodies of a scene are: the `BodyTree` of n of them together, and of those that moved since, which count
from n on; what these are called in the scene, ascending."""
N_BODIES, LOW, HIGH, N_NODES, BOXES, CHILD, BOUNDED, N_LISTED, LISTED, NUMBERS, NAMES, PLACED = range(12)
"""What stands of a `BodyTree` in a row of whole numbers, sizes and addresses: one is handed on where it would be a
hundred numbers. NUMBERS: of (4,), inverse and origin. NAMES: of (n,), what moved bodies are called. PLACED: of the
rows of their `Table`."""
_MOST_WAY: Final = 2.0**1000
_SLACK: Final = 2.0**-20
"""By how much a box in the tree's coordinates, at most 2 where it matters, is widened for its rounding to float32."""


@inline
def place_in(names: IntArray, body: int) -> int:
    """Return where a body stands among names, which ascend; -1 where it does not."""
    low, high = 0, names.size
    while low < high:  # bound: halved each turn
        middle = (low + high) // 2
        if names[middle] < body:
            low = middle + 1
        else:
            high = middle
    return low if low < names.size and names[low] == body else -1


@merged
def tree_in(row: IntArray, dimension: int) -> BodyTree:
    """Return the `BodyTree` of a row."""
    n, numbers = row[N_BODIES], array_at(row[NUMBERS], (4,), np.float64)
    boxes = array_at(row[BOXES], (row[N_NODES], BOX_ROWS, WIDTH), np.float32)
    child = array_at(row[CHILD], (row[N_NODES], WIDTH), np.int32)
    low, high = array_at(row[LOW], (n, dimension), np.float64), array_at(row[HIGH], (n, dimension), np.float64)
    bounded, listed = array_at(row[BOUNDED], (n,), np.int64), array_at(row[LISTED], (row[N_LISTED],), np.int64)
    origin: Any = numbers[1], numbers[2], numbers[3]
    return BodyTree(low, high, Bvh(boxes, child, origin, 1.0), numbers[0], bounded, listed)


@inline
def name_in(words: IntArray, body: int) -> int:
    """Return what a body, of which those that moved count from n on, is called in the scene."""
    n, m = words[0, N_BODIES], words[1, N_BODIES]
    return body if body < n else array_at(words[1, NAMES], (m,), np.int64)[body - n]


@inline
def has_moved(words: IntArray, body: int) -> bool:
    """Tell whether one of all bodies stands elsewhere by now."""
    m = words[1, N_BODIES]
    return m > 0 and place_in(array_at(words[1, NAMES], (m,), np.int64), body) >= 0


@inline
def way_of(segments: FloatArray, item: int, bodies: BodyTree) -> Way:
    """Return a segment in the coordinates of a tree."""
    is_flat = segments.shape[2] == 2
    px, py, pz = point_of(segments, item, 0, is_flat)
    qx, qy, qz = point_of(segments, item, 1, is_flat)
    return local_segment(Point3(px, py, pz), Point3(qx, qy, qz), bodies.tree.origin, bodies.inverse, 0.0)


@inline
def begin_way(bodies: BodyTree, way: Way, scratch: Scratch) -> None:
    """Begin to look for the bodies of a tree that a segment may meet."""
    scratch.waiting[0], scratch.keys[0], scratch.depths[0], scratch.depths[1] = 0, -1.0, way.is_near, bodies.listed.size


@inline
def next_body(segments: FloatArray, item: int, bodies: BodyTree, way: Way, last: float, scratch: Scratch) -> int:
    """Return the next body whose box a segment may enter before `last`, about the nearest; -1 where there is none."""
    depths = scratch.depths
    while depths[0] > 0:  # bound: each node, and each body, waits once
        depths[0] -= 1
        node = scratch.waiting[depths[0]]
        if scratch.keys[depths[0]] > last:
            continue
        if node < 0:
            return bodies.bounded[-1 - node]
        depths[0] = _open_node(bodies.tree, node, way, last, scratch, depths[0])
    while depths[1] > 0:
        depths[1] -= 1
        body = bodies.listed[depths[1]]
        if _in_its_box(segments, item, bodies, body):
            return body
    return -1


@inline
def near_bodies(segments: FloatArray, item: int, words: IntArray, room: IntArray) -> int:
    """Fill scratch.near with the bodies that a segment may meet; return how many."""
    scratch, n_found = scratch_at(room), 0
    for side in range(1 + (words[1, N_BODIES] > 0)):
        bodies, n_before = tree_in(words[side], segments.shape[2]), side * words[0, N_BODIES]
        way = way_of(segments, item, bodies)
        begin_way(bodies, way, scratch)
        body = next_body(segments, item, bodies, way, np.float32(1.0), scratch)
        while body >= 0:
            scratch.near[n_found] = n_before + body
            n_found += side == 1 or not has_moved(words, body)
            body = next_body(segments, item, bodies, way, np.float32(1.0), scratch)
    return n_found


@inline
def _in_its_box(segments: FloatArray, item: int, bodies: BodyTree, body: int) -> bool:
    """Tell whether a segment may meet the box of a body: (box - start) / (end - start) loses 4 units of rounding along
    each axis, or 2^-1074 where it underflows; differences beyond `_MOST_WAY`, which may be infinite, say nothing."""
    meet, enters, leaves = True, 0.0, 1.0
    for k in range(segments.shape[2]):
        start, end = segments[item, 0, k], segments[item, 1, k]
        low, high = bodies.low[body, k], bodies.high[body, k]
        meet &= (min(start, end) <= high) & (max(start, end) >= low)
        way = end - start
        if way != 0.0 and abs(way) <= _MOST_WAY:
            first, second = (low - start) / way, (high - start) / way
            enters, leaves = max(enters, min(first, second)), min(leaves, max(first, second))
    return meet and not enters > leaves + 2.0**-48 * (abs(enters) + abs(leaves)) + 2.0**-1000


@inline
def _open_node(tree: Bvh, node: int, way: Way, last: float, scratch: Scratch, depth: int) -> int:
    """Put what a node of a tree names, and a segment enters before `last`, on scratch.waiting from `depth` on, the
    nearest last; return where it ends."""
    waiting, keys, least, nearest = scratch.waiting, scratch.keys, np.float32(np.inf), depth
    bits = enter_boxes(tree.boxes, node, way.middle, way.inverse, way.slack, last, scratch.entered)
    while bits != 0:
        lane = lowest_bit(bits)
        bits &= bits - 1
        waiting[depth], keys[depth] = tree.child[node, lane], scratch.entered[0, lane]
        nearest, least = depth if keys[depth] < least else nearest, min(keys[depth], least)
        depth += waiting[depth] != EMPTY
    if depth > nearest:
        last = depth - 1
        waiting[last], waiting[nearest] = waiting[nearest], waiting[last]
        keys[last], keys[nearest] = keys[nearest], keys[last]
    return depth


@inline
def bodies_in(low: FloatArray, high: FloatArray, where: Where, stack: Int32Array, found: IntArray) -> int:
    """Fill `found` with the bodies of a `Where` whose boxes a box (dim,) meets, which may be infinite; return how
    many."""
    n_found, names = _of_box(low, high, where.together, 0, where.names, stack, found, 0), where.names
    if names.size > 0:
        n_found = _of_box(low, high, where.moved, where.together.low.shape[0], names[:0], stack, found, n_found)
    return n_found


@inline
def _is_met(low: FloatArray, high: FloatArray, bodies: BodyTree, body: int, left_out: IntArray) -> bool:
    """Tell whether a box meets that of a body which is not among those left out."""
    meet = True
    for k in range(low.size):
        meet &= (low[k] <= bodies.high[body, k]) & (high[k] >= bodies.low[body, k])
    return meet and place_in(left_out, body) < 0


@inline
def _local(value: float, inverse: float, way: float) -> Any:
    return np.float32(value * inverse + way * _SLACK)


@inline
def _of_box(
    low: FloatArray, high: FloatArray, bodies: BodyTree, n_before: int, left_out: IntArray, stack: Int32Array,
    found: IntArray, n_found: int,
) -> int:  # fmt: skip
    """Fill `found` from n_found on with the bodies of a `BodyTree` whose boxes a box meets, and that are not left out;
    return where they end."""
    tree, inverse, depth, stack[0] = bodies.tree, bodies.inverse, 1, 0
    is_flat, x, y, z = low.size == 2, tree.origin[0], tree.origin[1], tree.origin[2]
    bottom, top = (0.0 if is_flat else low[2]) - z, (0.0 if is_flat else high[2]) - z
    least = _local(low[0] - x, inverse, -1.0), _local(low[1] - y, inverse, -1.0), _local(bottom, inverse, -1.0)
    most = _local(high[0] - x, inverse, 1.0), _local(high[1] - y, inverse, 1.0), _local(top, inverse, 1.0)
    while depth > 0:  # bound: each node enters the stack once
        depth -= 1
        node = stack[depth]
        bits = inside_box(tree.boxes, node, least, most)
        while bits != 0:
            below = tree.child[node, lowest_bit(bits)]
            bits &= bits - 1
            if below >= 0:
                stack[depth] = below
                depth += 1
            elif below != EMPTY:
                body = bodies.bounded[-1 - below]
                found[n_found] = n_before + body
                n_found += _is_met(low, high, bodies, body, left_out)
    for body in bodies.listed:
        found[n_found] = n_before + body
        n_found += _is_met(low, high, bodies, body, left_out)
    return n_found


@kernel
def put_keys(segments: Any, t: float, bodies: Any, keys: Any) -> None:
    """Set keys (n,) to the cells of a tree, 32 along each axis, in which segments are at t, in the order of G. M.
    Morton, 1966."""
    origin, inverse = bodies.tree.origin, bodies.inverse
    for item in range(segments.shape[0]):
        key = 0
        for k in range(segments.shape[2]):
            x = segments[item, 0, k] * (1.0 - t) + segments[item, 1, k] * t
            cell = int(min(max(8.0 * (x - origin[k]) * inverse + 16.0, 0.0), 31.0))
            for bit in range(5):
                key |= ((cell >> bit) & 1) << (3 * bit + k)
        keys[item] = key
