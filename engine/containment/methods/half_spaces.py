"""Convex solids by their planes: a point is inside when it is on the inner side of every one.

The signed distance is taken in floating point first. With u = 2^-53, each of at most four terms of
a x + b y + c z + d carries at most one product and three sums, so the error is below 4 u (1 + 4 u) times the sum of the
terms' sizes; `_SLACK` is 8 u, which also covers the rounding of that sum itself. A product that underflows is off by
less than 2^-1075; `_TINY` covers all of them. Infinities and NaN fail the comparison and count as unsure.

Points go in blocks through all rows, a row at a time, which is arithmetic on short arrays without a branch: what is
kept of a point is its least signed distance. The sizes of the terms are taken at the block's largest coordinates, and
the largest bound of all rows serves for all of them. The few points within it, and blocks whose terms are not far from
overflow, are taken one by one. Where there are many rows, the points that are outside some of those taken so far, by
more than the largest bound of these, are settled and leave the block.

A row may also be the rounded image of a rational one (a posed plane, a wall of a prism): each coefficient then carries
another u, which the slack has room for (5 u of 8 u), but what the filter leaves open stays UNDECIDED.

Source: Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric predicates", for the form
of the filter; the exact sign is `side.py`'s.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.jit import inline, kernel, merged
from engine.predicates.loading import as_half_space2, as_half_space3, as_point2, as_point3
from engine.predicates.side import side_of_line, side_of_plane
from engine.types import UNDECIDED

_SLACK: Final = 8.0 * 2.0**-53
_TINY: Final = 1e-320
_BLOCK: Final = 256
"""Points taken together: their coordinates and least distances fit the first-level cache."""
_ROWS: Final = 4
"""Rows taken together: coordinates and least distances are loaded once for all of them."""
_LARGE: Final = 1e300
"""Terms of a row whose sizes add up to less than this cannot overflow, in any order; NaN is not less."""


@inline
def _row_at(planes: Any, row: int, like: Any) -> Any:
    """Return a row as what it is in the dimension of `like`, the length of which the compiler knows."""
    if len(like) == 2:
        return as_half_space2(planes, row)
    return as_half_space3(planes, row)


@inline
def _distance(h: Any, p: Any) -> float:
    """Return the signed distance of a point (x, y) or (x, y, z), in units of the normal."""
    if len(p) == 2:
        return h.a * p[0] + h.b * p[1] + h.c
    return h.a * p[0] + h.b * p[1] + h.c * p[2] + h.d


@inline
def _size(h: Any, p: Any) -> float:
    """Return the sum of the sizes of the terms of `_distance`."""
    if len(p) == 2:
        return abs(h.a * p[0]) + abs(h.b * p[1]) + abs(h.c)
    return abs(h.a * p[0]) + abs(h.b * p[1]) + abs(h.c * p[2]) + abs(h.d)


@inline
def _exact_side(h: Any, p: Any) -> int:
    if len(p) == 2:
        return int(side_of_line(h, p))
    return int(side_of_plane(h, p))


@inline
def _as_point(points: Any, item: int, like: Any) -> Any:
    if len(like) == 2:
        return as_point2(points, item)
    return as_point3(points, item)


@inline
def _locate_one(p: Any, planes: Any, is_exact: Any) -> tuple[int, bool]:
    """Return the location of a point and whether it needed more than the filter."""
    location, is_unsure = 1, False
    for row in range(len(planes)):
        h = _row_at(planes, row, p)
        distance, bound = _distance(h, p), _SLACK * _size(h, p) + _TINY
        if distance > bound:
            continue
        if -distance > bound:  # outside one is outside all, whatever is still undecided
            return -1, is_unsure
        is_unsure = True
        side = _exact_side(h, p) if is_exact[row] else UNDECIDED
        if side == -1:
            return -1, is_unsure
        if side == UNDECIDED:
            location = UNDECIDED
        elif side == 0 and location == 1:
            location = 0
    return location, is_unsure


@inline
def _largest(values: Any, folded: Any) -> float:
    """Return the largest size of values (_BLOCK,), by halves: short loops that the compiler turns into vectors."""
    half = _BLOCK // 2
    for k in range(half):
        folded[k] = max(abs(values[k]), abs(values[k + half]))
    while half > 1:  # bound: log2(_BLOCK) turns
        half //= 2
        for k in range(half):
            folded[k] = max(folded[k], folded[k + half])
    return float(folded[0])


@inline
def _pays(row: int, n_rows: int) -> bool:
    """Tell whether to leave out the points that are outside by now: after 8, 16, 32 ... rows, if many are to come."""
    return row >= 8 and row & (row - 1) == 0 and n_rows - row >= 24


@merged
def _load(points: Any, start: int, count: int, coordinates: Any, least: Any) -> None:
    """Load a block of points, an array for each axis; what is beyond `count` is 0."""
    for axis in range(len(coordinates)):
        values = coordinates[axis]
        for k in range(count):
            values[k] = points[start + k, axis]
        values[count:] = 0.0
    least[:] = _LARGE


@inline
def _sizes(coordinates: Any, folded: Any) -> Any:
    """Return the largest size of a coordinate on each axis."""
    if len(coordinates) == 2:
        return _largest(coordinates[0], folded), _largest(coordinates[1], folded)
    return _largest(coordinates[0], folded), _largest(coordinates[1], folded), _largest(coordinates[2], folded)


@inline
def _point_at(coordinates: Any, k: int) -> Any:
    if len(coordinates) == 2:
        return coordinates[0][k], coordinates[1][k]
    return coordinates[0][k], coordinates[1][k], coordinates[2][k]


@merged
def _leave_out(coordinates: Any, least: Any, places: Any, count: int, bound: float) -> int:
    """Close up over the points that are surely outside by now; return how many are left."""
    n_left = 0
    for k in range(count):
        left = np.uint32(n_left)
        for axis in range(len(coordinates)):
            coordinates[axis][left] = coordinates[axis][k]
        least[left], places[left] = least[k], places[k]
        n_left += not least[k] < -bound
    return n_left


@merged
def _take_rows(planes: Any, row: int, coordinates: Any, sizes: Any, count: int, least: Any, largest: float) -> float:
    """Lower the least distances by those from `_ROWS` rows; return the largest size of the terms so far."""
    last = len(planes) - 1
    e, f = _row_at(planes, row, sizes), _row_at(planes, min(row + 1, last), sizes)
    g, h = _row_at(planes, min(row + 2, last), sizes), _row_at(planes, min(row + 3, last), sizes)
    for each in (e, f, g, h):
        size = _size(each, sizes)
        largest = max(largest, size) if size < _LARGE else np.inf  # also for a row of NaN
    if largest < _LARGE:
        for k in range(count):
            p = _point_at(coordinates, k)
            first, second = min(_distance(e, p), _distance(f, p)), min(_distance(g, p), _distance(h, p))
            least[k] = min(least[k], min(first, second))
    return largest


@merged
def _locate_blocks(points: Any, planes: Any, is_exact: Any, coordinates: Any, locations: Any, flag: Any) -> int:
    """Do what `locate_in_half_spaces` does; coordinates: a block's, an array for each axis."""
    least, folded = np.empty(_BLOCK), np.empty(_BLOCK)
    places, found = np.empty(_BLOCK, np.uint32), np.empty(_BLOCK, np.int8)
    n_beyond = 0
    for start in range(0, len(points), _BLOCK):
        stop, is_thinned = min(start + _BLOCK, len(points)), False
        count = stop - start
        _load(points, start, count, coordinates, least)
        sizes, largest = _sizes(coordinates, folded), 0.0
        for row in range(0, len(planes), _ROWS):
            if flag[0]:
                return n_beyond
            if _pays(row, len(planes)):
                if not is_thinned:
                    is_thinned = True
                    for k in range(count):
                        places[k], locations[start + k] = k, -1
                count = _leave_out(coordinates, least, places, count, _SLACK * largest + _TINY)
            largest = _take_rows(planes, row, coordinates, sizes, count, least, largest)
            if not largest < _LARGE:
                break
        bound = _SLACK * largest + _TINY if largest < _LARGE else np.inf
        n_open = 0
        for k in range(count):
            is_in, is_out = least[k] > bound, least[k] < -bound
            found[k] = UNDECIDED - is_in - 3 * is_out  # no branch: 1, -1 or 2
            n_open += not (is_in | is_out)
        for k in range(count):
            locations[start + (places[k] if is_thinned else k)] = found[k]
        for item in range(start, stop if n_open > 0 else start):
            if locations[item] == UNDECIDED:
                locations[item], is_unsure = _locate_one(_as_point(points, item, sizes), planes, is_exact)
                n_beyond += is_unsure
    return n_beyond


@kernel
def locate_in_half_planes(points: Any, planes: Any, is_exact: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 2) and planes (m, 3); UNDECIDED where the exponents are out of range.

    is_exact: (m,) bool, False for a row that is correctly rounded from a rational one, without underflow.
    Returns how many points needed more than the filter. Stops early, answers incomplete, once flag[0] is set.
    """
    coordinates = (np.empty(_BLOCK), np.empty(_BLOCK))
    return int(_locate_blocks(points, planes, is_exact, coordinates, locations, flag))


@kernel
def locate_in_half_spaces(points: Any, planes: Any, is_exact: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 3) and planes (m, 4); the rest as in the plane."""
    coordinates = (np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK))
    return int(_locate_blocks(points, planes, is_exact, coordinates, locations, flag))
