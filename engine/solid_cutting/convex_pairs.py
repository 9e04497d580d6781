"""Compiled: the volume that two convex bodies have in common, and its ratio to their union, for many pairs under poses.

Each face f of either body is cut by the planes of the other (Sutherland-Hodgman), all in double-doubles from an origin
near both; with the normal n of f, v on it, k the axis on which n is largest and S twice the area that is left, seen
along k,

    6 volume = sum over all faces of (n.v / n_k) S                       (Gauss's theorem)

A face in a plane of the other counts once: as one of the first body, and only if both look in one direction. That is
decided for faces at right angles to an axis whose coordinates are exact; other such pairs are left open (NaN).

Where all corners are certainly beside all planes of the other body, edges are cut instead (`convex_edges.py`).

**Bounds.** Values of planes are off by e, see `convex_bodies.py`, which has u, D and eta too.
Of a polygon that is cut by computed values the corners that stay have w >= -e, those that go w <= e, and where an edge
is cut |w| <= e: so the part that is wrong lies where |w| <= e, in a strip of the polygon of width 2 e / g, where the
slope g of w is at least (max w - min w) / diameter. With F the extent of the face, its diameter below sqrt(3) F, twice
the area of the strip is below 24 e F^2 / (max w - min w), if that range exceeds 8 e; else the pair is left open. What
was wrong before is cut too, and does not grow. What corners and sums are rounded by is below 320 u^2 D F + 8 eta F a
corner, in twice the area.

The double nearest to the result is certain where the bound says so; else the pair is NaN. A result of zero takes a face
of one with all of the other beside it, or no edge of one in the other.

Source: I. E. Sutherland, G. W. Hodgman, Reentrant polygon clipping, 1974; S. Gottschalk, Separating axis theorem, 1996.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

from engine.compiling.jit import called, inline, kernel
from engine.predicates.error_free import U2, dd_add, dd_div, dd_mul, dd_sub, workspace
from engine.solid_cutting.convex_bodies import (
    AXIS,
    BESIDE,
    CERTAIN,
    EXTENT,
    PLACED,
    ROUGH,
    SLACK,
    STEEPEST,
    VALUE,
    WAY,
    Body,
    add_cone,
    difference,
    find_sides,
    measure_faces,
    place,
    set_planes,
    turn,
    value_at,
)
from engine.solid_cutting.convex_edges import FOUND, OPEN, Parts, add_common
from engine.solid_cutting.sums import certified
from engine.types import FlagArray, FloatArray, IntArray

CORNER: Final = 8
"""Numbers of a corner of a polygon: as placed, then its value (high, low)."""


@inline
def _is_within(plane: FloatArray, polygon: FloatArray, n: int) -> bool:
    """Return whether all corners of a polygon are certainly inside a plane."""
    for k in range(n):
        h = plane[VALUE] - (plane[0] * polygon[k, 0] + plane[1] * polygon[k, 1] + plane[2] * polygon[k, 2])
        if not h > plane[ROUGH]:
            return False
    return True


@inline
def _cut(plane: FloatArray, polygon: FloatArray, n: int, made: FloatArray, extent: float) -> tuple[int, float]:
    """Clip a polygon of n corners by a plane, and write the rest to `made`; return its number of corners, -1 if the
    polygon may lie in the plane, and a bound on twice the area that is wrong. extent: of the polygon."""
    least = most = 0.0
    for k in range(n):
        h, low = value_at(plane, polygon, k)
        polygon[k, 6], polygon[k, 7] = h, low
        least, most = (h, h) if k == 0 else (min(least, h), max(most, h))
    slack = plane[SLACK]
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
                dh, dl = difference(polygon, j, k, axis)
                dh, dl = dd_mul(dh, dl, h, low)
                made[n_made, axis], made[n_made, axis + 3] = dd_add(polygon[k, axis], polygon[k, axis + 3], dh, dl)
            n_made += 1
    return n_made, 0.0 if least > slack else 24.0 * (slack / (most - least)) * extent * extent


@called
def _add_faces(
    own: Body, other: Body, polygons: FloatArray, numbers: tuple[float, float, bool], sums: FloatArray
) -> bool:
    """Add to sums[0:3] six volumes of the cones over the faces of `own` that are clipped by the planes of `other`, as a
    double-double and a bound; return False where a face may lie in a plane of the other. polygons: scratch; numbers: D
    and eta of the module, and whether `own` is the first body."""
    (span, eta, is_first), placed, corners, n_others = numbers, own.placed, own.corners, other.planes.shape[0]
    share = 32.0 * (own.planes.shape[0] + n_others) * U2
    for face in range(own.planes.shape[0]):
        plane, start, size = own.planes[face], own.rings[face], own.rings[face + 1] - own.rings[face]
        extent, polygon, made = plane[EXTENT], polygons[0], polygons[1]
        for k in range(size):
            for axis in range(PLACED):
                polygon[k, axis] = placed[corners[start + k], axis]
        rounding = (320.0 * U2 * span + 8.0 * eta) * extent
        wrong, n_left = 0.0, size
        for item in range(n_others):
            n_out = 0
            for k in range(size):
                n_out += own.sides[corners[start + k], item] < 0.0
            if n_out == size:
                n_left = 0
                break
        if n_left == 0:
            continue
        for item in range(n_others):
            theirs = other.planes[item]
            if plane[AXIS] >= 0.0 and plane[AXIS] == theirs[AXIS]:
                value, _ = value_at(theirs, placed, corners[start])
                if value < 0.0 or (value == 0.0 and not (is_first and plane[WAY] == theirs[WAY])):
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
        h, low = 0.0, 0.0
        for k in range(1, n_left - 1):
            ph, pl = turn(polygon, 0, k, k + 1, int(plane[STEEPEST]))
            h, low = dd_add(h, low, ph, pl)
        add_cone(plane, h, low, wrong, share, sums, 0)
    return True


@called
def _value_of_pair(
    own: Body, other: Body, polygons: FloatArray, parts: Parts, errors: tuple[float, float], is_ratio: bool,
    sums: FloatArray,
) -> float:  # fmt: skip
    """Return the common volume of two placed bodies, or its ratio to that of the union (is_ratio), as the nearest
    double; NaN if not certain. errors: eta and D of the module; polygons, parts, sums: scratch."""
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
    if not set_planes(own, eta, span) or not set_planes(other, eta, span):
        return float("nan")
    sides = find_sides(own, other.planes)
    their_sides = find_sides(other, own.planes) if sides != BESIDE else BESIDE
    if their_sides == BESIDE:
        return 0.0
    for k in range(6):
        sums[k] = 0.0
    measure_faces(own, eta, span, other.planes.shape[0], sums)
    measure_faces(other, eta, span, own.planes.shape[0], sums)
    if sides == their_sides == CERTAIN:
        found = add_common(own, other, eta, span, parts, sums)
        if found != OPEN:
            return certified(sums, 6.0, is_ratio) if found == FOUND else 0.0
    for k in range(3):
        sums[k] = 0.0
    if not _add_faces(own, other, polygons, (span, eta, True), sums):
        return float("nan")
    if not _add_faces(other, own, polygons, (span, eta, False), sums):
        return float("nan")
    return certified(sums, 6.0, is_ratio)


Scratch = namedtuple("Scratch", "placed planes sides polygons spots areas segments")
"""Arrays (2, .., PLACED), (2, .., PLANE), (2, .., ..), (2, .., CORNER), and as in `Parts`."""


@kernel
def overlap_bodies(
    points: FloatArray, corners: IntArray, rings: IntArray, twins: IntArray, bodies: IntArray, pairs: IntArray,
    poses: FloatArray, is_ratio: bool, scratch: Scratch, values: FloatArray, flag: FlagArray,
) -> int:  # fmt: skip
    """Fill values (n,) with the common volumes of pairs (n, 4) of bodies, or their ratios to the union, NaN where that
    is not certain; return the number of NaN.

    | array | contents |
    | --- | --- |
    | points (.., 6) | corners: high parts, low parts |
    | corners, rings | faces, rings[k] .. rings[k + 1] of corners, counted from the body's first; seen from outside they
    run counter-clockwise |
    | twins | for each corner the face on the other side of the edge that begins there, counted from the body's first |
    | bodies (.., 5) | first point, first of rings, number of points, of faces, first of corners |
    | pairs (n, 4) | numbers of two bodies, and of their poses |
    | poses (.., 13) | rotation, translation, 0.0 for none |
    """
    placed, planes, sides, polygons = scratch.placed, scratch.planes, scratch.sides, scratch.polygons
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
        own = Body(
            corners[first[4] :], faces, twins[first[4] :], placed[0, : first[2]], exact, planes[0, : first[3]], sides[0]
        )
        other = Body(
            corners[second[4] :],
            theirs,
            twins[second[4] :],
            placed[1, : second[2]],
            their_exact,
            planes[1, : second[3]],
            sides[1],
        )
        parts = Parts(scratch.spots, scratch.segments, scratch.areas)
        eta = place(points[first[0] : first[0] + first[2]], pose, origin, own)
        eta = max(eta, place(points[second[0] : second[0] + second[2]], their_pose, origin, other))
        span = 0.0
        for body in (own.placed, other.placed):
            for k in range(body.shape[0]):
                span = max(span, abs(body[k, 0]), abs(body[k, 1]), abs(body[k, 2]))
        value = _value_of_pair(own, other, polygons, parts, (eta, 1.01 * span), is_ratio, sums)
        values[item] = value
        n_open += value != value
    return n_open
