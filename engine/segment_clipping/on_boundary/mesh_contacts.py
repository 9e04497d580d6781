"""A segment in the coordinates of a mesh's tree, with the slack that rounding takes.

The tree (bvh.py) holds float32 boxes in coordinates of its own. A segment is brought there in doubles, cut to what lies
near the tree, and stored as its middle and half in float32; the slack covers what all this rounds:

    middle, w = m - c      2^-24 (S + 2) each, S the largest coordinate (the tree's own are at most 2)
    half, quotients        see `enter_boxes`
    cutting                2^-50 of the segment's coordinates before, in either end

16 * 2^-24 (S + 2) for half widths is more than their sum.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.jit import merged
from engine.lanes.triangles import AXES_BEFORE, longest_axis
from engine.types import Point3

SLACK: Final = 2.0**-20
CUT_SLACK: Final = 2.0**-45
LIMIT: Final = 4.0
"""Segments are cut to this cube, in coordinates of the tree, that is: far outside of every box."""

_MOST: Final = np.float32(2.0**100)
Way = namedtuple("Way", "middle half inverse slack is_near")
"""A segment in the coordinates of a tree, with its slack, in float32. inverse: 1 / half, at most 2^100, where halves
are far below every slack; is_near: whether it comes near the tree at all."""


@merged
def local_segment(p: Point3, q: Point3, origin: Any, inverse: float, blur: float) -> Way:
    """Return a segment, whose ends are known to `blur` a coordinate, in the coordinates of a tree."""
    ox, oy, oz = origin[0] * inverse, origin[1] * inverse, origin[2] * inverse
    px, py, pz = p.x * inverse - ox, p.y * inverse - oy, p.z * inverse - oz
    dx, dy, dz = q.x * inverse - p.x * inverse, q.y * inverse - p.y * inverse, q.z * inverse - p.z * inverse
    size = max(abs(px), abs(py), abs(pz), abs(px + dx), abs(py + dy), abs(pz + dz))
    start, end, is_near = 0.0, 1.0, True
    cut = CUT_SLACK * (size + 2.0)
    if size > LIMIT and size < 2.0**40:
        for at, step in ((px, dx), (py, dy), (pz, dz)):
            if abs(step) < 2.0**-40:
                is_near &= abs(at) <= LIMIT
                continue
            first, last = (-LIMIT - at) / step, (LIMIT - at) / step
            start, end = max(start, min(first, last)), min(end, max(first, last))
        is_near &= start <= end
        size = LIMIT + 1.0
    middle, length = 0.5 * (start + end), 0.5 * (end - start)
    half: Any = np.float32(length * dx), np.float32(length * dy), np.float32(length * dz)
    x, y, z = np.float32(1.0) / half[0], np.float32(1.0) / half[1], np.float32(1.0) / half[2]
    return Way(
        (np.float32(px + middle * dx), np.float32(py + middle * dy), np.float32(pz + middle * dz)),
        half,
        (min(max(x, -_MOST), _MOST), min(max(y, -_MOST), _MOST), min(max(z, -_MOST), _MOST)),
        np.float32(SLACK * (size + 2.0) + cut + 64.0 * blur * inverse),
        is_near,
    )


@merged
def shear_of(way: Way) -> Any:
    """Return what `near_triangles` takes of a segment: axes, middle, r, s, reach and slack."""
    k, middle, half = longest_axis(way.half), way.middle, way.half
    i, j = AXES_BEFORE[k], AXES_BEFORE[k + 1]
    slack = np.float32(2.0) * way.slack  # 32 u (S + 2) of lanes/triangles.py, and twice what cutting loses
    place = middle[i], middle[j], middle[k]
    return (i, j, k), place, half[i] / half[k], half[j] / half[k], abs(half[k]) + slack, slack
