"""Cuts the faces that are certainly strictly convex in their projection into fans; see `ear_cutting.py`.

Where rounding leaves open along which axis the area of a face is largest, it must be convex along each that may be: the
fan is the same. A ring turns strictly one way at every corner and around once if every turn has that sign and the first
coordinate rises and falls once (comparisons of floats are exact).

**Bounds.** A face is brought to size 1 by a power of two; what that takes from tiny coordinates, 2^-1075, is far below
`_TINY`. A product of differences carries three roundings, a term four, a sum of k terms at most k more, each below the
sum of sizes; doubled.
"""

from __future__ import annotations

from math import frexp, ldexp
from typing import Any, Final

from engine.jit import inline, kernel

CONVEX, UNSURE = 0, 4
_TINY: Final = 1e-300  # far above what underflow takes from a sum of products (a few times 2^-1075)
_ROUNDOFF: Final = 2.0**-53
_POLL: Final = 0x3FF


@inline
def _at(vertices: Any, merged: Any, corner: int, axis: int, scale: float) -> float:
    return float(vertices[merged[corner], axis]) * scale


@inline
def _area(vertices: Any, merged: Any, corners: tuple[int, int], axis: int, scale: float) -> tuple[float, float]:
    """Return twice the area along an axis of the face of the corners from the first up to the last, and a bound on its
    error."""
    first, last = corners
    a, b = (axis + 1) % 3, (axis + 2) % 3
    u0, v0 = _at(vertices, merged, first, a, scale), _at(vertices, merged, first, b, scale)
    area, sizes, u, v = 0.0, 0.0, 0.0, 0.0
    for corner in range(first + 1, last):
        next_u, next_v = _at(vertices, merged, corner, a, scale) - u0, _at(vertices, merged, corner, b, scale) - v0
        left, right = u * next_v, next_u * v
        area += left - right
        sizes += abs(left) + abs(right)
        u, v = next_u, next_v
    return area, 2.0 * (last - first + 4) * _ROUNDOFF * sizes + _TINY


@inline
def _turns_once(vertices: Any, merged: Any, corners: tuple[int, int], axis: int, scale: float, is_left: bool) -> bool:
    """Tell whether a face certainly turns strictly one way at every corner, and around once."""
    first, last = corners
    a, b = (axis + 1) % 3, (axis + 2) % 3
    u, v = _at(vertices, merged, last - 1, a, scale), _at(vertices, merged, last - 1, b, scale)
    du = u - _at(vertices, merged, last - 2, a, scale)
    dv = v - _at(vertices, merged, last - 2, b, scale)
    n_changes, rises, first_rises = 0, 0, 0
    for corner in range(first, last):
        next_u, next_v = _at(vertices, merged, corner, a, scale), _at(vertices, merged, corner, b, scale)
        next_du, next_dv = next_u - u, next_v - v
        left, right = du * next_dv, next_du * dv
        turn = left - right if is_left else right - left
        if not turn > 8.0 * _ROUNDOFF * (abs(left) + abs(right)) + _TINY:
            return False
        if next_du != 0.0:  # a vertical side goes on as the one before it did
            way = 1 if next_du > 0.0 else -1
            n_changes += way == -rises
            first_rises = way if first_rises == 0 else first_rises
            rises = way
        u, v, du, dv = next_u, next_v, next_du, next_dv
    return n_changes + (first_rises == -rises) == 2


@inline
def _projection(vertices: Any, merged: Any, corners: tuple[int, int]) -> int:
    """Return CONVEX, or the number from 1 of the axis along which the area is largest, negative where that is negative;
    UNSURE where rounding leaves that open."""
    largest, least, found, is_convex = 0.0, -1.0, 0, True
    for corner in range(corners[0], corners[1]):
        for axis in range(3):
            largest = max(largest, abs(vertices[merged[corner], axis]))
    scale = ldexp(1.0, -max(frexp(largest)[1], -1000))
    for axis in range(3):
        area, bound = _area(vertices, merged, corners, axis, scale)
        least = max(least, abs(area) - bound)
    for axis in range(3):
        area, bound = _area(vertices, merged, corners, axis, scale)
        if abs(area) + bound >= least:
            is_convex = is_convex and _turns_once(vertices, merged, corners, axis, scale, area > 0.0)
            found = UNSURE if found != 0 or abs(area) <= bound else axis + 1 if area > 0.0 else -axis - 1
    return CONVEX if is_convex else found


@kernel
def cut_convex_faces(
    vertices: Any, offsets: Any, merged: Any, starts: Any, corners: Any, projections: Any, flag: Any
) -> None:
    """Fill corners (starts[-1], 3) with positions in `merged`: the triangles of face i from starts[i] on, fans about
    the last corner; faces that are not certainly convex are left out. projections (m,) int8: see `_projection`."""
    for face in range(offsets.shape[0] - 1):
        if face & _POLL == 0 and flag[0] != 0:
            return
        first, last, place = offsets[face], offsets[face + 1], starts[face]
        if last - first == 3:
            projections[face] = CONVEX
            corners[place, 0], corners[place, 1], corners[place, 2] = first, first + 1, first + 2
            continue
        projections[face] = _projection(vertices, merged, (first, last))
        for tip in range(first, last - 2 if projections[face] == CONVEX else first):
            corners[place, 0], corners[place, 1], corners[place, 2] = last - 1, tip, tip + 1
            place += 1
