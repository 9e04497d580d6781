"""Areas of rings of implicit points, as certified doubles: double-doubles with a running bound.

Twice the area is the sum of x_k (y_k+1 - y_k-1), places counted from a vertex near the ring. A vertex is known exactly;
the crossing of the edges ab and cd lies at a + t (b - a) with t = |w_a| / (|w_a| + |w_b|), the weights of
crossing_signs.py: t carries their relative errors and 20 u^2, the place that of t (b - a) and 4 u^2 for each sum. In a
sum of n terms, each is off by the errors of its factors and 12 u^2 of its size; what sums lose adds up to a second
double, which is off by less than (2 n + n^2) u^2 of all sizes, twice over. Where a weight is less than a thousand times
its bound both come from expansions, if exponents allow.

Where the ring runs along the input for long, x is counted from a double o from which no difference is rounded: that of
the ring's first vertex where all are between its half and its double (P. H. Sterbenz, Floating-point computation, 1974,
theorem 4.3.1), or else zero, and then x is no larger than twice what the ring is wide.

What the bound leaves open (a tie, a sum that nearly cancels, exponents near the ends) the caller settles in integers.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import inline, kernel, merged
from engine.polygon_overlay.compiled.clearance import common_places, weights_of
from engine.polygon_overlay.compiled.crossing_signs import Ends
from engine.polygon_overlay.compiled.loading import RingArrays
from engine.predicates.error_free import (
    U2,
    dd_add,
    dd_div,
    dd_mul,
    dd_sub,
    fast_two_sum,
    fma,
    surely_rounded,
    two_diff,
    two_sum,
    workspace,
)
from engine.types import FlagArray, FloatArray, Int32Array, IntArray

_TINY = 2.0**-1040
"""More than what an underflow may lose in a term."""
_LANES: Final = 8
_SUMS: Final = 3 * _LANES
_BLOCK: Final = 32
"""Vertices, one after another in the input, whose terms are summed apart, so many at once. The sums are joined at the
end: eight terms more are within twice the bound of as many as a block has."""


class _Place(NamedTuple):
    """A point, as double-doubles counted from another, and a bound of the error of each coordinate."""

    xh: float
    xl: float
    yh: float
    yl: float
    error: float


class _Pair(NamedTuple):
    """Polygons, and of a pair of them: first vertex of its subject, number of its vertices, first vertex of its clip;
    known: the ring that was found last, of either polygon."""

    subjects: Any
    clips: Any
    first: int
    n: int
    second: int
    known: Any


@merged
def _found(pair: _Pair, v: int) -> tuple[Any, int, int]:
    """Return the vertices that vertex v of a pair is one of, its place there, and 0 or 1 as it is the subject's."""
    if v < pair.n:
        return pair.subjects.vertices, pair.first + v, 0
    return pair.clips.vertices, pair.second + v - pair.n, 1


@merged
def _end_of(vertices: FloatArray, offsets: IntArray, v: int, known: Any, side: int) -> int:
    """Return the next vertex of the ring of vertex v that is not at its place (v if there is none)."""
    low, n = int(known[side]), offsets.shape[0] - 1
    if not offsets[low] <= v < offsets[low + 1]:
        low = (v - offsets[0]) * n // (offsets[n] - offsets[0])  # where all rings are of one size
    if not offsets[low] <= v < offsets[low + 1]:
        low, high = 0, n
        while high - low > 1:  # bound: halves
            middle = (low + high) // 2
            if offsets[middle] <= v:
                low = middle
            else:
                high = middle
    known[side] = low
    start, stop = offsets[low], offsets[low + 1]
    after = v
    for _ in range(stop - start):
        after = after + 1 if after + 1 < stop else start
        if vertices[after, 0] != vertices[v, 0] or vertices[after, 1] != vertices[v, 1]:
            break
    return after


@merged
def _edge(pair: _Pair, e: int) -> Ends:
    """Return the ends of the edge that begins with vertex e."""
    vertices, v, side = _found(pair, e)
    after = _end_of(vertices, pair.clips.offsets if side else pair.subjects.offsets, v, pair.known, side)
    return vertices[v, 0], vertices[v, 1], vertices[after, 0], vertices[after, 1]


