"""Locations that hold for every point within a blur of a given one: the filters for points in a posed body's frame.

A blurred point stands for all points whose coordinates are at most blur / 2 away. Each kernel answers where one
location is proven for all of them, else UNDECIDED. Each bound is that of the plain filter plus the largest change
that the blur can make, taken twice to pay for its own rounding; infinities and NaN compare false and so count as
unsure.
"""

from __future__ import annotations

from typing import Any, Final

from engine.arrays import FlagArray, FloatArray, Int8Array, IntArray
from engine.compiling.jit import inline, kernel
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.predicates.polynomial import sign_of_polynomial_exact, sign_of_polynomial_filter
from engine.types import UNDECIDED, Point2

_SLACK: Final = 8.0 * 2.0**-53
_TINY: Final = 1e-320
NOT_FINITE: Final = -1
"""Returned by kernels in place of a count."""


@inline
def has_not_finite(points: FloatArray) -> bool:
    """Tell whether NaN or an infinity is among points (n, dim): without a branch, at the speed of the memory."""
    is_found, flat = False, points.reshape(points.size)
    for place in range(len(flat)):
        is_found |= flat[place] - flat[place] != 0.0
    return is_found


@inline
def orient2d_blurred(a: Point2, b: Point2, q: Point2, blur: float) -> int:
    """Return the sign of orient2d(a, b, .) on all of the blurred q, or UNDECIDED."""
    left = (a.x - q.x) * (b.y - q.y)
    right = (a.y - q.y) * (b.x - q.x)
    turn = left - right
    bound = BOUND_2D * (abs(left) + abs(right)) + GUARD_2D + blur * (abs(b.x - a.x) + abs(b.y - a.y))
    return 1 if turn > bound else -1 if -turn > bound else UNDECIDED


@inline
def side_of_box(
    low: tuple[float, ...], high: tuple[float, ...], is_flat: bool, p: tuple[float, ...], blur: float
) -> int:
    """Return the location of a blurred point (x, y, z) in a box; in the plane all z are 0."""
    is_out = (p[0] + blur < low[0]) | (p[0] - blur > high[0])
    is_out |= (p[1] + blur < low[1]) | (p[1] - blur > high[1])
    is_out |= (p[2] + blur < low[2]) | (p[2] - blur > high[2])
    if is_out:
        return -1
    is_within = (low[0] < p[0] - blur) & (p[0] + blur < high[0])
    is_within &= (low[1] < p[1] - blur) & (p[1] + blur < high[1])
    is_within &= is_flat | ((low[2] < p[2] - blur) & (p[2] + blur < high[2]))
    if is_within:
        return 1
    return 0 if blur == 0.0 else UNDECIDED


@inline
def side_of_rows(rows: FloatArray, first: int, last: int, p: tuple[float, ...], blur: float) -> int:
    """Return the location of a blurred point (x, y, z) by the rows first ... last of rows (n, 4)."""
    location = 1
    for row in range(first, last):
        ax, by, cz, d = rows[row, 0] * p[0], rows[row, 1] * p[1], rows[row, 2] * p[2], rows[row, 3]
        distance = ax + by + cz + d
        bound = _SLACK * (abs(ax) + abs(by) + abs(cz) + abs(d)) + _TINY
        bound += blur * (abs(rows[row, 0]) + abs(rows[row, 1]) + abs(rows[row, 2]))
        if distance > bound:
            continue
        if -distance > bound:
            return -1
        location = UNDECIDED
    return location


@inline
def in_space(points: FloatArray, item: int) -> Any:
    """Return a row of points (n, 2 or 3) as (x, y, z); z is 0 in the plane."""
    return float(points[item, 0]), float(points[item, 1]), 0.0 if points.shape[1] == 2 else float(points[item, 2])


@kernel
def locate_in_rows_blurred(
    points: FloatArray, blurs: FloatArray, rows: FloatArray, locations: Int8Array, flag: FlagArray
) -> int:
    """Fill `locations` (n,) int8 for rows (m, 4), each given or correctly rounded; returns how many stay open.

    Those of the plane have 0 in the third place.
    """
    n_open = 0
    for item in range(len(points)):
        if flag[0]:
            break
        locations[item] = side_of_rows(rows, 0, len(rows), in_space(points, item), blurs[item])
        n_open += locations[item] == UNDECIDED
    return n_open


@kernel
def locate_in_box(
    points: FloatArray, blurs: FloatArray, low: FloatArray, high: FloatArray, locations: Int8Array, flag: FlagArray
) -> int:
    """Fill `locations` (n,) int8 for points (n, dim) and the corners low, high (dim,); returns how many stay open.

    Six comparisons, exact as they stand.
    blurs: (n,), or (0,) for points that are exact; then none stays open, and NOT_FINITE is returned where one is not
    finite. Where low = high on an axis every point of the box lies on its boundary: the comparisons say so by
    themselves.
    """
    if len(blurs) == 0 and has_not_finite(points):
        return NOT_FINITE
    n_open, is_flat = 0, len(low) == 2
    least = low[0], low[1], 0.0 if is_flat else low[2]
    most = high[0], high[1], 0.0 if is_flat else high[2]
    for item in range(len(points)):
        if flag[0]:
            break
        blur = float(blurs[item]) if len(blurs) > 0 else 0.0
        locations[item] = side_of_box(least, most, is_flat, in_space(points, item), blur)
        n_open += locations[item] == UNDECIDED
    return n_open


@kernel
def locate_by_polynomial(
    points: FloatArray, blurs: FloatArray, powers: IntArray, coefficients: FloatArray, degree: int,
    locations: Int8Array, flag: FlagArray,
) -> int:  # fmt: skip
    """Fill `locations` (n,) int8 for points (n, dim) with the sign of the polynomial, or UNDECIDED.

    blurs: as for `locate_in_box`. powers: (t, dim) int64; coefficients: (t,); degree: the largest total power. Returns
    the count beyond the filter, or NOT_FINITE.
    """
    if len(blurs) == 0 and has_not_finite(points):
        return NOT_FINITE
    n_beyond = 0
    for item in range(len(points)):
        if flag[0]:
            break
        blur = float(blurs[item]) if len(blurs) > 0 else 0.0
        sign = sign_of_polynomial_filter(powers, coefficients, degree, points, item, blur)
        if sign == UNDECIDED:
            n_beyond += 1
            if blur == 0.0:
                sign = sign_of_polynomial_exact(powers, coefficients, points, item)
        locations[item] = sign
    return n_beyond
