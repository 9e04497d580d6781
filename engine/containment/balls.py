"""Spheres: the exact sign of r^2 - |p - c|^2.

Three stages. (1) An axis on which |p - c| rounds to more than r: rounding is monotone and r is a double, so the exact
difference is above r as well, and the point is outside. (2) The plain value with an error bound: each difference
carries u = 2^-53 relative error, each square 3 u, a sum of up to four terms 3 u more; `_SLACK` = 16 u covers this and
the rounding of the bound. (3) Differences as exact pairs high + low; where all low parts are zero (the usual case on
flush data), r^2 and the squares are exact pairs, and the sign is that of an expansion of at most eight terms. Else
UNDECIDED. Squares are exact pairs only above 2^-480 in size, smaller ones (but zero) are UNDECIDED too.

Source: two_diff, two_prod and growing expansions of Shewchuk 1997.
"""

from __future__ import annotations

from typing import Any, Final

from engine.jit import inline, kernel
from engine.predicates.error_free import two_diff, two_prod, two_sum
from engine.types import UNDECIDED

_SLACK: Final = 16.0 * 2.0**-53
_TINY: Final = 1e-320
_SMALLEST: Final = 2.0**-480
_LARGEST: Final = 2.0**500


@inline
def _grow(expansion: Any, length: int, value: float) -> int:
    """Add `value` to the expansion of `length` components held in the workspace, exactly; return the new length."""
    for component in range(length):
        value, expansion[component] = two_sum(value, expansion[component])
    expansion[length] = value
    return length + 1


@inline
def _add_square(expansion: Any, length: int, value: float, sign: float) -> int:
    """Add sign * value^2 exactly; returns -1 where the square is no exact pair."""
    if value == 0.0 or length < 0:
        return length
    if not _SMALLEST < abs(value) < _LARGEST:
        return -1
    high, low = two_prod(value, value)
    return _grow(expansion, _grow(expansion, length, sign * low), sign * high)


@kernel
def locate_in_ball(
    points: Any, center: Any, blur: float, radius: float, workspace: Any, locations: Any, flag: Any
) -> int:
    """Fill `locations` (n,) int8 for points (n, dim); returns how many needed more than the filter.

    blur: bound on the error of each coordinate of `center`; 0.0 where it is exact, else what stays open is UNDECIDED.
    workspace: (8,) float64.
    """
    n_axes, n_beyond = len(center), 0
    for item in range(len(points)):
        if flag[0]:
            break
        is_far, total, spread = False, 0.0, 0.0
        for axis in range(n_axes):
            difference = points[item, axis] - center[axis]
            is_far |= abs(difference) > radius + 2.0 * blur if blur > 0.0 else abs(difference) > radius
            total += difference * difference
            spread += abs(difference)
        if is_far:
            locations[item] = -1
            continue
        square = radius * radius
        excess, bound = square - total, _SLACK * (square + total) + _TINY
        bound += 4.0 * blur * (spread + 2.0 * blur)  # |(d + e)^2 - d^2| <= 2 |d| e + e^2 an axis
        if excess > bound or -excess > bound:
            locations[item] = 1 if excess > 0.0 else -1
            continue
        n_beyond += 1
        length = _add_square(workspace, 0, radius, 1.0) if blur == 0.0 else -1
        for axis in range(n_axes):
            high, low = two_diff(points[item, axis], center[axis])
            length = _add_square(workspace, length, high, -1.0) if low == 0.0 else -1
        sign = UNDECIDED
        if length >= 0:
            sign = 0
            for component in range(length):  # the last component that is not zero outweighs all before it
                if workspace[component] != 0.0:
                    sign = 1 if workspace[component] > 0.0 else -1
        locations[item] = sign
    return n_beyond
