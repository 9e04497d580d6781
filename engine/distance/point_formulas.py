"""Distances of many points from the surface of a ball, and from planes, in double-doubles; what they leave open stays
NaN for rational arithmetic.

**Bounds** (u^2 = 2^-106). A difference of two doubles is exact; squares, their sum and its root are off by less than
2^-99 of the root, the difference of root and radius by 2^-99 of both. A height over a plane is a sum of d exact
products and the offset, off by 2^-101 of the sum of magnitudes; the quotient by the length of the normal by 2^-99 of
itself. `nearest_on_ball` takes a centre in double-doubles, off by 2^-105 of its largest coordinate, so that with M the
largest coordinate of all, offsets are off by 2^-102 M, the distance of the centre by 2^-101 M and 2^-99 of itself.
Coordinates are zero or within `SMALLEST` .. `LARGEST`, else the point is left open.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.compiling.jit import called, inline, kernel
from engine.distance.closed_forms import Wide, less, over, plus, product, root, times
from engine.lanes.lanes import array_at
from engine.predicates.error_free import fast_two_sum, is_correctly_rounded, two_diff
from engine.predicates.expansion import is_safe
from engine.predicates.vectors import largest_of
from engine.types import FlagArray, FloatArray, Point3

_BOUND: Final = 2.0**-99


@inline
def _answer(distance: Wide, error: float, most: float) -> float:
    """Return the double nearest to |distance|, NaN if unproven; given a finite `most`, 0.0 or infinity for distances
    within or beyond it."""
    value = abs(distance.h)
    if not (value > 2.0**-500 and is_correctly_rounded(distance.h, distance.low, error)) or value == most:
        return np.nan
    return value if most == np.inf else (0.0 if value < most else np.inf)


@kernel
def fill_from_planes(
    points: FloatArray, span: tuple[int, int], rows: FloatArray, most: float, distance: FloatArray, flag: FlagArray
) -> None:
    """Fill the NaN entries of distance (n,) for points (n, d) number span[0] .. span[1] - 1: from the nearest of planes
    (m, d + 1), if there is one or the point lies on the inner side of all. most: see `_answer`."""
    d = points.shape[1]
    for item in range(span[0], span[1]):
        if distance[item] == distance[item] or flag[0] != 0:
            continue
        least, lowest, is_usable = Wide(np.inf, 0.0), np.inf, True
        error = 0.0
        for row in range(rows.shape[0]):
            height, terms, square = Wide(rows[row, d], 0.0), abs(rows[row, d]), Wide(0.0, 0.0)
            is_usable = is_usable and is_safe(rows[row, d])
            for k in range(d):
                is_usable = is_usable and is_safe(rows[row, k]) and is_safe(points[item, k])
                height = plus(height, product(rows[row, k], points[item, k]))
                terms += abs(rows[row, k] * points[item, k])
                square = plus(square, product(rows[row, k], rows[row, k]))
            if not is_usable or not square.h > 0.0 or (rows.shape[0] > 1 and not height.h > 2.0**-101 * terms):
                is_usable = False
                break
            height = height if height.h >= 0.0 else Wide(-height.h, -height.low)
            size = root(square)
            here = over(height, size)
            bound = 2.0**-100 * terms / size.h + _BOUND * here.h
            lowest = min(lowest, here.h - bound)
            if less(here, least).h < 0.0 or row == 0:
                least, error = here, bound
        if is_usable:  # several nearly as near: within their errors they round alike, or stay open
            distance[item] = _answer(least, max(error, least.h - lowest) if lowest < least.h else error, most)


@inline
def _offset(x: float, centre: FloatArray, k: int) -> Wide:
    h, low = two_diff(x, centre[2 * k])
    return Wide(*fast_two_sum(h, low - centre[2 * k + 1]))


@called
def nearest_on_ball(ball: int, q: Point3, is_solid: bool, limit: float, foot: FloatArray) -> float:
    """Return the double nearest to the distance of a point from a ball, 0.0 strictly inside, or from its surface; -1.0
    if left open; given a finite limit 0.0 within it, infinity beyond, else `foot` (d,) is set too, unless it has no
    places. ball: address of (8,), the centre in double-doubles (z 0 in the plane), the radius, and 1.0 if the centre is
    exact.

    With D the distance of the centre, off by e = 2^-101 M + 2^-99 D, and x an offset, a coordinate of the foot is c + x
    (r / D), off by (r / D) (2^-102 M + e) and 2^-98 (r + M)."""
    numbers = array_at(ball, (8,), np.float64)
    x, y, z = _offset(q.x, numbers, 0), _offset(q.y, numbers, 1), _offset(q.z, numbers, 2)
    radius, size = numbers[6], largest_of(q) + max(abs(numbers[0]), abs(numbers[2]), abs(numbers[4]))
    square = plus(plus(times(x, x), times(y, y)), times(z, z))
    if not (is_safe(q.x) and is_safe(q.y) and is_safe(q.z) and square.h > 2.0**-500):
        return -1.0
    far = root(square)
    distance, error = less(far, Wide(radius, 0.0)), 2.0**-101 * size + _BOUND * (far.h + radius)
    if distance.h < -error and is_solid:
        return 0.0
    distance = distance if distance.h >= 0.0 else Wide(-distance.h, -distance.low)
    if not (distance.h > 2.0**-500 + error and is_correctly_rounded(distance.h, distance.low, error)):
        return -1.0
    if limit < np.inf:
        return -1.0 if distance.h == limit else 0.0 if distance.h < limit else np.inf
    share = over(Wide(radius, 0.0), far)
    bound = share.h * (2.0**-102 * size + error) + 2.0**-98 * (radius + size)
    for k, way in ((0, x), (1, y), (2, z)):
        if k >= foot.shape[0]:
            continue
        end = plus(times(way, share), Wide(numbers[2 * k], numbers[2 * k + 1]))
        is_proven = is_correctly_rounded(end.h, end.low, bound) and abs(end.h) > 2.0**-500
        if numbers[7] == 1.0 and way.h == 0.0:
            end, is_proven = Wide(numbers[2 * k], 0.0), True
        if not is_proven:
            return -1.0
        foot[k] = end.h + 0.0
    return distance.h


@kernel
def fill_from_ball(
    points: FloatArray, span: tuple[int, int], ball: int, limit: float, distance: FloatArray, feet: FloatArray,
    is_named: bool, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill the NaN entries of distance (n,) for points (n, d) number span[0] .. span[1] - 1: from the surface of a
    ball, as `nearest_on_ball` does. is_named: also feet (n, d), which else has a row at least."""
    for item in range(span[0], span[1]):
        if distance[item] == distance[item] or flag[0] != 0:
            continue
        q = Point3(points[item, 0], points[item, 1], points[item, 2] if points.shape[1] == 3 else 0.0)
        foot = feet[item if is_named else 0]
        value = nearest_on_ball(ball, q, False, limit, foot[: points.shape[1] if is_named else 0])
        distance[item] = value if value >= 0.0 else np.nan
