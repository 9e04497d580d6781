"""A segment in the coordinates of a mesh's tree, with the slack that rounding takes.

The tree (bvh.py) holds float32 boxes in coordinates of its own. A segment is brought there in doubles, cut to what lies
near the tree, and stored as its middle and half in float32; the slack covers what all this rounds:

    middle, w = m - c      2^-24 (S + 2) each, S the largest coordinate (the tree's own are at most 2)
    half, products         2^-24 of themselves, so of the bound |e_i| (S + 2), thrice
    cutting                2^-50 of the segment's coordinates before, in either end

16 * 2^-24 (S + 2) for half widths is more than their sum.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.jit import merged
from engine.types import Point3

SLACK: Final = 2.0**-20
CUT_SLACK: Final = 2.0**-45
LIMIT: Final = 4.0
"""Segments are cut to this cube, in coordinates of the tree, that is: far outside of every box."""

_MOST: Final = np.float32(2.0**100)
NOWHERE: Final = (np.float32(0.0), np.float32(0.0), np.float32(0.0))


@merged
def local_segment(p: Point3, q: Point3, origin: Any, inverse: float) -> tuple[Any, Any, float, float, bool]:
    """Return middle, half, slack and tiny (`near_segment`) of a segment, and whether it comes near the tree at all."""
    ox, oy, oz = origin[0] * inverse, origin[1] * inverse, origin[2] * inverse
    px, py, pz = p.x * inverse - ox, p.y * inverse - oy, p.z * inverse - oz
    dx, dy, dz = q.x * inverse - p.x * inverse, q.y * inverse - p.y * inverse, q.z * inverse - p.z * inverse
    size = max(abs(px), abs(py), abs(pz), abs(px + dx), abs(py + dy), abs(pz + dz))
    start, end = 0.0, 1.0
    tiny = CUT_SLACK * (size + 2.0)
    if size > LIMIT and size < 2.0**40:
        for at, step in ((px, dx), (py, dy), (pz, dz)):
            if abs(step) < 2.0**-40:
                if abs(at) > LIMIT:
                    return NOWHERE, NOWHERE, 0.0, 0.0, False
                continue
            first, last = (-LIMIT - at) / step, (LIMIT - at) / step
            start, end = max(start, min(first, last)), min(end, max(first, last))
        if start > end:
            return NOWHERE, NOWHERE, 0.0, 0.0, False
        size = LIMIT + 1.0
    middle, half = 0.5 * (start + end), 0.5 * (end - start)
    return (
        (np.float32(px + middle * dx), np.float32(py + middle * dy), np.float32(pz + middle * dz)),
        (np.float32(half * dx), np.float32(half * dy), np.float32(half * dz)),
        SLACK * (size + 2.0) + tiny,
        tiny,
        True,
    )


@merged
def inverse_of(half: Any) -> Any:
    """Return 1 / half for `enter_boxes`; halves below 2^-100 are far below every slack."""
    x, y, z = np.float32(1.0) / half[0], np.float32(1.0) / half[1], np.float32(1.0) / half[2]
    return min(max(x, -_MOST), _MOST), min(max(y, -_MOST), _MOST), min(max(z, -_MOST), _MOST)
