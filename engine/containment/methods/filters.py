"""Filters of point location: sign of a value in floating point with a proven error bound, or UNDECIDED.

**Blurred points.** A blurred point stands for all points whose coordinates differ by at most blur / 2. A filter decides
if all of them have the same location, else returns UNDECIDED. Its bound is that of the plain filter plus twice the
largest change that the blur can cause; comparisons with infinities and NaN are false, which means UNDECIDED.

**Points in a body's frame.** The exact preimage of q is R^-1 (q - t), computed as adj(R) (q - t) / det(R), u = 2^-53:

    entries of R <= 1, det(R) = 1 up to 1e-11     |error of an entry of the inverse| <= 32 u
    difference, products, sums                    |error of a coordinate| <= 48 u sum |q - t|
    blur                                          > 96 u sum |q - t|, so x + blur and x - blur rounded are bounds too

From 2^1021 on, where a coordinate could overflow, the blur is infinite, and all is UNDECIDED. If R only permutes axes
and the differences are exact, the preimage is exact and the blur is 0.

**Balls.** The exact sign of r^2 - |p - c|^2, in three stages:

1. If |p - c| on one axis rounds to more than r, the point is outside: rounding is monotone and r is a double.
2. The value in doubles: relative error u for a difference, 3 u for a square, 3 u more for a sum of up to four terms;
   `_BALL_SLACK` = 16 u covers this and the rounding of the bound.
3. Differences as exact pairs high + low. If all low parts are zero (usual on flush data), r^2 and the squares are exact
   pairs, and the sign is that of an expansion of at most eight terms; else UNDECIDED. Squares are exact pairs above
   2^-480 only: smaller ones (but zero) are UNDECIDED too.

The first two stages run on a block of points without branches, so that the compiler vectorises them. In 2D z is 0.

Source: two_diff, two_prod and growing expansions of Shewchuk 1997.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import called, inline, kernel, merged
from engine.predicates.error_free import two_diff, workspace
from engine.predicates.expansion import grow_product, sign
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.predicates.polynomial import sign_of_polynomial_exact, sign_of_polynomial_filter
from engine.solids.pose import Pose
from engine.types import UNDECIDED, BoolArray, FlagArray, FloatArray, Int8Array, Int32Array, IntArray, Point2


class Frames(NamedTuple):
    """The poses of many bodies with their inverses; 2D poses fill the upper left block of a matrix."""

    rows: Int32Array
    """Row of each body's pose in the arrays below, -1 for a body without a pose."""
    rotations: FloatArray
    """``(n, 3, 3)``."""
    inverses: FloatArray
    """``(n, 3, 3)``: each entry within 32 u of the exact inverse."""
    translations: FloatArray
    is_turn: BoolArray
    """Whether a rotation only permutes the axes, up to sign."""


def frames_of(poses: Sequence[Pose | None], dimension: int) -> Frames:
    """Return `Frames` of the poses that are not the identity; their `rows` has the row of each body's pose, -1 for the
    others."""
    given = [(body, pose) for body, pose in enumerate(poses) if pose is not None]
    rotations, translations = np.zeros((len(given), 3, 3)), np.zeros((len(given), 3))
    rotations[:, 2, 2] = 1.0
    rows = np.full(len(poses), -1, np.int32)
    if not given:
        return Frames(rows, rotations, rotations, translations, np.zeros(0, np.bool_))
    rotations[:, :dimension, :dimension] = [pose.rotation for _, pose in given]
    translations[:, :dimension] = [pose.translation for _, pose in given]
    is_moved = translations.any(axis=1) | (rotations != np.eye(3)).any(axis=(1, 2))
    rotations, translations = rotations[is_moved], np.ascontiguousarray(translations[is_moved])
    rows[np.array([body for body, _ in given])[is_moved]] = np.arange(len(rotations))
    sizes = np.abs(rotations)
    is_turn = ((sizes == 0.0) | (sizes == 1.0)).all(axis=(1, 2)) & (sizes.sum(axis=1) == 1.0).all(axis=1)
    return Frames(rows, rotations, _inverses(rotations), translations, is_turn)


