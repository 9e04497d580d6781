"""Poses inside kernels: rounded positions with a proven error, conservative boxes, and orientation signs that know it.

A posed vertex is exactly R p + t. Kernels see its rounded value and `error`, a bound on what rounding did to each
coordinate; an orientation sign that this error could change is UNDECIDED, and the exact posed coordinates settle it
elsewhere. A body without a pose has error 0, and its signs are settled here by expansions.

**error.** Four rounded terms of a coordinate: |rounded - exact| <= g4 (|R| |p| + |t|) + 4h with u = 2^-53, g4 = 4u /
(1 - 4u), h = 2^-1075. With |R| <= 1 + 1e-12 and |p| <= reach that is below 2^-50 (3 reach + max |t|) + 2^-1060, which
leaves a factor of two for the rounding of the bound itself.

**sign.** With u, v, w the rounded differences of three points from the first, M their largest component, and e twice
the error (both ends of a difference), the exact determinant differs from that of the exact differences of the rounded
points by at most 18 e M'^2 + 18 e^2 M' + 6 e^3 <= 18 e (M' + e)^2 (nine entries, each with a cofactor of at most 2
M'^2), M' = M (1 + u). The bound of `orient3d_filter` is added.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine.jit import inline
from engine.predicates.orientation import orient2d, orient3d
from engine.types import UNDECIDED, Point2, Point3

BOX_MARGIN = 8.0
"""A posed box is widened by this many times `error`: centre and half width, their images and the sums stay below 2."""


class PoseArrays(NamedTuple):
    """One or many poses of one body for kernels: rotations (n, 3, 3), translations (n, 3), are there any, do they round
    no coordinate of the body, and the largest coordinate of the body."""

    rotations: npt.NDArray[np.float64]
    translations: npt.NDArray[np.float64]
    is_posed: bool
    is_exact: bool
    reach: float


class Placement(NamedTuple):
    """Rotation (rows), translation, the error of a rounded posed coordinate (0.0: exact), how far boxes are widened."""

    xx: float
    xy: float
    xz: float
    yx: float
    yy: float
    yz: float
    zx: float
    zy: float
    zz: float
    x: float
    y: float
    z: float
    is_posed: bool
    error: float
    margin: float


class Box(NamedTuple):
    """An axis-aligned box."""

    x0: float
    y0: float
    z0: float
    x1: float
    y1: float
    z1: float


@inline
def as_placement(
    rotations: Any, translations: Any, item: int, is_posed: bool, is_exact: bool, reach: float
) -> Placement:
    """Load pose `item` for a body whose coordinates are at most `reach` in magnitude.

    is_exact: caller guarantees that every rounded posed coordinate of the body is exact.
    """
    r, t = rotations[item], translations[item]
    error = 0.0
    if is_posed:
        shift = max(abs(t[0]), abs(t[1]), abs(t[2]))
        error = 2.0**-50 * (3.0 * reach + shift) + 2.0**-1060
    margin = BOX_MARGIN * error
    if is_exact:
        error = 0.0
    return Placement(
        r[0, 0],
        r[0, 1],
        r[0, 2],
        r[1, 0],
        r[1, 1],
        r[1, 2],
        r[2, 0],
        r[2, 1],
        r[2, 2],
        t[0],
        t[1],
        t[2],
        is_posed,
        error,
        margin,
    )


@inline
def placement_of(pose: PoseArrays) -> Placement:
    """Load the one pose of a body."""
    return as_placement(pose.rotations, pose.translations, 0, pose.is_posed, pose.is_exact, pose.reach)


@inline
def placed_point(points: Any, item: int, place: Placement) -> Point3:
    """Return the rounded posed point, the point itself where there is no pose."""
    x, y, z = points[item, 0], points[item, 1], points[item, 2]
    if not place.is_posed:
        return Point3(x, y, z)
    return Point3(
        place.xx * x + place.xy * y + place.xz * z + place.x,
        place.yx * x + place.yy * y + place.yz * z + place.y,
        place.zx * x + place.zy * y + place.zz * z + place.z,
    )


@inline
def placed_box(boxes: Any, node: int, place: Placement) -> Box:
    """Return a box that holds the exact image of a tree's box (components may be NaN where numbers overflow)."""
    x0, y0, z0 = boxes[node, 0], boxes[node, 1], boxes[node, 2]
    x1, y1, z1 = boxes[node, 3], boxes[node, 4], boxes[node, 5]
    if not place.is_posed:
        return Box(x0, y0, z0, x1, y1, z1)
    cx, cy, cz = 0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1)
    hx, hy, hz = 0.5 * (x1 - x0), 0.5 * (y1 - y0), 0.5 * (z1 - z0)
    margin = place.margin
    x = place.xx * cx + place.xy * cy + place.xz * cz + place.x
    y = place.yx * cx + place.yy * cy + place.yz * cz + place.y
    z = place.zx * cx + place.zy * cy + place.zz * cz + place.z
    rx = abs(place.xx) * hx + abs(place.xy) * hy + abs(place.xz) * hz + margin
    ry = abs(place.yx) * hx + abs(place.yy) * hy + abs(place.yz) * hz + margin
    rz = abs(place.zx) * hx + abs(place.zy) * hy + abs(place.zz) * hz + margin
    return Box(x - rx, y - ry, z - rz, x + rx, y + ry, z + rz)


