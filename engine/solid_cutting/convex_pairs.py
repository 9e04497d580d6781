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

from collections import namedtuple
from typing import Final

from engine.compiling.jit import called, inline, kernel
from engine.predicates.error_free import U2, dd_add, dd_div, dd_mul, dd_scale, dd_sub, fast_two_sum, two_sum, workspace
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

Body = namedtuple("Body", "corners rings placed exact planes sides")
"""One body of a pair: corners and rings as `overlap_bodies` takes them, the rest filled here.

| field | contents |
| --- | --- |
| placed (n, 6) | corners under its pose less the origin |
| exact (3,) | 1.0 where all of them are exact on an axis |
| planes (m, 13) | those of its faces |
| sides (.., ..) | for each plane of the other body the sides of its own corners |
"""


@inline
def _place(points: FloatArray, pose: FloatArray, origin: FloatArray, body: Body) -> float:
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
def _difference(placed: FloatArray, a: int, b: int, axis: int) -> tuple[float, float]:
    return dd_sub(placed[a, axis], placed[a, axis + 3], placed[b, axis], placed[b, axis + 3])


@inline
def _turn(placed: FloatArray, a: int, b: int, c: int, axis: int) -> tuple[float, float]:
    """Return component `axis` of (b - a) x (c - a) as a double-double; a, b, c: rows of `placed`."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    ph, pl = dd_mul(*_difference(placed, b, a, i), *_difference(placed, c, a, j))
    qh, ql = dd_mul(*_difference(placed, b, a, j), *_difference(placed, c, a, i))
    return dd_sub(ph, pl, qh, ql)


@called
def _set_planes(body: Body, eta: float, span: float) -> bool:
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
            plane[axis], plane[axis + 3] = _turn(placed, a, b, c, axis)
            most = max(most, abs(plane[axis]))
        tilt = 1.01 * (48.0 * U2 * far * near + 8.0 * eta * (far + near)) + _TINY
        plane[_AXIS] = -1.0
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
                plane[_AXIS], plane[_WAY], tilt, most = float(axis), way, 0.0, 1.0
        if not most > 4.0 * tilt:
            return False
        h, low = 0.0, 0.0
        for axis in range(3):
            ph, pl = dd_mul(plane[axis], plane[axis + 3], placed[a, axis], placed[a, axis + 3])
            h, low = dd_add(h, low, ph, pl)
        plane[_VALUE], plane[_VALUE + 1], plane[_TILT] = h, low, tilt
        plane[_SLACK] = 3.0 * span * tilt + 3.0 * most * (4.0 * eta + 128.0 * U2 * span) + _TINY
        plane[_ROUGH] = 2.0**-47 * most * span + plane[_SLACK]
    return True


@inline
def _value(plane: FloatArray, points: FloatArray, at: int) -> tuple[float, float]:
    """Return n.(v - x), a double-double: n the normal of a plane, v a point on it, x = points[at]. It is positive
    inside, the distance times |n|."""
    h, low = plane[_VALUE], plane[_VALUE + 1]
    for axis in range(3):
        ph, pl = dd_mul(plane[axis], plane[axis + 3], points[at, axis], points[at, axis + 3])
        h, low = dd_sub(h, low, ph, pl)
    return h, low


@called
def _find_sides(body: Body, planes: FloatArray) -> bool:
    """Fill ``body.sides`` with the certain sides of its corners at `planes` of the other body: 1.0 inside, -1.0
    outside, 0.0 on the plane or not certain. Return whether one of the planes has the whole body outside or on it."""
    placed = body.placed
    for face in range(planes.shape[0]):
        plane, is_beside = planes[face], True
        axis = int(plane[_AXIS])
        is_sharp = axis >= 0 and body.exact[axis] > 0.0
        for k in range(placed.shape[0]):
            if is_sharp:
                h, _ = _value(plane, placed, k)  # two terms: its sign is exact
                side = 1.0 if h > 0.0 else -1.0 if h < 0.0 else 0.0
                is_beside = is_beside and h <= 0.0
            else:
                h = plane[_VALUE] - (plane[0] * placed[k, 0] + plane[1] * placed[k, 1] + plane[2] * placed[k, 2])
                side = 1.0 if h > plane[_ROUGH] else -1.0 if -h > plane[_ROUGH] else 0.0
                is_beside = is_beside and side < 0.0
            body.sides[face, k] = side
        if is_beside:
            return True
    return False


@inline
def _is_within(plane: FloatArray, polygon: FloatArray, n: int) -> bool:
    """Return whether all corners of a polygon are certainly inside a plane."""
    for k in range(n):
        h = plane[_VALUE] - (plane[0] * polygon[k, 0] + plane[1] * polygon[k, 1] + plane[2] * polygon[k, 2])
        if not h > plane[_ROUGH]:
            return False
    return True


@inline
def _cut(plane: FloatArray, polygon: FloatArray, n: int, made: FloatArray, extent: float) -> tuple[int, float]:
    """Clip a polygon of n corners by a plane, and write the rest to `made`; return its number of corners, -1 if the
    polygon may lie in the plane, and a bound on twice the area that is wrong. extent: of the polygon."""
    least = most = 0.0
    for k in range(n):
        h, low = _value(plane, polygon, k)
        polygon[k, 6], polygon[k, 7] = h, low
        least, most = (h, h) if k == 0 else (min(least, h), max(most, h))
    slack = plane[_SLACK]
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
def _add_cone(
    polygon: FloatArray, n: int, axis: int, height: tuple[float, float, float], wrong: float, share: float,
    sums: FloatArray, at: int,
) -> None:  # fmt: skip
    """Add share times 6 volumes of the cone from the origin over a polygon of n corners to sums[at : at + 3], a
    double-double and its error bound. axis: along which the polygon is projected; height: n.v / n_k of its plane (high,
    low) and the error of that; wrong: error of twice its area."""
    h, low = 0.0, 0.0
    for k in range(1, n - 1):
        ph, pl = _turn(polygon, 0, k, k + 1, axis)
        h, low = dd_add(h, low, ph, pl)
    size = abs(height[0])
    error = 1.01 * (size * wrong + height[2] * (abs(h) + wrong)) + share * abs(height[0] * h)
    h, low = dd_mul(height[0], height[1], h, low)
    sums[at], sums[at + 1] = dd_add(sums[at], sums[at + 1], h, low)
    sums[at + 2] += error + _TINY


@called
def _add_faces(
    own: Body, other: Body, polygons: FloatArray, numbers: tuple[float, float, bool], sums: FloatArray
) -> bool:
    """Add to sums[0:3] six volumes of the cones over the faces of `own` that are clipped by the planes of `other`, as a
    double-double and a bound, and to sums[3:6] those over the unclipped faces; return False where a face may lie in a
    plane of the other. polygons: scratch; numbers: D and eta of the module, and whether `own` is the first body."""
    (span, eta, is_first), placed, corners, n_others = numbers, own.placed, own.corners, other.planes.shape[0]
    share = 32.0 * (own.planes.shape[0] + n_others) * U2
    for face in range(own.planes.shape[0]):
        plane, start, size = own.planes[face], own.rings[face], own.rings[face + 1] - own.rings[face]
        axis, extent = 0, 0.0
        for k in range(1, 3):
            axis = k if abs(plane[k]) > abs(plane[axis]) else axis
        polygon, made = polygons[0], polygons[1]
        for k in range(size):
            for place in range(PLACED):
                polygon[k, place] = placed[corners[start + k], place]
                extent = max(extent, abs(polygon[k, place] - polygon[0, place]))
        h, low = dd_div(plane[_VALUE], plane[_VALUE + 1], plane[axis], plane[axis + 3])
        height = h, low, 3.0 * plane[_SLACK] / abs(plane[axis]) + 17.0 * U2 * abs(h)
        rounding = (320.0 * U2 * span + 8.0 * eta) * extent
        _add_cone(polygon, size, axis, height, size * rounding, share, sums, 3)
        wrong, n_left = 0.0, size
        for item in range(n_others):
            n_out = 0
            for k in range(size):
                n_out += own.sides[item, corners[start + k]] < 0.0
            if n_out == size:
                n_left = 0
                break
        if n_left == 0:
            continue
        for item in range(n_others):
            theirs = other.planes[item]
            if plane[_AXIS] >= 0.0 and plane[_AXIS] == theirs[_AXIS]:
                value, _ = _value(theirs, placed, corners[start])
                if value < 0.0 or (value == 0.0 and not (is_first and plane[_WAY] == theirs[_WAY])):
                    n_left = 0
                    break
                continue
            if n_left < 3 or _is_within(theirs, polygon, n_left):
                continue
            n_left, strip = _cut(theirs, polygon, n_left, made, extent)
            if n_left < 0:
                return False
            wrong += strip
            polygon, made = made, polygon
        wrong += 1.01 * (size + 2.0 * n_others) * rounding
        _add_cone(polygon, n_left, axis, height, wrong, share, sums, 0)
    return True


@inline
def _reach(placed: FloatArray, x: float, y: float, z: float) -> tuple[float, float]:
    """Return the least and the largest dot product of the direction (x, y, z) with corners `placed` (n, 6), rounded."""
    low = high = x * placed[0, 0] + y * placed[0, 1] + z * placed[0, 2]
    for k in range(1, placed.shape[0]):
        at = x * placed[k, 0] + y * placed[k, 1] + z * placed[k, 2]
        low, high = min(low, at), max(high, at)
    return low, high


@called
def _has_axis(own: Body, other: Body, margin: float) -> bool:
    """Return whether the cross product of an edge of each body certainly separates the two. margin: bound on the error
    of a dot product with a direction, relative to its size."""
    p, q = own.placed, other.placed
    for ring in range(own.planes.shape[0]):
        for start in range(own.rings[ring], own.rings[ring + 1]):
            a, b = own.corners[start], own.corners[start + 1 if start + 1 < own.rings[ring + 1] else own.rings[ring]]
            for their in range(other.planes.shape[0]):
                for k in range(other.rings[their], other.rings[their + 1]):
                    c = other.corners[k]
                    d = other.corners[k + 1 if k + 1 < other.rings[their + 1] else other.rings[their]]
                    if b < a or d < c:
                        continue
                    ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
                    vx, vy, vz = q[d, 0] - q[c, 0], q[d, 1] - q[c, 1], q[d, 2] - q[c, 2]
                    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
                    low, high = _reach(p, nx, ny, nz)
                    other_low, other_high = _reach(q, nx, ny, nz)
                    gap = max(other_low - high, low - other_high)
                    if gap > margin * (abs(nx) + abs(ny) + abs(nz)):
                        return True
    return False


@called
def _value_of_pair(
    own: Body, other: Body, polygons: FloatArray, errors: tuple[float, float], is_ratio: bool, sums: FloatArray
) -> float:
    """Return the common volume of two placed bodies, or its ratio to that of the union (is_ratio), as the nearest
    double; NaN if not certain. errors: eta and D of the module; polygons, sums: scratch."""
    eta, span = errors
    margin = 2.0**-48 * span + 4.0 * eta
    for axis in range(3):
        low = high = own.placed[0, axis]
        for k in range(1, own.placed.shape[0]):
            low, high = min(low, own.placed[k, axis]), max(high, own.placed[k, axis])
        other_low = other_high = other.placed[0, axis]
        for k in range(1, other.placed.shape[0]):
            other_low, other_high = min(other_low, other.placed[k, axis]), max(other_high, other.placed[k, axis])
        if low - other_high > margin or other_low - high > margin:
            return 0.0
    if not _set_planes(own, eta, span) or not _set_planes(other, eta, span):
        return float("nan")
    if _find_sides(own, other.planes) or _find_sides(other, own.planes):
        return 0.0
    for k in range(6):
        sums[k] = 0.0
    if not _add_faces(own, other, polygons, (span, eta, True), sums):
        return float("nan")
    if not _add_faces(other, own, polygons, (span, eta, False), sums):
        return float("nan")
    if not abs(sums[0]) > sums[2]:
        return 0.0 if _has_axis(own, other, margin) else float("nan")
    return certified(sums, 6.0, is_ratio)


@kernel
def overlap_bodies(
    points: FloatArray, corners: IntArray, rings: IntArray, bodies: IntArray, pairs: IntArray, poses: FloatArray,
    is_ratio: bool, placed: FloatArray, planes: FloatArray, sides: FloatArray, polygons: FloatArray,
    values: FloatArray, flag: FlagArray,
) -> int:  # fmt: skip
    """Fill values (n,) with the common volumes of pairs (n, 4) of bodies, or their ratios to the union, NaN where that
    is not certain; return the number of NaN.

    | array | contents |
    | --- | --- |
    | points (.., 6) | corners: high parts, low parts |
    | corners, rings | faces, rings[k] .. rings[k + 1] of corners, counted from the body's first; seen from outside they
    run counter-clockwise |
    | bodies (.., 4) | first point, first face, number of points, of faces |
    | pairs (n, 4) | numbers of two bodies, and of their poses |
    | poses (.., 13) | rotation, translation, 0.0 for none |
    | placed (2, .., 6), planes (2, .., 13), sides (2, .., ..), polygons (2, .., 8) | scratch |
    """
    n_open, origin, exact, their_exact, sums = 0, workspace(3), workspace(3), workspace(3), workspace(6)
    for item in range(pairs.shape[0]):
        if flag[0] != 0:
            break
        first, second = bodies[pairs[item, 0]], bodies[pairs[item, 1]]
        pose, their_pose = poses[pairs[item, 2]], poses[pairs[item, 3]]
        for axis in range(3):
            at = points[first[0], axis]
            if pose[12] != 0.0:
                at = pose[9 + axis]
                for k in range(3):
                    at += pose[3 * axis + k] * points[first[0], k]
            origin[axis] = at
        faces, theirs = rings[first[1] : first[1] + first[3] + 1], rings[second[1] : second[1] + second[3] + 1]
        own = Body(corners, faces, placed[0, : first[2]], exact, planes[0, : first[3]], sides[0])
        other = Body(corners, theirs, placed[1, : second[2]], their_exact, planes[1, : second[3]], sides[1])
        eta = _place(points[first[0] : first[0] + first[2]], pose, origin, own)
        eta = max(eta, _place(points[second[0] : second[0] + second[2]], their_pose, origin, other))
        span = 0.0
        for body in (own.placed, other.placed):
            for k in range(body.shape[0]):
                span = max(span, abs(body[k, 0]), abs(body[k, 1]), abs(body[k, 2]))
        value = _value_of_pair(own, other, polygons, (eta, 1.01 * span), is_ratio, sums)
        values[item] = value
        n_open += value != value
    return n_open
