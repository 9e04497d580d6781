"""Best-first distance join: the pairs of triangles of two placed bodies that may be the nearest.

A pair of boxes, each with the disc of its content, is bounded from below by `lanes/faces.py`. Pairs wait in a heap, the
least bound first; the larger box of a pair is expanded, and its eight children are bounded in one pass. The near pairs
of triangles of two blocks are selected eight at a time and bounded from both sides (near_triangles.py); the search ends
once no waiting pair is below the least upper bound. The result is all pairs of triangles whose lower bound does not
exceed the least upper bound: the distance of the bodies is that of one of them.

limits (2,): pairs above the first, which falls to the least upper bound, are dropped; one below the second ends the
search: CLOSER.

Source: G. Hjaltason, H. Samet, Incremental distance join algorithms for spatial databases, 1998 (the order); E. Larsen,
S. Gottschalk, M. Lin, D. Manocha, Fast distance queries with rectangular swept sphere volumes, 2000 (the descent).
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from engine.collision.meshes.mesh_arrays import MeshArrays, triangle_of
from engine.collision.meshes.near_triangles import nearest_points, relative_to, rounding_bound
from engine.collision.meshes.placement import PoseArrays, defect_of, place_pair, placed, set_frame
from engine.collision.meshes.triangle_triangle import Facet
from engine.compiling.jit import inline, kernel, merged
from engine.distance.refined import ROOT, Heap, Room, Search, View, certify, refine, retain_below, scaled
from engine.lanes.boxes import BOX_ROWS, DISC_ROWS, EMPTY, FRAME_ROWS, inverse_ratio
from engine.lanes.faces import FIXED_ROWS, child_bounds, near_triangle, place_triangles
from engine.lanes.lanes import lowest_bit
from engine.lanes.tracing import LANES
from engine.types import FlagArray, Float32Array, FloatArray


@inline
def load_lane(view: View, at: int, fixed: Float32Array) -> None:
    """Write box (6 rows) and disc (8 rows) of a child of a body's tree to column 0 of `fixed`. at: 8 node + lane of the
    child, or ROOT: around the whole tree."""
    if at == ROOT:
        for row in range(FIXED_ROWS):
            fixed[row, 0] = 4.0 if row > 11 else (2.0 if 3 <= row < 6 else (1.0 if row == 9 else 0.0))
        return
    for row in range(BOX_ROWS):
        fixed[row, 0] = view.mesh.boxes[at >> 3, row, at & 7]
    for row in range(DISC_ROWS):
        fixed[BOX_ROWS + row, 0] = view.mesh.discs[at >> 3, row, at & 7]


@merged
def size_of(view: View) -> float:
    """Return the length, in the scaled coordinates of the search, of a unit of the body's tree coordinates."""
    return float(view.mesh.scale * view.unit)


DONE: Final = 0
FULL: Final = 1
CLOSER: Final = 2
INTERRUPTED: Final = 3
"""Outcomes of a search: DONE, all pairs seen; FULL, no room for more pairs; CLOSER, two points nearer than the limit;
INTERRUPTED, the flag was set."""
_ABOVE_ONE: Final = 1.0 + 2.0**-22


@merged
def _triangle(view: View, item: int) -> Facet:
    """Return triangle ``item`` of a body, placed, rounded and scaled by the unit."""
    t, place, unit = triangle_of(view.mesh, item), view.place, view.unit
    return Facet(scaled(placed(t.p, place), unit), scaled(placed(t.q, place), unit), scaled(placed(t.r, place), unit))


@inline
def _measure(s: Facet, t: Facet, error: float, most: float) -> tuple[float, float, tuple[int, int]]:
    """Return a lower and an upper bound on the distance of two triangles, and the feature codes of nearly nearest
    points. error: bound on the rounding of points, both bodies together. If the lower bound is above `most`, the codes
    are arbitrary."""
    origin = s.p
    s, t = relative_to(origin, s), relative_to(origin, t)
    slack = rounding_bound(s, t) + error
    best, across = nearest_points(s, t, most + slack)
    return max(across.low - slack, 0.0), across.size + slack, (best.first, best.second)