@inline
def are_apart(a: Box, b: Box) -> bool:
    """Tell whether two boxes surely have no common point; comparisons with NaN are false, so overflow is never
    apart."""
    return a.x0 > b.x1 or b.x0 > a.x1 or a.y0 > b.y1 or b.y0 > a.y1 or a.z0 > b.z1 or b.z0 > a.z1


@inline
def size_of(box: Box) -> float:
    """Return the sum of the three widths."""
    return (box.x1 - box.x0) + (box.y1 - box.y0) + (box.z1 - box.z0)


@inline
def orient3d_near(a: Point3, b: Point3, c: Point3, d: Point3, error: float) -> int:
    """Return orient3d of the exact points behind rounded ones; UNDECIDED where `error` per coordinate could change
    it."""
    if error == 0.0:
        return orient3d(a, b, c, d)
    ux, uy, uz = b.x - a.x, b.y - a.y, b.z - a.z
    vx, vy, vz = c.x - a.x, c.y - a.y, c.z - a.z
    wx, wy, wz = d.x - a.x, d.y - a.y, d.z - a.z
    yz, zy = uy * vz, uz * vy
    zx, xz = uz * vx, ux * vz
    xy, yx = ux * vy, uy * vx
    det = (yz - zy) * wx + (zx - xz) * wy + (xy - yx) * wz
    permanent = (abs(yz) + abs(zy)) * abs(wx) + (abs(zx) + abs(xz)) * abs(wy) + (abs(xy) + abs(yx)) * abs(wz)
    m = max(max(abs(ux), abs(uy), abs(uz)), max(abs(vx), abs(vy), abs(vz)), max(abs(wx), abs(wy), abs(wz)))
    e = 2.0 * error
    threshold = 2.0**-50 * permanent + 18.5 * e * ((m + e) * (m + e)) + 2.0**-1070 * (1.0 + 3.0 * m)
    if det > threshold:
        return 1
    if -det > threshold:
        return -1
    return UNDECIDED


@inline
def orient2d_near(a: Point2, b: Point2, c: Point2, error: float) -> int:
    """Return orient2d of the exact points behind rounded ones; UNDECIDED where `error` per coordinate could change it.

    The determinant moves by at most 4 e M + 2 e^2 (four entries, each times an entry) for e twice the error.
    """
    if error == 0.0:
        return orient2d(a, b, c)
    ux, uy = b.x - a.x, b.y - a.y
    vx, vy = c.x - a.x, c.y - a.y
    left, right = ux * vy, uy * vx
    det = left - right
    m = max(max(abs(ux), abs(uy)), max(abs(vx), abs(vy)))
    e = 2.0 * error
    threshold = 2.0**-51 * (abs(left) + abs(right)) + 4.5 * e * (m + e) + 2.0**-1070
    if det > threshold:
        return 1
    if -det > threshold:
        return -1
    return UNDECIDED


@inline
def placed_axis(axis: int, place: Placement) -> int:
    """Return where the pose turns a coordinate axis to; caller guarantees a pose that permutes axes, or none."""
    if not place.is_posed or axis < 0:
        return axis
    x, y = place.xx, place.yx
    if axis == 1:
        x, y = place.xy, place.yy
    elif axis == 2:
        x, y = place.xz, place.yz
    return 0 if x != 0.0 else (1 if y != 0.0 else 2)


NO_ROTATION = np.eye(3).reshape(1, 3, 3)
NO_TRANSLATION = np.zeros((1, 3))