@merged
def _exactly(x: float, y: float, ox: float, oy: float) -> _Place:
    """Return a point of doubles, counted from o."""
    xh, xl = two_diff(x, ox)
    yh, yl = two_diff(y, oy)
    return _Place(xh, xl, yh, yl, 0.0)


@inline
def _crossing(pair: _Pair, e: int, f: int, ox: float, oy: float) -> _Place:
    """Return where two edges cross, counted from o; exactly where both run along the axes."""
    ends, others = _edge(pair, e), _edge(pair, f)
    (x, knows_x), (y, knows_y) = common_places(ends, others)
    if knows_x and knows_y:
        return _exactly(x, y, ox, oy)
    ax, ay, bx, by = ends
    ah, al, bh, bl, relative = weights_of(ends, others)
    sum_h, sum_l = dd_add(ah, al, bh, bl)
    th, tl = dd_div(ah, al, sum_h, sum_l)
    uh, ul = two_diff(bx, ax)
    vh, vl = two_diff(by, ay)
    error = (relative + 20.0 * U2) * th * max(abs(uh), abs(vh))
    uh, ul = dd_mul(th, tl, uh, ul)
    vh, vl = dd_mul(th, tl, vh, vl)
    xh, xl = two_diff(ax, ox)
    yh, yl = two_diff(ay, oy)
    error += 4.0 * U2 * max(abs(xh) + abs(uh), abs(yh) + abs(vh))
    xh, xl = dd_add(xh, xl, uh, ul)
    yh, yl = dd_add(yh, yl, vh, vl)
    return _Place(xh, xl, yh, yl, error)


@inline
def _place(pair: _Pair, sources: Int32Array, k: int, ox: float, oy: float) -> _Place:
    """Return point k, counted from o."""
    if sources[k, 1] >= 0:
        return _crossing(pair, sources[k, 0], sources[k, 1], ox, oy)
    vertices, v, _ = _found(pair, sources[k, 0])
    return _exactly(vertices[v, 0], vertices[v, 1], ox, oy)


@merged
def _is_stretch(pair: _Pair, sources: Int32Array, first: int) -> bool:
    """Tell whether `_BLOCK` points and two, from ``first`` on, are vertices that follow each other in the input."""
    last = first + _BLOCK + 1
    v, w = sources[first, 0], sources[last, 0]
    if abs(w - v) != last - first or (v < pair.n) != (w < pair.n):
        return False
    step, off, seconds = 1 if w > v else -1, 0, -1
    some = sources[first : last + 1]
    for j in range(_BLOCK + 2):  # no branches: the compiler makes vectors of this loop
        off |= some[j, 0] - v - step * j
        seconds &= some[j, 1]
    return off == 0 and seconds < 0


@merged
def _sum_block(vertices: FloatArray, ox: float, sign: float, sums: Any) -> bool:
    """Add the terms of `_BLOCK` vertices, those between the first and the last; tell whether ``ox`` is as needed.

    sums: (3, LANES) totals, what they lost, and sizes. sign: -1 where they are the ring's from the last to the first.
    """
    low, high = (min(0.5 * ox, 2.0 * ox), max(0.5 * ox, 2.0 * ox)) if ox != 0.0 else (-np.inf, np.inf)
    is_exact = True
    for row in range(1, _BLOCK, _LANES):
        some = vertices[row - 1 : row + _LANES + 1]
        for j in range(_LANES):  # no branches: the compiler makes vectors of this loop
            is_exact &= (some[j + 1, 0] >= low) & (some[j + 1, 0] <= high)
            x = sign * (some[j + 1, 0] - ox)
            dh, dl = two_diff(some[j + 2, 1], some[j, 1])
            ph = x * dh
            sums[j], lost = two_sum(sums[j], ph)
            sums[_LANES + j] += lost + fma(x, dl, fma(x, dh, -ph))
            sums[2 * _LANES + j] += abs(ph)
    return is_exact


@inline
def _twice_area(pair: _Pair, sources: Int32Array, first: int, last: int) -> tuple[float, float, float, float]:
    """Return twice the area of a ring as a double-double, the bound of its terms, and the sum of their sizes."""
    vertices, v, _ = _found(pair, sources[first, 0])
    ox, n = vertices[v, 0], (last - first) >> 2
    for k in range(first, last if n > _BLOCK else first, max(n, 1)):  # the others are likely to be like these
        some, at, _ = _found(pair, sources[k, 0])
        ox = ox if abs(some[at, 0] - 1.25 * ox) <= 0.75 * abs(ox) else 0.0
    total = rest = size = 0.0
    error = -1.0
    while error < 0.0:  # bound: two turns, since zero is always as needed
        total, rest, error, size = _twice_area_from(pair, sources, first, last, ox, vertices[v, 1])
        ox = 0.0
    return total, rest, error, size


