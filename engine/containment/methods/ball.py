"""Spheres: the exact sign of r^2 - |p - c|^2.

Three stages. (1) An axis on which |p - c| rounds to more than r: rounding is monotone and r is a double, so the exact
difference is above r as well, and the point is outside. (2) The plain value with an error bound: each difference
carries u = 2^-53 relative error, each square 3 u, a sum of up to four terms 3 u more; `_SLACK` = 16 u covers this and
the rounding of the bound. (3) Differences as exact pairs high + low; where all low parts are zero (the usual case on
flush data), r^2 and the squares are exact pairs, and the sign is that of an expansion of at most eight terms. Else
UNDECIDED. Squares are exact pairs only above 2^-480 in size, smaller ones (but zero) are UNDECIDED too.

The first two stages are taken for a block of points at once, without branches: so the compiler uses vectors, and no
processor has to foretell which points lie inside. In the plane z is 0 throughout.

Source: two_diff, two_prod and growing expansions of Shewchuk 1997.
"""

from __future__ import annotations

from typing import Any, Final

from engine.arrays import FlagArray, FloatArray, Int8Array
from engine.compiling.jit import called, inline, kernel, merged
from engine.containment.methods.filters import NOT_FINITE, has_not_finite
from engine.predicates.error_free import two_diff, workspace
from engine.predicates.expansion import grow_product, sign
from engine.types import UNDECIDED

_SLACK: Final = 16.0 * 2.0**-53
_TINY: Final = 1e-320
_SMALLEST: Final = 2.0**-480
_LARGEST: Final = 2.0**500
_BLOCK: Final = 64
"""Points looked at together: four numbers each stay in the nearest cache."""


@merged
def located(dx: float, dy: float, dz: float, square: float, reach: float, blur: float) -> float:
    """Return the location of a point at that difference from the centre, UNDECIDED where the filter is unsure."""
    ax, ay, az = abs(dx), abs(dy), abs(dz)
    total = dx * dx + dy * dy + dz * dz
    excess, bound = square - total, _SLACK * (square + total) + _TINY
    bound += 4.0 * blur * (ax + ay + az + 2.0 * blur)  # |(d + e)^2 - d^2| <= 2 |d| e + e^2 an axis
    is_out = (max(ax, max(ay, az)) > reach) | (-excess > bound)
    return -1.0 if is_out else (1.0 if excess > bound else 2.0)


@inline
def _has_exact_square(value: float) -> bool:
    return value == 0.0 or _SMALLEST < abs(value) < _LARGEST


@called
def _settle(points: FloatArray, item: int, center: FloatArray, radius: float, expansion: Any) -> int:
    """Return the location by exact sums; UNDECIDED where differences or squares are no exact pairs."""
    if not _has_exact_square(radius):
        return UNDECIDED
    n = grow_product(expansion, 0, radius, radius)
    for axis in range(len(center)):
        high, low = two_diff(points[item, axis], center[axis])
        if low != 0.0 or not _has_exact_square(high):
            return UNDECIDED
        n = grow_product(expansion, n, -high, high)
    return sign(expansion, n)


@kernel
def locate_in_ball(
    points: FloatArray, center: FloatArray, blur: float, radius: float, locations: Int8Array, flag: FlagArray
) -> int:
    """Fill `locations` (n,) int8 for points (n, dim); returns how many needed more than the filter, or NOT_FINITE.

    blur: bound on the error of each coordinate of `center`; 0.0 where it is exact, else what stays open is UNDECIDED.
    """
    if has_not_finite(points):
        return NOT_FINITE
    is_flat, n_beyond = len(center) == 2, 0
    x, y, z = center[0], center[1], 0.0 if is_flat else center[2]
    square, reach, expansion = radius * radius, radius + 2.0 * blur, workspace(8)
    dx, dy, dz, found = workspace(64), workspace(64), workspace(64), workspace(64)
    for first in range(0, len(points), _BLOCK):
        if flag[0]:
            break
        size = min(_BLOCK, len(points) - first)
        for j in range(size):
            dx[j], dy[j] = points[first + j, 0] - x, points[first + j, 1] - y
            dz[j] = 0.0 if is_flat else points[first + j, 2] - z
        for j in range(_BLOCK):  # a number of turns that the compiler knows; those past `size` are not looked at
            found[j] = located(dx[j], dy[j], dz[j], square, reach, blur)
        n_open = 0
        for j in range(size):
            locations[first + j] = int(found[j])
            n_open += found[j] == UNDECIDED
        n_beyond += n_open
        if n_open == 0 or blur > 0.0:
            continue
        for item in range(first, first + size):
            if locations[item] == UNDECIDED:
                locations[item] = _settle(points, item, center, radius, expansion)
    return n_beyond
