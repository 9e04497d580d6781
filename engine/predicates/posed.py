"""orient3d of points under rigid poses: exact for the map p -> R p + t in the float64 numbers given.

A posed coordinate is a sum of three products and a number, an expansion of at most seven components; it is never
rounded before a decision. Four points of one pose have the sign they have unposed, since det R > 0.

**The filter** works on rounded posed coordinates, each off by at most `error`. A difference of two is then off by
d = 2 error beside its rounding, and the determinant, one column after the other, by at most d (Y Z + X Z + X Y) with
X, Y, Z the sums of magnitudes of the columns plus 3 d: a column of errors d meets every product of entries of the two
other columns from two different rows, each once. The threshold adds this, with d enlarged by an eighth for its own
rounding, to that of `orient3d_filter`; its guard 16h (1 + sum |z|) has room for the four underflows more.

**error.** The rounded coordinate ((r x + s y) + q z) + t is off by at most 4u (1 + 4u) S + 3h, S the sum of magnitudes
|r x| + |s y| + |q z| + |t|. With |x|, |y|, |z| <= reach, the bound used is twice that: 2^-50 (row sum * reach + |t|)
+ 2^-1070.

**The exact stage** needs expansions of differences (14 components), 2 x 2 minors and the determinant. Nonadjacent
components between 2^-1074 and 2^1024 number at most 1050, whatever was added.
"""

from __future__ import annotations

from math import frexp, ldexp
from typing import NamedTuple

from engine.compiling.jit import called, inline
from engine.predicates.error_free import workspace
from engine.predicates.expansion import Components, add_scaled, compress, grow_product, sign
from engine.predicates.orientation import (
    BOUND_3D,
    GUARD_3D,
    OUT_OF_RANGE,
    axis_shift,
    orient3d_exact,
    rounded_determinant,
    smaller_nonzero,
)
from engine.predicates.vectors import minus
from engine.types import UNDECIDED, FloatArray, Point3

UNPOSED = -1
"""Pose number of a point without a pose."""

ERROR_SHARE = 2.0**-50
ERROR_FLOOR = 2.0**-1070
ENLARGED_TWO = 2.25  # both ends of a difference, enlarged by an eighth

TOP = 327  # |posed coordinate| <= 3.01 |p| + |t| < 2^(327 + 3), the top of `orient3d_exact`
BOTTOM = -254  # a coordinate is a multiple of 2^(low R - 52 + low p - 52), which must be at least 2^-358: 104 - 358

N_DIFFERENCE = 16  # two places for each of 8 products
N_DIFFERENCES = 9 * N_DIFFERENCE
N_MINOR = 784  # 2 products of 14 x 14 components, 2 places each
N_TOTAL = 1100


class PosedPoint3(NamedTuple):
    """A point before its pose, and `pose`, the row of that pose in an array of poses (n, 12), or UNPOSED."""

    x: float
    y: float
    z: float
    pose: int


@inline
def posed_error(poses: FloatArray, pose: int, reach: float) -> float:
    """Return a bound on the rounding of each coordinate of `posed_point`, for points with coordinates up to `reach`
    under pose number `pose`; 0.0 if UNPOSED."""
    if pose == UNPOSED:
        return 0.0
    largest = 0.0
    for axis in range(3):
        row_sum = 0.0
        for k in range(3):
            row_sum += abs(float(poses[pose, 3 * axis + k]))
        largest = max(largest, row_sum * reach + abs(float(poses[pose, 9 + axis])))
    return ERROR_SHARE * largest + ERROR_FLOOR


@inline
def posed_point(poses: FloatArray, p: PosedPoint3) -> Point3:
    """Return R p + t, rounded, each coordinate within `posed_error`; p itself if UNPOSED."""
    if p.pose == UNPOSED:
        return Point3(p.x, p.y, p.z)
    return Point3(_rounded(poses, p, 0), _rounded(poses, p, 1), _rounded(poses, p, 2))


@inline
def _rounded(poses: FloatArray, p: PosedPoint3, axis: int) -> float:
    """Return coordinate ``axis`` of R p + t in floating point."""
    r, i = p.pose, 3 * axis
    x, y, z = float(poses[r, i]) * p.x, float(poses[r, i + 1]) * p.y, float(poses[r, i + 2]) * p.z
    return x + y + z + float(poses[r, 9 + axis])


@inline
def orient3d_rounded(a: Point3, b: Point3, c: Point3, d: Point3, error: float) -> int:
    """Return the sign of orient3d of points known to +- `error` a coordinate; UNDECIDED if that could change it."""
    u, v, w = minus(a, d), minus(b, d), minus(c, d)
    det, permanent = rounded_determinant(u, v, w)
    moved = ENLARGED_TWO * error
    x = abs(u.x) + abs(v.x) + abs(w.x) + 3.0 * moved
    y = abs(u.y) + abs(v.y) + abs(w.y) + 3.0 * moved
    z = abs(u.z) + abs(v.z) + abs(w.z) + 3.0 * moved
    threshold = BOUND_3D * permanent + GUARD_3D * (1.0 + z) + moved * (y * z + x * z + x * y)
    return 1 if det > threshold else (-1 if -det > threshold else UNDECIDED)


@inline
def orient3d_posed(
    poses: FloatArray, a: PosedPoint3, b: PosedPoint3, c: PosedPoint3, d: PosedPoint3, error: float
) -> int:
    """Return the sign of orient3d of four points under their poses, exact, or UNDECIDED. poses (n, 12) float64: R by
    rows, then t; caller guarantees det R > 0 and entries of R of at most 1.01. error: the largest `posed_error` of the
    points."""
    side = orient3d_rounded(
        posed_point(poses, a), posed_point(poses, b), posed_point(poses, c), posed_point(poses, d), error
    )
    if side != UNDECIDED:
        return side
    return orient3d_posed_exact(poses, a, b, c, d)