@inline
def _twice_area_from(
    pair: _Pair, sources: Int32Array, first: int, last: int, ox: float, oy: float
) -> tuple[float, float, float, float]:
    """Return what `_twice_area` does, places counted from o; a bound below 0 where that must be zero."""
    before = _place(pair, sources, last - 1, ox, oy)
    now = _place(pair, sources, first, ox, oy)
    total = rest = error = size = 0.0
    start, end = now, before
    sums = workspace(_SUMS)
    for j in range(_SUMS):
        sums[j] = 0.0
    k = first
    while k < last:  # bound: each turn passes a point at least
        begin = k
        while first < k < last - _BLOCK and _is_stretch(pair, sources, k - 1):  # bound: each turn passes points
            low, high = sources[k - 1, 0], sources[k + _BLOCK, 0]
            some, v, _ = _found(pair, min(low, high))
            if not _sum_block(some[v : v + _BLOCK + 2], ox, 1.0 if low < high else -1.0, sums):
                return 0.0, 0.0, -1.0, 0.0
            k += _BLOCK
        if k > begin:
            before = _place(pair, sources, k - 1, ox, oy)
            now = _place(pair, sources, k, ox, oy)
        after = start if k + 1 == last else end
        if k + 2 < last:
            after = _place(pair, sources, k + 1, ox, oy)
        dh, dl = dd_sub(after.yh, after.yl, before.yh, before.yl)
        ph, pl = dd_mul(now.xh, now.xl, dh, dl)
        total, lost = two_sum(total, ph)
        rest += lost + pl
        off = before.error + after.error
        error += now.error * (abs(dh) + off) + abs(now.xh) * off
        size += abs(now.xh) * (abs(after.yh) + abs(before.yh))
        before, now = now, after
        k += 1
    for j in range(_LANES):
        total, lost = two_sum(total, sums[j])
        rest += lost + sums[_LANES + j]
        size += sums[2 * _LANES + j]
    total, rest = fast_two_sum(total, rest)
    return total, rest, error, size


@kernel
def sum_areas(
    subjects: RingArrays, subject_items: IntArray, clips: RingArrays, clip_items: IntArray, sources: Int32Array,
    offsets: IntArray, groups: IntArray, stop: FlagArray, areas: FloatArray,
) -> int:  # fmt: skip
    """Fill ``areas``, (n,) float64, with the doubles nearest to the areas of some rings each, NaN where that is unsure.

    subjects, subject_items, clips, clip_items: as of overlay_pairs, a pair for each area, or one for all. sources,
    offsets: of rings, as overlay_pairs fills them. groups: (n + 1,) int64 into the rings. Returns how many are unsure.
    """
    n_unsure = 0
    known = workspace(2)
    known[0] = known[1] = 0.0
    for k in range(areas.shape[0]):
        number = min(k, subject_items.shape[0] - 2)
        first, end = subjects.offsets[subject_items[number]], subjects.offsets[subject_items[number + 1]]
        pair = _Pair(subjects, clips, first, end - first, clips.offsets[clip_items[number]], known)
        total_h = total_l = error = size = 0.0
        n_points = 0
        for ring in range(groups[k], groups[k + 1]):
            if stop[0]:
                return 0
            h, low, ring_error, ring_size = _twice_area(pair, sources, offsets[ring], offsets[ring + 1])
            total_h, total_l = dd_add(total_h, total_l, h, low)
            error, size = error + ring_error, size + ring_size
            n_points += offsets[ring + 1] - offsets[ring]
        n = float(n_points)
        bound = 1.001 * (error + (16.0 + 4.0 * n + 2.0 * n * n) * U2 * size) + n_points * _TINY
        is_sure = n_points == 0 or surely_rounded(total_h, total_l, bound + 4.0 * U2 * abs(total_h))
        areas[k] = (total_h + total_l) / 2.0 + 0.0 if is_sure else float("nan")
        n_unsure += not is_sure
    return n_unsure
