"""Areas of rings of implicit points, as certified doubles: double-doubles with a running error bound.

Twice the area is the sum of x_k (y_k+1 - y_k-1), coordinates relative to a vertex near the ring. Error bounds, u =
2^-53:

    vertex                       0
    crossing of ab and cd        a + t (b - a), t = |w_a| / (|w_a| + |w_b|) (weights: crossing_signs.py)
      error of t                 relative errors of the weights + 20 u^2; of the place: that of t (b - a) + 4 u^2 a sum
    term of the sum              errors of its factors + 12 u^2 of its size
    sum of n terms               its rounding errors are added up: below (2 n + n^2) u^2 of all sizes, doubled

Where a weight is less than a thousand times its bound both come from expansions, if exponents allow.

Where the ring follows the input for long, x is relative to a double o from which no difference is rounded: the x of the
ring's first vertex if all lie between half and twice of it (P. H. Sterbenz, Floating-point computation, 1974, theorem
4.3.1), else zero, and then x is at most twice the width of the ring.

What the bound does not decide (a tie, cancellation, extreme exponents) the caller settles in integers.
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
    is_correctly_rounded,
    two_diff,
    two_sum,
    workspace,
)
from engine.types import FlagArray, FloatArray, Int32Array, IntArray

_TINY = 2.0**-1040
"""Bound of what a term may lose by underflow."""
_LANES: Final = 8
_SUMS: Final = 3 * _LANES
_BLOCK: Final = 32
"""Consecutive input vertices whose terms are summed in eight lanes. Joining the sums adds eight terms, within twice the
bound of a block."""


class _Place(NamedTuple):
    """A point (xh + xl, yh + yl) as double-doubles, relative to an origin; error: bound on the error of each
    coordinate."""

    xh: float
    xl: float
    yh: float
    yl: float
    error: float


class _Pair(NamedTuple):
    """Two polygons among many. subjects, clips: all `RingArrays`; first, n: the subject's first vertex and its number
    of vertices; second: the clip's first vertex; last_rings: by side (0 subject, 1 clip) the ring located last, a guess
    for the next search. Vertices of a pair are numbered subject first."""

    subjects: Any
    clips: Any
    first: int
    n: int
    second: int
    last_rings: Any


@merged
def _polygon_vertex(pair: _Pair, v: int) -> tuple[Any, int, int]:
    """Return the array that contains vertex v of a pair, its index there, and its side (0: subject, 1: clip)."""
    if v < pair.n:
        return pair.subjects.vertices, pair.first + v, 0
    return pair.clips.vertices, pair.second + v - pair.n, 1


@merged
def _end_of(vertices: FloatArray, offsets: IntArray, v: int, last_rings: Any, side: int) -> int:
    """Return the next vertex of v's ring whose position differs from that of v (v itself if there is none). offsets: of
    rings; last_rings[side]: a guess of the ring that contains v, updated."""
    low, n = int(last_rings[side]), offsets.shape[0] - 1
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
    last_rings[side] = low
    start, stop = offsets[low], offsets[low + 1]
    after = v
    for _ in range(stop - start):
        after = after + 1 if after + 1 < stop else start
        if vertices[after, 0] != vertices[v, 0] or vertices[after, 1] != vertices[v, 1]:
            break
    return after


@merged
def _edge(pair: _Pair, e: int) -> Ends:
    """Return ax, ay, bx, by of the edge that begins at vertex e of a pair."""
    vertices, v, side = _polygon_vertex(pair, e)
    after = _end_of(vertices, pair.clips.offsets if side else pair.subjects.offsets, v, pair.last_rings, side)
    return vertices[v, 0], vertices[v, 1], vertices[after, 0], vertices[after, 1]


@merged
def _place_of_doubles(x: float, y: float, ox: float, oy: float) -> _Place:
    """Return the point (x, y) relative to the origin (ox, oy), exactly."""
    xh, xl = two_diff(x, ox)
    yh, yl = two_diff(y, oy)
    return _Place(xh, xl, yh, yl, 0.0)


@inline
def _crossing(pair: _Pair, e: int, f: int, ox: float, oy: float) -> _Place:
    """Return the crossing of edges e and f of a pair, relative to (ox, oy); exact if one is vertical and one
    horizontal."""
    ends, others = _edge(pair, e), _edge(pair, f)
    (x, has_x), (y, has_y) = common_places(ends, others)
    if has_x and has_y:
        return _place_of_doubles(x, y, ox, oy)
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
    """Return the point of row k of ``sources``, a vertex or a crossing of two edges, relative to (ox, oy)."""
    if sources[k, 1] >= 0:
        return _crossing(pair, sources[k, 0], sources[k, 1], ox, oy)
    vertices, v, _ = _polygon_vertex(pair, sources[k, 0])
    return _place_of_doubles(vertices[v, 0], vertices[v, 1], ox, oy)


@merged
def _is_stretch(pair: _Pair, sources: Int32Array, first: int) -> bool:
    """Return whether the `_BLOCK` + 2 rows of ``sources`` from ``first`` on are consecutive input vertices of one
    polygon, in either direction."""
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
    """Add the area terms of all but the first and last of `_BLOCK` + 2 vertices (rows of ``vertices``) to ``sums``;
    return whether all differences to ``ox`` are exact. sums: (3 * LANES,), by lane the totals, then the rounding
    errors, then the sums of magnitudes. sign: -1.0 if the ring runs from the last to the first, else 1.0."""
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
    """Return (h, low, error, size) for the ring of rows first .. last - 1 of ``sources``: twice its area as a
    double-double h + low, a bound on its error but for roundings of the sum, and the sum of the magnitudes of its
    terms."""
    vertices, v, _ = _polygon_vertex(pair, sources[first, 0])
    ox, n = vertices[v, 0], (last - first) >> 2
    for k in range(first, last if n > _BLOCK else first, max(n, 1)):  # the others are likely to be like these
        some, at, _ = _polygon_vertex(pair, sources[k, 0])
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
    """Return what `_twice_area` does, with coordinates relative to (ox, oy). An error below 0.0: a difference to ``ox``
    is not exact; call again with ``ox`` = 0.0."""
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
            some, v, _ = _polygon_vertex(pair, min(low, high))
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
    offsets: IntArray, groups: IntArray, stop: FlagArray, areas: FloatArray, sums: FloatArray,
) -> int:  # fmt: skip
    """Fill ``areas``, (n,) float64, with the double nearest to the area of each group of rings, NaN if not proven.

    Returns the number of NaN. sums: (n, 3), twice the areas as double-doubles and their bounds, or (0, 3).
    subject_items, clip_items: offsets of polygons into the rings of subjects and clips, a pair of polygons for each
    area, or one for all. sources, offsets: source of each vertex (`overlay_pairs`), offsets of rings. groups: (n + 1,)
    int64 offsets of groups into the rings.
    """
    n_uncertified = 0
    last_rings = workspace(2)
    last_rings[0] = last_rings[1] = 0.0
    for k in range(areas.shape[0]):
        number = min(k, subject_items.shape[0] - 2)
        first, end = subjects.offsets[subject_items[number]], subjects.offsets[subject_items[number + 1]]
        pair = _Pair(subjects, clips, first, end - first, clips.offsets[clip_items[number]], last_rings)
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
        is_certified = n_points == 0 or is_correctly_rounded(total_h, total_l, bound + 4.0 * U2 * abs(total_h))
        areas[k] = (total_h + total_l) / 2.0 + 0.0 if is_certified else float("nan")
        n_uncertified += not is_certified
        if k < sums.shape[0]:
            sums[k, 0], sums[k, 1], sums[k, 2] = total_h, total_l, bound
    return n_uncertified
