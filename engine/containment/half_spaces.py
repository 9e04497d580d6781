"""Convex solids by their planes: a point is inside when it is on the inner side of every one.

The signed distance is taken in floating point first. With u = 2^-53, each of at most four terms of
a x + b y + c z + d carries at most one product and three sums, so the error is below 4 u (1 + 4 u) times the sum of the
terms' sizes; `_SLACK` is 8 u, which also covers the rounding of that sum itself. A product that underflows is off by
less than 2^-1075; `_TINY` covers all of them. Infinities and NaN fail the comparison and count as unsure.

A row may also be the rounded image of a rational one (a posed plane, a wall of a prism): each coefficient then carries
another u, which the slack has room for (5 u of 8 u), but what the filter leaves open stays UNDECIDED.

Source: Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric predicates", for the form
of the filter; the exact sign is `side.py`'s.
"""

from __future__ import annotations

from typing import Any, Final

from engine.jit import inline, kernel
from engine.predicates.loading import as_half_space2, as_half_space3, as_point2, as_point3
from engine.predicates.side import side_of_line, side_of_plane
from engine.types import UNDECIDED

_SLACK: Final = 8.0 * 2.0**-53
_TINY: Final = 1e-320


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


@kernel
def locate_in_half_planes(points: Any, planes: Any, is_exact: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 2) and planes (m, 3); UNDECIDED where the exponents are out of range.

    is_exact: (m,) bool, False for a row that is correctly rounded from a rational one, without underflow.
    Returns how many points needed more than the filter. Stops early, answers incomplete, once flag[0] is set.
    """
    n_beyond = 0
    for item in range(len(points)):
        if flag[0]:
            break
        p = as_point2(points, item)
        location, is_unsure = 1, False
        for row in range(len(planes)):
            side = _filter2(as_half_space2(planes, row), p)
            if side == 1:
                continue
            if side == UNDECIDED:
                is_unsure = True
                side = side_of_line(as_half_space2(planes, row), p) if is_exact[row] else UNDECIDED
            if side == -1:  # outside one is outside all, whatever is still undecided
                location = -1
                break
            if side == UNDECIDED:
                location = UNDECIDED
            elif side == 0 and location == 1:
                location = 0
        locations[item] = location
        n_beyond += is_unsure
    return n_beyond


@kernel
def locate_in_half_spaces(points: Any, planes: Any, is_exact: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 3) and planes (m, 4); the rest as in the plane."""
    n_beyond = 0
    for item in range(len(points)):
        if flag[0]:
            break
        p = as_point3(points, item)
        location, is_unsure = 1, False
        for row in range(len(planes)):
            side = _filter3(as_half_space3(planes, row), p)
            if side == 1:
                continue
            if side == UNDECIDED:
                is_unsure = True
                side = side_of_plane(as_half_space3(planes, row), p) if is_exact[row] else UNDECIDED
            if side == -1:
                location = -1
                break
            if side == UNDECIDED:
                location = UNDECIDED
            elif side == 0 and location == 1:
                location = 0
        locations[item] = location
        n_beyond += is_unsure
    return n_beyond
