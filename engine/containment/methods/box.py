"""Axis-parallel boxes: six comparisons, exact as they stand."""

from __future__ import annotations

from typing import Any

from engine.containment.posed.filters import NOT_FINITE, has_not_finite
from engine.jit import kernel


@kernel
def locate_in_box(points: Any, low: Any, high: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, dim) and the corners low, high (dim,); returns 0, or NOT_FINITE.

    Where low = high on an axis every point of the box lies on its boundary: the comparisons say so by themselves.
    """
    if has_not_finite(points):
        return NOT_FINITE
    n_axes = len(low)
    for item in range(len(points)):
        if flag[0]:
            break
        is_out, is_within = False, True
        for axis in range(n_axes):
            value = points[item, axis]
            is_out |= value < low[axis] or value > high[axis]
            is_within &= low[axis] < value and value < high[axis]
        locations[item] = -1 if is_out else 1 if is_within else 0
    return 0
