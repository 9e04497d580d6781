"""Compiled: the area that two convex polygons have in common, and its ratio to their union, for many pairs.

Signs are exact; where a corner is on a line, the second polygon counts as a little larger, each of its lines moved
outwards by less than anything, the first one most (simulation of simplicity): then no corner is on a line, and edges
meet in crossings alone. The common part is bounded by the part of each edge that is in the other polygon, from t to s;
with positions taken from one origin, and counter-clockwise rings,

    2 area = sum over all edges of (s - t) (p x q)                       (Green's theorem)

s is 1 where the edge ends inside, t is 0 where it starts there; other ends are crossings. Where an edge p, p + u
crosses an edge q, q + v, at s of one and t of the other, or the other way round, with w = p - q, both add

    +- ((v x w) (p x (p + u)) - (u x w) (q x (q + v))) / (u x v)

Where an edge of one has all of the other on its right or on it, nothing is common; two convex polygons without common
interior have such an edge.

With u = 2^-53 and P the sum of the two products of a determinant in size, a determinant of exact differences is off by
24 u^2 P (`sums.py`); products, differences and quotients of these by their factors' errors and 5, 4 and 17 u^2 of their
sizes, a sum of k terms by 4 k^2 u^2 of all sizes (`sums.py`). The double nearest to the result is certain where this
bound says so; else the pair is NaN.

Source: H. Edelsbrunner, E. P. Muecke, Simulation of simplicity, 1990; G. Green, 1828.
"""

from __future__ import annotations

from typing import Final

from engine.compiling.jit import called, inline, kernel
from engine.lanes.lanes import lowest_bit
from engine.predicates.error_free import U2, dd_div, dd_mul, dd_sub, two_diff, two_sum, workspace
from engine.predicates.orientation import BOUND_2D, GUARD_2D, orient2d_exact
from engine.solid_cutting.sums import certified, cross_of
from engine.types import UNDECIDED, FlagArray, FloatArray, IntArray, Point2

MOST_CORNERS: Final = 16
"""Corners up to which a polygon is taken here."""
_TINY: Final = 2.0**-1000
_EDGE: Final = 8
"""Numbers of an edge p q: q - p (x high, low, y high, low), p x q (high, low, error)."""
_UNKNOWN: Final = float("inf")
_POLL: Final = 0xFFF
Sums = tuple[float, float, float, float]


@inline
def _copy_turned(rings: FloatArray, item: int, x: FloatArray, y: FloatArray) -> bool:
    """Copy ring `item` of rings (n, k, 2), turned counter-clockwise, to x and y; return whether it is proven strictly
    convex."""
    n, n_left, n_right, n_turns = rings.shape[1], 0, 0, 0
    j = n - 1
    ux, uy = rings[item, j, 0] - rings[item, j - 1, 0], rings[item, j, 1] - rings[item, j - 1, 1]
    for k in range(n):
        vx, vy = rings[item, k, 0] - rings[item, j, 0], rings[item, k, 1] - rings[item, j, 1]
        left, right = ux * vy, uy * vx
        threshold = BOUND_2D * (abs(left) + abs(right)) + GUARD_2D
        n_left += left - right > threshold
        n_right += right - left > threshold
        n_turns += (ux > 0.0) != (vx > 0.0)  # twice, if it runs around once
        ux, uy, j = vx, vy, k
    is_turned = n_right == n
    for k in range(n):
        place = n - 1 - k if is_turned else k
        x[place], y[place] = rings[item, k, 0], rings[item, k, 1]
    return (n_left == n or is_turned) and n_turns == 2


@called
def _find_sides(
    x: FloatArray, y: FloatArray, n: int, ox: FloatArray, oy: FloatArray, m: int, inside: IntArray, on: IntArray
) -> int:
    """Fill inside, on (m,) with which corners are strictly on the left of each edge of the other polygon, and which on
    its line, as bits, exact; return 1, 2 if some are on one, 0 if an edge has none on its left, -1 for UNDECIDED."""
    result = 1
    for a in range(m):
        b, left_ones, right_ones = a + 1 if a + 1 < m else 0, 0, 0
        ux, uy = ox[b] - ox[a], oy[b] - oy[a]
        for i in range(n):
            left, right = ux * (y[i] - oy[a]), uy * (x[i] - ox[a])
            value, bound = left - right, BOUND_2D * (abs(left) + abs(right)) + GUARD_2D
            left_ones |= int(value > bound) << i
            right_ones |= int(-value > bound) << i
        open_ones = (1 << n) - 1 ^ (left_ones | right_ones)
        on[a] = 0
        while open_ones != 0:  # bound: each turn ends a corner
            i = lowest_bit(open_ones)
            open_ones ^= 1 << i
            side = orient2d_exact(Point2(ox[a], oy[a]), Point2(ox[b], oy[b]), Point2(x[i], y[i]))
            if side == UNDECIDED:
                return -1
            left_ones |= int(side > 0) << i
            on[a] |= int(side == 0) << i
            result = 2 if side == 0 else result
        inside[a] = left_ones
        if left_ones == 0:
            return 0
    return result


