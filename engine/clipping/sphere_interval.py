"""Segments on a closed ball: the interval between two roots of a quadratic, decided exactly, 2D and 3D.

With d = q - p and f = p - c (g = q - c at the other end) the points of the ball have

    A t^2 + 2 B t + C <= 0,     A = d.d,  B = d.f,  C = f.f - r^2,     t = (-B -+ sqrt(D)) / A,

    D = B^2 - A C = A r^2 - |d x f|^2        (Lagrange: no cancellation unless the line is nearly tangent)

The signs of C at either end say which ends are inside. With both outside, the ball is met exactly if D >= 0 and the
foot of the centre lies between the ends: d.f < 0 < d.g. Doubles with a bound settle most items; then double-double;
what is still open (tangent lines, ends on the sphere) goes to integers and their square roots (exact_segments.py).

A point is found from t in doubles by one step of Newton whose residual F(t) is taken in double-double: the root lies
within (E_F + s E_G + A s^2) / |F'| of t - F / F', where E bounds the errors of F and F' and s the step. F is convex
and quadratic, so that is a proof for whatever t came in, and no square root has to be precise.

Source: the textbook's exercise, a segment on a sphere; bounds: see the comments at each constant.
"""

from __future__ import annotations

import math
from typing import Any, Final

from engine.clipping.cohen_sutherland import DROPPED, KEPT, OPEN
from engine.clipping.cut_point import TINY as CUT_TINY
from engine.clipping.cut_point import is_safe
from engine.clipping.cyrus_beck import is_segment_safe
from engine.jit import inline, kernel
from engine.predicates.double_double import U2, dd_add, dd_mul, dd_sub
from engine.predicates.error_free import fast_two_sum, two_diff, two_prod, two_sum, workspace
from engine.predicates.expansion import grow_product, sign

ROUGH_BOUND: Final = 32.0 * 2.0**-53
"""Doubles: differences, products and three sums, each term at most (1 + u)^8, squared terms (1 + u)^14."""
SUM_BOUND: Final = 32.0 * U2
"""A sum of at most four products of double-doubles: 5 u^2 for a product, 4 u^2 for each of four sums."""
DISCRIMINANT_BOUND: Final = 96.0 * U2
"""D: A r^2 carries 42 u^2; a squared component of the cross product 2 * 9 + 5 u^2 of (|d_i f_j| + |d_j f_i|)^2."""
TINY: Final = 2.0**-960
"""Added to bounds in doubles for products that underflow."""
RESIDUAL_BOUND: Final = 48.0 * U2
"""Of F, times the sum of (|p - c| + |t d|)^2 and r^2: a place carries 8 u^2 of its size, from three roundings of tails,
its square twice that and 5 u^2; four sums have 4 u^2 each."""
RESIDUAL_TINY: Final = 2.0**-1060
"""Products of F that underflow."""
SLOPE_BOUND: Final = 16.0 * 2.0**-53
"""Of F' = 2 d.(x - c) in doubles, times the sum of absolute terms."""


@inline
def power_sign(point: Any, center: Any, radius: float) -> int:
    """Return the exact sign of |point - center|^2 - radius^2, all within the safe range."""
    e = workspace(26)
    n = grow_product(e, 0, -radius, radius)
    for k in range(center.size):
        h, low = two_diff(point[k], center[k])
        n = grow_product(e, n, low, low)
        n = grow_product(e, n, 2.0 * low, h)
        n = grow_product(e, n, h, h)
    return sign(e, n)


@inline
def direction_sign(segment: Any, point: Any, center: Any) -> int:
    """Return the exact sign of (q - p) . (point - center), all within the safe range."""
    e = workspace(24)
    n = 0
    for k in range(center.size):
        dh, dl = two_diff(segment[1, k], segment[0, k])
        fh, fl = two_diff(point[k], center[k])
        n = grow_product(e, n, dl, fl)
        n = grow_product(e, n, dl, fh)
        n = grow_product(e, n, dh, fl)
        n = grow_product(e, n, dh, fh)
    return sign(e, n)


