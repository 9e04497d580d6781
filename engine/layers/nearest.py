"""How far apart features are: bounds by doubles for many pairs, exact squares where bounds do not decide; compiled.

The distance of two features that do not meet is that of a vertex of one and an edge of the other. In doubles it is off
by less than 32 u (|p - a| + |b - a|) for a vertex p and an edge ab: differences carry u each, the cross product 4 u of
both products, and a foot that is taken for an end, or the reverse, moves it by the error of its place, 6 u |p - a|.
"""

from __future__ import annotations

from fractions import Fraction
from math import hypot, inf
from typing import Any, Final

import numpy as np

from engine.arrangement.simple_rings import BLOCK, after, next_leaf
from engine.compiling.jit import allocating_kernel, called, entry_of, inline
from engine.layers.relate import matrices
from engine.layers.rows import Limits
from engine.layers.shapes import Shape, Shapes, pairs_between, shape_of
from engine.predicates.rational import nearest_with_root
from engine.predicates.vectors import as_point2
from engine.running.parallel import run_chunks
from engine.types import BoolArray, FlagArray, FloatArray, IntArray, Point2

_ERROR: Final = 2.0**-48
_TINY: Final = 2.0**-530
_LEAST: Final = 5e-324
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
    low, high = _bounds(left, right, pairs[rest], np.full(len(rest), distance), limits)
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
        low, high = np.zeros(len(pairs)), np.zeros(len(pairs))
        low[~made], high[~made] = _bounds(left, right, pairs[~made], reaches[pairs[~made, 0]], limits)
        np.minimum.at(best, pairs[:, 0], high)
        is_last = reach >= min(most, 2.0 * extent)
        done = open_ if is_last else open_[best[open_] <= reach]
        some = np.zeros(len(left.dims), np.bool_)
        some[done] = True
        near = some[pairs[:, 0]] & (low <= best[pairs[:, 0]]) & (low <= most)
        chosen, exact = _ties(left, right, pairs[near], low[near], high[near], most, limits)
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
    left: Shapes, right: Shapes, pairs: IntArray, low: FloatArray, high: FloatArray, most: float, limits: Limits
) -> tuple[IntArray, FloatArray]:
    """Return those of pairs, sorted by left feature, whose exact distance is the least, and at most `most`."""
    distances, stays = np.zeros(len(pairs)), high == 0.0
    squares: dict[int, Fraction] = {}
    for k in np.flatnonzero(~stays).tolist():
        squares[k] = _square(left, right, pairs[k], float(high[k]), limits)
    least: dict[int, Fraction] = {}
    for k, square in squares.items():
        least[int(pairs[k, 0])] = min(square, least.get(int(pairs[k, 0]), square))
    meeting = set(pairs[stays, 0].tolist())
    limit = None if most == inf else Fraction(most) ** 2
    for k, square in squares.items():
        i = int(pairs[k, 0])
        if i not in meeting and square == least[i] and (limit is None or square <= limit):
            stays[k], distances[k] = True, root_of(square)
    return pairs[stays], distances[stays]


def root_of(square: Fraction) -> float:
    """Return the double nearest to the square root of a positive number; the smallest denormal instead of 0."""
    p, q = square.numerator, square.denominator
    return nearest_with_root(0, 1, p * q, q) or _LEAST


def _square(left: Shapes, right: Shapes, pair: IntArray, reach: float, limits: Limits) -> Fraction:
    """Return the exact square of the distance of a pair that is at most `reach`, and does not meet."""
    i, j = pair.tolist()
    rows = np.empty((64, 6))
    while True:  # bound: the second turn has room
        n = entry_of(_list_near)(left, right, i, j, reach, rows)
        if n <= len(rows):
            break
        rows = np.empty((n, 6))
    limits.budget().check()
    return min(_exact_square(*map(Fraction, row)) for row in set(map(tuple, rows[:n].tolist())))


def _exact_square(x: Any, y: Any, ax: Any, ay: Any, bx: Any, by: Any) -> Fraction:
    """Return the exact square of the distance of a point from a segment."""
    x, y, ux, uy = x - ax, y - ay, bx - ax, by - ay
    along, length = x * ux + y * uy, ux * ux + uy * uy
    if along <= 0:
        return Fraction(x * x + y * y)
    if along >= length:
        return Fraction((x - ux) ** 2 + (y - uy) ** 2)
    return Fraction((x * uy - y * ux) ** 2, 1) / length


