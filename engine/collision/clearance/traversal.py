"""The pairs of triangles of two placed bodies that may be the nearest, by a best-first descent of both trees.

A pair of boxes is bounded from below along eight axes: those of either box, whose gaps are also put together, the line
of the two centres, and that of the nearest pair so far. Pairs wait in a heap, the least bound first; the larger box of
a pair is opened. Triangles are bounded from both sides (near_triangles.py); the least upper bound so far ends the
search once no pair that waits is below it. Now and then each body alone is asked what of it reaches far enough along
that line to be nearer: where that is little, it is measured and nothing is left. What is returned are all pairs of
triangles whose lower bound does not exceed the least upper bound: the distance of the bodies is that of one of them.

**Bounds.** All numbers are those of the two bodies under poses that `place_pair` moved together, times a power of two
that brings them near 1. A box is the image of eight corners under its body's matrix R, its centre c, so that for any
direction d the interval of d . x over it is d . c -+ sum |d . R_k| h_k; a gap between two intervals, over |d|, is below
the distance. `defect` bounds |R' R - I|: |d| of the axes, and the length of three gaps as that of one vector, are off
by less than twice it. Everything else is rounding: `margin`.

Source: G. Hjaltason, H. Samet, Incremental distance join algorithms for spatial databases, 1998 (the order); E. Larsen,
S. Gottschalk, M. Lin, D. Manocha, Fast distance queries with rectangular swept sphere volumes, 2000 (the descent).
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.collision.clearance.near_triangles import nearest_points, rounding_of, seen_from, slab
from engine.collision.meshes.frames import defect_of
from engine.collision.meshes.mesh_arrays import MeshArrays, triangle_of
from engine.collision.meshes.placement import Placement, PoseArrays, place_pair, placed, turned, turned_back
from engine.collision.meshes.triangle_triangle import Triangle3
from engine.jit import bare_kernel, inline, merged
from engine.lanes.boxes import EMPTY
from engine.lanes.tracing import LANES
from engine.predicates.vectors import dot, largest_of, length, minus
from engine.types import Point3

DONE: Final = 0
FULL: Final = 1
CLOSER: Final = 2
INTERRUPTED: Final = 3
"""How a search ended: with all pairs; without room for more pairs of boxes or triangles; with two points nearer than
asked; by the flag."""

MOST_LISTED: Final = 64
MOST_STEPS: Final = 8
"""Blocks of either body that are measured in all pairs; steps of the first approach."""
ROOT: Final = -1
"""In place of a lane: the whole tree."""
_BOX_ROUNDING: Final = 2.0**-44
"""Of the size of both bodies: what 40 roundings of sums and products of coordinates may come to."""


_BELOW_ONE: Final = 1.0 - 2.0**-50


class View(NamedTuple):
    """A body as the search sees it: its mesh, where it is, and the power of two that its numbers are taken times."""

    mesh: MeshArrays
    place: Placement
    unit: float


class Frame(NamedTuple):
    """From the tree of the second body to the axes of the first: x' = columns x + shift, and what bounds allow for."""

    x: Point3
    y: Point3
    z: Point3
    """Rows of R_a' R_b."""
    shift: Point3
    shrink: float
    """What a length in the axes of a body is at least of that in space."""
    margin: float


class Heap(NamedTuple):
    """Pairs of boxes that wait, the least bound first: bounds (room,), lanes (room, 2) int64, eight a node, or ROOT."""

    bounds: Any
    lanes: Any


class Candidates(NamedTuple):
    """Pairs of triangles: pairs (room, 4) int64, two triangles and two features; bounds (room,) float64 from below."""

    pairs: Any
    bounds: Any


class Room(NamedTuple):
    """Work space of searches, one at a time.

    line (12,): the direction of the nearest pair so far, not longer than 1, in the axes of both bodies and in space;
    where the two origins are along it; how often it turned. corners (2, 8, 3, 3), reaches (2, 8): of the triangles of
    two blocks, and how far they reach along the line. kept (n_nodes, 4): of either body the turn at which
    `_block_reach` was found, and it. waiting (n_nodes,), listed (2, MOST_LISTED): nodes of one body.
    """

    heap: Heap
    found: Candidates
    line: Any
    corners: Any
    reaches: Any
    kept: Any
    waiting: Any
    listed: Any


