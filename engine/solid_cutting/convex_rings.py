"""Compiled: the area that two convex polygons have in common, and its ratio to their union, for many pairs.

Each edge p q of either polygon lies in the other from t to s, cut at its lines (Cyrus-Beck); with positions taken from
one origin, and counter-clockwise rings,

    2 area = sum over all edges of (s - t) (p x q)                       (Green's theorem)

Nothing is decided by t and s: they depend continuously on the input, so the greater of two values that their errors do
not separate is within the greater of both errors. Signs are exact. An edge on a line of the other counts once: as one
of the first polygon, and only if both run in one direction. Where an edge of one has all of the other on its right or
on it, nothing is common; two convex polygons without common interior have such an edge.

With u = 2^-53 and P the sum of the two products of a determinant in size, a determinant of exact differences is off by
24 u^2 P (`sums.py`), t = N / D by (its N and D errors) / |D| + 17 u^2, a term by its factors' errors and 20 u^2 of its
size, additions by 4 u^2 of all sizes each. The double nearest to the result is certain where this bound
says so; else the pair is NaN.

Source: M. Cyrus, J. Beck, Generalized two- and three-dimensional clipping, 1978; G. Green, 1828.
"""

from __future__ import annotations

from typing import Final

from engine.compiling.jit import called, inline, kernel
from engine.predicates.error_free import U2, dd_add, dd_div, dd_mul, dd_sub, two_diff, workspace
from engine.predicates.orientation import BOUND_2D, GUARD_2D, orient2d_exact
from engine.solid_cutting.sums import certified, cross_of
from engine.types import UNDECIDED, FlagArray, FloatArray, Point2

MOST_CORNERS: Final = 16
"""Corners up to which a polygon is taken here."""
_TINY: Final = 2.0**-1000
_SUMMED: Final = 4.0 * 2 * MOST_CORNERS * U2
"""Error of adding 2 MOST_CORNERS terms, of their sizes."""
_CLEAR: Final = 2.0**-20
"""Bounds beyond which a place between 0 and 1 is taken as unknown: an error of 1."""
_POLL: Final = 0xFFF


@inline
def _copy_turned(rings: FloatArray, item: int, x: FloatArray, y: FloatArray) -> bool:
    """Copy a ring counter-clockwise; return whether it is proven to be strictly convex."""
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
    x: FloatArray, y: FloatArray, n: int, ox: FloatArray, oy: FloatArray, m: int, sides: FloatArray, values: FloatArray
) -> int:
    """Fill sides, values [j n + i] with the side of edge j of the other polygon on which corner i is, exact, and the
    rounded determinant; return 1, 0 if an edge has all corners on its right or on it, -1 for UNDECIDED."""
    for a in range(m):
        b = a + 1 if a + 1 < m else 0
        ux, uy, is_beside = ox[b] - ox[a], oy[b] - oy[a], True
        for i in range(n):
            left, right = ux * (y[i] - oy[a]), uy * (x[i] - ox[a])
            value = left - right
            side = 1.0 if value > 0.0 else -1.0
            if not abs(value) > BOUND_2D * (abs(left) + abs(right)) + GUARD_2D:
                exact = orient2d_exact(Point2(ox[a], oy[a]), Point2(ox[b], oy[b]), Point2(x[i], y[i]))
                if exact == UNDECIDED:
                    return -1
                side = float(exact)
            is_beside = is_beside and side <= 0.0
            sides[a * n + i], values[a * n + i] = side, value
        if is_beside:
            return 0
    return 1


@inline
def _crossing(
    x: FloatArray, y: FloatArray, i: int, k: int, ox: FloatArray, oy: FloatArray, a: int, b: int
) -> tuple[float, float, float]:
    """Return (h, l, bound): where on its way from corner i to k an edge crosses the line from a to b of the other."""
    uh, ul = two_diff(ox[b], ox[a])
    vh, vl = two_diff(oy[b], oy[a])
    sh, sl = two_diff(x[i], ox[a])
    th, tl = two_diff(y[i], oy[a])
    h, low, size = cross_of(uh, ul, th, tl, vh, vl, sh, sl)
    sh, sl = two_diff(x[i], x[k])
    th, tl = two_diff(y[i], y[k])
    over_h, over_l, over_size = cross_of(uh, ul, th, tl, vh, vl, sh, sl)
    h, low = dd_div(h, low, over_h, over_l)
    bound = 1.01 * (24.0 * U2 * (size + over_size) + _TINY) / abs(over_h) + 17.0 * U2
    return h, low, bound if bound < _CLEAR else 1.0


@inline
def _part_within(
    x: FloatArray, y: FloatArray, i: int, k: int, n: int, ox: FloatArray, oy: FloatArray, m: int, sides: FloatArray,
    values: FloatArray, limits: tuple[float, float, float],
) -> tuple[float, float, float]:  # fmt: skip
    """Return (h, l, bound): s - t of the edge from corner i to k. limits: t at least and s at most, within their
    errors, and slack as for `_add_edges`."""
    low, high, slack = limits
    th, tl, t_error, sh, sl, s_error = 0.0, 0.0, 0.0, 1.0, 0.0, 0.0
    for a in range(m):
        p = sides[a * n + i]
        if p * sides[a * n + k] < 0.0:
            over = 1.0 / (values[a * n + i] - values[a * n + k])
            t, off = values[a * n + i] * over, slack * abs(over) + 2.0**-50
            if (p > 0.0 and t - off > high) or (p < 0.0 and t + off < low):
                continue  # another line cuts more
            h, rest, bound = _crossing(x, y, i, k, ox, oy, a, a + 1 if a + 1 < m else 0)
            if p > 0.0:
                s_error = max(s_error, bound)
                if (h - sh) + (rest - sl) < 0.0:
                    sh, sl = h, rest
            else:
                t_error = max(t_error, bound)
                if (h - th) + (rest - tl) > 0.0:
                    th, tl = h, rest
    sh, sl = dd_sub(sh, sl, th, tl)
    return sh, sl, t_error + s_error + 20.0 * U2


