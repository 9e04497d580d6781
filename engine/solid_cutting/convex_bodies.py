"""Compiled: convex bodies under poses, near an origin, with the planes of their faces, all in double-doubles.

Let u = 2^-53, D bound all coordinates, and eta the error of a placed corner on an axis. A plane through three corners
has n = a x b, off by 48 u^2 |a| |b| + 8 eta (|a| + |b|) on each axis (norms: the largest component), so its value
w = n.(v - x) at a corner x is off by

    e = 3 D (48 u^2 |a| |b| + 8 eta (|a| + |b|)) + 3 |n| (4 eta + 128 u^2 D)
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

from engine.compiling.jit import called, inline
from engine.predicates.error_free import U2, dd_add, dd_div, dd_mul, dd_scale, dd_sub, fast_two_sum, two_sum
from engine.types import FloatArray

PLACED: Final = 6
"""Numbers of a corner: x y z of the high part, then of the low part."""
PLANE: Final = 15
VALUE, SLACK, TILT, ROUGH, AXIS, WAY, STEEPEST, EXTENT = 6, 8, 9, 10, 11, 12, 13, 14
"""Where the numbers of a plane are.

| from | contents |
| --- | --- |
| 0 | normal, as a corner |
| VALUE | n.v, high and low |
| SLACK, TILT, ROUGH | e, the error of n, the bound on values in plain doubles |
| AXIS, WAY | the axis at a right angle to it, exactly, or -1.0; the sign of the normal there |
| STEEPEST, EXTENT | k, the axis on which n is largest; the largest difference of corners of the face |
"""
_TINY: Final = 2.0**-900
BESIDE, CERTAIN, OPEN_SIDES = 0, 1, 2

Body = namedtuple("Body", "corners rings twins placed exact planes sides")
"""One body of a pair: corners, rings and twins as `overlap_bodies` takes them, the rest filled here.

| field | contents |
| --- | --- |
| placed (n, 6) | corners under its pose less the origin |
| exact (3,) | 1.0 where all of them are exact on an axis |
| planes (m, PLANE) | those of its faces |
| sides (.., ..) | for each corner the values of the other body's planes, 0.0 where the sign is not certain |
"""


@inline
def place(points: FloatArray, pose: FloatArray, origin: FloatArray, body: Body) -> float:
    """Fill ``body.placed`` and ``body.exact`` with the corners (n, 6) under a pose, relative to `origin` (3,); return
    eta, the bound on the error of a placed coordinate (see the module)."""
    eta, is_posed = 0.0, pose[12] != 0.0
    for axis in range(3):
        r = axis * 3
        n_ones = int(abs(pose[r]) == 1.0) + int(abs(pose[r + 1]) == 1.0) + int(abs(pose[r + 2]) == 1.0)
        n_zeros = int(pose[r] == 0.0) + int(pose[r + 1] == 0.0) + int(pose[r + 2] == 0.0)
        is_exact = not is_posed or (n_ones == 1 and n_zeros == 2)
        for k in range(points.shape[0]):
            h, low = points[k, axis], points[k, axis + 3]
            size = abs(h)
            if is_posed:
                h = low = size = 0.0
                for j in range(3):
                    if pose[r + j] != 0.0:
                        ph, pl = dd_scale(points[k, j], points[k, j + 3], pose[r + j])
                        h, low = dd_add(h, low, ph, pl)
                        size += abs(ph)
                        is_exact = is_exact and points[k, j + 3] == 0.0
                h, rest = two_sum(h, pose[9 + axis])
                low, lost = two_sum(low, rest)
                is_exact = is_exact and lost == 0.0
                size += abs(pose[9 + axis]) + abs(lost) / U2
            is_exact = is_exact and (is_posed or low == 0.0)
            h, rest = two_sum(h, -origin[axis])
            low, lost = two_sum(low, rest)
            is_exact = is_exact and lost == 0.0
            body.placed[k, axis], body.placed[k, axis + 3] = fast_two_sum(h, low)
            if not is_exact:
                eta = max(eta, 64.0 * U2 * (size + abs(origin[axis])) + abs(lost))
        body.exact[axis] = 1.0 if is_exact else 0.0
    return eta


@inline
def difference(placed: FloatArray, a: int, b: int, axis: int) -> tuple[float, float]:
    return dd_sub(placed[a, axis], placed[a, axis + 3], placed[b, axis], placed[b, axis + 3])


@inline
def turn(placed: FloatArray, a: int, b: int, c: int, axis: int) -> tuple[float, float]:
    """Return component `axis` of (b - a) x (c - a) as a double-double; a, b, c: rows of `placed`."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    ph, pl = dd_mul(*difference(placed, b, a, i), *difference(placed, c, a, j))
    qh, ql = dd_mul(*difference(placed, b, a, j), *difference(placed, c, a, i))
    return dd_sub(ph, pl, qh, ql)