def new_room(room: int, n_nodes: int) -> Room:
    """Return work space for so many pairs, and trees of so many nodes."""
    return Room(
        Heap(np.empty(room), np.empty((room, 2), np.int64)),
        Candidates(np.empty((room, 4), np.int64), np.empty(room)),
        np.zeros(12),
        np.empty((2, LANES, 3, 3)),
        np.empty((2, LANES)),
        np.zeros((n_nodes, 4)),
        np.empty(n_nodes, np.int32),
        np.empty((2, MOST_LISTED), np.int32),
    )


class Search(NamedTuple):
    """One question: both bodies, the map between them, bound on the distance of a point from its rounded one (both
    bodies together), and work space."""

    a: View
    b: View
    frame: Frame
    error: float
    room: Room


@inline
def _frame_of(a: View, b: View) -> Frame:
    """Return the map between two trees."""
    p, q = a.place, b.place
    x, y, z = Point3(1.0, 0.0, 0.0), Point3(0.0, 1.0, 0.0), Point3(0.0, 0.0, 1.0)
    u, v, w = turned_back(p, turned(q, x)), turned_back(p, turned(q, y)), turned_back(p, turned(q, z))
    origin, other = a.mesh.origin, b.mesh.origin
    there = turned(q, Point3(other[0] * b.unit, other[1] * b.unit, other[2] * b.unit))
    moved = Point3((q.x - p.x) * a.unit, (q.y - p.y) * a.unit, (q.z - p.z) * a.unit)
    t = turned_back(p, Point3(there.x + moved.x, there.y + moved.y, there.z + moved.z))
    shift = Point3(t.x - origin[0] * a.unit, t.y - origin[1] * a.unit, t.z - origin[2] * a.unit)
    size = 4.0 * (a.mesh.extent.reach * a.unit + b.mesh.extent.reach * b.unit) + 2.0 * largest_of(moved)
    defect = defect_of(p) + defect_of(q)
    return Frame(
        Point3(u.x, v.x, w.x), Point3(u.y, v.y, w.y), Point3(u.z, v.z, w.z), shift,
        1.0 - 8.0 * defect - 2.0**-40, (_BOX_ROUNDING + 16.0 * defect) * size + 1e-300,
    )  # fmt: skip


@merged
def _magnitudes(v: Point3) -> Point3:
    return Point3(abs(v.x), abs(v.y), abs(v.z))


@merged
def _gap(value: float, reach: float) -> float:
    return max(abs(value) - reach, 0.0)


@inline
def _box_bound(s: Search, most: float, c: Point3, h: Point3, other: Point3, half: Point3) -> float:
    """Return a lower bound on the distance of two boxes, each given by centre and half widths in its own axes.

    most: what is beyond it need not be told by how much.
    """
    f, line = s.frame, s.room.line
    v = Point3(dot(f.x, other) + f.shift.x - c.x, dot(f.y, other) + f.shift.y - c.y, dot(f.z, other) + f.shift.z - c.z)
    d, e = Point3(line[0], line[1], line[2]), Point3(line[3], line[4], line[5])
    along = dot(d, v) - dot(_magnitudes(d), h) - dot(_magnitudes(e), half)
    if along * f.shrink - f.margin > most:
        return most * 2.0
    mx, my, mz = _magnitudes(f.x), _magnitudes(f.y), _magnitudes(f.z)
    x, y, z = _gap(v.x, h.x + dot(mx, half)), _gap(v.y, h.y + dot(my, half)), _gap(v.z, h.z + dot(mz, half))
    square = x * x + y * y + z * z
    w = Point3(
        f.x.x * v.x + f.y.x * v.y + f.z.x * v.z,
        f.x.y * v.x + f.y.y * v.y + f.z.y * v.z,
        f.x.z * v.x + f.y.z * v.y + f.z.z * v.z,
    )
    x = _gap(w.x, half.x + mx.x * h.x + my.x * h.y + mz.x * h.z)
    y = _gap(w.y, half.y + mx.y * h.x + my.y * h.y + mz.y * h.z)
    z = _gap(w.z, half.z + mx.z * h.x + my.z * h.y + mz.z * h.z)
    bound = np.sqrt(max(square, x * x + y * y + z * z))
    size = np.sqrt(dot(v, v))
    if size > 0.0:
        bound = max(bound, size - (dot(_magnitudes(v), h) + dot(_magnitudes(w), half)) / size)
    return max(max(bound, along) * f.shrink - f.margin, 0.0)