@called
def orient3d_posed_exact(poses: FloatArray, a: PosedPoint3, b: PosedPoint3, c: PosedPoint3, d: PosedPoint3) -> int:
    """Return the exact sign of orient3d of four points under their poses by an expansion, or UNDECIDED. poses (n, 12)
    float64: R by rows, then t; caller guarantees det R > 0 and entries of R of at most 1.01."""
    if a.pose == d.pose and b.pose == d.pose and c.pose == d.pose:
        return orient3d_exact(
            Point3(a.x, a.y, a.z), Point3(b.x, b.y, b.z), Point3(c.x, c.y, c.z), Point3(d.x, d.y, d.z)
        )
    shift = _common_shift(poses, a, b, c, d)
    if shift == OUT_OF_RANGE:
        return UNDECIDED
    w, lengths = workspace(N_DIFFERENCES), workspace(9)
    for slot in range(9):  # slot 3 k + axis: the difference from d of a, b, c, the first factor of its column first
        p = a if slot < 3 else (b if slot < 6 else c)
        lengths[slot] = float(_set_difference(w, slot * N_DIFFERENCE, poses, p, d, slot % 3, shift))
    e, m = workspace(N_TOTAL), workspace(N_MINOR)
    n = 0
    for k in range(3):  # z of a, b, c, times the minor of x and y of the two others: (next, last) so that 1 is above
        following, last = 3 * ((k + 1) % 3), 3 * ((k + 2) % 3)
        n_m = _add_product_of(m, 0, w, lengths, last, following + 1, 1.0)
        n_m = compress(m, _add_product_of(m, n_m, w, lengths, last + 1, following, -1.0))
        slot = 3 * k + 2
        for i in range(int(lengths[slot])):
            n = add_scaled(e, n, m, n_m, w[slot * N_DIFFERENCE + i])
    return sign(e, n)


@called
def are_equal_exact(poses: FloatArray, a: PosedPoint3, b: PosedPoint3) -> bool:
    """Return whether two points under their poses are equal, exactly; False if exponents are out of range."""
    shift, w = _common_shift(poses, a, a, b, b), workspace(N_DIFFERENCE)
    if shift == OUT_OF_RANGE:
        return False
    n_other = 0
    for axis in range(3):
        n_other += sign(w, _set_difference(w, 0, poses, a, b, axis, shift)) != 0
    return n_other == 0


@inline
def _add_product_of(m: Components, n: int, w: Components, lengths: Components, f: int, g: int, factor: float) -> int:
    """Add ``factor`` (1 or -1) times the product of differences number f and g to expansion m of n components; return
    its new length. w: differences as expansions, N_DIFFERENCE places each; lengths: their numbers of components."""
    for i in range(int(lengths[f])):
        for k in range(int(lengths[g])):
            n = grow_product(m, n, factor * w[f * N_DIFFERENCE + i], w[g * N_DIFFERENCE + k])
    return n


@inline
def _set_difference(
    w: Components, start: int, poses: FloatArray, p: PosedPoint3, q: PosedPoint3, axis: int, shift: int
) -> int:
    """Write 2^shift (p - q) on one axis, both points under their poses, exactly, as an expansion to w[start:]; return
    its length."""
    e = workspace(N_DIFFERENCE)
    n = 0
    for end in range(2):
        point, factor = (p, 1.0) if end == 0 else (q, -1.0)
        for k in range(4):
            entry, value = _factors(poses, point, axis, k, shift, factor)
            n = grow_product(e, n, entry, value)
    n = compress(e, n)
    for i in range(n):
        w[start + i] = e[i]
    return n


@inline
def _factors(poses: FloatArray, p: PosedPoint3, axis: int, k: int, shift: int, factor: float) -> tuple[float, float]:
    """Return two doubles whose product is one of the four terms of 2^shift factor times coordinate ``axis`` of R p + t:
    k = 0, 1, 2 for the product with x, y, z, 3 for the translation. factor: 1 or -1."""
    value = factor * (p.x if k == 0 else (p.y if k == 1 else p.z))
    if p.pose == UNPOSED:
        entry = 1.0 if k == axis else 0.0
    elif k == 3:
        entry, value = 1.0, factor * float(poses[p.pose, 9 + axis])
    else:
        entry = float(poses[p.pose, 3 * axis + k])
    return entry, ldexp(value, shift)


@inline
def _common_shift(poses: FloatArray, a: PosedPoint3, b: PosedPoint3, c: PosedPoint3, d: PosedPoint3) -> int:
    """Return the exponent k of the power 2^k that scales the coordinates of four posed points into the range of the
    exact stage, or OUT_OF_RANGE."""
    largest, smallest, smallest_entry = 0.0, float("inf"), 1.0
    for k in range(4):
        p = a if k == 0 else (b if k == 1 else (c if k == 2 else d))
        if p.pose != UNPOSED:
            for i in range(9):
                smallest_entry = smaller_nonzero(smallest_entry, float(poses[p.pose, i]))
        for i in range(3 if p.pose == UNPOSED else 6):
            value = float(poses[p.pose, 6 + i]) if i > 2 else (p.x if i == 0 else (p.y if i == 1 else p.z))
            largest, smallest = max(largest, abs(value)), smaller_nonzero(smallest, value)
    # a multiple of the lowest bit of the smallest entry: as if the smallest coordinate were smaller by that factor
    return axis_shift(smallest, largest, BOTTOM - exponent_of(smallest_entry), TOP)


@inline
def exponent_of(magnitude: float) -> int:
    """Return k with 2^k <= magnitude < 2^(k + 1), for a positive magnitude."""
    return frexp(magnitude)[1] - 1