def _inverses(rotations: FloatArray) -> FloatArray:
    """Return R^-1 = adj(R) / det(R) for matrices (n, 3, 3), rounded; exact where R permutes the axes, up to sign."""
    after = (1, 2, 0)
    adjugates = np.empty_like(rotations)
    for i in range(3):
        for j in range(3):
            r, s, p, q = after[j], after[after[j]], after[i], after[after[i]]
            adjugates[:, i, j] = rotations[:, r, p] * rotations[:, s, q] - rotations[:, s, p] * rotations[:, r, q]
    determinants = (rotations[:, 0, :] * adjugates[:, :, 0]).sum(axis=1)
    return np.ascontiguousarray(adjugates / determinants[:, None, None]) + 0.0


_BLUR: Final = 16.0 * 2.0**-53
"""Factor of the sum of 8 |difference|: that sum overflows before a coordinate does, and the blur is then infinite."""


@inline
def to_frame(frames: Frames, frame: int, p: tuple[float, ...]) -> Any:
    """Return point p = (x, y, z) in the frame of a pose, R^-1 (p - t), and its blur: twice the error bound of a
    coordinate, 0.0 if it is exact. frame: row of the pose in `frames`, -1 for none."""
    if frame < 0:
        return p, 0.0
    inverses, translations = frames.inverses, frames.translations
    dx, x_tail = two_diff(p[0], float(translations[frame, 0]))
    dy, y_tail = two_diff(p[1], float(translations[frame, 1]))
    dz, z_tail = two_diff(p[2], float(translations[frame, 2]))
    x = inverses[frame, 0, 0] * dx + inverses[frame, 0, 1] * dy + inverses[frame, 0, 2] * dz
    y = inverses[frame, 1, 0] * dx + inverses[frame, 1, 1] * dy + inverses[frame, 1, 2] * dz
    z = inverses[frame, 2, 0] * dx + inverses[frame, 2, 1] * dy + inverses[frame, 2, 2] * dz
    if frames.is_turn[frame] and x_tail == 0.0 and y_tail == 0.0 and z_tail == 0.0:
        return (x, y, z), 0.0
    return (x, y, z), _BLUR * (8.0 * abs(dx) + 8.0 * abs(dy) + 8.0 * abs(dz)) + _TINY


@kernel
def move_to_body_frame(points: FloatArray, frames: Frames, moved: FloatArray, blurs: FloatArray) -> None:
    """Fill moved (n, dim) and blurs (n,) with the preimages of points (n, dim) under the only pose in `frames`, and
    their blurs."""
    for item in range(len(points)):
        p, blurs[item] = to_frame(frames, 0, in_space(points, item))
        moved[item, 0], moved[item, 1] = p[0], p[1]
        if points.shape[1] == 3:
            moved[item, 2] = p[2]


_SLACK: Final = 8.0 * 2.0**-53
_TINY: Final = 1e-320
NOT_FINITE: Final = -1
"""Return value of a kernel, instead of a count, where a point has NaN or an infinity."""


@inline
def has_not_finite(points: FloatArray) -> bool:
    """Return whether points (n, dim) contain NaN or an infinity; without branches."""
    is_any, flat = False, points.reshape(points.size)
    for place in range(len(flat)):
        is_any |= flat[place] - flat[place] != 0.0
    return is_any


@inline
def orient2d_blurred(a: Point2, b: Point2, q: Point2, blur: float) -> int:
    """Return the sign (1, -1) of orient2d(a, b, x) where it is the same, 1 or -1, for all points x with coordinates
    within blur / 2 of q's, else UNDECIDED."""
    left = (a.x - q.x) * (b.y - q.y)
    right = (a.y - q.y) * (b.x - q.x)
    turn = left - right
    bound = BOUND_2D * (abs(left) + abs(right)) + GUARD_2D + blur * (abs(b.x - a.x) + abs(b.y - a.y))
    return 1 if turn > bound else -1 if -turn > bound else UNDECIDED


