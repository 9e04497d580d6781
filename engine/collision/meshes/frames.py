"""From the tree of one placed body to the tree of another: the maps that `box_lanes.meeting` takes, with their margins.

With p = o + s a for tree coordinates a (origin o, scale s a power of two), the placements R p + t of two bodies give

    a = M b + T,    M = (s_b / s_a) R_a' R_b,    T = (R_a' (R_b o_b + t_b - t_a) - o_a) / s_a

where R_a' stands for the inverse of R_a. **margin.** The transpose is used instead: with `defect` the largest entry of
|R' R - I|, it is off by 3.1 defect relative to the vector it turns. Float64 rounding is below 2^-46 of the same
magnitudes, rounding to float32 and the sums of `meeting` below 2^-19 of the numbers there, which are at most 2 + 3.5
s_b / s_a + |T|. Where scales differ by more than 2^60 the axes of the smaller body are left out: nothing is apart on
them; so are those of a map that is not finite.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.collision.meshes.placement import Placement, turned, turned_back
from engine.jit import inline
from engine.predicates.vectors import largest_of
from engine.types import Point3

WIDEST_RATIO = 2.0**60
WIDEST_MARGIN = 1e15
NEVER_APART = 1e20
"""Margin of a map that is left out: far above all boxes, far below `bvh.UNUSED`, which stays apart from everything."""


@inline
def defect_of(place: Placement) -> float:
    """Return a bound on the entries of |R' R - I|."""
    if not place.is_posed:
        return 0.0
    x = turned_back(place, Point3(place.xx, place.yx, place.zx))
    y = turned_back(place, Point3(place.xy, place.yy, place.zy))
    z = turned_back(place, Point3(place.xz, place.yz, place.zz))
    off = max(abs(x.y), abs(x.z), abs(y.z))
    return max(off, abs(x.x - 1.0), abs(y.y - 1.0), abs(z.z - 1.0)) + 2.0**-50


@inline
def set_frame(
    frame: Any, a: Placement, a_origin: Any, a_scale: float, b: Placement, b_origin: Any, b_scale: float, defect: float
) -> bool:
    """Fill frame (22, 8) float32 with the map from tree b to tree a; tell whether the two trees are surely apart."""
    ratio = b_scale / a_scale
    origin = Point3(b_origin[0], b_origin[1], b_origin[2])
    there = turned(b, origin)
    shift = Point3(b.x - a.x, b.y - a.y, b.z - a.z)
    v = turned_back(a, Point3(there.x + shift.x, there.y + shift.y, there.z + shift.z))
    t = Point3((v.x - a_origin[0]) / a_scale, (v.y - a_origin[1]) / a_scale, (v.z - a_origin[2]) / a_scale)
    a_reach = max(abs(a_origin[0]), abs(a_origin[1]), abs(a_origin[2]))
    sizes = (a_reach + largest_of(origin) + largest_of(shift)) / a_scale + 2.0 + 2.0 * ratio
    margin = 2.0**-19 * (2.0 + 3.5 * ratio + largest_of(t)) + (32.0 * defect + 2.0**-46) * sizes
    if not (ratio <= WIDEST_RATIO and margin <= WIDEST_MARGIN and np.isfinite(t.x + t.y + t.z)):
        for row in range(21):
            frame[row, :] = 1.0 if 9 <= row < 18 else 0.0
        frame[21, :] = NEVER_APART
        return False
    for k in range(3):
        m = turned_back(a, turned(b, Point3(1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)))
        frame[k, :], frame[3 + k, :], frame[6 + k, :] = ratio * m.x, ratio * m.y, ratio * m.z
        frame[9 + k, :], frame[12 + k, :], frame[15 + k, :] = ratio * abs(m.x), ratio * abs(m.y), ratio * abs(m.z)
    frame[18, :], frame[19, :], frame[20, :] = t.x, t.y, t.z
    frame[21, :] = margin
    return largest_of(t) > 2.0 + 3.5 * ratio + margin