@merged
def _lane_centre(view: View, at: int) -> Point3:
    """Return the centre of a box in the axes of its body, from the origin of its tree; ROOT is all of the tree."""
    if at == ROOT:
        return Point3(0.0, 0.0, 0.0)
    node, lane, boxes, scale = at >> 3, at & 7, view.mesh.boxes, view.mesh.scale * view.unit
    return Point3(
        scale * float(boxes[node, 0, lane]), scale * float(boxes[node, 1, lane]), scale * float(boxes[node, 2, lane])
    )


@merged
def _lane_half(view: View, at: int) -> Point3:
    """Return the half widths of a box."""
    scale = view.mesh.scale * view.unit
    if at == ROOT:
        return Point3(2.0 * scale, 2.0 * scale, 2.0 * scale)
    node, lane, boxes = at >> 3, at & 7, view.mesh.boxes
    return Point3(
        scale * float(boxes[node, 3, lane]), scale * float(boxes[node, 4, lane]), scale * float(boxes[node, 5, lane])
    )


@inline
def _push(heap: Heap, n: int, bound: float, i: int, j: int) -> None:
    bounds, lanes = heap.bounds, heap.lanes
    while n > 0 and bounds[(n - 1) >> 1] > bound:  # bound: the height of the heap
        bounds[n], lanes[n, 0], lanes[n, 1] = bounds[(n - 1) >> 1], lanes[(n - 1) >> 1, 0], lanes[(n - 1) >> 1, 1]
        n = (n - 1) >> 1
    bounds[n], lanes[n, 0], lanes[n, 1] = bound, i, j


@inline
def _drop_first(heap: Heap, n: int) -> None:
    """Take the first of n entries out, the last one takes a place of its own."""
    bounds, lanes = heap.bounds, heap.lanes
    last, i, j = bounds[n - 1], lanes[n - 1, 0], lanes[n - 1, 1]
    place = 0
    while 2 * place + 1 < n - 1:  # bound: the height of the heap
        child = 2 * place + 1
        if child + 1 < n - 1 and bounds[child + 1] < bounds[child]:
            child += 1
        if bounds[child] >= last:
            break
        bounds[place], lanes[place, 0], lanes[place, 1] = bounds[child], lanes[child, 0], lanes[child, 1]
        place = child
    bounds[place], lanes[place, 0], lanes[place, 1] = last, i, j


@inline
def _triangle(view: View, item: int) -> Triangle3:
    """Return a placed triangle, rounded, times the unit."""
    t, place, unit = triangle_of(view.mesh, item), view.place, view.unit
    p, q, r = placed(t.p, place), placed(t.q, place), placed(t.r, place)
    return Triangle3(
        Point3(p.x * unit, p.y * unit, p.z * unit),
        Point3(q.x * unit, q.y * unit, q.z * unit),
        Point3(r.x * unit, r.y * unit, r.z * unit),
    )


@inline
def _measure(s: Triangle3, t: Triangle3, error: float) -> tuple[float, float, Point3, tuple[int, int]]:
    """Return bounds on the distance of two triangles, from below and above, and direction and features of nearly
    nearest points.

    error: bound on the distance of a point from its rounded one, both bodies together.
    """
    origin = s.p
    s, t = seen_from(origin, s), seen_from(origin, t)
    slack = rounding_of(s, t) + error
    best = nearest_points(s, t)
    gap = minus(best.q, best.p)
    largest = largest_of(gap)
    if not largest > 0.0:
        return 0.0, slack, Point3(0.0, 0.0, 0.0), (best.first, best.second)
    d = Point3(gap.x / largest, gap.y / largest, gap.z / largest)  # order: squares of small numbers are none
    size = np.sqrt(dot(d, d))
    low, high = max(slab(s, t, d, size) - slack, 0.0), largest * size + slack
    return low, high, Point3(d.x / size, d.y / size, d.z / size), (best.first, best.second)


@inline
def _set_line(line: Any, a: View, b: View, d: Point3) -> None:
    """Keep a direction, not longer than 1, in the axes of either body and in space."""
    d = Point3(_BELOW_ONE * d.x, _BELOW_ONE * d.y, _BELOW_ONE * d.z)
    e, f = turned_back(a.place, d), turned_back(b.place, d)
    line[0], line[1], line[2] = e.x, e.y, e.z
    line[3], line[4], line[5] = f.x, f.y, f.z
    line[6], line[7], line[8] = d.x, d.y, d.z
    line[9] = dot(d, Point3(a.place.x, a.place.y, a.place.z)) * a.unit
    line[10] = dot(d, Point3(b.place.x, b.place.y, b.place.z)) * b.unit
    line[11] += 1.0