@inline
def side_of_box(
    low: tuple[float, ...], high: tuple[float, ...], is_flat: bool, p: tuple[float, ...], blur: float
) -> int:
    """Return the location of a blurred point p = (x, y, z) in the box low .. high: 1 inside, 0 boundary, -1 outside,
    UNDECIDED if not all of its blur has one. is_flat: a planar box; all z are 0."""
    is_out = (p[0] + blur < low[0]) | (p[0] - blur > high[0])
    is_out |= (p[1] + blur < low[1]) | (p[1] - blur > high[1])
    is_out |= (p[2] + blur < low[2]) | (p[2] - blur > high[2])
    if is_out:
        return -1
    is_within = (low[0] < p[0] - blur) & (p[0] + blur < high[0])
    is_within &= (low[1] < p[1] - blur) & (p[1] + blur < high[1])
    is_within &= is_flat | ((low[2] < p[2] - blur) & (p[2] + blur < high[2]))
    if is_within:
        return 1
    return 0 if blur == 0.0 else UNDECIDED


@inline
def side_of_rows(rows: FloatArray, first: int, last: int, p: tuple[float, ...], blur: float) -> int:
    """Return the location of a blurred point p = (x, y, z) in the intersection of the half-spaces first .. last - 1 of
    plane rows (n, 4): 1 inside, -1 outside, or UNDECIDED."""
    location = 1
    for row in range(first, last):
        ax, by, cz, d = rows[row, 0] * p[0], rows[row, 1] * p[1], rows[row, 2] * p[2], rows[row, 3]
        distance = ax + by + cz + d
        bound = _SLACK * (abs(ax) + abs(by) + abs(cz) + abs(d)) + _TINY
        bound += blur * (abs(rows[row, 0]) + abs(rows[row, 1]) + abs(rows[row, 2]))
        if distance > bound:
            continue
        if -distance > bound:
            return -1
        location = UNDECIDED
    return location


@inline
def in_space(points: FloatArray, item: int) -> Any:
    """Return row `item` of points (n, 2 or 3) as (x, y, z), with z = 0 in the plane."""
    return float(points[item, 0]), float(points[item, 1]), 0.0 if points.shape[1] == 2 else float(points[item, 2])


@kernel
def locate_in_rows_blurred(
    points: FloatArray, blurs: FloatArray, rows: FloatArray, locations: Int8Array, flag: FlagArray
) -> int:
    """Fill locations (n,) int8 of blurred points in the half-spaces of plane rows (m, 4); blurs: (n,); return how many
    are UNDECIDED. rows: exact or correctly rounded; in the plane the third coefficient is 0."""
    n_open = 0
    for item in range(len(points)):
        if flag[0]:
            break
        locations[item] = side_of_rows(rows, 0, len(rows), in_space(points, item), blurs[item])
        n_open += locations[item] == UNDECIDED
    return n_open


@kernel
def locate_in_box(
    points: FloatArray, blurs: FloatArray, low: FloatArray, high: FloatArray, locations: Int8Array, flag: FlagArray
) -> int:
    """Fill locations (n,) int8 of points (n, dim) in a box by six comparisons; return how many are UNDECIDED, or
    NOT_FINITE. low, high: corners (dim,). blurs: (n,), or (0,) for exact points, which are all decided. Where low =
    high on an axis, every point of the box is BOUNDARY, as the comparisons say."""
    if len(blurs) == 0 and has_not_finite(points):
        return NOT_FINITE
    n_open, is_flat = 0, len(low) == 2
    least = low[0], low[1], 0.0 if is_flat else low[2]
    most = high[0], high[1], 0.0 if is_flat else high[2]
    for item in range(len(points)):
        if flag[0]:
            break
        blur = float(blurs[item]) if len(blurs) > 0 else 0.0
        locations[item] = side_of_box(least, most, is_flat, in_space(points, item), blur)
        n_open += locations[item] == UNDECIDED
    return n_open


@kernel
def locate_by_polynomial(
    points: FloatArray, blurs: FloatArray, powers: IntArray, coefficients: FloatArray, degree: int,
    locations: Int8Array, flag: FlagArray,
) -> int:  # fmt: skip
    """Fill locations (n,) int8 of points (n, dim) with the sign of a polynomial, or UNDECIDED. blurs: (n,), or (0,) for
    exact points. powers: (t, dim) int64; coefficients: (t,); degree: the largest total power. Returns the number of
    points that the filter left open, or NOT_FINITE."""
    if len(blurs) == 0 and has_not_finite(points):
        return NOT_FINITE
    n_beyond = 0
    for item in range(len(points)):
        if flag[0]:
            break
        blur = float(blurs[item]) if len(blurs) > 0 else 0.0
        sign = sign_of_polynomial_filter(powers, coefficients, degree, points, item, blur)
        if sign == UNDECIDED:
            n_beyond += 1
            if blur == 0.0:
                sign = sign_of_polynomial_exact(powers, coefficients, points, item)
        locations[item] = sign
    return n_beyond