@called
def _add_edges(
    x: FloatArray, y: FloatArray, n: int, ox: FloatArray, oy: FloatArray, m: int, sides: FloatArray,
    values: FloatArray, origin: tuple[float, float], slack: float, is_first: bool, sums: FloatArray,
) -> None:  # fmt: skip
    """Add the edges of one polygon to sums[0:3], twice the common area as a double-double and a bound, and without cuts
    to sums[3:6]. slack: a bound on the errors of values, times 3: t = p / (p - q) is off by 3 of them over p - q."""
    for i in range(n):
        k = i + 1 if i + 1 < n else 0
        ah, al = two_diff(x[i], origin[0])
        bh, bl = two_diff(y[k], origin[1])
        ch, cl = two_diff(y[i], origin[1])
        dh, dl = two_diff(x[k], origin[0])
        ph, pl, size = cross_of(ah, al, bh, bl, ch, cl, dh, dl)
        sums[3], sums[4] = dd_add(sums[3], sums[4], ph, pl)
        error = 25.0 * U2 * size + _SUMMED * abs(ph) + _TINY
        sums[5] += error
        low, high, is_out, n_cuts = 0.0, 1.0, False, 0
        for a in range(m):
            p, q = sides[a * n + i], sides[a * n + k]
            if p * q < 0.0:
                over = 1.0 / (values[a * n + i] - values[a * n + k])
                t, off = values[a * n + i] * over, slack * abs(over) + 2.0**-50
                n_cuts += 1
                if p > 0.0 and t + off < high:
                    high = t + off
                elif p < 0.0 and t - off > low:
                    low = t - off
            elif p + q < 0.0:
                is_out = True
            elif p == 0.0 and q == 0.0:  # case: on its line
                b = a + 1 if a + 1 < m else 0
                is_along = (x[k] > x[i]) == (ox[b] > ox[a]) and (y[k] > y[i]) == (oy[b] > oy[a])  # no underflow
                is_out = is_out or not (is_first and is_along)
        if is_out or low > high:
            continue
        if n_cuts:
            wh, wl, off = _part_within(x, y, i, k, n, ox, oy, m, sides, values, (low, high, slack))
            error += abs(ph) * off
            ph, pl = dd_mul(wh, wl, ph, pl) if wh > 0.0 else (0.0, 0.0)
        sums[0], sums[1] = dd_add(sums[0], sums[1], ph, pl)
        sums[2] += error


@kernel
def overlap_rings(first: FloatArray, second: FloatArray, is_ratio: bool, values: FloatArray, flag: FlagArray) -> int:
    """Fill values (n,) with the common areas of pairs of polygons (n, k, 2), (n, m, 2), or their ratios to the union,
    NaN where that is not proven or a polygon is not convex; return the number of NaN. k, m: at most MOST_CORNERS."""
    n, m, n_open = first.shape[1], second.shape[1], 0
    x, y, ox, oy = workspace(16), workspace(16), workspace(16), workspace(16)
    sides, products, other_sides, other_products = workspace(256), workspace(256), workspace(256), workspace(256)
    sums = workspace(6)
    for item in range(first.shape[0]):
        if item & _POLL == 0 and flag[0] != 0:
            break
        span, is_apart = 0.0, False
        for axis in range(2):
            low, high = first[item, 0, axis], first[item, 0, axis]
            for k in range(1, n):
                low, high = min(low, first[item, k, axis]), max(high, first[item, k, axis])
            other_low, other_high = second[item, 0, axis], second[item, 0, axis]
            for k in range(1, m):
                other_low, other_high = min(other_low, second[item, k, axis]), max(other_high, second[item, k, axis])
            is_apart = is_apart or high <= other_low or other_high <= low
            span = max(span, max(high, other_high) - min(low, other_low))
        values[item] = 0.0
        if is_apart:
            continue
        lies = -1
        if _copy_turned(first, item, x, y) and _copy_turned(second, item, ox, oy):
            lies = _find_sides(x, y, n, ox, oy, m, sides, products)
            if lies > 0:
                lies = _find_sides(ox, oy, m, x, y, n, other_sides, other_products)
        if lies == 0:
            continue
        result = float("nan")
        if lies > 0:
            for k in range(6):
                sums[k] = 0.0
            origin, slack = (x[0], y[0]), 2.0**-47 * span * span + _TINY
            _add_edges(x, y, n, ox, oy, m, sides, products, origin, slack, True, sums)
            _add_edges(ox, oy, m, x, y, n, other_sides, other_products, origin, slack, False, sums)
            result = certified(sums, 2.0, is_ratio)
        n_open += result != result
        values[item] = result
    return n_open