@inline
def discriminant(segment: Any, center: Any, radius: float) -> tuple[float, float]:
    """Return A r^2 - |d x f|^2, from double-doubles, and its bound."""
    ah = al = 0.0
    for k in range(center.size):
        dh, dl = two_diff(segment[1, k], segment[0, k])
        sh, sl = dd_mul(dh, dl, dh, dl)
        ah, al = dd_add(ah, al, sh, sl)
    rh, rl = two_prod(radius, radius)
    h, low = dd_mul(ah, al, rh, rl)
    size = h
    for k in range(center.size):
        dh, dl = two_diff(segment[1, k], segment[0, k])
        fh, fl = two_diff(segment[0, k], center[k])
        for j in range(k):
            eh, el = two_diff(segment[1, j], segment[0, j])
            gh, gl = two_diff(segment[0, j], center[j])
            uh, ul = dd_mul(dh, dl, gh, gl)
            vh, vl = dd_mul(eh, el, fh, fl)
            ch, cl = dd_sub(uh, ul, vh, vl)
            sh, sl = dd_mul(ch, cl, ch, cl)
            h, low = dd_sub(h, low, sh, sl)
            size += (abs(uh) + abs(vh)) * (abs(uh) + abs(vh))
    return h, DISCRIMINANT_BOUND * size


@inline
def decide_exactly(segment: Any, center: Any, radius: float) -> tuple[int, int, int]:
    """Decide on one segment by exact signs: state, and 0 for an end on the sphere, -1 for one of the segment."""
    safe = is_segment_safe(segment) and is_safe(radius)
    for k in range(center.size):
        safe = safe and is_safe(center[k])
    if not safe:
        return OPEN, -1, -1
    p_out, q_out = power_sign(segment[0], center, radius) > 0, power_sign(segment[1], center, radius) > 0
    if not (p_out and q_out):
        return KEPT, 0 if p_out else -1, 0 if q_out else -1
    if direction_sign(segment, segment[0], center) >= 0 or direction_sign(segment, segment[1], center) <= 0:
        return DROPPED, -1, -1  # a point too
    value, bound = discriminant(segment, center, radius)
    if -value > bound:
        return DROPPED, -1, -1
    return (KEPT, 0, 0) if value > bound else (OPEN, -1, -1)  # case: tangent, or nearly so


@inline
def axis_terms(p: float, q: float, c: float) -> tuple[float, float, float]:
    """Return p - c, q - c and q - p."""
    return p - c, q - c, q - p


@inline
def decide_roughly(
    ff: float, gg: float, dd: float, df: float, df_size: float, dg: float, dg_size: float, cross: float, size: float,
    rr: float,
) -> tuple[int, int, int]:  # fmt: skip
    """Decide from sums of products in doubles, with sums of their absolute terms; OPEN where they prove nothing."""
    p_gap, q_gap = ff - rr, gg - rr
    p_bound, q_bound = ROUGH_BOUND * (ff + rr) + TINY, ROUGH_BOUND * (gg + rr) + TINY
    if not ((abs(p_gap) > p_bound) & (abs(q_gap) > q_bound)):
        return OPEN, -1, -1
    p_out, q_out = p_gap > 0.0, q_gap > 0.0
    if not (p_out & q_out):
        return KEPT, 0 if p_out else -1, 0 if q_out else -1
    df_bound, dg_bound = ROUGH_BOUND * df_size + TINY, ROUGH_BOUND * dg_size + TINY
    gap, bound = dd * rr - cross, ROUGH_BOUND * (size + dd * rr) + TINY
    if (df > df_bound) | (-dg > dg_bound) | (-gap > bound):
        return DROPPED, -1, -1
    if (-df > df_bound) & (dg > dg_bound) & (gap > bound):
        return KEPT, 0, 0
    return OPEN, -1, -1


