"""The nearest of many bodies to each of many points: down the tree over their boxes, nearest first, each body measured
where its turn comes; compiled.

Boxes are rounded outward, so they bound distances from below: in tree coordinates by `lanes/points.py`, then in
doubles: two times `hypot`, some units in the last place below `_BELOW`. For a point far from all bodies, where the tree
tells little, every box is compared with the farthest point of the nearest one.

A body whose distance is left open, or of a kind that no kernel measures, is noted for the Python beside it
(`distances.py`), and so is one with an inside whose box has the point.

Source: N. Roussopoulos, S. Kelley, F. Vincent, Nearest neighbor queries, 1995.
"""

from __future__ import annotations

from collections import namedtuple
from math import hypot
from typing import Final, NamedTuple

import numpy as np

from engine.compiling.jit import inline, kernel
from engine.distance.point_formulas import nearest_on_ball
from engine.distance.point_mesh import NOWHERE, OTHER, Features, mesh_at, write_feature
from engine.distance.point_search import Goal, PointRoom, Spot, enter_node, limit_of, measure_from, next_child, spot_of
from engine.distance.traversal import FULL
from engine.lanes.lanes import array_at
from engine.scenes.near_boxes import N_BODIES, BodyTree, has_moved, name_in, tree_in
from engine.solids.registry import BodyKind
from engine.types import FlagArray, FloatArray, IntArray, Point3

KIND, SHAPE, POSE, IS_POSED, HAS_INSIDE, N_NAMES, CORNERS, ARE_INNER, N_COLUMNS = range(9)
"""Columns of a body's row: `BodyKind` (MESH, BALL, OTHER); addresses of its words (`mesh_at`, `nearest_on_ball`) and of
its pose; whether it has these; number and addresses of `CornerNames`, 0 for none."""
DONE, NO_ROOM, UNREADY, NO_CANDIDATES = range(4)
"""Outcomes: all is done; there is no room for the notes of a point; a row is not filled; a search needs more room."""
TO_LOCATE, TO_MEASURE = 0, 1
_BELOW: Final = 1.0 - 2.0**-48
_ABOVE: Final = 1.0 + 2.0**-48
_TINY: Final = 2.0**-1072
"""More than denormal numbers lose."""
_LARGEST: Final = 2.0**1023 * (2.0 - 2.0**-52)
_REACH: Final = 2.0**1000
"""Coordinates of a tree, up to which a point is looked up there."""


class Nearest(NamedTuple):
    """Answers by point: the double nearest to the distance, infinity for none so far, the body, -1 for none, the
    nearest point (n, d), and what of the body it lies on."""

    distance: FloatArray
    body: IntArray
    point: FloatArray
    features: Features


Notes = namedtuple("Notes", "rows bounds n")
"""What is left to Python: rows (k, 3), point, body and TO_LOCATE or TO_MEASURE; bounds (k,), below the distance; n
(3,): the next point, the number of rows, the body whose row is not filled."""


@inline
def _gap(point: FloatArray, bodies: BodyTree, body: int) -> tuple[float, float]:
    """Return a lower bound on the distance of a point (d,) from a body, and an upper one, by the body's box. Squares
    would leave the range of doubles: of tiny scenes an upper bound would be 0, of huge ones a lower one infinite."""
    near, far = 0.0, 0.0
    for k in range(point.size):
        below, above = bodies.low[body, k] - point[k], point[k] - bodies.high[body, k]
        near, far = hypot(near, max(below, above, 0.0)), hypot(far, max(-below, -above))
    return max(0.0, min(near, _LARGEST) * _BELOW - _TINY), far * _ABOVE + _TINY


@inline
def _most_of(nearest: Nearest, item: int, limit: float) -> float:
    """Return the distance beyond which bodies do not count for a point."""
    most = limit if limit < np.inf else nearest.distance[item]
    return most * _ABOVE + 5e-324


@inline
def _write(nearest: Nearest, item: int, row: IntArray, point: FloatArray, value: float, name: int, room: PointRoom,
           foot: FloatArray) -> None:  # fmt: skip
    """Make a body the nearest of a point, `value` away, and `foot` the nearest point."""
    features = nearest.features
    nearest.distance[item], nearest.body[item] = value, name
    features.face[item], features.numbers[item, 0], features.numbers[item, 1] = -1, -1, -1
    is_inside = row[KIND] == BodyKind.BALL and value == 0.0
    features.kind[item] = NOWHERE if is_inside else OTHER
    for k in range(point.size):
        nearest.point[item, k] = point[k] if is_inside else foot[k]
    if row[KIND] == BodyKind.MESH:
        triangle, code = room.candidates.pairs[0, 0], room.candidates.pairs[0, 2]
        if row[N_NAMES] == 0:  # named later
            features.numbers[item, 0], features.numbers[item, 1] = triangle, code
            return
        face = mesh_at(row[SHAPE]).faces[triangle]
        corners = array_at(row[CORNERS], (row[N_NAMES], 3), np.int64)[triangle]
        inner = array_at(row[ARE_INNER], (row[N_NAMES],), np.uint8)[triangle]
        write_feature(face, code, corners, inner, item, features)