@inline
def _kept(found: Candidates, n: int, most: float) -> int:
    """Leave out the candidates above the bound; return how many there are."""
    n_kept = 0
    for item in range(n):
        if found.bounds[item] <= most:
            found.bounds[n_kept] = found.bounds[item]
            for column in range(4):
                found.pairs[n_kept, column] = found.pairs[item, column]
            n_kept += 1
    return n_kept


@inline
def _open(s: Search, n: int, pair: tuple[int, int, bool], most: float) -> int:
    """Put the pairs of one box with the children of a node of the other body on the heap; return its height.

    pair: the node, the lane of the other body, and whether the node is the first body's.
    """
    node, other, is_first = pair
    view, fixed = (s.a, s.b) if is_first else (s.b, s.a)
    centre, half = _lane_centre(fixed, other), _lane_half(fixed, other)
    for lane in range(LANES):
        if view.mesh.child[node, lane] == EMPTY:
            continue
        at = node * LANES + lane
        c, h = _lane_centre(view, at), _lane_half(view, at)
        bound = _box_bound(s, most, c, h, centre, half) if is_first else _box_bound(s, most, centre, half, c, h)
        if bound <= most:
            _push(s.room.heap, n, bound, at if is_first else other, other if is_first else at)
            n += 1
    return n


@inline
def _block_reach(s: Search, view: View, row: int, node: int) -> float:
    """Return how far the triangles of a block reach along the line, toward the other body; kept until that turns."""
    turn = s.room.line[11]
    if s.room.kept[node, 2 * row] == turn:
        return float(s.room.kept[node, 2 * row + 1])
    d = Point3(s.room.line[3 * row], s.room.line[3 * row + 1], s.room.line[3 * row + 2])
    sign = 1.0 if row == 0 else -1.0
    reach = -np.inf
    for lane in range(LANES):
        child = int(view.mesh.child[node, lane])
        if child == EMPTY:
            break
        t = triangle_of(view.mesh, -1 - child)
        reach = max(reach, sign * dot(d, t.p), sign * dot(d, t.q), sign * dot(d, t.r))
    reach = sign * reach * view.unit + s.room.line[9 + row]
    s.room.kept[node, 2 * row], s.room.kept[node, 2 * row + 1] = turn, reach
    return reach


@inline
def _load_block(s: Search, view: View, row: int, node: int) -> int:
    """Place the triangles of a block, and find how far each reaches along the line; return how many there are."""
    n = 0
    d = Point3(s.room.line[6], s.room.line[7], s.room.line[8])
    while n < LANES and view.mesh.child[node, n] != EMPTY:
        t = _triangle(view, -1 - int(view.mesh.child[node, n]))
        c = s.room.corners
        c[row, n, 0, 0], c[row, n, 0, 1], c[row, n, 0, 2] = t.p.x, t.p.y, t.p.z
        c[row, n, 1, 0], c[row, n, 1, 1], c[row, n, 1, 2] = t.q.x, t.q.y, t.q.z
        c[row, n, 2, 0], c[row, n, 2, 1], c[row, n, 2, 2] = t.r.x, t.r.y, t.r.z
        along = (dot(d, t.p), dot(d, t.q), dot(d, t.r))
        s.room.reaches[row, n] = max(along[0], along[1], along[2]) if row == 0 else min(along[0], along[1], along[2])
        n += 1
    return n


@inline
def _loaded(s: Search, row: int, n: int) -> Triangle3:
    c = s.room.corners
    return Triangle3(
        Point3(c[row, n, 0, 0], c[row, n, 0, 1], c[row, n, 0, 2]),
        Point3(c[row, n, 1, 0], c[row, n, 1, 1], c[row, n, 1, 2]),
        Point3(c[row, n, 2, 0], c[row, n, 2, 1], c[row, n, 2, 2]),
    )