@kernel
def decide_on_sphere_2d(
    segments: Any,
    center: Any,
    radius: float,
    first: int,
    last: int,
    stop: Any,
    items: Any,
    planes: Any,
    still: Any,
    n: Any,
) -> None:
    """Decide on ``segments[first:last]`` ((n, 2, 2) float64) and the closed ball: see `decide_on_boxes`."""
    kept, n_open, beyond = first, first, 0
    rr, cx, cy = radius * radius, center[0], center[1]
    for i in range(first, last):
        if stop[0]:
            return
        fx, gx, dx = axis_terms(segments[i, 0, 0], segments[i, 1, 0], cx)
        fy, gy, dy = axis_terms(segments[i, 0, 1], segments[i, 1, 1], cy)
        z, z_size = dx * fy - dy * fx, abs(dx * fy) + abs(dy * fx)
        state, entered, left = decide_roughly(
            fx * fx + fy * fy,
            gx * gx + gy * gy,
            dx * dx + dy * dy,
            dx * fx + dy * fy,
            abs(dx * fx) + abs(dy * fy),
            dx * gx + dy * gy,
            abs(dx * gx) + abs(dy * gy),
            z * z,
            z_size * z_size,
            rr,
        )
        if state == OPEN:
            beyond += 1
            state, entered, left = decide_exactly(segments[i], center, radius)
            if state == OPEN:
                still[n_open] = i
                n_open += 1
        if state == KEPT:
            items[kept], planes[kept, 0], planes[kept, 1] = i, entered, left
            kept += 1
    n[0], n[1], n[2] = kept - first, n_open - first, beyond


@kernel
def decide_on_sphere_3d(
    segments: Any,
    center: Any,
    radius: float,
    first: int,
    last: int,
    stop: Any,
    items: Any,
    planes: Any,
    still: Any,
    n: Any,
) -> None:
    """Decide on ``segments[first:last]`` ((n, 2, 3) float64) and the closed ball: see `decide_on_boxes`."""
    kept, n_open, beyond = first, first, 0
    rr, cx, cy, cz = radius * radius, center[0], center[1], center[2]
    for i in range(first, last):
        if stop[0]:
            return
        fx, gx, dx = axis_terms(segments[i, 0, 0], segments[i, 1, 0], cx)
        fy, gy, dy = axis_terms(segments[i, 0, 1], segments[i, 1, 1], cy)
        fz, gz, dz = axis_terms(segments[i, 0, 2], segments[i, 1, 2], cz)
        x, x_size = dy * fz - dz * fy, abs(dy * fz) + abs(dz * fy)
        y, y_size = dz * fx - dx * fz, abs(dz * fx) + abs(dx * fz)
        z, z_size = dx * fy - dy * fx, abs(dx * fy) + abs(dy * fx)
        state, entered, left = decide_roughly(
            fx * fx + fy * fy + fz * fz,
            gx * gx + gy * gy + gz * gz,
            dx * dx + dy * dy + dz * dz,
            dx * fx + dy * fy + dz * fz,
            abs(dx * fx) + abs(dy * fy) + abs(dz * fz),
            dx * gx + dy * gy + dz * gz,
            abs(dx * gx) + abs(dy * gy) + abs(dz * gz),
            x * x + y * y + z * z,
            x_size * x_size + y_size * y_size + z_size * z_size,
            rr,
        )
        if state == OPEN:
            beyond += 1
            state, entered, left = decide_exactly(segments[i], center, radius)
            if state == OPEN:
                still[n_open] = i
                n_open += 1
        if state == KEPT:
            items[kept], planes[kept, 0], planes[kept, 1] = i, entered, left
            kept += 1
    n[0], n[1], n[2] = kept - first, n_open - first, beyond


@inline
def root_in_doubles(ff: float, dd: float, df: float, cross: float, rr: float, side: int) -> float:
    """Return one root of the quadratic in doubles, by the form of it that does not cancel."""
    root = math.sqrt(max(0.0, dd * rr - cross))
    outer = -df - root if df > 0.0 else root - df  # the root of larger size, times A
    if (side == 1) == (df <= 0.0):
        return outer / dd
    return (ff - rr) / outer


@inline
def place_on(p: float, q: float, c: float, t: float) -> tuple[float, float, float, float]:
    """Return one coordinate of p + t (q - p) - c as a double-double, its size |p - c| + |t (q - p)|, and q - p."""
    dh, dl = two_diff(q, p)
    mh, ml = two_prod(t, dh)
    fh, fl = two_diff(p, c)
    h, low = two_sum(fh, mh)
    h, low = fast_two_sum(h, low + ((fl + ml) + t * dl))
    return h, low, abs(fh) + abs(mh), dh


