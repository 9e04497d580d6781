"""Traversal of a tree of boxes: the bodies near a segment or a box; compiled. In the plane z is 0.

Also the work space of one segment in a scene, cached per thread: one array with named parts.
"""

from __future__ import annotations

import threading
from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.bounding.bvh import STACK, WIDTH
from engine.compiling.jit import inline, kernel, merged
from engine.lanes.boxes import BOX_ROWS, EMPTY, inside_box
from engine.lanes.faces import CORNER_ROWS
from engine.lanes.lanes import array_at, lowest_bit
from engine.lanes.tracing import LANES
from engine.segment_clipping.on_boundary.boundary_cut import Crossings
from engine.segment_clipping.on_boundary.descent import Descent, Way, begin_descent, far_end, local_segment, next_leaf
from engine.segment_clipping.on_boundary.triangle_contacts import corner
from engine.segment_clipping.pieces import Pieces, point_of
from engine.types import FlagArray, FloatArray, Int32Array, IntArray, Point3

MOST_MET: Final = 512
"""Most triangles of one body that a segment may cross; with more it is UNDECIDED."""

_here: Final = threading.local()
_MOST_CACHED: Final = 1 << 14
"""Most bodies for which a thread caches its work space: some 800 kB."""

Scratch = namedtuple("Scratch", "inner cuts room outer best hit n_listed near")
"""Work space of one segment.

| field | meaning |
|---|---|
| inner, cuts | for one body: descent of its tree, its `Crossings` |
| room | the pieces in one body; the last row is the first piece of all bodies |
| outer | descent of the tree over bodies |
| best, hit | start of the first piece; its body, and 1 if another may begin there too |
| n_listed | number of bodies outside the tree still to be tested |
| near | result: bodies |
"""
_SIZES: Final = (
    STACK // 2, MOST_MET, MOST_MET, 3 * MOST_MET, MOST_MET, MOST_MET, MOST_MET + 1, 6 * MOST_MET + 6, 2 * MOST_MET + 2,
    2 * MOST_MET + 2, STACK // 2, STACK // 2, WIDTH // 2, 1, 2, 5, MOST_MET, STACK // 2,
)  # fmt: skip
"""Sizes of the arrays of a `Scratch` in 8-byte words, in order, without `near`."""
_AT: Final = tuple(8 * (2 + sum(_SIZES[:k])) for k in range(len(_SIZES) + 1))
"""Byte offsets of these arrays."""