@called
def _move_lines(inside: IntArray, on: IntArray, n: int, other_inside: IntArray, other_on: IntArray, m: int) -> None:
    """Take corners on lines to where they are if the lines of the second polygon are moved outwards, the first one
    most, each of the others less than those before.

    Its corner j goes on along the edge before if line j moves, back along the edge after if line j - 1 does.
    """
    for a in range(m):
        inside[a] |= on[a]
    for i in range(n):
        bits, left_ones = other_on[i], other_inside[i]
        while bits != 0:  # bound: each turn ends a corner
            j = lowest_bit(bits)
            bits ^= 1 << j
            before, after = j - 1 if j > 0 else m - 1, j + 1 if j + 1 < m else 0
            first, second = (after, before) if j > 0 else (before, after)
            guide = second if other_on[i] >> first & 1 else first
            left_ones |= (other_inside[i] >> guide & 1 ^ 1) << j
        other_inside[i] = left_ones


@inline
def _changes(bits: int, n: int) -> int:
    """Return the bits of a ring of n that are not as the ones after."""
    return bits ^ (bits >> 1 | (bits & 1) << (n - 1))


@inline
def _add(sums: Sums, h: float, low: float, error: float) -> Sums:
    """Return a sum with a term more: high part, low part, bound on the errors of all terms, their sizes."""
    total, lost = two_sum(sums[0], h)
    return total, sums[1] + (lost + low), sums[2] + error, sums[3] + abs(h)


@called
def _set_edges(x: FloatArray, y: FloatArray, n: int, origin: tuple[float, float], edges: FloatArray) -> Sums:
    """Fill the edges of a polygon; return the sum of p x q of all."""
    ah, al = two_diff(x[0], origin[0])
    bh, bl = two_diff(y[0], origin[1])
    sums = (0.0, 0.0, 0.0, 0.0)
    for i in range(n):
        k, at = i + 1 if i + 1 < n else 0, i * _EDGE
        ch, cl = two_diff(x[k], origin[0])
        dh, dl = two_diff(y[k], origin[1])
        ph, pl, size = cross_of(ah, al, dh, dl, bh, bl, ch, cl)
        ah, al, bh, bl = ch, cl, dh, dl
        edges[at], edges[at + 1] = two_diff(x[k], x[i])
        edges[at + 2], edges[at + 3] = two_diff(y[k], y[i])
        edges[at + 4], edges[at + 5], edges[at + 6] = ph, pl, 24.0 * U2 * size + _TINY
        sums = _add(sums, ph, pl, edges[at + 6])
    return sums


@inline
def _add_edges_inside(inside: IntArray, n: int, m: int, edges: FloatArray, sums: Sums) -> Sums:
    """Return the sum with p x q of the edges that end inside the other polygon."""
    within = inside[0]
    for a in range(1, m):
        within &= inside[a]
    for i in range(n):
        at, weight = i * _EDGE, float(within >> (i + 1 if i + 1 < n else 0) & 1)  # no branch: not to be predicted
        sums = _add(sums, weight * edges[at + 4], weight * edges[at + 5], weight * edges[at + 6])
    return sums


@inline
def _add_crossing(
    wx: tuple[float, float], wy: tuple[float, float], p: FloatArray, at: int, q: FloatArray, to: int, way: float,
    sums: Sums,
) -> Sums:  # fmt: skip
    """Return the sum with what the crossing of edge `at` of p and edge `to` of q adds, way: 1.0 where p starts inside.
    wx, wy: from the start of q's edge to that of p's."""
    uxh, uxl, uyh, uyl, ch, cl, c_error = p[at], p[at + 1], p[at + 2], p[at + 3], p[at + 4], p[at + 5], p[at + 6]
    vxh, vxl, vyh, vyl, dh, dl, d_error = q[to], q[to + 1], q[to + 2], q[to + 3], q[to + 4], q[to + 5], q[to + 6]
    sh, sl, size = cross_of(vxh, vxl, wy[0], wy[1], vyh, vyl, wx[0], wx[1])
    th, tl, other_size = cross_of(uxh, uxl, wy[0], wy[1], uyh, uyl, wx[0], wx[1])
    over_h, over_l, over_size = cross_of(uxh, uxl, vyh, vyl, uyh, uyl, vxh, vxl)
    error = abs(ch) * (24.0 * U2 * size + _TINY) + abs(sh) * c_error
    error += abs(dh) * (24.0 * U2 * other_size + _TINY) + abs(th) * d_error
    sh, sl = dd_mul(sh, sl, ch, cl)
    th, tl = dd_mul(th, tl, dh, dl)
    error += 10.0 * U2 * (abs(sh) + abs(th)) + _TINY
    sh, sl = dd_sub(sh, sl, th, tl)
    sh, sl = dd_div(sh, sl, over_h, over_l)
    over_error = 24.0 * U2 * over_size + _TINY
    error = 1.01 * (error + abs(sh) * over_error) / abs(over_h) + 17.0 * U2 * abs(sh)
    is_sure = 2.0**-20 * abs(over_h) > over_error
    return _add(sums, way * sh, way * sl, error if is_sure else _UNKNOWN)


