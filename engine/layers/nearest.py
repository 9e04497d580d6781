"""How far apart features are: bounds by doubles for many pairs, exact squares where bounds do not decide; compiled.

The distance of two features that do not meet is that of a vertex of one and an edge of the other. In doubles it is off
by less than 32 u (|p - a| + |b - a|) for a vertex p and an edge ab: differences carry u each, the cross product 4 u of
both products, and a foot that is taken for an end, or the reverse, moves it by the error of its place, 6 u |p - a|.

Source: C. Ericson, Real-Time Collision Detection, 2005, 5.1.
"""

from __future__ import annotations

from fractions import Fraction
from math import hypot, inf
from typing import Final, NamedTuple

import numpy as np

from engine.arrangement.simple_rings import BLOCK, after, next_leaf
from engine.compiling.jit import called, entry_of, inline, kernel
from engine.layers.limits import Limits
from engine.layers.relate import matrices
from engine.layers.shapes import Shape, Shapes, pairs_between, shape_of
from engine.predicates.rational import common_integers, nearest_with_root
from engine.predicates.vectors import as_point2
from engine.running.parallel import run_chunks
from engine.types import BoolArray, FlagArray, FloatArray, IntArray, Point2

_ERROR: Final = 2.0**-48
_TINY: Final = 2.0**-530
_LEAST: Final = 5e-324
_LONG: Final = 2.0**-60
"""Largest rounding of long doubles that are of use."""
_PAIRS_EACH: Final = 4.0
"""Features of the right layer within the first reach of a feature of the left, about."""


def meets(left: Shapes, right: Shapes, pairs: IntArray, limits: Limits) -> BoolArray:
    """Return whether pairs of features have a common point."""
    bits, is_turned = np.zeros(len(pairs), np.int64), left.dims[pairs[:, 0]] > right.dims[pairs[:, 1]]
    with limits.budget() as budget:
        bits[~is_turned] = matrices(left, right, pairs[~is_turned], True, budget, limits.workers)
        bits[is_turned] = matrices(right, left, pairs[is_turned][:, ::-1].copy(), True, budget, limits.workers)
    return bits != 0


def are_within(left: Shapes, right: Shapes, pairs: IntArray, distance: float, limits: Limits) -> BoolArray:
    """Return whether pairs of features are at most `distance` apart, exactly."""
    result = meets(left, right, pairs, limits)
    rest = np.flatnonzero(~result)
    low, high, _, _ = _bounds(left, right, pairs[rest], np.full(len(rest), distance), False, limits)
    result[rest] = high <= distance
    limit = Fraction(distance) ** 2
    for k in np.flatnonzero((low <= distance) & (high > distance)).tolist():
        result[rest[k]] = _square(left, right, pairs[rest[k]], high[k], limits) <= limit
    return result


def nearest_pairs(
    left: Shapes, right: Shapes, most: float, left_out: IntArray, limits: Limits
) -> tuple[IntArray, FloatArray]:
    """Return (n, 2) pairs of each left feature and all right features that are nearest to it, sorted, and their
    distances, the nearest doubles. most: the largest distance; left_out: pairs
    that do not count, as first * n_right + second."""
    open_, result, distances = np.flatnonzero(left.dims >= 0), [np.zeros((0, 2), np.int64)], [np.zeros(0)]
    filled = np.flatnonzero(right.dims >= 0)
    if not len(filled) or not len(open_):
        return result[0], distances[0]
    both = np.concatenate([left.vertices, right.vertices])
    extent = float((both.max(axis=0) - both.min(axis=0)).max())
    reach = min(most, extent * (_PAIRS_EACH / len(filled)) ** 0.5 / 2.0)
    while len(open_):  # bound: the reach doubles, up to the extent or `most`
        reaches = np.full(len(left.dims), -inf)
        reaches[open_] = reach
        pairs = _of(pairs_between(left, right, np.maximum(reaches, 0.0), limits), reaches)
        pairs = pairs[~np.isin(pairs[:, 0] * len(right.dims) + pairs[:, 1], left_out)]
        best, made = np.full(len(left.dims), inf), meets(left, right, pairs, limits)
        bounds = _bounds(left, right, pairs, np.where(made, -inf, reaches[pairs[:, 0]]), True, limits)
        bounds.low[made] = bounds.high[made] = 0.0
        np.minimum.at(best, pairs[:, 0], bounds.high)
        is_last = reach >= min(most, 2.0 * extent)
        done = open_ if is_last else open_[best[open_] <= reach]
        some = np.zeros(len(left.dims), np.bool_)
        some[done] = True
        near = some[pairs[:, 0]] & (bounds.low <= best[pairs[:, 0]]) & (bounds.low <= most)
        chosen, exact = _ties(left, right, pairs[near], bounds.take(near), most, limits)
        result.append(chosen)
        distances.append(exact)
        open_ = np.setdiff1d(open_, done)
        reach = min(most, reach * 2.0)
    pairs, exact = np.concatenate(result), np.concatenate(distances)
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    return pairs[order], exact[order]