@inline
def _measure_blocks(s: Search, i: int, j: int, n_found: int, limits: Any) -> tuple[int, int]:
    """Add the pairs of triangles of two blocks that may be the nearest; return how that ended, and their number.

    limits: as in `find_nearest`; the first falls.
    """
    n_first, n_second = _load_block(s, s.a, 0, i), _load_block(s, s.b, 1, j)
    for k in range(n_first):
        t = _loaded(s, 0, k)
        for m in range(n_second):
            if s.room.reaches[1, m] - s.room.reaches[0, k] - s.frame.margin > limits[0]:
                continue
            low, high, d, features = _measure(t, _loaded(s, 1, m), s.error)
            if high < limits[1]:
                return CLOSER, 0
            if high < limits[0]:
                limits[0] = high
                _set_line(s.room.line, s.a, s.b, d)
            if low > limits[0]:
                continue
            if n_found == len(s.room.found.bounds):
                n_found = _kept(s.room.found, n_found, limits[0])
                if 2 * n_found > len(s.room.found.bounds):
                    return FULL, 0
            pairs = s.room.found.pairs
            s.room.found.bounds[n_found] = low
            pairs[n_found, 0], pairs[n_found, 1] = -1 - s.a.mesh.child[i, k], -1 - s.b.mesh.child[j, m]
            pairs[n_found, 2], pairs[n_found, 3] = features
            n_found += 1
    return DONE, n_found


@inline
def _reach_of_lane(s: Search, view: View, row: int, at: int) -> float:
    """Return a bound on how far a box reaches along the line toward the other body."""
    d = Point3(s.room.line[3 * row], s.room.line[3 * row + 1], s.room.line[3 * row + 2])
    o, unit, sign = view.mesh.origin, view.unit, (1.0 if row == 0 else -1.0)
    c, h = _lane_centre(view, at), _lane_half(view, at)
    middle = d.x * (o[0] * unit + c.x) + d.y * (o[1] * unit + c.y) + d.z * (o[2] * unit + c.z) + s.room.line[9 + row]
    return sign * middle + dot(_magnitudes(d), h) + s.frame.margin


@inline
def _furthest(s: Search, view: View, row: int) -> tuple[float, int]:
    """Return how far a body reaches along the line toward the other, and the block that does."""
    child, waiting, sign = view.mesh.child, s.room.waiting, (1.0 if row == 0 else -1.0)
    waiting[0], n, best, found = 0, 1, -np.inf, 0
    while n > 0:  # bound: each node enters once
        n -= 1
        node = int(waiting[n])
        if child[node, 0] < 0:
            reach = sign * _block_reach(s, view, row, node)
            if reach > best:
                best, found = reach, node
            continue
        for lane in range(LANES):
            if child[node, lane] != EMPTY and _reach_of_lane(s, view, row, node * LANES + lane) > best:
                waiting[n] = child[node, lane]
                n += 1
    return best, found


@inline
def _approach(s: Search, limits: Any) -> tuple[int, int]:
    """Measure the blocks that reach furthest along the line as long as that brings an upper bound down and turns it.

    Returns CLOSER or DONE, and 0.
    """
    for _ in range(MOST_STEPS):
        before = limits[0]
        (reach, i), (their_reach, j) = _furthest(s, s.a, 0), _furthest(s, s.b, 1)
        if -their_reach - reach - s.frame.margin > limits[0]:
            return DONE, 0
        how, _ = _measure_blocks(s, i, j, 0, limits)
        if how != DONE or not limits[0] < before:
            return how, 0
    return DONE, 0


@inline
def _list_blocks(s: Search, view: View, row: int, least: float) -> int:
    """List the blocks that reach so far toward the other body; return their number, above MOST_LISTED for too many."""
    child, waiting, sign = view.mesh.child, s.room.waiting, (1.0 if row == 0 else -1.0)
    waiting[0], n, n_listed = 0, 1, 0
    while n > 0 and n_listed <= MOST_LISTED:  # bound: each node enters once
        n -= 1
        node = int(waiting[n])
        if child[node, 0] < 0:
            if sign * _block_reach(s, view, row, node) >= least:
                if n_listed < MOST_LISTED:
                    s.room.listed[row, n_listed] = node
                n_listed += 1
            continue
        for lane in range(LANES):
            if child[node, lane] != EMPTY and _reach_of_lane(s, view, row, node * LANES + lane) >= least:
                waiting[n] = child[node, lane]
                n += 1
    return n_listed


