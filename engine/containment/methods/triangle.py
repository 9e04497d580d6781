"""Triangles of the plane: exact signs of orient2d for the three edges.

A triangle without area is the segment (or point) it covers, and all of it is BOUNDARY: there, a point off the line is
seen on both sides, since the three signed areas add up to zero, and a point on the line is compared with the box.

Source: the textbook's "same side" test of a triangle; exact signs and three values added.
"""

from __future__ import annotations

from typing import Any

from engine.containment.methods.polyhedron_ray_parity import decide2
from engine.jit import kernel
from engine.predicates.loading import as_point2
from engine.types import UNDECIDED


@kernel
def locate_in_triangle(points: Any, corners: Any, low: Any, high: Any, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, 2); returns how many needed more than the filter.

    corners: (3, 2), in either orientation. low, high: (2,), the corners of its box.
    """
    n_beyond = 0
    a, b, c = as_point2(corners, 0), as_point2(corners, 1), as_point2(corners, 2)
    for item in range(len(points)):
        if flag[0]:
            break
        q = as_point2(points, item)
        if q.x < low[0] or q.x > high[0] or q.y < low[1] or q.y > high[1]:
            locations[item] = -1
            continue
        first, first_beyond = decide2(a, b, q)
        second, second_beyond = decide2(b, c, q)
        third, third_beyond = decide2(c, a, q)
        n_beyond += (first_beyond | second_beyond | third_beyond) != 0
        has_left = first == 1 or second == 1 or third == 1
        has_right = first == -1 or second == -1 or third == -1
        if has_left and has_right:
            locations[item] = -1
        elif first == UNDECIDED or second == UNDECIDED or third == UNDECIDED:
            locations[item] = UNDECIDED
        else:
            locations[item] = 1 if first != 0 and second != 0 and third != 0 else 0
    return n_beyond