def _of(pairs: IntArray, reaches: FloatArray) -> IntArray:
    return pairs[reaches[pairs[:, 0]] >= 0.0]


def _ties(
    left: Shapes, right: Shapes, pairs: IntArray, bounds: _Bounds, most: float, limits: Limits
) -> tuple[IntArray, FloatArray]:
    """Return the pairs, of candidates (n, 2) sorted by left feature, that have the least exact distance of their left
    feature, at most `most`; and these distances, as nearest doubles. bounds: of the candidates' distances."""
    distances, is_sure = _rounded(bounds)
    n = np.bincount(pairs[:, 0], minlength=len(left.dims))[pairs[:, 0]]
    stays = bounds.high == 0.0
    is_open = ~stays & ~((n == 1) & is_sure & (bounds.high <= most))
    stays |= ~is_open
    meeting = set(pairs[bounds.high == 0.0, 0].tolist())
    squares, least = dict[int, Fraction](), dict[int, Fraction]()
    for k in np.flatnonzero(is_open).tolist():
        i = int(pairs[k, 0])
        squares[k] = _square(left, right, pairs[k], float(bounds.high[k]), limits)
        least[i] = min(squares[k], least.get(i, squares[k]))
    limit = None if most == inf else Fraction(most) ** 2
    for k, square in squares.items():
        i = int(pairs[k, 0])
        if i not in meeting and square == least[i] and (limit is None or square <= limit):
            stays[k], distances[k] = True, root_of(square)
    return pairs[stays], distances[stays]


def _rounded(bounds: _Bounds) -> tuple[FloatArray, BoolArray]:
    """Return the distances (n,) of pairs by their `_Bounds.rows`, and (n,) whether each is certainly the nearest
    double: in long doubles, with 12 units of their rounding for the differences, products, sum, quotient and root, and
    the products' size."""
    unit = float(np.finfo(np.longdouble).eps)
    with np.errstate(all="ignore"):
        x, y, ax, ay, bx, by = bounds.rows.astype(np.longdouble).T
        u, v, ux, uy = x - ax, y - ay, bx - ax, by - ay
        length = np.hypot(ux, uy)
        distance = np.where(length > 0.0, np.abs(u * uy - v * ux) / length, np.hypot(u, v))
        error = 12.0 * unit * (distance + np.where(length > 0.0, (np.abs(u * uy) + np.abs(v * ux)) / length, 0.0))
        low, high = (distance - error).astype(np.float64), (distance + error).astype(np.float64)
    return low, bounds.is_alone & (low == high) & (unit < _LONG) & (low > _TINY)


def root_of(square: Fraction) -> float:
    """Return the double nearest to the square root of a positive number; the smallest denormal instead of 0."""
    p, q = square.numerator, square.denominator
    return nearest_with_root(0, 1, p * q, q) or _LEAST


def _square(left: Shapes, right: Shapes, pair: IntArray, reach: float, limits: Limits) -> Fraction:
    """Return the exact square of the distance of a pair that is at most `reach`, and does not meet."""
    (i, j), rows = pair.tolist(), np.empty((64, 6))
    with limits.budget() as budget:
        while True:  # bound: the second turn has room
            n = entry_of(_list_near)(left, right, i, j, reach, rows, np.full(_N_STATE, np.inf), budget.flag)
            budget.check()
            if n <= len(rows):
                break
            rows = np.empty((n, 6))
    return min(map(_exact_square, set(map(tuple, rows[:n].tolist()))))


def _exact_square(row: tuple[float, ...]) -> Fraction:
    """Return the exact square of the distance of a point from a segment, given as x, y, x, y, x, y."""
    (x, y, ax, ay, bx, by), unit = common_integers(row)
    x, y, ux, uy = x - ax, y - ay, bx - ax, by - ay
    along, length = x * ux + y * uy, ux * ux + uy * uy
    if along <= 0:
        return Fraction(x * x + y * y, unit * unit)
    if along >= length:
        return Fraction((x - ux) ** 2 + (y - uy) ** 2, unit * unit)
    return Fraction((x * uy - y * ux) ** 2, length * unit * unit)