@inline
def _finish_along_line(s: Search, limits: Any) -> tuple[int, int]:
    """Measure all pairs of blocks that may be nearer than the least upper bound, where few reach so far along the line.

    Bodies that bulge toward each other have few: this looks at each body alone, not at pairs of boxes. Returns FULL
    where they are many, and there is nothing gained.
    """
    margin = s.frame.margin
    (furthest, _), (theirs, _) = _furthest(s, s.a, 0), _furthest(s, s.b, 1)
    n_first = _list_blocks(s, s.a, 0, -theirs - limits[0] - 2.0 * margin)
    if n_first > MOST_LISTED:
        return FULL, 0
    n_second = _list_blocks(s, s.b, 1, -furthest - limits[0] - 2.0 * margin)
    if n_second > MOST_LISTED:
        return FULL, 0
    n_found = 0
    for k in range(n_first):
        for m in range(n_second):
            i, j = int(s.room.listed[0, k]), int(s.room.listed[1, m])
            if _block_reach(s, s.b, 1, j) - _block_reach(s, s.a, 0, i) - margin > limits[0]:
                continue
            how, n_found = _measure_blocks(s, i, j, n_found, limits)
            if how != DONE:
                return how, 0
    return DONE, _kept(s.room.found, n_found, limits[0])


@inline
def _search(s: Search, limits: Any, flag: Any) -> tuple[int, int]:
    """Fill the candidates; return how the search ended, and their number. See `find_nearest`."""
    first, second = s.a.mesh.child, s.b.mesh.child
    how, n_found = _approach(s, limits)
    if how != DONE:
        return how, 0
    n, n_turns, next_try = 1, 0, 1
    s.room.heap.bounds[0], s.room.heap.lanes[0, 0], s.room.heap.lanes[0, 1] = 0.0, ROOT, ROOT
    while n > 0 and s.room.heap.bounds[0] <= limits[0]:  # bound: each pair of boxes enters once
        i, j = int(s.room.heap.lanes[0, 0]), int(s.room.heap.lanes[0, 1])
        _drop_first(s.room.heap, n)
        n -= 1
        n_turns += 1
        if n_turns == next_try:
            next_try *= 4
            how, n_all = _finish_along_line(s, limits)
            if how != FULL:
                return how, n_all
        if flag[0] != 0:
            return INTERRUPTED, 0
        if n + LANES > len(s.room.heap.bounds):
            return FULL, 0
        half, other = _lane_half(s.a, i), _lane_half(s.b, j)
        if _box_bound(s, limits[0], _lane_centre(s.a, i), half, _lane_centre(s.b, j), other) > limits[0]:
            continue
        node = 0 if i == ROOT else int(first[i >> 3, i & 7])
        their_node = 0 if j == ROOT else int(second[j >> 3, j & 7])
        i_block, j_block = first[node, 0] < 0, second[their_node, 0] < 0
        if i_block and j_block:
            reach, their_reach = _block_reach(s, s.a, 0, node), _block_reach(s, s.b, 1, their_node)
            if their_reach - reach - s.frame.margin > limits[0]:
                continue
            how, n_found = _measure_blocks(s, node, their_node, n_found, limits)
            if how != DONE:
                return how, 0
        elif not i_block and (j_block or largest_of(half) >= largest_of(other)):
            n = _open(s, n, (node, j, True), limits[0])
        else:
            n = _open(s, n, (their_node, i, False), limits[0])
    return DONE, _kept(s.room.found, n_found, limits[0])


@bare_kernel
def find_nearest(
    first: MeshArrays, first_pose: PoseArrays, second: MeshArrays, second_poses: PoseArrays, item: int,
    unit: float, limits: Any, room: Room, flag: Any,
) -> tuple[int, int]:  # fmt: skip
    """Fill `room.found` with the pairs of triangles that may be the nearest; return how the search ended, and their
    number.

    second_poses, item: the pose of the second body is that one of many. unit: a power of two that brings the bodies
    near 1. limits (2,): pairs above the first are not looked for (it falls to the least upper bound found); a pair
    below the second ends the search as CLOSER; both times unit.
    """
    place, other = place_pair(first.extent, first_pose, 0, second.extent, second_poses, item)
    a, b = View(first, place, unit), View(second, other, unit)
    frame, error = _frame_of(a, b), 2.0 * unit * (place.error + other.error)
    s = Search(a, b, frame, error, room)
    for k in range(11):
        s.room.line[k] = 0.0
    s.room.line[11] += 1.0  # what was kept is of no use
    middle = turned(place, frame.shift)  # the line of the middles of both trees, to begin with
    size = length(middle)
    if 0.0 < size < np.inf:
        _set_line(s.room.line, a, b, Point3(middle.x / size, middle.y / size, middle.z / size))
    return _search(s, limits, flag)