def _bounds(
    left: Shapes, right: Shapes, pairs: IntArray, reaches: FloatArray, limits: Limits
) -> tuple[FloatArray, FloatArray]:
    """Return bounds (low, high) of the distances of pairs that do not meet; infinite beyond their reach."""
    low, high = np.empty(len(pairs)), np.empty(len(pairs))
    with limits.budget() as budget:

        def task(start: int, stop: int) -> None:
            some = slice(start, stop)
            entry_of(_measure)(left, right, pairs[some], reaches[some], low[some], high[some], budget.flag)
            budget.check()

        run_chunks(task, len(pairs), budget=budget, workers=limits.workers)
    return low, high


@allocating_kernel
def _measure(
    left: Shapes, right: Shapes, pairs: IntArray, reaches: FloatArray, low: FloatArray, high: FloatArray,
    flag: FlagArray,
) -> None:  # fmt: skip
    """Fill low and high (n,)."""
    rows = np.empty((0, 6))
    for item in range(len(pairs)):
        if flag[0] != 0:
            return
        i, j = pairs[item, 0], pairs[item, 1]
        own, their = shape_of(left, i), shape_of(right, j)
        below, above, _ = _scan(own, their, reaches[item], rows, 0)
        least, most, _ = _scan(their, own, min(reaches[item], above), rows, 0)
        low[item], high[item] = min(below, least), min(above, most)


@allocating_kernel
def _list_near(left: Shapes, right: Shapes, i: int, j: int, reach: float, rows: FloatArray) -> int:
    """Fill rows (n, 6) with vertices and edges (x, y, x, y, x, y) that may be within `reach`; return their number."""
    own, their = shape_of(left, i), shape_of(right, j)
    return _scan(their, own, reach, rows, _scan(own, their, reach, rows, 0)[2])[2]


@called
def _scan(own: Shape, their: Shape, reach: float, rows: FloatArray, n: int) -> tuple[float, float, int]:
    """Return bounds of the least distance of a vertex of one feature from an edge of another, infinite beyond `reach`.
    rows: if there are any, filled from row n on with all within `reach`, the number of which is the third result."""
    low, high, leaves, m = np.inf, np.inf, len(their.boxes) // 2, len(their.following)
    is_list = len(rows) > 0
    for vertex in range(len(own.following)):
        p = as_point2(own.points, vertex)
        near = reach + _ERROR * reach + _ERROR * (abs(p.x) + abs(p.y)) + _TINY
        leaf = next_leaf(their.boxes, 1, p.x - near, p.y - near, p.x + near, p.y + near)
        while leaf > 0:  # bound: each leaf once
            for other in range(BLOCK * (leaf - leaves), min(BLOCK * (leaf - leaves + 1), m)):
                a, b = as_point2(their.points, other), as_point2(their.points, their.following[other])
                distance, error = _distance(p, a, b)
                if distance - error > reach:
                    continue
                if is_list:
                    if n < len(rows):
                        rows[n, 0], rows[n, 1], rows[n, 2] = p.x, p.y, a.x
                        rows[n, 3], rows[n, 4], rows[n, 5] = a.y, b.x, b.y
                    n += 1
                    continue
                low, high = min(low, max(0.0, distance - error)), min(high, distance + error)
                reach = min(reach, high)
            near = reach + _ERROR * reach + _ERROR * (abs(p.x) + abs(p.y)) + _TINY
            leaf = next_leaf(their.boxes, after(leaf), p.x - near, p.y - near, p.x + near, p.y + near)
    return low, high, n


@inline
def _distance(p: Point2, a: Point2, b: Point2) -> tuple[float, float]:
    """Return the distance of p from the segment ab, rounded, and a bound on its error."""
    x, y, ux, uy = p.x - a.x, p.y - a.y, b.x - a.x, b.y - a.y
    along, length = x * ux + y * uy, ux * ux + uy * uy
    error = _ERROR * (abs(x) + abs(y) + abs(ux) + abs(uy)) + _TINY
    if along <= 0.0 or length == 0.0:
        return hypot(x, y), error
    if along >= length:
        return hypot(x - ux, y - uy), error
    return abs(x * uy - y * ux) / length**0.5, error