@inline
def coordinate_at(p: float, q: float, t: float, step: float, slack: float) -> tuple[float, bool]:
    """Return p + (t + step) (q - p) and whether it is surely the nearest double; the step is known within `slack`."""
    if p == q:
        return p, True
    dh, dl = two_diff(q, p)
    mh, ml = two_prod(t, dh)
    sh, sl = two_sum(p, mh)
    low = (sl + ml) + (step * dh + t * dl)
    bound = 24.0 * U2 * (abs(p) + abs(mh)) + (1.01 * slack + 4.0 * 2.0**-53 * abs(step)) * abs(dh) + CUT_TINY
    return sh + low, sh + (low - bound) == sh + (low + bound)


@inline
def newton_step_2d(segments: Any, i: int, center: Any, radius: float, t: float, side: int) -> tuple[float, float, bool]:
    """Return the step from `t` to the root where the ball is entered (side 0) or left, its bound, and if that holds.

    Caller guarantees that there are roots. With the sign of F' that the root has, it is at most 2 |F / F'| away.
    """
    x, xl, x_size, dx = place_on(segments[i, 0, 0], segments[i, 1, 0], center[0], t)
    y, yl, y_size, dy = place_on(segments[i, 0, 1], segments[i, 1, 1], center[1], t)
    h, low = two_prod(-radius, radius)
    size = -h
    sh, sl = dd_mul(x, xl, x, xl)
    h, low = dd_add(h, low, sh, sl)
    sh, sl = dd_mul(y, yl, y, yl)
    h, low = dd_add(h, low, sh, sl)
    size += x_size * x_size + y_size * y_size
    slope = 2.0 * (dx * x + dy * y)
    slope_bound = SLOPE_BOUND * (abs(dx) * x_size + abs(dy) * y_size) + TINY
    steepness = -slope if side == 0 else slope
    bound = RESIDUAL_BOUND * size + RESIDUAL_TINY
    step = -h / slope
    away = 4.2 * (abs(h) + bound) / abs(slope)
    curve = 1.01 * (dx * dx + dy * dy)
    slack = 1.01 * (bound + away * (slope_bound + away * curve)) / abs(slope) + 4.0 * 2.0**-53 * abs(step)
    return step, slack, steepness > 2.0 * slope_bound


@kernel
def fill_on_sphere_2d(
    segments: Any,
    center: Any,
    radius: float,
    items: Any,
    planes: Any,
    first: int,
    last: int,
    stop: Any,
    source: Any,
    ends: Any,
    t: Any,
    faces: Any,
    still: Any,
    n: Any,
) -> None:
    """Fill rows first .. last - 1 of the pieces of ``segments`` ((n, 2, 2) float64): see `fill_on_boxes`."""
    n_open = 0
    rr = radius * radius
    for row in range(first, last):
        if stop[0]:
            return
        i = items[row]
        source[row] = i
        all_sure = True
        for side in range(2):
            plane = planes[row, side]
            faces[row, side] = plane
            if plane < 0:
                t[row, side] = side
                ends[side, row, 0], ends[side, row, 1] = (
                    segments[i, side, 0] + 0.0,
                    segments[i, side, 1] + 0.0,
                )
                continue
            fx, _, dx = axis_terms(segments[i, 0, 0], segments[i, 1, 0], center[0])
            fy, _, dy = axis_terms(segments[i, 0, 1], segments[i, 1, 1], center[1])
            z = dx * fy - dy * fx
            cross = z * z
            guess = root_in_doubles(
                fx * fx + fy * fy,
                dx * dx + dy * dy,
                dx * fx + dy * fy,
                cross,
                rr,
                side,
            )
            step, slack, sure = newton_step_2d(segments, i, center, radius, guess, side)
            t[row, side] = guess + step + 0.0
            sure = sure & (guess + (step - slack) == guess + (step + slack))
            at, is_sure = coordinate_at(segments[i, 0, 0], segments[i, 1, 0], guess, step, slack)
            ends[side, row, 0] = at + 0.0
            sure = sure & is_sure
            at, is_sure = coordinate_at(segments[i, 0, 1], segments[i, 1, 1], guess, step, slack)
            ends[side, row, 1] = at + 0.0
            sure = sure & is_sure
            all_sure = all_sure and sure
        if not all_sure:
            still[first + n_open] = row
            n_open += 1
    n[0], n[1] = n_open, n_open