class _Bounds(NamedTuple):
    """Bounds on the distances of n pairs of features.

    | field | shape | meaning |
    |---|---|---|
    | low, high | (n,) | distance from below and above; infinity beyond the reach |
    | rows | (n, 6) | point x, y and segment x, y, x, y at about the distance; for two points the segment is a point |
    | is_alone | (n,) | whether no other point and segment of the pair may be as near |
    """

    low: FloatArray
    high: FloatArray
    rows: FloatArray
    is_alone: BoolArray

    def take(self, some: BoolArray) -> _Bounds:
        """Return the bounds of some pairs."""
        return _Bounds(self.low[some], self.high[some], self.rows[some], self.is_alone[some])


def _bounds(
    left: Shapes, right: Shapes, pairs: IntArray, reaches: FloatArray, is_least: bool, limits: Limits
) -> _Bounds:
    """Return bounds on the distances of pairs (n, 2), sorted by left feature. reaches (n,): a larger distance may be
    given as infinity; -infinity for pairs that meet, of which nothing is measured. is_least: also those larger than
    another of the same left feature may be infinite."""
    n = len(pairs)
    made = _Bounds(np.full(n, np.inf), np.full(n, np.inf), np.zeros((n, 6)), np.zeros(n, np.bool_))
    with limits.budget() as budget:

        def task(start: int, stop: int) -> None:
            some = slice(start, stop)
            own, state = (each[some] for each in made), np.empty(_N_STATE)
            entry_of(_measure)(left, right, pairs[some], reaches[some], is_least, *own, state, budget.flag)
            budget.check()

        run_chunks(task, n, budget=budget, workers=limits.workers)
    return made


_ROW, _LOW, _HIGH, _RIVAL, _N_STATE = 6, 7, 8, 9, 10
"""Columns of the state of a scan: the nearest row so far before _ROW, its distance there, bounds of that, and the least
lower bound of all other rows."""