_BALL_SLACK: Final = 16.0 * 2.0**-53
_SMALLEST: Final = 2.0**-480
_LARGEST: Final = 2.0**500
_BALL_BLOCK: Final = 64
"""Points of a block: four numbers each fit the L1 cache."""


@merged
def location_in_ball(dx: float, dy: float, dz: float, square: float, reach: float, blur: float) -> float:
    """Return 1.0 (inside), -1.0 (outside) or 2.0 (UNDECIDED) for a point that differs from a ball's centre by (dx, dy,
    dz), by doubles. square: r^2; reach: r + 2 blur; blur: bound on the error of a coordinate of the centre."""
    ax, ay, az = abs(dx), abs(dy), abs(dz)
    total = dx * dx + dy * dy + dz * dz
    excess, bound = square - total, _BALL_SLACK * (square + total) + _TINY
    bound += 4.0 * blur * (ax + ay + az + 2.0 * blur)  # |(d + e)^2 - d^2| <= 2 |d| e + e^2 an axis
    is_out = (max(ax, max(ay, az)) > reach) | (-excess > bound)
    return -1.0 if is_out else (1.0 if excess > bound else 2.0)


@inline
def _has_exact_square(value: float) -> bool:
    return value == 0.0 or _SMALLEST < abs(value) < _LARGEST


@called
def _settle(points: FloatArray, item: int, center: FloatArray, radius: float, expansion: Any) -> int:
    """Return the location of point `item` in a ball by the exact sign of r^2 - |p - c|^2: 1, 0, -1; UNDECIDED if a
    difference is not exact or a square no exact pair. expansion: scratch."""
    if not _has_exact_square(radius):
        return UNDECIDED
    n = grow_product(expansion, 0, radius, radius)
    for axis in range(len(center)):
        high, low = two_diff(points[item, axis], center[axis])
        if low != 0.0 or not _has_exact_square(high):
            return UNDECIDED
        n = grow_product(expansion, n, -high, high)
    return sign(expansion, n)


@kernel
def locate_in_ball(
    points: FloatArray, center: FloatArray, blur: float, radius: float, locations: Int8Array, flag: FlagArray
) -> int:
    """Fill locations (n,) int8 of points (n, dim) in a ball; return how many the filter left open, or NOT_FINITE. blur:
    bound on the error of each coordinate of `center`; where it is not 0.0, what the filter leaves open stays UNDECIDED.
    """
    if has_not_finite(points):
        return NOT_FINITE
    is_flat, n_beyond = len(center) == 2, 0
    x, y, z = center[0], center[1], 0.0 if is_flat else center[2]
    square, reach, expansion = radius * radius, radius + 2.0 * blur, workspace(8)
    dx, dy, dz, results = workspace(64), workspace(64), workspace(64), workspace(64)
    for first in range(0, len(points), _BALL_BLOCK):
        if flag[0]:
            break
        size = min(_BALL_BLOCK, len(points) - first)
        for j in range(size):
            dx[j], dy[j] = points[first + j, 0] - x, points[first + j, 1] - y
            dz[j] = 0.0 if is_flat else points[first + j, 2] - z
        for j in range(_BALL_BLOCK):  # a number of turns that the compiler knows; those past `size` are not looked at
            results[j] = location_in_ball(dx[j], dy[j], dz[j], square, reach, blur)
        n_open = 0
        for j in range(size):
            locations[first + j] = int(results[j])
            n_open += results[j] == UNDECIDED
        n_beyond += n_open
        if n_open == 0 or blur > 0.0:
            continue
        for item in range(first, first + size):
            if locations[item] == UNDECIDED:
                locations[item] = _settle(points, item, center, radius, expansion)
    return n_beyond
