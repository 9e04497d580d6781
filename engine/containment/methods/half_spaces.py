"""Convex solids by their planes: a point is inside if it is on the inner side of every plane.

**Filter.** With u = 2^-53, each of at most four terms of a x + b y + c z + d carries at most one product and three
sums:

    |error| <= 4 u (1 + 4 u) sum |terms|          `_SLACK` = 8 u also covers the rounding of that sum
    underflow of a product: < 2^-1075             `_TINY` covers all of them

Comparisons with infinities and NaN are false, which means UNDECIDED.

**Blocks.** A block of points goes through all rows without branches and stores the least signed distance of each point.
The bound is evaluated at the largest coordinates of the block and the largest row. Points within it, and blocks whose
terms could overflow, are decided one by one. With many rows, points that are certainly outside leave the block early.

A row may be the rounded image of a rational one (a posed plane, a wall of a prism): each coefficient then carries
another u, which the slack covers (5 u of 8 u), but points beyond the filter stay UNDECIDED.

Source: Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric predicates", for the form
of the filter; the exact sign is `side.py`'s.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.compiling.jit import allocating_kernel, inline, merged
from engine.containment.methods.filters import NOT_FINITE, has_not_finite, in_space
from engine.predicates.side import side_of_plane, side_of_plane_filter
from engine.types import UNDECIDED, BoolArray, FlagArray, FloatArray, HalfSpace3, Int8Array, Point3

_SLACK: Final = 8.0 * 2.0**-53
_TINY: Final = 1e-320
_BLOCK: Final = 256
"""Points of a block: their coordinates and least distances fit the L1 cache."""
_FEW: Final = 16
"""Number of points below which a block costs more than it saves."""
_ROWS: Final = 4
"""Rows per pass over a block: coordinates and least distances are loaded once for all of them."""
_LARGE: Final = 1e300
"""Bound on the sum of |terms| of a row below which no partial sum overflows; false for NaN."""


@merged
def _row(planes: FloatArray, row: int, is_flat: bool) -> HalfSpace3:
    """Return row `row` of planes (m, 3 or 4) as four coefficients; in the plane the third is 0."""
    a, b, d = float(planes[row, 0]), float(planes[row, 1]), float(planes[row, 2 if is_flat else 3])
    return HalfSpace3(a, b, 0.0 if is_flat else float(planes[row, 2]), d)


@inline
def _locate_one(points: FloatArray, item: int, planes: FloatArray, is_exact: BoolArray) -> tuple[int, bool]:
    """Return the location of point `item` of (n, 2 or 3) in an intersection of half-spaces, and whether the filter left
    a plane open. is_exact: by row of planes, as in `locate_in_half_spaces`."""
    x, y, z = in_space(points, item)
    p, location, is_unsure = Point3(x, y, z), 1, False
    for row in range(len(planes)):
        h = _row(planes, row, planes.shape[1] == 3)
        side = side_of_plane_filter(h, p)
        if side == 1:
            continue
        if side == UNDECIDED:
            is_unsure = True
            side = side_of_plane(h, p) if is_exact[row] else UNDECIDED
        if side == -1:
            return -1, is_unsure
        if side == UNDECIDED:
            location = UNDECIDED
        elif side == 0 and location == 1:
            location = 0
    return location, is_unsure


@inline
def _largest(values: FloatArray, folded: FloatArray) -> float:
    """Return max |values| of a block (_BLOCK,), by halves so that the compiler vectorises it. folded: scratch."""
    half = _BLOCK // 2
    for k in range(half):
        folded[k] = max(abs(values[k]), abs(values[k + half]))
    while half > 1:  # bound: log2(_BLOCK) turns
        half //= 2
        for k in range(half):
            folded[k] = max(folded[k], folded[k + half])
    return float(folded[0])


@merged
def _value(h: HalfSpace3, x: float, y: float, z: float, is_flat: bool) -> Any:
    return h.a * x + h.b * y + h.d if is_flat else h.a * x + h.b * y + h.c * z + h.d


@allocating_kernel
def locate_in_half_spaces(
    points: FloatArray, planes: FloatArray, is_exact: BoolArray, locations: Int8Array, flag: FlagArray
) -> int:
    """Fill locations (n,) int8 of points (n, dim) in an intersection of half-spaces; UNDECIDED where exponents are out
    of range. planes: (m, dim + 1). is_exact: (m,) bool, False for a row that is rounded from a rational one. Returns
    how many points the filter left open, or NOT_FINITE. Stops early once flag[0] is set."""
    is_flat = planes.shape[1] == 3
    if has_not_finite(points):
        return NOT_FINITE
    n_beyond, last = 0, len(planes) - 1
    if len(points) < _FEW:
        for item in range(len(points)):
            locations[item], is_unsure = _locate_one(points, item, planes, is_exact)
            n_beyond += is_unsure
        return n_beyond
    xs, ys, zs = np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK)
    least, folded = np.empty(_BLOCK), np.empty(_BLOCK)
    places, results = np.empty(_BLOCK, np.uint32), np.empty(_BLOCK, np.int8)
    for start in range(0, len(points), _BLOCK):
        stop, is_thinned = min(start + _BLOCK, len(points)), False
        count = stop - start
        for k in range(count):
            xs[k], ys[k] = points[start + k, 0], points[start + k, 1]
            if not is_flat:
                zs[k] = points[start + k, 2]
        xs[count:], ys[count:], zs[count:], least[:] = 0.0, 0.0, 0.0, _LARGE
        x_size, y_size, largest = _largest(xs, folded), _largest(ys, folded), 0.0
        z_size = 0.0 if is_flat else _largest(zs, folded)
        for row in range(0, len(planes), _ROWS):
            if flag[0]:
                return n_beyond
            if row >= 8 and row & (row - 1) == 0 and len(planes) - row >= 24:  # after 8, 16 ... if many are to come
                if not is_thinned:
                    is_thinned = True
                    for k in range(count):
                        places[k], locations[start + k] = k, -1
                bound, n_left = _SLACK * largest + _TINY, 0
                for k in range(count):
                    left = np.uint32(n_left)
                    xs[left], ys[left], least[left], places[left] = xs[k], ys[k], least[k], places[k]
                    if not is_flat:
                        zs[left] = zs[k]
                    n_left += not least[k] < -bound
                count = n_left
            e, f = _row(planes, row, is_flat), _row(planes, min(row + 1, last), is_flat)
            g, h = _row(planes, min(row + 2, last), is_flat), _row(planes, min(row + 3, last), is_flat)
            for each in (e, f, g, h):
                size = abs(each.a) * x_size + abs(each.b) * y_size + abs(each.c) * z_size + abs(each.d)
                largest = max(largest, size) if size < _LARGE else np.inf  # also for a row of NaN
            if not largest < _LARGE:
                break
            for k in range(count):
                x, y, z = xs[k], ys[k], 0.0 if is_flat else zs[k]
                first = min(_value(e, x, y, z, is_flat), _value(f, x, y, z, is_flat))
                second = min(_value(g, x, y, z, is_flat), _value(h, x, y, z, is_flat))
                least[k] = min(least[k], min(first, second))
        bound = _SLACK * largest + _TINY if largest < _LARGE else np.inf
        n_open = 0
        for k in range(count):
            is_in, is_out = least[k] > bound, least[k] < -bound
            results[k] = UNDECIDED - is_in - 3 * is_out  # no branch: 1, -1 or 2
            n_open += not (is_in | is_out)
        for k in range(count):
            locations[start + (places[k] if is_thinned else k)] = results[k]
        for item in range(start, stop if n_open > 0 else start):
            if locations[item] == UNDECIDED:
                locations[item], is_unsure = _locate_one(points, item, planes, is_exact)
                n_beyond += is_unsure
    return n_beyond
