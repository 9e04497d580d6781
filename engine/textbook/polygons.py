"""Points in a polygon of the plane: by the parity of a half-line; in a convex one by angles, or by sides of edges.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics. `by_half_line` has the
half-open rule for the ends of an edge ("one end strictly above, the other not"), which counts a vertex once. Of the sum
of angles ("if the sum is 360 degrees, then the point is inside, otherwise it is outside") there are two readings:
`by_signed_angles` adds angles with their sign: a full turn inside and 0 outside, so comparing the sum with half a turn
leaves room for every rounding error. `by_unsigned_angles` is the textbook's sum: inside it is a full turn, outside
less, but just outside an edge it is as close to a full turn as one likes, and no float sum equals 360 degrees; so it
needs a tolerance, which calls points within some distance of the boundary inside.
"""

from __future__ import annotations

from math import acos, atan2, hypot, pi
from typing import Any

import numpy as np

from engine.compiling.jit import allocating, allocating_kernel, inline
from engine.types import BoolArray, FloatArray, IntArray


@allocating_kernel
def by_half_line(points: FloatArray, vertices: FloatArray, ring_offsets: IntArray) -> BoolArray:
    """Return (n,) bool: whether each point (n, 2) is in the rings vertices[ring_offsets[r] : ring_offsets[r + 1]]
    (even-odd), by the parity of the edges that a half-line along x crosses (crossing number). What goes wrong: where it
    meets an edge is computed by a division and compared; near an edge rounding decides."""
    contained = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        x, y = points[i]
        inside = False
        for r in range(len(ring_offsets) - 1):
            before = ring_offsets[r + 1] - 1
            for now in range(ring_offsets[r], ring_offsets[r + 1]):
                x1, y1 = vertices[before]
                x2, y2 = vertices[now]
                if (y1 > y) != (y2 > y) and x < x1 + (y - y1) * (x2 - x1) / (y2 - y1):
                    inside = not inside
                before = now
        contained[i] = inside
    return contained


@inline
def signed_angle(ux: float, uy: float, vx: float, vy: float) -> float:
    """Return the angle from vector u to vector v in (-pi, pi]."""
    return atan2(ux * vy - uy * vx, ux * vx + uy * vy)


@inline
def unsigned_angle(ux: float, uy: float, vx: float, vy: float) -> float:
    """Return the angle between vectors u and v in [0, pi] by the scalar product; pi if one is zero."""
    size = hypot(ux, uy) * hypot(vx, vy)
    if size == 0.0:
        return pi
    return acos(min(1.0, max(-1.0, (ux * vx + uy * vy) / size)))


@allocating
def sum_of_angles(point: FloatArray, vertices: FloatArray, angle: Any) -> float:
    """Return the sum of angle(u, v) over the edges of a ring (n, 2), u and v being the vectors from the point to the
    edge's ends; angle(ux, uy, vx, vy): signed or unsigned."""
    total = 0.0
    for j in range(len(vertices)):
        u, v = vertices[j - 1] - point, vertices[j] - point
        total += angle(u[0], u[1], v[0], v[1])
    return total


@allocating_kernel
def by_signed_angles(points: FloatArray, vertices: FloatArray) -> BoolArray:
    """Return (n,) bool: whether each point (n, 2) is in a ring (m, 2): the magnitude of the sum of signed angles to its
    edges exceeds half a turn. What goes wrong: it is twelve times slower than sides, and on an edge the angle is half a
    turn of either sign."""
    contained = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        contained[i] = abs(sum_of_angles(points[i], vertices, signed_angle)) > pi
    return contained


@allocating_kernel
def by_unsigned_angles(points: FloatArray, vertices: FloatArray, tolerance: float) -> BoolArray:
    """Return (n,) bool: whether each point (n, 2) is in a convex ring (m, 2): the sum of unsigned angles to its edges
    is at least a full turn less `tolerance` (radians)."""
    contained = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        contained[i] = sum_of_angles(points[i], vertices, unsigned_angle) >= 2.0 * pi - tolerance
    return contained


@allocating_kernel
def by_same_side(points: FloatArray, vertices: FloatArray) -> BoolArray:
    """Return (n,) bool for points (n, 2): whether a point is on the same side of every edge of the convex ring vertices
    (m, 2). Either orientation of the ring will do; a point on an edge counts as inside. What goes wrong: the cross
    product of a point close to an edge may have the wrong sign."""
    contained = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        has_left, has_right = False, False
        for j in range(len(vertices)):
            edge, to_point = vertices[j] - vertices[j - 1], points[i] - vertices[j - 1]
            turn = edge[0] * to_point[1] - edge[1] * to_point[0]
            has_left = has_left or turn > 0.0
            has_right = has_right or turn < 0.0
        contained[i] = not (has_left and has_right)
    return contained
