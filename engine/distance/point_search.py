"""The nearest triangle of a mesh to each of many points.

1. Depth first through the tree, the nearest child first, boxes and triangles bounded eight at a time in float32
   (`lanes/points.py`): the triangles that may be the nearest are the candidates. The next child of a node is
   chosen when the one before is entered, so that no turn waits for it.
2. Each is bounded in float64 (`measure`). One that may contain the point is decided by exact signs: 0. A single one
   with the foot certainly within its face is left to step 3: off the plane, the distance from it is the answer.
3. If all candidates left name one feature, and it certainly is the nearest of each (`_is_certain`), the distance is
   that of a vertex, a line or a plane: in double-doubles of the point's exact differences from the corners, scaled so
   that the longest is near 1 (`distance_to`).
4. Else the candidates are bounded in double-doubles (`_refine`; the bound is that of `refined.py`), which decides the
   distance of ties too, and the feature if every corner of every candidate that is not of it lies strictly behind the
   plane at the foot across the connection (`_certify`; the margins are those of `refined.certify`).
5. What none of these proves is left open, for integers (`points.py`), and so is what is nearer, over the size of the
   coordinates, than squares of doubles can be small.

The face is the least of the candidates'.

**A pose.** The point is moved back by R', which differs from the inverse of R by less than 1e-12 in each entry
(`solids/pose.py`): distances change by less than 2^-36 of the coordinates, far below what the bounds of
`lanes/points.py` leave room for. Then placed corners are rounded, within `error` of `placement.py`; step 3 is left out,
and coordinates in double-doubles are those of `refined.py`.

Source: N. Roussopoulos, S. Kelley, F. Vincent, Nearest neighbor queries, 1995 (the order of the search).
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from engine.bounding.bvh import MAX_DEPTH
from engine.collision.meshes.mesh_arrays import triangle_of
from engine.collision.meshes.near_triangles import FACE, relative_to
from engine.collision.meshes.placement import PoseArrays, as_placement, defect_of, placed, rotate_back
from engine.collision.meshes.triangle_triangle import Facet
from engine.compiling.jit import called, inline, kernel, merged
from engine.distance.closed_forms import Wide, Wide3, less, less3
from engine.distance.exact_within import compare_with_limit
from engine.distance.point_mesh import PointMesh, mesh_at, pose_at
from engine.distance.point_triangle import UNSURE, distance_to, feature_under, measure, seen_from
from engine.distance.refined import (
    CERTAIN,
    ROUNDING,
    Candidates,
    View,
    are_strictly_beyond,
    bounds_of_features,
    ends_of,
    named,
    retain_below,
    scaled,
    write_offset_point,
)  # fmt: skip
from engine.distance.traversal import BEYOND, CLOSER, DONE, FULL, INTERRUPTED
from engine.lanes.boxes import EMPTY
from engine.lanes.lanes import lowest_bit
from engine.lanes.points import (
    MARGIN,
    SLACK,
    boxes_toward,
    boxes_within,
    nearest_of,
    triangle_bounds,
    triangles_toward,
)  # fmt: skip
from engine.lanes.tracing import LANES
from engine.predicates.error_free import is_correctly_rounded
from engine.predicates.vectors import as_point3, dot, largest_of, minus
from engine.types import FlagArray, Float32Array, FloatArray, Int32Array, IntArray, Point3

ALL_LANES: Final = (1 << LANES) - 1
_LARGEST: Final = 1e300
_DISTANT: Final = 1024.0
_ABOVE_ONE: Final = 1.0 + 2.0**-20
_SHORTEST: Final = 2.0**-200
"""In the unit of the coordinates: what is nearer in all coordinates is measured in integers."""


class PointRoom(NamedTuple):
    """Work space of one search at a time: candidates, of which the first and third columns are used; by level of
    the way down a node, the bits of its children that are left, and those of the nearest of these, nodes (n, 3), and
    their bounds (n, 8); work (2, 8): of `lanes/points.py`; start (1, 3): the point."""

    candidates: Candidates
    nodes: Int32Array
    bounds: Float32Array
    work: Float32Array
    start: FloatArray


def new_point_room(room: int) -> PointRoom:
    """Allocate work space for `room` candidates."""
    candidates = Candidates(np.empty((room, 4), np.int64), np.empty(room))
    nodes, bounds = np.empty((MAX_DEPTH + 1, 3), np.int32), np.empty((MAX_DEPTH + 1, LANES), np.float32)
    return PointRoom(candidates, nodes, bounds, np.empty((2, LANES), np.float32), np.empty((1, 3)))


class Goal(NamedTuple):
    """What is asked of each point. most: points farther away do not count; enough: a distance below it ends the search;
    limit: the distance compared with, infinity for none; is_named: the nearest point and its feature too."""

    most: float
    enough: float
    limit: float
    is_named: bool


class Spot(NamedTuple):
    """Where a search starts: the point in tree coordinates, and reach, S of `lanes/points.py`; for a distant point
    (spread > 0) its direction, and the spread of its bounds."""

    at: Point3
    reach: float
    spread: float


@inline
def spot_of(at: Point3, blur: float) -> Spot:
    """Return a point, given in tree coordinates, as a search takes it. blur: by how much its distances may be off; 2^21
    blur more of S adds as much to the margin of boxes, and four times as much to the slack of triangles."""
    largest, more = largest_of(at), 2.0**21 * blur
    if largest < _DISTANT:
        return Spot(at, largest + 2.0 + more, 0.0)
    e = Point3(at.x / largest, at.y / largest, at.z / largest)
    size = np.sqrt(dot(e, e))
    far = Point3(e.x / size, e.y / size, e.z / size)
    return Spot(far, 2.0 + more / largest, 6.1 / (largest * size - 4.0) * _ABOVE_ONE)


@inline
def limit_of(spot: Spot, most: float) -> float:
    """Return what bounds of boxes are compared with, the square unless the point is distant, no less than for `most`
    once it is rounded to float32."""
    limit = most if spot.spread > 0.0 else most * most
    return limit + 2.0**-20 * abs(limit) + 1e-37


@inline
def bound_boxes(tree: Any, node: int, spot: Spot, bounds: Float32Array, row: int) -> int:
    """Write to row `row` of bounds lower bounds on the distance of a spot from the boxes of a node's children; return
    the nearest as bits (`boxes_within`, `boxes_toward`)."""
    at = spot.at
    if spot.spread > 0.0:
        return boxes_toward(tree.boxes, node, at.x, at.y, at.z, SLACK * spot.reach, bounds, row)
    return boxes_within(tree.boxes, node, at.x, at.y, at.z, MARGIN * spot.reach, bounds, row)


@inline
def next_child(tree: Any, room: PointRoom, level: int, limit: float) -> tuple[int, int]:
    """Return (child, level): the next child whose bound is not above the limit; level 0 if there is none."""
    nodes = room.nodes
    while level > 0:  # bound: each turn leaves a level, or takes a child
        bits = int(nodes[level - 1, 2])
        lane = lowest_bit(bits | ALL_LANES + 1)
        if bits == 0 or room.bounds[level - 1, lane] > limit:
            level -= 1
            continue
        rest = int(nodes[level - 1, 1]) & ~(1 << lane)
        nodes[level - 1, 1], nodes[level - 1, 2] = rest, nearest_of(room.bounds, level - 1, rest)
        child = int(tree.child[nodes[level - 1, 0], lane])
        if child != EMPTY:  # case: a point so far away that it has no direction, and bounds are -infinity
            return child, level
    return -1, 0


@inline
def enter_node(tree: Any, node: int, spot: Spot, room: PointRoom, level: int) -> int:
    """Bound the children of an inner node, from which `next_child` chooses; return the new level."""
    bits, nodes = bound_boxes(tree, node, spot, room.bounds, level), room.nodes
    nodes[level, 0], nodes[level, 1], nodes[level, 2] = node, ALL_LANES, bits
    return level + 1


@inline
def _bound_block(tree: PointMesh, node: int, spot: Spot, most: float, work: Float32Array) -> int:
    """Write bounds on the distance of a spot from the triangles of a leaf to `work`; return the mask of those that may
    be the nearest and within `most` (`triangle_bounds`, `triangles_toward`)."""
    at, slack, most = spot.at, SLACK * spot.reach, most + 2.0**-20 * abs(most) + 1e-37  # rounded to float32
    if spot.spread > 0.0:
        return triangles_toward(tree.blocks, node, at.x, at.y, at.z, slack, spot.spread, most, work)
    return triangle_bounds(tree.blocks, node, at.x, at.y, at.z, slack, most, work)


@called
def _search(
    tree: PointMesh, spot: Spot, most: float, enough: float, room: PointRoom, flag: FlagArray
) -> tuple[int, int]:
    """Fill ``room.candidates`` with the triangles that may be nearest to a spot, and return (outcome, their number).
    CLOSER: one is nearer than `enough`, which ends the search; INTERRUPTED: by `flag`; FULL: no room. most, enough: in
    tree coordinates."""
    candidates, work = room.candidates, room.work
    n_candidates, level, node, limit = 0, 0, 0, limit_of(spot, most)
    while True:  # bound: each node is entered once
        if tree.child[node, 0] >= 0:
            level = enter_node(tree, node, spot, room, level)
        elif flag[0] != 0:
            return INTERRUPTED, 0
        else:
            near = _bound_block(tree, node, spot, most, work)
            if work[0, 0] < most:
                most = float(work[0, 0])
                limit = limit_of(spot, most)
                if most < enough:
                    return CLOSER, 0
            while near != 0:  # bound: each turn takes a bit
                lane = lowest_bit(near)
                near &= near - 1
                child = tree.child[node, lane]
                if child == EMPTY:
                    break
                if n_candidates == len(candidates.bounds):
                    n_candidates = retain_below(candidates, n_candidates, most)
                    if 2 * n_candidates > len(candidates.bounds):
                        return FULL, n_candidates
                candidates.pairs[n_candidates, 0], candidates.bounds[n_candidates] = -1 - child, work[1, lane]
                n_candidates += 1
        node, level = next_child(tree, room, level, limit)
        if level == 0:
            return DONE, retain_below(candidates, n_candidates, most)


@inline
def _rounded(distance: Wide, error: float, unit: float) -> float:
    """Return the double nearest to a distance over the unit; -1.0 if the error leaves it open."""
    value = distance.h / unit
    is_proven = 2.0**-1000 < value < 2.0**1000 and is_correctly_rounded(distance.h, distance.low, error)
    return value if is_proven else -1.0


@called
def _refine(view: View, q: Point3, n: int, candidates: Candidates) -> tuple[Wide, float, int]:
    """Return (distance, error, left): the distance of point q from the nearest of the first n candidates, in
    double-doubles and times `view.unit`, a bound on its error, and the number of candidates left. Those that are
    certainly farther are removed, the others moved to the front with new lower bounds. Caller guarantees that the
    distance is not 0."""
    none = Wide(0.0, 0.0)
    origin = Wide3(none, none, none)
    least, lowest, spot = Wide(np.inf, 0.0), Wide(np.inf, 0.0), Facet(origin, origin, origin)
    for k in range(n):
        size, beyond = bounds_of_features(seen_from(view, candidates.pairs[k, 0], q), spot, candidates.pairs[k, 2], 0)
        low = less(size, Wide(beyond, 0.0))
        candidates.bounds[k] = low.h - ROUNDING
        least = size if k == 0 or less(size, least).h < 0.0 else least
        lowest = low if k == 0 or less(low, lowest).h < 0.0 else lowest
    n = retain_below(candidates, n, least.h + ROUNDING)
    return least, less(least, lowest).h + ROUNDING, n


@called
def _certify(
    view: View, q: Point3, n: int, is_certain: bool, room: PointRoom, start: FloatArray, move: FloatArray,
    foot: FloatArray,
) -> bool:  # fmt: skip
    """Write the nearest point to foot (d,) if the first n candidates prove it (see the module), and return whether they
    do; the candidate of the least face moves to row 0. start: the point (3,); move: the mesh's translation. is_certain:
    all name one feature, and it is the nearest of each."""
    pairs, best, faces = room.candidates.pairs, 0, view.mesh.faces
    here = named(view, pairs[0, 0], pairs[0, 2])
    none = Wide(0.0, 0.0)
    origin = Wide3(none, none, none)
    spot = Facet(origin, origin, origin)
    p, _, inside, steepness = ends_of(seen_from(view, pairs[0, 0], q), spot, pairs[0, 2], 0)
    error = CERTAIN * steepness + 2.0**-92
    way = less3(origin, p)
    size = way.x.h * way.x.h + way.y.h * way.y.h + way.z.h * way.z.h
    if not (inside > CERTAIN and size > 2.0**-300):
        return False
    for k in range(n):
        if not is_certain:
            if named(view, pairs[k, 0], pairs[k, 2]) != here:
                return False
            t = seen_from(view, pairs[k, 0], q)
            if not are_strictly_beyond(view, pairs[k, 0], here, t, way, p, CERTAIN + 16.0 * error):
                return False
        best = k if faces[pairs[k, 0]] < faces[pairs[best, 0]] else best
    pairs[0, 0], pairs[0, 2] = pairs[best, 0], pairs[best, 2]
    return write_offset_point(view, here, p, way, 0.0, start, move, error, foot)


@inline
def _scaled(t: Facet, unit: float) -> Facet:
    return Facet(scaled(t.p, unit), scaled(t.q, unit), scaled(t.r, unit))


@merged
def _decide(
    mesh: PointMesh, pose: PoseArrays, unit: float, n: int, goal: Goal, room: PointRoom, foot: FloatArray
) -> tuple[float, int, bool]:
    """Return (distance, n, is_named): the nearest double, -1.0 if unproven (with a limit: 0.0 within it, infinity
    beyond; without one infinity beyond `goal.most`), the number of candidates left, and whether row 0 and `foot` name
    the nearest point. unit: power of two that brings all coordinates below 1."""
    candidates, start, move = room.candidates, room.start, as_point3(pose.translations, 0)
    q = as_point3(start, 0)
    pairs = candidates.pairs
    error = 2.0**-50 * (3.0 * mesh.reach + largest_of(move)) + 2.0**-1060 if pose.is_posed else 0.0
    place = as_placement(pose, 0, move, error)
    scaled_q, slack = scaled(q, unit), 2.0 * unit * error
    most, largest, shortest, on, is_unsure, is_over = goal.most * unit, 0.0, np.inf, -1, False, False
    for k in range(n):
        t = triangle_of(mesh, pairs[k, 0])
        t = Facet(placed(t.p, place), placed(t.q, place), placed(t.r, place))
        t = relative_to(scaled_q, _scaled(t, unit))
        size = max(largest_of(t.p), largest_of(t.q), largest_of(t.r))
        shortest, largest = min(shortest, size), max(largest, size)
        low, high, code, is_certain = measure(t)
        is_over = n == 1 and code == FACE and is_certain and not pose.is_posed
        if low <= slack and not is_over:
            under = UNSURE if pose.is_posed else feature_under(mesh, pairs[k, 0], q)
            is_unsure = is_unsure or under == UNSURE
            if under >= 0:
                if not goal.is_named:
                    return 0.0, 1, True
                if on < 0 or mesh.faces[pairs[k, 0]] < mesh.faces[pairs[on, 0]]:
                    on = k
                code = under
        candidates.bounds[k], pairs[k, 1], pairs[k, 2] = low - slack, int(is_certain and not pose.is_posed), code
        most = min(most, high + slack)
    if on >= 0 and not is_unsure:
        pairs[0, 0], pairs[0, 2] = pairs[on, 0], pairs[on, 2]
        for k in range(foot.shape[0]):
            foot[k] = start[0, k]
        return 0.0, 1, True
    if shortest < _SHORTEST:  # squares of its lengths underflow
        return -1.0, n, False
    n = retain_below(candidates, n, most)
    if is_unsure or n == 0:
        return (np.inf if n == 0 and goal.most < np.inf else -1.0), n, False
    if goal.limit < np.inf:
        if most < goal.enough * unit:
            return 0.0, n, False
        if goal.limit == 0.0 and not is_over:
            return np.inf, n, False
    view, is_certain = View(mesh, place, unit), pairs[0, 1] == 1
    for k in range(1, n):
        is_alike = named(view, pairs[k, 0], pairs[k, 2]) == named(view, pairs[0, 0], pairs[0, 2])
        is_certain = is_certain and pairs[k, 1] == 1 and is_alike
    if not pose.is_posed:  # differences are exact: in units of the longest
        view = View(mesh, place, math.ldexp(1.0, _power(largest / unit)))
    if is_certain:
        distance, bound = distance_to(
            _scaled(triangle_of(mesh, pairs[0, 0]), view.unit), scaled(q, view.unit), pairs[0, 2]
        )
    else:
        distance, bound, n = _refine(view, q, n, candidates)
    value = _rounded(distance, bound, view.unit)
    if value < 0.0 and is_over and feature_under(mesh, pairs[0, 0], q) == FACE:
        for k in range(foot.shape[0]):
            foot[k] = start[0, k]
        return 0.0, 1, True
    if goal.limit < np.inf:
        return compare_with_limit(view, q, n, candidates, distance, bound, goal.limit, unit), n, False
    is_named = goal.is_named and value >= 0.0
    if is_named:
        is_named = _certify(view, q, n, is_certain, room, start[0], pose.translations[0], foot)
    return value, n, is_named


@inline
def _power(size: float) -> int:
    """Return the power of two that brings a number below 1, between -1000 and 1000."""
    return -min(max(math.frexp(size)[1], -1000), 1000)


@called
def measure_from(
    words: int, pose_: int, is_posed: bool, q: Point3, goal: Goal, room: PointRoom, foot: FloatArray, flag: FlagArray
) -> tuple[float, int, int]:
    """Return (distance, outcome, n) of a point and the mesh at address `words` (`mesh_at`) under the pose at another:
    the double nearest to the distance, infinity beyond `goal.most`, or with a limit 0.0 within it, infinity beyond;
    -1.0 if it is left open, then also the outcome of the search and the number of candidates. If the goal says so,
    also `foot` (d,), the nearest doubles to the nearest point, and in row 0 of the candidates its triangle and, third,
    its feature code (`near_triangles.py`).

    Under a pose R, t the search takes p = R' (q - t) for R^-1 (q - t). With d = |R' R - I| in entries and L = |q - t| +
    |x| for the points x of the mesh, p is off by 3.1 d L, lengths change by 1.6 d L, and rounding is far below; L is
    less than sqrt(3) times the sum of the largest coordinates, a quarter of `size`. `blur` is 16 d of that sum."""
    mesh, pose = mesh_at(words), pose_at(pose_, is_posed)
    o, scale, move = mesh.origin, mesh.scale, as_point3(pose.translations, 0)
    place = as_placement(pose, 0, move, 0.0)
    size = 4.0 * (mesh.reach + largest_of(q) + largest_of(move))
    if not (size < _LARGEST and 0.0 * (q.x + q.y + q.z) == 0.0):  # NaN is lost in `largest_of`
        return -1.0, BEYOND, 0
    unit, p = math.ldexp(1.0, _power(size)), rotate_back(place, minus(q, move)) if is_posed else q
    spot = spot_of(
        Point3((p.x - o.x) / scale, (p.y - o.y) / scale, (p.z - o.z) / scale), 4.0 * size * defect_of(place) / scale
    )
    most, enough = goal.most / scale * _ABOVE_ONE, goal.enough / scale / _ABOVE_ONE
    if spot.spread > 0.0 or not goal.enough > 0.0:
        enough = -np.inf
    how, n = _search(mesh, spot, np.inf if spot.spread > 0.0 else most, enough, room, flag)
    if how == CLOSER:
        return 0.0, DONE, n
    if how != DONE:
        return -1.0, how, n
    room.start[0, 0], room.start[0, 1], room.start[0, 2] = q
    value, n, is_named = _decide(mesh, pose, unit, n, goal, room, foot)
    return (value if is_named or not goal.is_named or value == np.inf else -1.0), DONE, n


@kernel
def find_nearest_on_mesh(
    body: tuple[int, int, bool], points: FloatArray, span: tuple[int, int], goal: Goal, answers: FloatArray,
    codes: IntArray, feet: FloatArray, room: PointRoom, flag: FlagArray,
) -> tuple[int, int, int]:  # fmt: skip
    """Fill the NaN entries of answers (n,) for points (n, 3) span[0] .. span[1] - 1 as `measure_from` does, from a body
    given as its first arguments; if the goal says so, also codes (n, 2), triangle and feature code, and feet (n, d).

    Returns (item, outcome, n): the first point left open, the outcome of its search, and the number of candidates; item
    span[1] if none is left."""
    for item in range(span[0], span[1]):
        if answers[item] == answers[item]:
            continue
        foot = feet[item] if goal.is_named else room.start[0, :0]
        value, how, n = measure_from(body[0], body[1], body[2], as_point3(points, item), goal, room, foot, flag)
        if value < 0.0:
            return item, how, n
        answers[item] = value
        if goal.is_named:
            codes[item, 0], codes[item, 1] = room.candidates.pairs[0, 0], room.candidates.pairs[0, 2]
    return span[1], DONE, 0