@inline
def newton_step_3d(segments: Any, i: int, center: Any, radius: float, t: float, side: int) -> tuple[float, float, bool]:
    """Return the step from `t` to the root where the ball is entered (side 0) or left, its bound, and if that holds.

    Caller guarantees that there are roots. With the sign of F' that the root has, it is at most 2 |F / F'| away.
    """
    x, xl, x_size, dx = place_on(segments[i, 0, 0], segments[i, 1, 0], center[0], t)
    y, yl, y_size, dy = place_on(segments[i, 0, 1], segments[i, 1, 1], center[1], t)
    z, zl, z_size, dz = place_on(segments[i, 0, 2], segments[i, 1, 2], center[2], t)
    h, low = two_prod(-radius, radius)
    size = -h
    sh, sl = dd_mul(x, xl, x, xl)
    h, low = dd_add(h, low, sh, sl)
    sh, sl = dd_mul(y, yl, y, yl)
    h, low = dd_add(h, low, sh, sl)
    sh, sl = dd_mul(z, zl, z, zl)
    h, low = dd_add(h, low, sh, sl)
    size += x_size * x_size + y_size * y_size + z_size * z_size
    slope = 2.0 * (dx * x + dy * y + dz * z)
    slope_bound = SLOPE_BOUND * (abs(dx) * x_size + abs(dy) * y_size + abs(dz) * z_size) + TINY
    steepness = -slope if side == 0 else slope
    bound = RESIDUAL_BOUND * size + RESIDUAL_TINY
    step = -h / slope
    away = 4.2 * (abs(h) + bound) / abs(slope)
    curve = 1.01 * (dx * dx + dy * dy + dz * dz)
    slack = 1.01 * (bound + away * (slope_bound + away * curve)) / abs(slope) + 4.0 * 2.0**-53 * abs(step)
    return step, slack, steepness > 2.0 * slope_bound


@kernel
def fill_on_sphere_3d(
    segments: Any,
    center: Any,
    radius: float,
    items: Any,
    planes: Any,
    first: int,
    last: int,
    stop: Any,
    source: Any,
    ends: Any,
    t: Any,
    faces: Any,
    still: Any,
    n: Any,
) -> None:
    """Fill rows first .. last - 1 of the pieces of ``segments`` ((n, 2, 3) float64): see `fill_on_boxes`."""
    n_open = 0
    rr = radius * radius
    for row in range(first, last):
        if stop[0]:
            return
        i = items[row]
        source[row] = i
        all_sure = True
        for side in range(2):
            plane = planes[row, side]
            faces[row, side] = plane
            if plane < 0:
                t[row, side] = side
                ends[side, row, 0], ends[side, row, 1], ends[side, row, 2] = (
                    segments[i, side, 0] + 0.0,
                    segments[i, side, 1] + 0.0,
                    segments[i, side, 2] + 0.0,
                )
                continue
            fx, _, dx = axis_terms(segments[i, 0, 0], segments[i, 1, 0], center[0])
            fy, _, dy = axis_terms(segments[i, 0, 1], segments[i, 1, 1], center[1])
            fz, _, dz = axis_terms(segments[i, 0, 2], segments[i, 1, 2], center[2])
            x, y, z = dy * fz - dz * fy, dz * fx - dx * fz, dx * fy - dy * fx
            cross = x * x + y * y + z * z
            guess = root_in_doubles(
                fx * fx + fy * fy + fz * fz,
                dx * dx + dy * dy + dz * dz,
                dx * fx + dy * fy + dz * fz,
                cross,
                rr,
                side,
            )
            step, slack, sure = newton_step_3d(segments, i, center, radius, guess, side)
            t[row, side] = guess + step + 0.0
            sure = sure & (guess + (step - slack) == guess + (step + slack))
            at, is_sure = coordinate_at(segments[i, 0, 0], segments[i, 1, 0], guess, step, slack)
            ends[side, row, 0] = at + 0.0
            sure = sure & is_sure
            at, is_sure = coordinate_at(segments[i, 0, 1], segments[i, 1, 1], guess, step, slack)
            ends[side, row, 1] = at + 0.0
            sure = sure & is_sure
            at, is_sure = coordinate_at(segments[i, 0, 2], segments[i, 1, 2], guess, step, slack)
            ends[side, row, 2] = at + 0.0
            sure = sure & is_sure
            all_sure = all_sure and sure
        if not all_sure:
            still[first + n_open] = row
            n_open += 1
    n[0], n[1] = n_open, n_open
