"""Convex solids by their planes: a point is inside when it is on the inner side of every one.

The signed distance is taken in floating point first. With u = 2^-53, each of at most four terms of
a x + b y + c z + d carries at most one product and three sums, so the error is below 4 u (1 + 4 u) times the sum of the
terms' sizes; `_SLACK` is 8 u, which also covers the rounding of that sum itself. A product that underflows is off by
less than 2^-1075; `_TINY` covers all of them. Infinities and NaN fail the comparison and count as unsure.

Points go in blocks through all rows, a row at a time, which is arithmetic on short arrays without a branch: what is
kept of a point is its least signed distance. The sizes of the terms are taken at the block's largest coordinates, and
the largest bound of all rows serves for all of them. The few points within it, and blocks whose terms are not far from
overflow, are taken one by one.

A row may also be the rounded image of a rational one (a posed plane, a wall of a prism): each coefficient then carries
another u, which the slack has room for (5 u of 8 u), but what the filter leaves open stays UNDECIDED.

Source: Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric predicates", for the form
of the filter; the exact sign is `side.py`'s.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.jit import inline, kernel
from engine.predicates.loading import as_half_space2, as_half_space3, as_point2, as_point3
from engine.predicates.side import side_of_line, side_of_plane
from engine.types import UNDECIDED

_SLACK: Final = 8.0 * 2.0**-53
_TINY: Final = 1e-320
_BLOCK: Final = 256
"""Points taken together: their coordinates and least distances fit the first-level cache."""
_LARGE: Final = 1e300
"""Terms of a row whose sizes add up to less than this cannot overflow, in any order; NaN is not less."""


@inline
def _filter2(h: Any, p: Any) -> int:
    """Return the sign of h at p where floating point proves it, else UNDECIDED."""
    ax, by = h.a * p.x, h.b * p.y
    distance = ax + by + h.c
    bound = _SLACK * (abs(ax) + abs(by) + abs(h.c)) + _TINY
    return 1 if distance > bound else -1 if -distance > bound else UNDECIDED


@inline
def _filter3(h: Any, p: Any) -> int:
    """Return the sign of h at p where floating point proves it, else UNDECIDED."""
    ax, by, cz = h.a * p.x, h.b * p.y, h.c * p.z
    distance = ax + by + cz + h.d
    bound = _SLACK * (abs(ax) + abs(by) + abs(cz) + abs(h.d)) + _TINY
    return 1 if distance > bound else -1 if -distance > bound else UNDECIDED


@inline
def _locate2(p: Any, planes: Any, is_exact: Any) -> tuple[int, bool]:
    """Return the location of a point and whether it needed more than the filter."""
    location, is_unsure = 1, False
    for row in range(len(planes)):
        side = _filter2(as_half_space2(planes, row), p)
        if side == 1:
            continue
        if side == UNDECIDED:
            is_unsure = True
            side = side_of_line(as_half_space2(planes, row), p) if is_exact[row] else UNDECIDED
        if side == -1:  # outside one is outside all, whatever is still undecided
            return -1, is_unsure
        if side == UNDECIDED:
            location = UNDECIDED
        elif side == 0 and location == 1:
            location = 0
    return location, is_unsure


@inline
def _locate3(p: Any, planes: Any, is_exact: Any) -> tuple[int, bool]:
    """Return the location of a point and whether it needed more than the filter."""
    location, is_unsure = 1, False
    for row in range(len(planes)):
        side = _filter3(as_half_space3(planes, row), p)
        if side == 1:
            continue
        if side == UNDECIDED:
            is_unsure = True
            side = side_of_plane(as_half_space3(planes, row), p) if is_exact[row] else UNDECIDED
        if side == -1:
            return -1, is_unsure
        if side == UNDECIDED:
            location = UNDECIDED
        elif side == 0 and location == 1:
            location = 0
    return location, is_unsure


@inline
def _settle_least(least: Any, count: int, bound: float, locations: Any, start: int) -> int:
    """Fill the locations of a block by the least distances (count,); return how many are UNDECIDED."""
    n_open = 0
    for k in range(count):
        is_in, is_out = least[k] > bound, least[k] < -bound
        locations[start + k] = np.int8(1) if is_in else np.int8(-1) if is_out else np.int8(UNDECIDED)
        n_open += not (is_in | is_out)
    return n_open


@kernel
def locate_in_half_planes(points: Any, planes: Any, is_exact: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 2) and planes (m, 3); UNDECIDED where the exponents are out of range.

    is_exact: (m,) bool, False for a row that is correctly rounded from a rational one, without underflow.
    Returns how many points needed more than the filter. Stops early, answers incomplete, once flag[0] is set.
    """
    xs, ys, least = np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK)
    n_beyond = 0
    for start in range(0, len(points), _BLOCK):
        count = min(_BLOCK, len(points) - start)
        x_size = y_size = 0.0
        for k in range(count):
            p = as_point2(points, start + k)
            xs[k], ys[k] = p.x, p.y
            x_size, y_size = max(x_size, abs(p.x)), max(y_size, abs(p.y))
            least[k] = _LARGE
        largest = 0.0
        for row in range(len(planes)):
            if flag[0]:
                return n_beyond
            h = as_half_space2(planes, row)
            size = abs(h.a) * x_size + abs(h.b) * y_size + abs(h.c)
            largest = size if not size <= largest else largest  # NaN is taken over, and ends the loop
            if not largest < _LARGE:
                break
            for k in range(count):
                distance = h.a * xs[k] + h.b * ys[k] + h.c
                least[k] = min(least[k], distance)
        bound = _SLACK * largest + _TINY if largest < _LARGE else np.inf
        if _settle_least(least, count, bound, locations, start) == 0:
            continue
        for item in range(start, start + count):
            if locations[item] == UNDECIDED:
                locations[item], is_unsure = _locate2(as_point2(points, item), planes, is_exact)
                n_beyond += is_unsure
    return n_beyond


@kernel
def locate_in_half_spaces(points: Any, planes: Any, is_exact: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 3) and planes (m, 4); the rest as in the plane."""
    xs, ys, zs, least = np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK)
    n_beyond = 0
    for start in range(0, len(points), _BLOCK):
        count = min(_BLOCK, len(points) - start)
        x_size = y_size = z_size = 0.0
        for k in range(count):
            p = as_point3(points, start + k)
            xs[k], ys[k], zs[k] = p.x, p.y, p.z
            x_size, y_size, z_size = max(x_size, abs(p.x)), max(y_size, abs(p.y)), max(z_size, abs(p.z))
            least[k] = _LARGE
        largest = 0.0
        for row in range(len(planes)):
            if flag[0]:
                return n_beyond
            h = as_half_space3(planes, row)
            size = abs(h.a) * x_size + abs(h.b) * y_size + abs(h.c) * z_size + abs(h.d)
            largest = size if not size <= largest else largest
            if not largest < _LARGE:
                break
            for k in range(count):
                distance = h.a * xs[k] + h.b * ys[k] + h.c * zs[k] + h.d
                least[k] = min(least[k], distance)
        bound = _SLACK * largest + _TINY if largest < _LARGE else np.inf
        if _settle_least(least, count, bound, locations, start) == 0:
            continue
        for item in range(start, start + count):
            if locations[item] == UNDECIDED:
                locations[item], is_unsure = _locate3(as_point3(points, item), planes, is_exact)
                n_beyond += is_unsure
    return n_beyond