@kernel
def _measure(
    left: Shapes, right: Shapes, pairs: IntArray, reaches: FloatArray, is_least: bool, low: FloatArray,
    high: FloatArray, rows: FloatArray, is_alone: BoolArray, state: FloatArray, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill low .. is_alone, the fields of `_Bounds`, for pairs (n, 2); reaches, is_least: as in `_bounds`. state
    (_N_STATE,): scratch."""
    none, least, before = rows[:0], np.inf, np.int64(-1)
    for item in range(len(pairs)):
        if flag[0] != 0:
            return
        i, j = pairs[item, 0], pairs[item, 1]
        least, before = least if is_least and i == before else np.inf, i
        reach = min(reaches[item], least)
        if _gap(left.boxes, left.box_firsts[i] + 1, right.boxes, right.box_firsts[j] + 1) * (1.0 - _ERROR) > reach:
            least = 0.0 if reach < 0.0 else least
            continue
        own, their = shape_of(left, i), shape_of(right, j)
        state[:_ROW], state[_ROW:] = 0.0, np.inf
        _scan(own, their, reach, none, 0, state, flag)
        _scan(their, own, reach, none, 0, state, flag)
        least = min(least, state[_HIGH])
        low[item], high[item] = min(state[_LOW], state[_RIVAL]), state[_HIGH]
        is_alone[item] = state[_RIVAL] > state[_HIGH]
        for k in range(_ROW):
            rows[item, k] = state[k]


@inline
def _gap(boxes: FloatArray, node: int, others: FloatArray, other: int) -> float:
    """Return the distance of two boxes, rounded."""
    x = max(0.0, max(boxes[node, 0] - others[other, 2], others[other, 0] - boxes[node, 2]))
    y = max(0.0, max(boxes[node, 1] - others[other, 3], others[other, 1] - boxes[node, 3]))
    return hypot(x, y)


@kernel
def _list_near(
    left: Shapes, right: Shapes, i: int, j: int, reach: float, rows: FloatArray, state: FloatArray, flag: FlagArray
) -> int:
    """Fill rows (n, 6) with pairs of a vertex of one feature and an edge of the other (x, y, x, y, x, y) that may be
    within `reach`; return their number, maybe more than the room."""
    own, their = shape_of(left, i), shape_of(right, j)
    return _scan(their, own, reach, rows, _scan(own, their, reach, rows, 0, state, flag), state, flag)


@called
def _scan(own: Shape, their: Shape, reach: float, rows: FloatArray, n: int, state: FloatArray, flag: FlagArray) -> int:
    """Measure each vertex of one feature against the edges of the other that may be within `reach` of it, and update
    `state` (columns above) by these distances; return n.

    With rows (m, 6) not empty, the vertices and edges are written there instead, from row n on, and the number of rows
    with them is returned, maybe more than m. Where an end of the edge is the nearest point, the row has that end as
    both ends of the edge, and the lower of the two points first, so that it is equal seen from either feature."""
    leaves, m, is_list = len(their.boxes) // 2, len(their.following), len(rows) > 0
    for vertex in range(len(own.following)):
        if flag[0] != 0:
            return 0
        p = as_point2(own.points, vertex)
        near = _grown(min(reach, state[_HIGH]), p)
        leaf = next_leaf(their.boxes, 1, p.x - near, p.y - near, p.x + near, p.y + near)
        while leaf > 0:  # bound: each leaf once
            for other in range(BLOCK * (leaf - leaves), min(BLOCK * (leaf - leaves + 1), m)):
                a, b = as_point2(their.points, other), as_point2(their.points, their.following[other])
                distance, error, part = _distance(p, a, b)
                if not distance - error <= min(reach, state[_HIGH]):
                    continue
                q = p
                if part != 0:
                    a = b = a if part < 0 else b
                    if a.x < p.x or (a.x == p.x and a.y < p.y):
                        q, a, b = a, p, p
                if is_list:
                    if n < len(rows):
                        _put(rows, n, q, a, b)
                    n += 1
                elif not _is_put(state, q, a, b):
                    _enter(state, q, a, b, distance, error)
            near = _grown(min(reach, state[_HIGH]), p)
            leaf = next_leaf(their.boxes, after(leaf), p.x - near, p.y - near, p.x + near, p.y + near)
    return n


@inline
def _grown(reach: float, p: Point2) -> float:
    """Return a distance that covers `reach` and the rounding of p plus or minus it."""
    return reach + _ERROR * (reach + abs(p.x) + abs(p.y)) + _TINY


@inline
def _put(rows: FloatArray, n: int, p: Point2, a: Point2, b: Point2) -> None:
    rows[n, 0], rows[n, 1], rows[n, 2], rows[n, 3], rows[n, 4], rows[n, 5] = p.x, p.y, a.x, a.y, b.x, b.y


@inline
def _is_put(state: FloatArray, p: Point2, a: Point2, b: Point2) -> bool:
    """Return whether `state` already has vertex p and edge ab as the nearest so far."""
    return (
        (state[0] == p.x) & (state[1] == p.y) & (state[2] == a.x) & (state[3] == a.y) & (state[4] == b.x)
        & (state[5] == b.y) & (state[_ROW] < np.inf)
    )  # fmt: skip


@inline
def _enter(state: FloatArray, p: Point2, a: Point2, b: Point2, distance: float, error: float) -> None:
    """Update `state` by vertex p and edge ab, whose distance is known to +- error: they become the nearest so far, or
    else lower the bound on all others."""
    low = max(0.0, distance - error)
    if distance < state[_ROW]:
        state[_RIVAL] = min(state[_RIVAL], state[_LOW])
        state[0], state[1], state[2], state[3], state[4], state[5] = p.x, p.y, a.x, a.y, b.x, b.y
        state[_ROW], state[_LOW], state[_HIGH] = distance, low, distance + error
    else:
        state[_RIVAL] = min(state[_RIVAL], low)


@inline
def _distance(p: Point2, a: Point2, b: Point2) -> tuple[float, float, int]:
    """Return the rounded distance of p from segment ab, a bound on its error, and which point of the segment is
    nearest: a (-1), b (1), or one between (0)."""
    x, y, ux, uy = p.x - a.x, p.y - a.y, b.x - a.x, b.y - a.y
    along, length = x * ux + y * uy, ux * ux + uy * uy
    error = _ERROR * (abs(x) + abs(y) + abs(ux) + abs(uy)) + _TINY
    if along <= 0.0 or length == 0.0:
        return hypot(x, y), error, -1
    if along >= length:
        return hypot(p.x - b.x, p.y - b.y), error, 1
    return abs(x * uy - y * ux) / length**0.5, error, 0
