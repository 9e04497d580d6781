"""Cohen-Sutherland clipping of segments to a box by outcodes, decided exactly: 2D and 3D.

                 |        |                One bit for each plane a point lies outside of, in the order
        1001     |  1000  |   1010         xmin, xmax, ymin, ymax, zmin, zmax (drawn: ymax ymin xmax xmin
       ----------+--------+----------      would be 1000, 0100, 0010, 0001). Codes that share a bit: the
        0001     |  0000  |   0010         segment misses the box. Both zero: it lies inside. Else it is
       ----------+--------+----------      cut by planes it crosses, of which at most one per axis is
        0101     |  0100  |   0110         entered and one left.

The textbook clips the outside end at one plane after another until the codes accept or reject. Two differences:

1. Its loop can run for ever by rounding, (1, 1)-(-1, -1) on the box [1e-9, 3]^2. Here each plane is tested once: the
   last plane entered and the first plane left bound the piece, if in this order.
2. It decides from rounded points. Here the parameters of the planes, quotients of differences of original coordinates,
   are compared in doubles with a bound, then in double-doubles, then exactly, as plane rows are (cyrus_beck.py). The
   clipped coordinate is the plane's own value.

The first two comparisons run on a block of segments without branches, so that the compiler vectorises them. In 2D z is
0 throughout. Two kernels: `decide_on_boxes` decides which planes bound each piece, `fill_on_boxes` (planes_cut.py)
computes the ends.

**Bound of a crossing.** t = n / d with n = at - p and d = q - p on the plane's axis, exact pairs n + n', d + d' of a
rounded difference and its rounding error, u = 2^-53:

    t = fl(n / d)                          |t - n / d| <= u t
    r = n - t d (exact by fma)             |r| <= u n,  |n'| <= u n,  |t d'| <= u n
    t_low = fl((r + n' - t d') / d)        sum: 6 u^2 n, quotient: 3 u^2 t, d' left out of the divisor: 3 u^2 t
    |t + t_low - exact| <= 13 u^2 t        |t_low| <= 3.1 u t

Source: Cohen and Sutherland in W. M. Newman, R. F. Sproull, Principles of Interactive Computer Graphics, 1979; the
textbook's section on clipping segments on an AABB.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from engine.compiling.jit import kernel, merged
from engine.predicates.error_free import U2, fma, two_diff, two_prod, workspace
from engine.segment_clipping.cyrus_beck import coordinate_limit, decide_alone
from engine.segment_clipping.pieces import ACCEPTED, BLOCK, Triple, is_plain, point_of
from engine.types import OPEN, FlagArray, FloatArray, Int32Array, IntArray

T_GAP: Final = 16.0 * 2.0**-53
"""Relative error of t = n / d: 3 u (1 + u)^2; two of them and the comparison: 8 u."""
T_TINY: Final = 2.0**-1060
"""Bound for parameters that underflow."""
SHORTEST: Final = 2.0**-400
LONGEST: Final = 2.0**400
"""Range of |d| (SHORTEST .. LONGEST) in which the bound of a crossing holds: quotients of products that underflow are
below `_UNDERFLOW`."""
_UNDERFLOW: Final = 2.0**-600
_CLOSE: Final = 48.0 * U2
"""Relative error of the difference of two parameters: 26 u^2 for both, 6 u^2 for the difference of their low parts;
that of the high parts is exact within a factor of two, and elsewhere does not matter."""


class PlaneCrossing(NamedTuple):
    """The crossing of a segment with a plane of a slab, at t = n / d. t, t_low: the parameter as a double-double. n, d:
    at - p and q - p on the plane's axis, rounded. is_exact: both differences are exact. plane: 0.0 .. 5.0 for xmin,
    xmax, ymin, ..., or -1.0 for no crossing, with a t outside of [0, 1] that equals no other."""

    t: float
    t_low: float
    n: float
    d: float
    is_exact: bool
    plane: float


@merged
def plane_crossing(p: float, q: float, at: float, plane: float) -> PlaneCrossing:
    """Return the crossing of a segment with the plane at `at` across an axis. p, q: coordinates of its ends on that
    axis. plane: number of the plane, copied to the result."""
    n, n_low = two_diff(at, p)
    d, d_low = two_diff(q, p)
    d = d if p != q else 1.0  # not met: any number
    t = n / d
    return PlaneCrossing(t, ((fma(-t, d, n) + n_low) - t * d_low) / d, n, d, (n_low == 0.0) & (d_low == 0.0), plane)


@merged
def slab_crossings(
    p: float, q: float, low: float, high: float, axis: float
) -> tuple[PlaneCrossing, PlaneCrossing, bool]:
    """Return the crossings where a segment enters and leaves the slab low .. high, and False if |q - p| is too small or
    large for their bounds, else True. p, q: coordinates of its ends on the axis `axis`, 0.0, 1.0 or 2.0."""
    is_entered, is_left = (p < low) | (p > high), (q < low) | (q > high)
    entered = plane_crossing(p, q, low if p < low else high, 2.0 * axis if p < low else 2.0 * axis + 1.0)
    left = plane_crossing(p, q, low if q < low else high, 2.0 * axis if q < low else 2.0 * axis + 1.0)
    length = abs(entered.d)
    has_range = ((length >= SHORTEST) & (length <= LONGEST)) | (not (is_entered | is_left))
    entered = entered if is_entered else PlaneCrossing(-1.0 - axis, 0.0, 0.0, 1.0, False, -1.0)
    left = left if is_left else PlaneCrossing(2.0 + axis, 0.0, 0.0, 1.0, False, -1.0)
    return entered, left, has_range


@merged
def compare_parameters(a: PlaneCrossing, b: PlaneCrossing) -> tuple[float, bool]:
    """Return the parameter of crossing a minus that of b, and whether its sign is proven; 0.0 and True if both are
    proven equal. If all differences are exact, equality is n_a d_b = n_b d_a (lattices: diagonals through corners)."""
    gap = (a.t - b.t) + (a.t_low - b.t_low)
    left, left_tail = two_prod(a.n, b.d)
    right, right_tail = two_prod(b.n, a.d)
    is_tie = a.is_exact & b.is_exact & (left == right) & (left_tail == right_tail) & (abs(left) > _UNDERFLOW)
    return (0.0 if is_tie else gap), (abs(gap) > _CLOSE * max(abs(a.t), abs(b.t)) + _UNDERFLOW) | is_tie


@merged
def slab(p: float, q: float, low: float, high: float, not_entered: float, not_left: float) -> tuple[float, float]:
    """Return the parameters at which a segment enters and leaves the slab low .. high (slab test on one axis), in
    doubles. p, q: coordinates of its ends on the axis. not_entered, not_left: returned instead if p, or q, is within
    the slab."""
    d = q - p if p != q else 1.0  # not met: any number
    enters, leaves = ((low if p < low else high) - p) / d, ((low if q < low else high) - p) / d
    return (enters if (p < low) | (p > high) else not_entered), (leaves if (q < low) | (q > high) else not_left)


@merged
def decide_in_doubles(p: Triple, q: Triple, low: Triple, high: Triple) -> Triple:
    """Return (state, plane entered, plane left) of segment p q in the box low .. high; planes 0.0 .. 5.0, or -1.0 for
    none. State: 0.0 REJECTED, 1.0 ACCEPTED, 2.0 OPEN if doubles do not prove it."""
    (px, py, pz), (qx, qy, qz), (x0, y0, z0), (x1, y1, z1) = p, q, low, high
    misses = (max(px, qx) < x0) | (min(px, qx) > x1) | (max(py, qy) < y0) | (min(py, qy) > y1)
    misses = misses | (max(pz, qz) < z0) | (min(pz, qz) > z1)  # the outcodes share a bit
    # planes that are not met stand in an order of their own, far from all others
    a, d = slab(px, qx, x0, x1, -1.0, 2.0)
    b, e = slab(py, qy, y0, y1, -2.0, 3.0)
    c, f = slab(pz, qz, z0, z1, -3.0, 4.0)
    start, end = max(a, max(b, c)), min(d, min(e, f))
    before, after = max(min(a, b), min(max(a, b), c)), min(max(d, e), max(min(d, e), f))  # the second of three
    gap = T_GAP * max(start, end) + T_TINY
    drops = misses | (start - end > gap)
    keeps = (end - start > gap) & (start - before > gap) & (after - end > gap)
    x_entered, y_entered, z_entered = (1.0 if px > x1 else 0.0), (3.0 if py > y1 else 2.0), (5.0 if pz > z1 else 4.0)
    entered = x_entered if a == start else (y_entered if b == start else z_entered)
    x_left, y_left, z_left = (1.0 if qx > x1 else 0.0), (3.0 if qy > y1 else 2.0), (5.0 if qz > z1 else 4.0)
    left = x_left if d == end else (y_left if e == end else z_left)
    state = 0.0 if drops else (1.0 if keeps else 2.0)
    return (state if is_plain(p, q) else 2.0), (entered if start >= 0.0 else -1.0), (left if end <= 1.5 else -1.0)


@merged
def decide_in_double_doubles(p: Triple, q: Triple, low: Triple, high: Triple) -> Triple:
    """Return (state, plane entered, plane left) of segment p q in the box low .. high, as `decide_in_doubles`, but by
    double-doubles."""
    a, d, is_x = slab_crossings(p[0], q[0], low[0], high[0], 0.0)
    b, e, is_y = slab_crossings(p[1], q[1], low[1], high[1], 1.0)
    c, f, is_z = slab_crossings(p[2], q[2], low[2], high[2], 2.0)
    gap, sure_1 = compare_parameters(a, b)
    entered = a if gap >= 0.0 else b  # equal: the smaller plane stays
    gap, sure_2 = compare_parameters(entered, c)
    entered = entered if gap >= 0.0 else c
    gap, sure_3 = compare_parameters(d, e)
    left = d if gap <= 0.0 else e
    gap, sure_4 = compare_parameters(left, f)
    left = left if gap <= 0.0 else f
    gap, sure_5 = compare_parameters(entered, left)
    sure = is_plain(p, q) & is_x & is_y & is_z & sure_1 & sure_2 & sure_3 & sure_4 & sure_5
    return (2.0 if not sure else (0.0 if gap > 0.0 else 1.0)), entered.plane, left.plane


@merged
def corners_of(low: FloatArray, high: FloatArray) -> tuple[Triple, Triple]:
    """Return the low and the high corner of a box as triples; a 2D box (points have z = 0) has z from -1 to 1."""
    is_flat = low.size == 2
    return (low[0], low[1], (-1.0 if is_flat else low[2])), (high[0], high[1], (1.0 if is_flat else high[2]))


@kernel
def decide_on_boxes(
    segments: FloatArray, low: FloatArray, high: FloatArray, columns: FloatArray, first: int, last: int,
    stop: FlagArray, items: Int32Array, planes: Int32Array, still: Int32Array, n: IntArray,
) -> None:  # fmt: skip
    """Decide which planes bound the pieces of ``segments[first:last]`` ((n, 2, dim) float64) in the box `low`, `high`.

    | argument | content |
    |---|---|
    | columns | of the box's plane rows, see `as_columns` |
    | items (m,) int32 | out: the segments that are accepted, in order |
    | planes (m, 2) int32 | out: the planes entered and left, 0 .. 5 for xmin, xmax, ...; -1: an end of the segment |
    | still (m,) int32 | out: the segments left OPEN |
    | n (3,) int64 | out: how many are accepted, OPEN, and beyond the filter |
    | stop (1,) uint8 | polled |
    """
    is_flat = low.size == 2
    lowest, highest = corners_of(low, high)
    px, py, pz, qx, qy, qz = (
        workspace(64), workspace(64), workspace(64), workspace(64), workspace(64), workspace(64),
    )  # fmt: skip
    state, entered, left, unsure = workspace(64), workspace(64), workspace(64), workspace(64)
    numbers, chosen, limit = (workspace(8), workspace(8), workspace(8)), workspace(8), coordinate_limit(columns)
    n_accepted, n_open, beyond = 0, 0, 0
    for start in range(first, last, BLOCK):
        if stop[0]:
            return
        size = min(BLOCK, last - start)
        n_lanes = (size + 7) >> 3 << 3  # whole vectors; what is past `size` is not looked at
        for j in range(n_lanes):
            px[j], py[j], pz[j] = point_of(segments, min(start + j, last - 1), 0, is_flat)
            qx[j], qy[j], qz[j] = point_of(segments, min(start + j, last - 1), 1, is_flat)
        for j in range(n_lanes):
            p, q = (px[j], py[j], pz[j]), (qx[j], qy[j], qz[j])
            state[j], entered[j], left[j] = decide_in_doubles(p, q, lowest, highest)
        n_unsure = 0
        for j in range(size):
            if state[j] == OPEN:
                unsure[n_unsure] = j
                n_unsure += 1
        for k in range(n_unsure):
            px[k], py[k], pz[k] = point_of(segments, start + int(unsure[k]), 0, is_flat)
            qx[k], qy[k], qz[k] = point_of(segments, start + int(unsure[k]), 1, is_flat)
        for k in range((n_unsure + 7) >> 3 << 3):  # whole vectors
            p, q = (px[k], py[k], pz[k]), (qx[k], qy[k], qz[k])
            px[k], py[k], pz[k] = decide_in_double_doubles(p, q, lowest, highest)
        for k in range(n_unsure):
            j = int(unsure[k])
            state[j], entered[j], left[j] = px[k], py[k], pz[k]
            if state[j] == OPEN:
                state[j], entered[j], left[j], _ = decide_alone(segments, start + j, columns, limit, numbers, chosen)
            if state[j] == OPEN:
                still[n_open] = start + j
                n_open += 1
        beyond += n_unsure
        for j in range(size):  # n_accepted <= start + j - first: rows of others are overwritten
            items[n_accepted], planes[n_accepted, 0], planes[n_accepted, 1] = start + j, int(entered[j]), int(left[j])
            n_accepted += state[j] == ACCEPTED
    n[0], n[1], n[2] = n_accepted, n_open, beyond
