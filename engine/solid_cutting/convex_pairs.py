"""Compiled: the volume that two convex bodies have in common, and its ratio to their union, for many pairs under poses.

Each face f of either body is cut by the planes of the other (Sutherland-Hodgman), all in double-doubles from an origin
near both; with the normal n of f, v on it, k the axis on which n is largest and S twice the area that is left, seen
along k,

    6 volume = sum over all faces of (n.v / n_k) S                       (Gauss's theorem)

A face in a plane of the other counts once: as one of the first body, and only if both look in one direction. That is
decided for faces at right angles to an axis whose coordinates are exact; other such pairs are left open (NaN).

**Bounds.** Let u = 2^-53, D bound all coordinates, and eta the error of a placed corner on an axis. A plane through
three corners has n = a x b, off by 48 u^2 |a| |b| + 8 eta (|a| + |b|) on each axis (norms: the largest component), so
its value w = n.(v - x) at a corner x is off by

    e = 3 D (48 u^2 |a| |b| + 8 eta (|a| + |b|)) + 3 |n| (4 eta + 128 u^2 D)

Of a polygon that is cut by computed values the corners that stay have w >= -e, those that go w <= e, and where an edge
is cut |w| <= e: so the part that is wrong lies where |w| <= e, in a strip of the polygon of width 2 e / g, where the
slope g of w is at least (max w - min w) / diameter. With F the extent of the face, its diameter below sqrt(3) F, twice
the area of the strip is below 24 e F^2 / (max w - min w), if that range exceeds 8 e; else the pair is left open. What
was wrong before is cut too, and does not grow. What corners and sums are rounded by is below 320 u^2 D F + 8 eta F a
corner, in twice the area.

The double nearest to the result is certain where the bound says so; else the pair is NaN. A result of zero takes a
plane between both, that of a face or through an edge of each.

Source: I. E. Sutherland, G. W. Hodgman, Reentrant polygon clipping, 1974; S. Gottschalk, Separating axis theorem, 1996.
"""

from __future__ import annotations

from typing import Final

from engine.compiling.jit import called, inline, kernel
from engine.predicates.error_free import (
    U2,
    dd_add,
    dd_div,
    dd_mul,
    dd_scale,
    dd_sub,
    fast_two_sum,
    two_sum,
    workspace,
)
from engine.solid_cutting.sums import certified
from engine.types import FlagArray, FloatArray, IntArray

PLACED: Final = 6
"""Numbers of a corner: x y z of the high part, then of the low part."""
PLANE: Final = 13
"""Numbers of a plane: normal as a corner, n.v (high, low), e, error of n, bound of rounded values, axis or -1, way."""
_VALUE, _SLACK, _TILT, _ROUGH, _AXIS, _WAY = 6, 8, 9, 10, 11, 12
CORNER: Final = 8
"""Numbers of a corner of a polygon: as placed, then its value (high, low)."""
_TINY: Final = 2.0**-900


@inline
def _place(
    points: FloatArray, first: int, n: int, pose: FloatArray, origin: FloatArray, placed: FloatArray,
    exact: FloatArray, at: int,
) -> float:  # fmt: skip
    """Fill placed (n, 6) with corners under a pose less the origin, exact[at + axis] with 1.0 if all are exact on an
    axis; return eta."""
    eta, is_posed = 0.0, pose[12] != 0.0
    for axis in range(3):
        r = axis * 3
        n_ones = int(abs(pose[r]) == 1.0) + int(abs(pose[r + 1]) == 1.0) + int(abs(pose[r + 2]) == 1.0)
        n_zeros = int(pose[r] == 0.0) + int(pose[r + 1] == 0.0) + int(pose[r + 2] == 0.0)
        is_exact = not is_posed or (n_ones == 1 and n_zeros == 2)
        for k in range(n):
            h, low = points[first + k, axis], points[first + k, axis + 3]
            size = abs(h)
            if is_posed:
                h = low = size = 0.0
                for j in range(3):
                    if pose[r + j] != 0.0:
                        ph, pl = dd_scale(points[first + k, j], points[first + k, j + 3], pose[r + j])
                        h, low = dd_add(h, low, ph, pl)
                        size += abs(ph)
                        is_exact = is_exact and points[first + k, j + 3] == 0.0
                h, rest = two_sum(h, pose[9 + axis])
                low, lost = two_sum(low, rest)
                is_exact = is_exact and lost == 0.0
                size += abs(pose[9 + axis]) + abs(lost) / U2
            is_exact = is_exact and (is_posed or low == 0.0)
            h, rest = two_sum(h, -origin[axis])
            low, lost = two_sum(low, rest)
            is_exact = is_exact and lost == 0.0
            placed[k, axis], placed[k, axis + 3] = fast_two_sum(h, low)
            if not is_exact:
                eta = max(eta, 64.0 * U2 * (size + abs(origin[axis])) + abs(lost))
        exact[at + axis] = 1.0 if is_exact else 0.0
    return eta