@merged
def measure_blocks(s: Search, i: int, j: int, n_candidates: int, limits: FloatArray) -> tuple[int, int]:
    """Append the candidate pairs of triangles of leaf blocks i and j to the n_candidates so far; return the outcome
    (DONE, FULL, CLOSER) and their new number. limits: see the module; the first is lowered to the least upper bound."""
    frames, work, candidates, per_size = s.room.frames, s.room.work, s.room.candidates, _ABOVE_ONE / size_of(s.a)
    place_triangles(s.b.mesh.blocks, j, frames, work)
    for k in range(LANES):
        own = int(s.a.mesh.child[i, k])
        if own == EMPTY:
            break
        bits = near_triangle(s.a.mesh.blocks, i, k, frames, limits[0] * per_size, work)
        t = _triangle(s.a, -1 - own)
        while bits != 0:  # bound: each turn takes a bit
            their = int(s.b.mesh.child[j, lowest_bit(bits)])
            bits &= bits - 1
            if their == EMPTY:
                break
            low, high, features = _measure(t, _triangle(s.b, -1 - their), s.error, limits[0])
            if high < limits[1]:
                return CLOSER, 0
            if high < limits[0]:
                limits[0] = high
            if low > limits[0]:
                continue
            if n_candidates == len(candidates.bounds):
                n_candidates = retain_below(candidates, n_candidates, limits[0])
                if 2 * n_candidates > len(candidates.bounds):
                    return FULL, n_candidates
            candidates.bounds[n_candidates] = low
            candidates.pairs[n_candidates, 0], candidates.pairs[n_candidates, 1] = -1 - own, -1 - their
            candidates.pairs[n_candidates, 2], candidates.pairs[n_candidates, 3] = features
            n_candidates += 1
    return DONE, n_candidates


BEYOND: Final = 4
"""Outcome without a search: beyond `_LARGEST`, sums of coordinates may overflow."""
ANSWERED: Final = 5
"""Outcome: the answer and the points are proven, and candidate 0 names the features."""
_LARGEST: Final = 1e300


class Query(NamedTuple):
    """Goal of a search. most: pairs farther apart do not count; enough: a distance below it ends the search; radius,
    other_radius: of balls about the triangles; reach: bound on sums of coordinates; is_answered: also stop at poses
    with a proven answer, for their features."""

    most: float
    enough: float
    radius: float
    other_radius: float
    reach: float
    is_answered: bool


@inline
def push(heap: Heap, n: int, bound: float, i: int, j: int) -> None:
    """Insert a pair of boxes (i, j) with its bound into the heap of n entries."""
    bounds, lanes = heap.bounds, heap.lanes
    while n > 0 and bounds[(n - 1) >> 1] > bound:  # bound: the height of the heap
        bounds[n], lanes[n, 0], lanes[n, 1] = bounds[(n - 1) >> 1], lanes[(n - 1) >> 1, 0], lanes[(n - 1) >> 1, 1]
        n = (n - 1) >> 1
    bounds[n], lanes[n, 0], lanes[n, 1] = bound, i, j


@inline
def drop_first(heap: Heap, n: int) -> None:
    """Remove the first of the heap's n entries."""
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


@merged
def _expand(s: Search, n: int, pair: tuple[int, int, bool], most: float) -> int:
    """Push the pairs of one box with each child of a node of the other body on the heap of n entries; return its new
    size. pair: the node; the box, 8 node + lane of the other body, or ROOT; whether the node is the first body's. most:
    pairs with a greater bound are dropped."""
    node, other, is_first = pair
    view, fixed, own = (s.a, s.b, 0) if is_first else (s.b, s.a, 1)
    unit, their_unit = size_of(view), size_of(fixed)
    load_lane(fixed, other, s.room.fixed)
    child_bounds(
        view.mesh.boxes, view.mesh.discs, node, s.room.fixed, s.room.frames, own * FRAME_ROWS, (1 - own) * FRAME_ROWS,
        their_unit / unit, inverse_ratio(their_unit, unit), s.room.work,
    )  # fmt: skip
    for lane in range(LANES):
        bound, at = unit * float(s.room.work[0, lane]), node * LANES + lane
        if bound <= most and view.mesh.child[node, lane] != EMPTY:
            push(s.room.heap, n, bound, at if is_first else other, other if is_first else at)
            n += 1
    return n


@merged
def _half_of(view: View, at: int) -> float:
    """Return the largest half width of the box of child at = 8 node + lane (ROOT: of the tree), in tree coordinates."""
    node, lane, b = at >> 3, at & 7, view.mesh.boxes
    return 2.0 if at == ROOT else float(max(b[node, 3, lane], b[node, 4, lane], b[node, 5, lane]))