def scratch_for(n_bodies: int) -> IntArray:
    """Return the work space of one segment in a scene of n_bodies, one array that `scratch_at` reads; cached per
    thread."""
    scratch: IntArray | None = getattr(_here, "scratch", None)
    if scratch is None or scratch[1] <= n_bodies:
        scratch = np.empty(_AT[-1] // 8 + n_bodies + 1, np.int64)
        scratch[:2] = scratch.ctypes.data, n_bodies + 1
        if n_bodies <= _MOST_CACHED:
            _here.scratch = scratch
    return scratch


@merged
def scratch_at(words: IntArray) -> Scratch:
    """Return the arrays of a `Scratch` as views, from the array of `scratch_for`."""
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
    stack, keys = array_at(at + _AT[0], (STACK,), np.int32), array_at(at + _AT[17], (STACK,), np.float32)
    waiting, their_keys = array_at(at + _AT[10], (STACK,), np.int32), array_at(at + _AT[11], (STACK,), np.float32)
    entered, counts = array_at(at + _AT[12], (1, WIDTH), np.float32), array_at(at + _AT[15], (5,), np.int64)
    return Scratch(
        Descent(stack, keys, entered, counts[:1], counts[1:2]), cuts, room,
        Descent(waiting, their_keys, entered, counts[2:3], counts[3:4]),
        array_at(at + _AT[13], (1,), np.float64), array_at(at + _AT[14], (2,), np.int64), counts[4:],
        array_at(at + _AT[18], (words[1],), np.int64),
    )  # fmt: skip


BodyTree = namedtuple("BodyTree", "low high tree inverse bounded listed")
"""A tree over bodies. low, high (n, dimension): their boxes, infinite for unbounded ones; tree, inverse: a `Bvh` over
the bounded ones, if there are enough, and 1 / its scale; bounded: the body of each item; listed: bodies tested one by
one."""
_Nodes = namedtuple("_Nodes", "boxes child origin n_inner corners")
"""The tree of a `BodyTree` as `next_leaf` reads it: all nodes are inner ones."""
Where = namedtuple("Where", "together moved names")
"""Positions of the bodies of a scene. together: the `BodyTree` of all n as first placed; moved: that of the moved ones,
numbered from n on; names: the indices of the moved ones in the scene, ascending."""
N_BODIES, LOW, HIGH, N_NODES, BOXES, CHILD, BOUNDED, N_LISTED, LISTED, NUMBERS, NAMES, PLACED = range(12)
"""Columns of a `BodyTree` encoded as a row of integers, sizes and addresses: one argument instead of a hundred.
NUMBERS: address of (4,), inverse and origin. NAMES: of (n,), indices of moved bodies. PLACED: of the rows of their
`Table`."""
_MOST_WAY: Final = 2.0**1000
_FAR: Final = 2.0**38
"""Size in tree coordinates from which a line is compared with the box of each body."""
_SLACK: Final = 2.0**-20
"""Enlargement of a box in tree coordinates (at most 2 where it matters) that covers its rounding to float32."""


@inline
def place_in(names: IntArray, body: int) -> int:
    """Return the index of a body in ascending ``names`` by binary search, -1 if absent."""
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
    """Return the `BodyTree` encoded in a row of integers by `words_of`."""
    n, numbers = row[N_BODIES], array_at(row[NUMBERS], (4,), np.float64)
    boxes = array_at(row[BOXES], (row[N_NODES], BOX_ROWS, WIDTH), np.float32)
    child = array_at(row[CHILD], (row[N_NODES], WIDTH), np.int32)
    low, high = array_at(row[LOW], (n, dimension), np.float64), array_at(row[HIGH], (n, dimension), np.float64)
    bounded, listed = array_at(row[BOUNDED], (n,), np.int64), array_at(row[LISTED], (row[N_LISTED],), np.int64)
    origin: Any = numbers[1], numbers[2], numbers[3]
    tree = _Nodes(boxes, child, origin, row[N_NODES], array_at(0, (0, CORNER_ROWS, LANES), np.float32))
    return BodyTree(low, high, tree, numbers[0], bounded, listed)


@inline
def name_in(words: IntArray, body: int) -> int:
    """Return the index in the scene of body number ``body`` of kernels, which number moved bodies from n on. words:
    both rows of `words_of`."""
    n, m = words[0, N_BODIES], words[1, N_BODIES]
    return body if body < n else array_at(words[1, NAMES], (m,), np.int64)[body - n]


@inline
def has_moved(words: IntArray, body: int) -> bool:
    """Return whether body ``body`` < n has been moved, so that its first placement no longer counts. words: both rows
    of `words_of`."""
    m = words[1, N_BODIES]
    return m > 0 and place_in(array_at(words[1, NAMES], (m,), np.int64), body) >= 0


@inline
def way_of(segments: FloatArray, item: int, bodies: BodyTree) -> Way:
    """Return segment ``item`` in the coordinates of a tree."""
    is_flat = segments.shape[2] == 2
    px, py, pz = point_of(segments, item, 0, is_flat)
    qx, qy, qz = point_of(segments, item, 1, is_flat)
    inverse = bodies.inverse, bodies.inverse, bodies.inverse
    return local_segment(Point3(px, py, pz), Point3(qx, qy, qz), bodies.tree.origin, inverse, 0.0)


@inline
def begin_way(bodies: BodyTree, way: Way, scratch: Scratch) -> None:
    """Initialise `scratch` for the traversal of a tree along a segment."""
    begin_descent(scratch.outer)
    scratch.outer.depth[0], scratch.n_listed[0] = way.is_near, bodies.listed.size


@inline
def way_of_line(lines: FloatArray, item: int, is_ray: bool, bodies: BodyTree) -> tuple[Way, bool]:
    """Return line ``item``, two ends or the start and direction of a ray, in the coordinates of a tree, a ray as far as
    it may meet a box; and whether these are small enough for a `Way`."""
    x, origin, (p, q) = bodies.inverse, bodies.tree.origin, (corner(lines, item, 0), corner(lines, item, 1))
    start = Point3(p.x * x - origin[0] * x, p.y * x - origin[1] * x, p.z * x - origin[2] * x)
    way = Point3(q.x * x, q.y * x, q.z * x)
    if not is_ray:
        way = Point3(way.x - p.x * x, way.y - p.y * x, way.z - p.z * x)
    far = far_end(start, way, is_ray)
    sizes = abs(start.x) + abs(start.y) + abs(start.z), abs(far.x) + abs(far.y) + abs(far.z)  # sums: NaN stays
    is_small = sizes[0] < _FAR and sizes[1] < 2.0 * _FAR
    return local_segment(start, far, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 0.0), is_small


@inline
def next_body(
    lines: FloatArray, item: int, is_ray: bool, bodies: BodyTree, way: Way, last: float, scratch: Scratch
) -> int:
    """Return the next body whose box a segment, or ray, may enter before parameter `last`, roughly in order of entry,
    continuing the traversal of `begin_way`; -1 if there is no more."""
    leaf = next_leaf(bodies.tree, way, last, scratch.outer)
    if leaf != EMPTY:
        return bodies.bounded[-1 - leaf]
    while scratch.n_listed[0] > 0:
        scratch.n_listed[0] -= 1
        body = bodies.listed[scratch.n_listed[0]]
        if _in_its_box(lines, item, is_ray, bodies, body):
            return body
    return -1


@inline
def near_bodies(segments: FloatArray, item: int, words: IntArray, room: IntArray) -> int:
    """Fill scratch.near with the numbers of the bodies whose boxes a segment may meet; return how many. words: both
    rows of `words_of`. room: of `scratch_for`."""
    scratch, n_near = scratch_at(room), 0
    for side in range(1 + (words[1, N_BODIES] > 0)):
        bodies, n_before = tree_in(words[side], segments.shape[2]), side * words[0, N_BODIES]
        way = way_of(segments, item, bodies)
        begin_way(bodies, way, scratch)
        body = next_body(segments, item, False, bodies, way, np.float32(1.0), scratch)
        while body >= 0:
            scratch.near[n_near] = n_before + body
            n_near += side == 1 or not has_moved(words, body)
            body = next_body(segments, item, False, bodies, way, np.float32(1.0), scratch)
    return n_near


@inline
def _in_its_box(lines: FloatArray, item: int, is_ray: bool, bodies: BodyTree, body: int) -> bool:
    """Return whether a segment, or ray, may meet the box of a body (slab test, in doubles). (box - start) / way is off
    by 4 units of rounding on each axis, or 2^-1074 on underflow; differences beyond `_MOST_WAY`, which may be infinite,
    decide nothing."""
    meet, enters, leaves = True, 0.0, np.inf if is_ray else 1.0
    for k in range(lines.shape[2]):
        start, end = lines[item, 0, k], lines[item, 1, k]
        low, high, way = bodies.low[body, k], bodies.high[body, k], end if is_ray else end - start
        if is_ray:
            end = start if way == 0.0 else np.inf if way > 0.0 else -np.inf
        meet &= (min(start, end) <= high) & (max(start, end) >= low)
        if way != 0.0 and abs(way) <= _MOST_WAY:
            first, second = (low - start) / way, (high - start) / way
            enters, leaves = max(enters, min(first, second)), min(leaves, max(first, second))
    return meet and not enters > leaves + 2.0**-48 * (abs(enters) + abs(leaves)) + 2.0**-1000


@kernel
def near_pairs(
    lines: FloatArray, is_ray: bool, words: IntArray, room: IntArray, stop: FlagArray, pairs: IntArray, n: IntArray
) -> None:
    """Fill pairs (k, 2) with each line (m, 2, 3), from number n[0] on, and the bodies whose boxes it may meet, as
    kernels number them; n (2,) is on return the next line, fewer than m if there is no room, and the number of pairs.
    words: both rows of `words_of`. room: of `scratch_for`. Caller guarantees room for one line and every body."""
    scratch, n_all, n[1] = scratch_at(room), words[0, N_BODIES] + words[1, N_BODIES], 0
    for item in range(n[0], lines.shape[0]):
        n[0] = item
        if stop[0] or n[1] + n_all > pairs.shape[0]:
            return
        for side in range(1 + (words[1, N_BODIES] > 0)):
            bodies, n_before = tree_in(words[side], 3), side * words[0, N_BODIES]
            way, is_small = way_of_line(lines, item, is_ray, bodies)
            begin_way(bodies, way, scratch)
            for turn in range(words[side, N_BODIES]):  # bound: each body once
                body = next_body(lines, item, is_ray, bodies, way, np.float32(1.0), scratch) if is_small else turn
                if body < 0:
                    break
                is_near = is_small or _in_its_box(lines, item, is_ray, bodies, body)
                if is_near and (side == 1 or not has_moved(words, body)):
                    pairs[n[1], 0], pairs[n[1], 1] = item, n_before + body
                    n[1] += 1
    n[0] = lines.shape[0]


@inline
def bodies_in(low: FloatArray, high: FloatArray, where: Where, stack: Int32Array, hits: IntArray) -> int:
    """Fill `hits` with the numbers of the bodies whose boxes intersect the box low .. high (dim,), maybe infinite
    (broad phase); return how many. stack: scratch."""
    n_hits, names = _of_box(low, high, where.together, 0, where.names, stack, hits, 0), where.names
    if names.size > 0:
        n_hits = _of_box(low, high, where.moved, where.together.low.shape[0], names[:0], stack, hits, n_hits)
    return n_hits


@inline
def _is_met(low: FloatArray, high: FloatArray, bodies: BodyTree, body: int, left_out: IntArray) -> bool:
    """Return whether the box low .. high intersects that of a body, and the body is not among those left out
    (ascending)."""
    meet = True
    for k in range(low.size):
        meet &= (low[k] <= bodies.high[body, k]) & (high[k] >= bodies.low[body, k])
    return meet and place_in(left_out, body) < 0


@inline
def _local(value: float, inverse: float, way: float) -> Any:
    """Return value * inverse, a coordinate in a tree's scale, as float32 enlarged outward: up for way 1.0, down for
    -1.0."""
    return np.float32(value * inverse + way * _SLACK)


@inline
def _of_box(
    low: FloatArray, high: FloatArray, bodies: BodyTree, n_before: int, left_out: IntArray, stack: Int32Array,
    hits: IntArray, n_hits: int,
) -> int:  # fmt: skip
    """Append to the n_hits `hits` the number n_before + i of each body i of a `BodyTree` whose box intersects low ..
    high; return their number then. left_out: ascending bodies to skip. stack: scratch."""
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
                hits[n_hits] = n_before + body
                n_hits += _is_met(low, high, bodies, body, left_out)
    for body in bodies.listed:
        hits[n_hits] = n_before + body
        n_hits += _is_met(low, high, bodies, body, left_out)
    return n_hits


@kernel
def put_keys(segments: Any, t: float, bodies: Any, keys: Any) -> None:
    """Set keys (n,) to Morton codes, 32 cells an axis, of points at parameter t of segments, in coordinates of a
    `BodyTree` (G. M. Morton, 1966)."""
    origin, inverse = bodies.tree.origin, bodies.inverse
    for item in range(segments.shape[0]):
        key = 0
        for k in range(segments.shape[2]):
            x = segments[item, 0, k] * (1.0 - t) + segments[item, 1, k] * t
            cell = int(min(max(8.0 * (x - origin[k]) * inverse + 16.0, 0.0), 31.0))
            for bit in range(5):
                key |= ((cell >> bit) & 1) << (3 * bit + k)
        keys[item] = key