@inline
def _difference(placed: FloatArray, a: int, b: int, axis: int) -> tuple[float, float]:
    return dd_sub(placed[a, axis], placed[a, axis + 3], placed[b, axis], placed[b, axis + 3])


@called
def _set_planes(
    placed: FloatArray, corners: IntArray, rings: IntArray, first: int, n: int, exact: FloatArray, at: int,
    eta: float, span: float, planes: FloatArray,
) -> bool:  # fmt: skip
    """Fill planes (n, 13) with those of the faces from ring `first` on; return False for one without a sure normal."""
    for face in range(n):
        start, size = rings[first + face], rings[first + face + 1] - rings[first + face]
        a, b, c = corners[start], corners[start + size // 3], corners[start + 2 * size // 3]
        far = near = most = 0.0
        for axis in range(3):
            far = max(far, abs(placed[b, axis] - placed[a, axis]))
            near = max(near, abs(placed[c, axis] - placed[a, axis]))
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            ph, pl = dd_mul(*_difference(placed, b, a, i), *_difference(placed, c, a, j))
            qh, ql = dd_mul(*_difference(placed, b, a, j), *_difference(placed, c, a, i))
            planes[face, axis], planes[face, axis + 3] = dd_sub(ph, pl, qh, ql)
            most = max(most, abs(planes[face, axis]))
        tilt = 1.01 * (48.0 * U2 * far * near + 8.0 * eta * (far + near)) + _TINY
        planes[face, _AXIS] = -1.0
        for axis in range(3):
            is_flat = exact[at + axis] > 0.0
            for k in range(size):
                corner = corners[start + k]
                is_flat = is_flat and placed[corner, axis] == placed[a, axis]
                is_flat = is_flat and placed[corner, axis + 3] == placed[a, axis + 3]
            if is_flat:
                if not abs(planes[face, axis]) > tilt:
                    return False
                way = 1.0 if planes[face, axis] > 0.0 else -1.0
                for k in range(PLACED):
                    planes[face, k] = way if k == axis else 0.0
                planes[face, _AXIS], planes[face, _WAY], tilt, most = float(axis), way, 0.0, 1.0
        if not most > 4.0 * tilt:
            return False
        h, low = 0.0, 0.0
        for axis in range(3):
            ph, pl = dd_mul(planes[face, axis], planes[face, axis + 3], placed[a, axis], placed[a, axis + 3])
            h, low = dd_add(h, low, ph, pl)
        planes[face, _VALUE], planes[face, _VALUE + 1] = h, low
        planes[face, _SLACK] = 3.0 * span * tilt + 3.0 * most * (4.0 * eta + 128.0 * U2 * span) + _TINY
        planes[face, _TILT] = tilt
        planes[face, _ROUGH] = 2.0**-47 * most * span + planes[face, _SLACK]
    return True


@inline
def _value(planes: FloatArray, face: int, point: FloatArray, at: int) -> tuple[float, float]:
    """Return how far within a plane a point is, times the length of its normal, as a double-double."""
    h, low = planes[face, _VALUE], planes[face, _VALUE + 1]
    for axis in range(3):
        ph, pl = dd_mul(planes[face, axis], planes[face, axis + 3], point[at, axis], point[at, axis + 3])
        h, low = dd_sub(h, low, ph, pl)
    return h, low


@called
def _find_sides(
    planes: FloatArray, n_planes: int, placed: FloatArray, n: int, exact: FloatArray, at: int, sides: FloatArray
) -> bool:
    """Fill sides (n_planes, n) with 1.0 or -1.0 for corners that are certainly inside or outside, 0.0 for others or,
    where it is certain, on a plane; return whether all lie outside one of the planes, or on it."""
    for face in range(n_planes):
        axis, is_beside = int(planes[face, _AXIS]), True
        is_sharp = axis >= 0 and exact[at + axis] > 0.0
        for k in range(n):
            if is_sharp:
                h, _ = _value(planes, face, placed, k)  # two terms: its sign is exact
                side = 1.0 if h > 0.0 else -1.0 if h < 0.0 else 0.0
                is_beside = is_beside and h <= 0.0
            else:
                h = planes[face, _VALUE] - (
                    planes[face, 0] * placed[k, 0] + planes[face, 1] * placed[k, 1] + planes[face, 2] * placed[k, 2]
                )
                side = 1.0 if h > planes[face, _ROUGH] else -1.0 if -h > planes[face, _ROUGH] else 0.0
                is_beside = is_beside and side < 0.0
            sides[face, k] = side
        if is_beside:
            return True
    return False


@inline
def _cut(
    planes: FloatArray, face: int, polygon: FloatArray, n: int, made: FloatArray, extent: float
) -> tuple[int, float]:
    """Write what a plane leaves of a polygon of n corners to `made`; return how many corners it has, -1 for a polygon
    that may be in the plane, and a bound on twice the area that is wrong."""
    least = most = 0.0
    for k in range(n):
        h, low = _value(planes, face, polygon, k)
        polygon[k, 6], polygon[k, 7] = h, low
        least, most = (h, h) if k == 0 else (min(least, h), max(most, h))
    slack = planes[face, _SLACK]
    if most < -slack:
        return 0, 0.0
    if not most - least > 8.0 * slack and not least > slack:
        return -1, 0.0
    n_made = 0
    for k in range(n):
        j = k + 1 if k + 1 < n else 0
        if polygon[k, 6] >= 0.0:
            for place in range(PLACED):
                made[n_made, place] = polygon[k, place]
            n_made += 1
        if (polygon[k, 6] >= 0.0) != (polygon[j, 6] >= 0.0):
            h, low = dd_sub(polygon[k, 6], polygon[k, 7], polygon[j, 6], polygon[j, 7])
            h, low = dd_div(polygon[k, 6], polygon[k, 7], h, low)
            for axis in range(3):
                dh, dl = _difference(polygon, j, k, axis)
                dh, dl = dd_mul(dh, dl, h, low)
                made[n_made, axis], made[n_made, axis + 3] = dd_add(polygon[k, axis], polygon[k, axis + 3], dh, dl)
            n_made += 1
    return n_made, 0.0 if least > slack else 24.0 * slack * extent * extent / (most - least)


@inline
def _twice_area(polygon: FloatArray, n: int, axis: int) -> tuple[float, float]:
    """Return twice the area of a polygon seen along an axis, as a double-double."""
    i, j, h, low = (axis + 1) % 3, (axis + 2) % 3, 0.0, 0.0
    for k in range(1, n - 1):
        ph, pl = dd_mul(*_difference(polygon, k, 0, i), *_difference(polygon, k + 1, 0, j))
        qh, ql = dd_mul(*_difference(polygon, k, 0, j), *_difference(polygon, k + 1, 0, i))
        ph, pl = dd_sub(ph, pl, qh, ql)
        h, low = dd_add(h, low, ph, pl)
    return h, low


@called
def _add_faces(
    placed: FloatArray, corners: IntArray, rings: IntArray, first: int, n: int, planes: FloatArray,
    others: FloatArray, n_others: int, sides: FloatArray, polygons: FloatArray, numbers: tuple[float, float, bool],
    sums: FloatArray,
) -> bool:  # fmt: skip
    """Add the faces of a body, cut by the planes `others`, to sums[0:3], 6 volumes as a double-double and a bound, and
    uncut to sums[3:6]; return False where a face may be in a plane. numbers: D, eta, whether it is the first body."""
    span, eta, is_first = numbers
    for face in range(n):
        start, size = rings[first + face], rings[first + face + 1] - rings[first + face]
        axis, extent = 0, 0.0
        for k in range(1, 3):
            axis = k if abs(planes[face, k]) > abs(planes[face, axis]) else axis
        polygon, made = polygons[0], polygons[1]
        for k in range(size):
            for place in range(PLACED):
                polygon[k, place] = placed[corners[start + k], place]
                extent = max(extent, abs(polygon[k, place] - polygon[0, place]))
        over_h, over_l = planes[face, axis], planes[face, axis + 3]
        height_h, height_l = dd_div(planes[face, _VALUE], planes[face, _VALUE + 1], over_h, over_l)
        height_error = 3.0 * planes[face, _SLACK] / abs(over_h) + 17.0 * U2 * abs(height_h)
        rounding = (320.0 * U2 * span + 8.0 * eta) * extent
        h, low = _twice_area(polygon, size, axis)
        wrong = size * rounding
        error = 1.01 * (abs(height_h) * wrong + height_error * (abs(h) + wrong)) + 32.0 * (n + n_others) * U2 * abs(
            height_h * h
        )
        h, low = dd_mul(height_h, height_l, h, low)
        sums[3], sums[4] = dd_add(sums[3], sums[4], h, low)
        sums[5] += error + _TINY
        wrong, n_left = 0.0, size
        for other in range(n_others):
            if planes[face, _AXIS] >= 0.0 and planes[face, _AXIS] == others[other, _AXIS]:
                value, _ = _value(others, other, placed, corners[start])
                if value < 0.0 or (value == 0.0 and not (is_first and planes[face, _WAY] == others[other, _WAY])):
                    n_left = 0
                    break
                continue
            n_in = n_out = 0
            for k in range(size):
                side = sides[other, corners[start + k]]
                n_in += side > 0.0
                n_out += side < 0.0
            if n_out == size:
                n_left = 0
                break
            if n_in == size or n_left < 3:
                continue
            n_left, strip = _cut(others, other, polygon, n_left, made, extent)
            if n_left < 0:
                return False
            wrong += strip
            polygon, made = made, polygon
        wrong += 1.01 * (size + 2.0 * n_others) * rounding
        h, low = _twice_area(polygon, n_left, axis)
        error = 1.01 * (abs(height_h) * wrong + height_error * (abs(h) + wrong)) + 32.0 * (n + n_others) * U2 * abs(
            height_h * h
        )
        h, low = dd_mul(height_h, height_l, h, low)
        sums[0], sums[1] = dd_add(sums[0], sums[1], h, low)
        sums[2] += error + _TINY
    return True


@called
def _has_axis(
    placed: FloatArray, n: int, corners: IntArray, rings: IntArray, faces: tuple[int, int], others: FloatArray,
    n_others: int, other_faces: tuple[int, int], margin: float,
) -> bool:  # fmt: skip
    """Return whether a plane at right angles to an edge of each body certainly has them on different sides. margin: a
    bound on the error of a product, over the size of the direction."""
    for ring in range(faces[0], faces[1]):
        for start in range(rings[ring], rings[ring + 1]):
            a, b = corners[start], corners[start + 1 if start + 1 < rings[ring + 1] else rings[ring]]
            for other_ring in range(other_faces[0], other_faces[1]):
                for other in range(rings[other_ring], rings[other_ring + 1]):
                    c = corners[other]
                    d = corners[other + 1 if other + 1 < rings[other_ring + 1] else rings[other_ring]]
                    if b < a or d < c:
                        continue
                    ux, uy, uz = placed[b, 0] - placed[a, 0], placed[b, 1] - placed[a, 1], placed[b, 2] - placed[a, 2]
                    vx, vy, vz = others[d, 0] - others[c, 0], others[d, 1] - others[c, 1], others[d, 2] - others[c, 2]
                    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
                    low = high = nx * placed[0, 0] + ny * placed[0, 1] + nz * placed[0, 2]
                    for k in range(1, n):
                        at = nx * placed[k, 0] + ny * placed[k, 1] + nz * placed[k, 2]
                        low, high = min(low, at), max(high, at)
                    other_low = other_high = nx * others[0, 0] + ny * others[0, 1] + nz * others[0, 2]
                    for k in range(1, n_others):
                        at = nx * others[k, 0] + ny * others[k, 1] + nz * others[k, 2]
                        other_low, other_high = min(other_low, at), max(other_high, at)
                    gap = max(other_low - high, low - other_high)
                    if gap > margin * (abs(nx) + abs(ny) + abs(nz)):
                        return True
    return False


@called
def _value_of_pair(
    corners: IntArray, rings: IntArray, bodies: IntArray, a: int, b: int, placed: FloatArray, planes: FloatArray,
    sides: FloatArray, polygons: FloatArray, exact: FloatArray, errors: tuple[float, float], is_ratio: bool,
    sums: FloatArray,
) -> float:  # fmt: skip
    """Return the value of one pair of placed bodies. errors: eta, D."""
    eta, span = errors
    margin = 2.0**-48 * span + 4.0 * eta
    first, n, n_planes = bodies[a, 1], bodies[a, 2], bodies[a, 3]
    other_first, n_other, n_other_planes = bodies[b, 1], bodies[b, 2], bodies[b, 3]
    for axis in range(3):
        low = high = placed[0, 0, axis]
        for k in range(1, n):
            low, high = min(low, placed[0, k, axis]), max(high, placed[0, k, axis])
        other_low = other_high = placed[1, 0, axis]
        for k in range(1, n_other):
            other_low, other_high = min(other_low, placed[1, k, axis]), max(other_high, placed[1, k, axis])
        if low - other_high > margin or other_low - high > margin:
            return 0.0
    if not _set_planes(placed[0], corners, rings, first, n_planes, exact, 0, eta, span, planes[0]):
        return float("nan")
    if not _set_planes(placed[1], corners, rings, other_first, n_other_planes, exact, 3, eta, span, planes[1]):
        return float("nan")
    if _find_sides(planes[1], n_other_planes, placed[0], n, exact, 0, sides[0]):
        return 0.0
    if _find_sides(planes[0], n_planes, placed[1], n_other, exact, 3, sides[1]):
        return 0.0
    for k in range(6):
        sums[k] = 0.0
    if not _add_faces(placed[0], corners, rings, first, n_planes, planes[0], planes[1], n_other_planes, sides[0],
                      polygons, (span, eta, True), sums):  # fmt: skip
        return float("nan")
    if not _add_faces(placed[1], corners, rings, other_first, n_other_planes, planes[1], planes[0], n_planes, sides[1],
                      polygons, (span, eta, False), sums):  # fmt: skip
        return float("nan")
    if not abs(sums[0]) > sums[2]:
        ends = first + n_planes, other_first + n_other_planes
        if _has_axis(
            placed[0], n, corners, rings, (first, ends[0]), placed[1], n_other, (other_first, ends[1]), margin
        ):
            return 0.0
        return float("nan")
    return certified(sums, 6.0, is_ratio)


@kernel
def overlap_bodies(
    points: FloatArray, corners: IntArray, rings: IntArray, bodies: IntArray, pairs: IntArray, poses: FloatArray,
    is_ratio: bool, placed: FloatArray, planes: FloatArray, sides: FloatArray, polygons: FloatArray,
    values: FloatArray, flag: FlagArray,
) -> int:  # fmt: skip
    """Fill values (n,) with the common volumes of pairs (n, 2) of bodies, or their ratios to the union, NaN where that
    is not certain; return the number of NaN.

    | array | contents |
    | --- | --- |
    | points (.., 6) | corners: high parts, low parts |
    | corners, rings | faces, rings[k] .. rings[k + 1] of corners, counted from the body's first; seen from outside they
    run counter-clockwise |
    | bodies (.., 4) | first point, first face, number of points, of faces |
    | poses (2, 13) | of all first and of all second bodies: rotation, translation, 0.0 for none |
    | placed (2, .., 6), planes (2, .., 13), sides (2, .., ..), polygons (2, .., 8) | scratch |
    """
    n_open, origin, exact, sums = 0, workspace(3), workspace(6), workspace(6)
    for item in range(pairs.shape[0]):
        if flag[0] != 0:
            break
        for axis in range(3):
            at = points[bodies[pairs[item, 0], 0], axis]
            if poses[0, 12] != 0.0:
                at = poses[0, 9 + axis]
                for k in range(3):
                    at += poses[0, 3 * axis + k] * points[bodies[pairs[item, 0], 0], k]
            origin[axis] = at
        eta = span = 0.0
        for side in range(2):
            body = pairs[item, side]
            more = _place(points, bodies[body, 0], bodies[body, 2], poses[side], origin, placed[side], exact, 3 * side)
            eta = max(eta, more)
            for k in range(bodies[body, 2]):
                for axis in range(3):
                    span = max(span, abs(placed[side, k, axis]))
        value = _value_of_pair(
            corners, rings, bodies, pairs[item, 0], pairs[item, 1], placed, planes, sides, polygons, exact,
            (eta, 1.01 * span), is_ratio, sums,
        )  # fmt: skip
        values[item] = value
        n_open += value != value
    return n_open