@inline
def _search(s: Search, limits: FloatArray, flag: FlagArray) -> tuple[int, int]:
    """Fill the candidates by a best-first search; return the outcome (DONE, FULL, CLOSER, INTERRUPTED) and their
    number. limits: see the module."""
    first, second, sizes = s.a.mesh.child, s.b.mesh.child, (size_of(s.a), size_of(s.b))
    n, n_candidates = 1, 0
    s.room.heap.bounds[0], s.room.heap.lanes[0, 0], s.room.heap.lanes[0, 1] = 0.0, ROOT, ROOT
    while n > 0 and s.room.heap.bounds[0] <= limits[0]:  # bound: each pair of boxes enters once
        i, j = int(s.room.heap.lanes[0, 0]), int(s.room.heap.lanes[0, 1])
        drop_first(s.room.heap, n)
        n -= 1
        if flag[0] != 0:
            return INTERRUPTED, 0
        if n + LANES > len(s.room.heap.bounds):
            return FULL, n_candidates
        node = 0 if i == ROOT else int(first[i >> 3, i & 7])
        their_node = 0 if j == ROOT else int(second[j >> 3, j & 7])
        i_block, j_block = first[node, 0] < 0, second[their_node, 0] < 0
        if i_block and j_block:
            how, n_candidates = measure_blocks(s, node, their_node, n_candidates, limits)
            if how != DONE:
                return how, n_candidates
            continue
        is_first = not i_block and (j_block or _half_of(s.a, i) * sizes[0] >= _half_of(s.b, j) * sizes[1])
        n = _expand(s, n, (node if is_first else their_node, j if is_first else i, is_first), limits[0])
    return DONE, retain_below(s.room.candidates, n_candidates, limits[0])


@kernel
def find_nearest(
    first: MeshArrays, first_poses: PoseArrays, second: MeshArrays, second_poses: PoseArrays, span: tuple[int, int],
    query: Query, answers: FloatArray, room: Room, flag: FlagArray,
) -> tuple[int, int, int]:  # fmt: skip
    """Fill the NaN entries of answers (n,) for poses span[0] .. span[1] - 1 of both bodies; the first may have one
    pose.

    Returns (pose, outcome, n): the first pose left open, the outcome of its search, and the number of candidates in
    `room.candidates`; pose span[1] if none is left. An answer is the double nearest to the distance; with a limit in
    the query 0.0 for a pose that is provably nearer, infinity for one that is provably not."""
    limits, has_one = room.limits, len(first_poses.translations) == 1
    for item in range(span[0], span[1]):
        if answers[item] == answers[item]:
            continue
        own = 0 if has_one else item
        start, move = first_poses.translations[own], second_poses.translations[item]
        size = max(abs(start[0]), abs(start[1]), abs(start[2]), abs(move[0]), abs(move[1]), abs(move[2]))
        size = query.reach + 2.0 * size
        if not size < _LARGEST:
            return item, BEYOND, 0
        unit = math.ldexp(1.0, -min(max(math.frexp(size)[1], -1000), 1000))
        limits[0], limits[1] = query.most * unit, (query.enough * unit if query.enough > 0.0 else -1.0)
        place, other = place_pair(first.extent, first_poses, own, second.extent, second_poses, item)
        radii = query.radius * unit, query.other_radius * unit
        a, b = View(first, place, unit), View(second, other, unit)
        s = Search(a, b, 2.0 * unit * (place.error + other.error), room)
        defect = defect_of(place) + defect_of(other)
        set_frame(room.frames[0], place, first, other, second, defect)
        set_frame(room.frames[1], other, second, place, first, defect)
        how, n = _search(s, limits, flag)
        if how == CLOSER or (how == DONE and n == 0):
            answers[item] = 0.0 if how == CLOSER else np.inf
        elif how == DONE and query.most == np.inf:
            distance, n = refine(s, start, move, radii, n)
            if distance > 0.0:
                answers[item] = distance
                if query.is_answered and certify(s, start, move, radii, n, room.points):
                    return item, ANSWERED, 1
        if answers[item] != answers[item] or query.is_answered:
            return item, how, n
    return span[1], DONE, 0