@called
def _value_of(
    x: FloatArray, y: FloatArray, n: int, ox: FloatArray, oy: FloatArray, m: int, edges: FloatArray,
    other_edges: FloatArray, sides: IntArray, is_ratio: bool, sums: FloatArray,
) -> float:  # fmt: skip
    """Return the value of two strictly convex polygons, NaN where it is not certain. edges, other_edges, sides, sums:
    scratch, as `overlap_rings` makes it."""
    inside, on, other_inside, other_on = sides[0], sides[1], sides[2], sides[3]
    lies = _find_sides(x, y, n, ox, oy, m, inside, on)
    if lies > 0:
        others_lie = _find_sides(ox, oy, m, x, y, n, other_inside, other_on)
        lies = max(lies, others_lie) if others_lie > 0 else others_lie
    if lies <= 0:
        return 0.0 if lies == 0 else float("nan")
    if lies > 1:
        _move_lines(inside, on, n, other_inside, other_on, m)
    total, other = _set_edges(x, y, n, (x[0], y[0]), edges), _set_edges(ox, oy, m, (x[0], y[0]), other_edges)
    total = _add((total[0], total[1], total[2], total[3] + other[3]), other[0], other[1], other[2])
    common = _add_edges_inside(inside, n, m, edges, (0.0, 0.0, 0.0, 0.0))
    common = _add_edges_inside(other_inside, m, n, other_edges, common)
    for i in range(n):
        on[i] = _changes(other_inside[i], m)
    for a in range(m):
        crossed = _changes(inside[a], n)
        while crossed != 0:  # bound: each turn ends an edge
            i = lowest_bit(crossed)
            crossed ^= 1 << i
            if on[i] >> a & 1:
                wx, wy = two_diff(x[i], ox[a]), two_diff(y[i], oy[a])
                way = 1.0 if inside[a] >> i & 1 else -1.0
                common = _add_crossing(wx, wy, edges, i * _EDGE, other_edges, a * _EDGE, way, common)
    summed = 16.0 * float((n + m) * (n + m)) * U2  # an edge for each corner, and no more crossings
    sums[0], sums[1], sums[2] = common[0], common[1], common[2] + summed * common[3]
    sums[3], sums[4], sums[5] = total[0], total[1], total[2] + summed * total[3]
    return certified(sums, 2.0, is_ratio)


@kernel
def overlap_rings(
    first: FloatArray, second: FloatArray, is_ratio: bool, sides: IntArray, values: FloatArray, flag: FlagArray
) -> int:
    """Fill values (n,) with the common areas of pairs of polygons (n, k, 2), (n, m, 2), or their ratios to the union,
    NaN where that is not proven or a polygon is not convex; return the number of NaN. k, m: at most MOST_CORNERS.
    sides (4, MOST_CORNERS): scratch."""
    n, m, n_open = first.shape[1], second.shape[1], 0
    x, y, ox, oy = workspace(16), workspace(16), workspace(16), workspace(16)
    edges, other_edges, sums = workspace(128), workspace(128), workspace(6)
    for item in range(first.shape[0]):
        if item & _POLL == 0 and flag[0] != 0:
            break
        is_apart = False
        for axis in range(2):
            low, high = first[item, 0, axis], first[item, 0, axis]
            for k in range(1, n):
                low, high = min(low, first[item, k, axis]), max(high, first[item, k, axis])
            other_low, other_high = second[item, 0, axis], second[item, 0, axis]
            for k in range(1, m):
                other_low, other_high = min(other_low, second[item, k, axis]), max(other_high, second[item, k, axis])
            is_apart = is_apart or high <= other_low or other_high <= low
        values[item] = 0.0
        if is_apart:
            continue
        values[item] = float("nan")
        if _copy_turned(first, item, x, y) and _copy_turned(second, item, ox, oy):
            values[item] = _value_of(x, y, n, ox, oy, m, edges, other_edges, sides, is_ratio, sums)
        n_open += values[item] != values[item]
    return n_open


@kernel
def turn_boxes(boxes: FloatArray, cosines: FloatArray, sines: FloatArray, corners: FloatArray) -> None:
    """Fill corners (n, 4, 2) of boxes (n, 5), by middle, width, height and angle, whose cosines and sines are given."""
    for item in range(boxes.shape[0]):
        width, height, cosine, sine = boxes[item, 2], boxes[item, 3], cosines[item] / 2.0, sines[item] / 2.0
        for axis in range(2):
            along, across = (cosine * width, -sine * height) if axis == 0 else (sine * width, cosine * height)
            middle, plus, minus = boxes[item, axis], along + across, along - across
            corners[item, 0, axis], corners[item, 1, axis] = middle - plus, middle + minus
            corners[item, 2, axis], corners[item, 3, axis] = middle + plus, middle - minus