@inline
def _measure(
    points: FloatArray, item: int, bodies: BodyTree, body: int, row: IntArray, name: int, upper: float, limit: float,
    nearest: Nearest, notes: Notes, room: PointRoom, foot: FloatArray, flag: FlagArray,
) -> int:  # fmt: skip
    """Measure a point's distance from a body unless its box is too far; return an outcome. name: the body's index in
    the scene; upper: bound on the least distance."""
    point, is_in_box = points[item], row[HAS_INSIDE] == 1
    low, _ = _gap(point, bodies, body)
    most = min(_most_of(nearest, item, limit), upper)
    if low > most:
        return DONE
    q = Point3(point[0], point[1], point[2] if point.size == 3 else 0.0)
    value, how = -1.0, DONE
    if row[KIND] == BodyKind.UNREADY:
        return UNREADY
    if row[KIND] == BodyKind.MESH:
        goal = Goal(most, -1.0 if limit == np.inf else limit * (1.0 - 2.0**-50), limit, limit == np.inf)
        value, how, _ = measure_from(row[SHAPE], row[POSE], row[IS_POSED] == 1, q, goal, room, foot, flag)
        for k in range(point.size):
            is_in_box &= bodies.low[body, k] <= point[k] <= bodies.high[body, k]
        if how == FULL:
            return NO_CANDIDATES
    elif row[KIND] == BodyKind.BALL:
        value, is_in_box = nearest_on_ball(row[SHAPE], q, True, limit, foot), False
    else:
        is_in_box = False
    best = nearest.distance[item]
    if value < 0.0 or (is_in_box and value > 0.0):
        for reason in (TO_LOCATE, TO_MEASURE):
            if (reason == TO_LOCATE and is_in_box) or (reason == TO_MEASURE and value < 0.0):
                n = notes.n[1]
                notes.rows[n, 0], notes.rows[n, 1], notes.rows[n, 2], notes.bounds[n] = item, name, reason, low
                notes.n[1] = n + 1
    if limit < np.inf:
        nearest.distance[item] = min(best, value) if value >= 0.0 else best
    elif value >= 0.0 and (value < best or (value == best and value < np.inf and name < nearest.body[item])):
        _write(nearest, item, row, point, value, name, room, foot)
    return DONE


@inline
def _bound_of_all(point: FloatArray, bodies: BodyTree, side: int, words: IntArray) -> float:
    """Return an upper bound on the distance of a point from the nearest body of a tree."""
    least = np.inf
    for body in range(bodies.low.shape[0]):
        if side == 1 or not has_moved(words, body):
            least = min(least, _gap(point, bodies, body)[1])
    return least


@inline
def _next_body(
    bodies: BodyTree, way: PointRoom, spot: Spot, most: float, level: int, turn: int, is_far: bool
) -> tuple[int, int, int]:
    """Return (body, level, turn): the next body to be measured, -1 if there is none, and where to go on from: those in
    the tree within `most`, about nearest first, then those listed; all in turn if the point is_far from them."""
    while level > 0:  # bound: each node is entered once
        child, level = next_child(bodies.tree, way, level, limit_of(spot, most * bodies.inverse * _ABOVE))
        if level > 0 and child < 0:
            return bodies.bounded[-1 - child], level, turn
        if level > 0:
            level = enter_node(bodies.tree, child, spot, way, level)
    if turn < (bodies.low.shape[0] if is_far else bodies.listed.size):
        return turn if is_far else bodies.listed[turn], 0, turn + 1
    return -1, 0, turn


@kernel
def find_nearest_bodies(
    points: FloatArray, last: int, words: IntArray, still: IntArray, moved: IntArray, limit: float, nearest: Nearest,
    notes: Notes, way: PointRoom, room: PointRoom, foot: FloatArray, flag: FlagArray,
) -> int:  # fmt: skip
    """Fill the answers for points (n, d) notes.n[0] .. last - 1; return an outcome.

    | argument | content |
    |---|---|
    | words | both rows of `words_of`: the tree over the bodies as first placed, and that over the moved ones |
    | still, moved | rows (n, N_COLUMNS) of these |
    | limit | infinity; else distances are 0.0 if a body is within it, and stay infinite if none is |
    | nearest | `distance` infinite on entry |
    | notes | room for two rows a body for one point at least |
    | way, room, foot | work space: of this tree, of one body's, (d,) |
    """
    n_all = words[0, N_BODIES] + words[1, N_BODIES]
    for item in range(notes.n[0], last):
        notes.n[0], before = item, notes.n[1]
        if flag[0]:
            return DONE
        if before + 2 * n_all > notes.bounds.size:
            return NO_ROOM
        point = points[item]
        for side in range(1 + (words[1, N_BODIES] > 0)):
            bodies, rows = tree_in(words[side], points.shape[1]), still if side == 0 else moved
            o, x, z = bodies.tree.origin, bodies.inverse, point[2] if point.size == 3 else 0.0
            at = Point3((point[0] - o[0]) * x, (point[1] - o[1]) * x, (z - o[2]) * x)
            is_in_reach = abs(at.x) < _REACH and abs(at.y) < _REACH and abs(at.z) < _REACH
            spot = spot_of(at if is_in_reach else Point3(0.0, 0.0, 0.0), 0.0)
            has_tree = bodies.bounded.size > 0
            is_far = has_tree and (spot.spread > 0.0 or not is_in_reach)
            upper = _bound_of_all(point, bodies, side, words) if is_far else np.inf
            level, turn = enter_node(bodies.tree, 0, spot, way, 0) if has_tree and not is_far else 0, 0
            while True:  # bound: each body is measured once
                most = _most_of(nearest, item, limit)
                body, level, turn = _next_body(bodies, way, spot, most, level, turn, is_far)
                if body < 0:
                    break
                if side == 0 and has_moved(words, body):
                    continue
                if limit < np.inf and nearest.distance[item] == 0.0:
                    break
                number = body + side * words[0, N_BODIES]
                how = _measure(
                    points, item, bodies, body, rows[body], name_in(words, number), upper, limit, nearest, notes, room,
                    foot, flag,
                )  # fmt: skip
                if how != DONE:
                    notes.n[1], notes.n[2] = before, number
                    nearest.distance[item], nearest.body[item] = np.inf, -1
                    return how
    notes.n[0] = last
    return DONE
