"""Axis-parallel boxes: six comparisons, exact as they stand."""

from __future__ import annotations

from typing import Any

from engine.containment.posed.filters import NOT_FINITE, has_not_finite, in_space, side_of_box
from engine.jit import kernel
from engine.types import UNDECIDED


@kernel
def locate_in_box(points: Any, blurs: Any, low: Any, high: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, dim) and the corners low, high (dim,); returns how many stay open.

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