@called
def set_planes(body: Body, eta: float, span: float) -> bool:
    """Fill ``body.planes`` from its placed corners; return False if the normal of a face is not certain. eta: error of
    a placed coordinate; span: bound on all coordinates."""
    placed, corners = body.placed, body.corners
    for face in range(body.planes.shape[0]):
        plane, start, size = body.planes[face], body.rings[face], body.rings[face + 1] - body.rings[face]
        a, b, c = corners[start], corners[start + size // 3], corners[start + 2 * size // 3]
        far = near = most = 0.0
        for axis in range(3):
            far = max(far, abs(placed[b, axis] - placed[a, axis]))
            near = max(near, abs(placed[c, axis] - placed[a, axis]))
        for axis in range(3):
            plane[axis], plane[axis + 3] = turn(placed, a, b, c, axis)
            most = max(most, abs(plane[axis]))
        tilt = 1.01 * (48.0 * U2 * far * near + 8.0 * eta * (far + near)) + _TINY
        plane[AXIS] = -1.0
        for axis in range(3):
            is_flat = body.exact[axis] > 0.0
            for k in range(size):
                corner = corners[start + k]
                is_flat = is_flat and placed[corner, axis] == placed[a, axis]
                is_flat = is_flat and placed[corner, axis + 3] == placed[a, axis + 3]
            if is_flat:
                if not abs(plane[axis]) > tilt:
                    return False
                way = 1.0 if plane[axis] > 0.0 else -1.0
                for k in range(PLACED):
                    plane[k] = way if k == axis else 0.0
                plane[AXIS], plane[WAY], tilt, most = float(axis), way, 0.0, 1.0
        if not most > 4.0 * tilt:
            return False
        h, low = 0.0, 0.0
        for axis in range(3):
            ph, pl = dd_mul(plane[axis], plane[axis + 3], placed[a, axis], placed[a, axis + 3])
            h, low = dd_add(h, low, ph, pl)
        plane[VALUE], plane[VALUE + 1], plane[TILT] = h, low, tilt
        plane[SLACK] = 3.0 * span * tilt + 3.0 * most * (4.0 * eta + 128.0 * U2 * span) + _TINY
        plane[ROUGH] = 2.0**-47 * most * span + plane[SLACK]
    return True


@inline
def value_at(plane: FloatArray, points: FloatArray, at: int) -> tuple[float, float]:
    """Return n.(v - x), a double-double: n the normal of a plane, v a point on it, x = points[at]. It is positive
    inside, the distance times |n|."""
    h, low = plane[VALUE], plane[VALUE + 1]
    for axis in range(3):
        ph, pl = dd_mul(plane[axis], plane[axis + 3], points[at, axis], points[at, axis + 3])
        h, low = dd_sub(h, low, ph, pl)
    return h, low


@called
def find_sides(body: Body, planes: FloatArray) -> int:
    """Fill ``body.sides`` for `planes` of the other body; return `BESIDE` if one of them has the whole body outside or
    on it, else `CERTAIN` or `OPEN_SIDES`."""
    placed, result = body.placed, CERTAIN
    for face in range(planes.shape[0]):
        plane, is_beside = planes[face], True
        axis = int(plane[AXIS])
        is_sharp = axis >= 0 and body.exact[axis] > 0.0
        for k in range(placed.shape[0]):
            if is_sharp:
                h, _ = value_at(plane, placed, k)  # two terms: its sign is exact
                is_beside = is_beside and h <= 0.0
            else:
                h = plane[VALUE] - (plane[0] * placed[k, 0] + plane[1] * placed[k, 1] + plane[2] * placed[k, 2])
                h = h if abs(h) > plane[ROUGH] else 0.0
                is_beside = is_beside and h < 0.0
            body.sides[k, face] = h
            result = result if h != 0.0 else OPEN_SIDES
        if is_beside:
            return BESIDE
    return result


@called
def measure_faces(body: Body, eta: float, span: float, n_others: int, sums: FloatArray) -> None:
    """Fill the rest of ``body.planes``, from STEEPEST on, and add six times the volume of the body to sums[3:6], a
    double-double and its bound. eta, span: as for `set_planes`; n_others: number of faces of the other body."""
    placed, corners = body.placed, body.corners
    share = 32.0 * (body.planes.shape[0] + n_others) * U2
    for face in range(body.planes.shape[0]):
        plane, start, stop = body.planes[face], body.rings[face], body.rings[face + 1]
        axis, extent = 0, 0.0
        for k in range(1, 3):
            axis = k if abs(plane[k]) > abs(plane[axis]) else axis
        first, h, low = corners[start], 0.0, 0.0
        for k in range(start + 1, stop):
            for place in range(3):
                extent = max(extent, abs(placed[corners[k], place] - placed[first, place]))
        plane[STEEPEST], plane[EXTENT] = float(axis), extent
        if stop - start == 3 and plane[AXIS] < 0.0:  # case: n.v is the determinant of its corners
            sums[3], sums[4] = dd_add(sums[3], sums[4], plane[VALUE], plane[VALUE + 1])
            sums[5] += plane[SLACK] + share * abs(plane[VALUE])
            continue
        for k in range(start + 1, stop - 1):
            ph, pl = turn(placed, first, corners[k], corners[k + 1], axis)
            h, low = dd_add(h, low, ph, pl)
        add_cone(plane, h, low, (stop - start) * (320.0 * U2 * span + 8.0 * eta) * extent, share, sums, 3)


@inline
def add_cone(plane: FloatArray, h: float, low: float, wrong: float, share: float, sums: FloatArray, at: int) -> None:
    """Add six volumes of the cone from the origin over a part of a face to sums[at : at + 3], a double-double and its
    error bound. h, low: twice its area, seen along the steepest axis; wrong: the error of that; share: of sums."""
    axis = int(plane[STEEPEST])
    high, rest = dd_div(plane[VALUE], plane[VALUE + 1], plane[axis], plane[axis + 3])
    size, off = abs(high), 3.0 * plane[SLACK] / abs(plane[axis]) + 17.0 * U2 * abs(high)
    error = 1.01 * (size * wrong + off * (abs(h) + wrong)) + share * abs(high * h)
    h, low = dd_mul(high, rest, h, low)
    sums[at], sums[at + 1] = dd_add(sums[at], sums[at + 1], h, low)
    sums[at + 2] += error + _TINY
