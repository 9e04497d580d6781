"""The points where segments enter and leave a ball, each coordinate the nearest double.

A point is found from t in doubles by one step of Newton whose residual F(t) is taken in double-double: the root lies
within (E_F + s E_G + A s^2) / |F'| of t - F / F', where E bounds the errors of F and F' and s the step. F is convex
and quadratic, so that is a proof for whatever t came in, and no square root has to be precise.

What is not sure goes to integers and their square roots (profiles.py).
"""

from __future__ import annotations

import math
from typing import Any, Final

from engine.jit import called, inline, kernel, merged
from engine.predicates.cut_point import TINY as CUT_TINY
from engine.predicates.cut_point import point_along
from engine.predicates.double_double import U2, dd_add, dd_div, dd_mul
from engine.predicates.error_free import fast_two_sum, two_diff, two_prod, two_sum
from engine.segment_clipping.ball_interval import (
    DOT_BOUND,
    TINY,
    axis_terms,
    center_of,
    dd_dot,
    discriminant,
    is_ball_safe,
)
from engine.segment_clipping.pieces import Pieces, Triple, point_of, put_end, put_own_end

RESIDUAL_BOUND: Final = 48.0 * U2
"""Of F, times the sum of (|p - c| + |t d|)^2 and r^2: a place carries 8 u^2 of its size, from three roundings of tails,
its square twice that and 5 u^2; four sums have 4 u^2 each."""
RESIDUAL_TINY: Final = 2.0**-1060
"""Products of F that underflow."""
SLOPE_BOUND: Final = 16.0 * 2.0**-53
"""Of F' = 2 d.(x - c) in doubles, times the sum of absolute terms."""


@merged
def root_in_doubles(p: Triple, q: Triple, c: Triple, rr: float, side: int) -> float:
    """Return one root of the quadratic in doubles, by the form of it that does not cancel."""
    fx, _, dx = axis_terms(p[0], q[0], c[0])
    fy, _, dy = axis_terms(p[1], q[1], c[1])
    fz, _, dz = axis_terms(p[2], q[2], c[2])
    x, y, z = dy * fz - dz * fy, dz * fx - dx * fz, dx * fy - dy * fx
    dd, df, cross = dx * dx + dy * dy + dz * dz, dx * fx + dy * fy + dz * fz, x * x + y * y + z * z
    root = math.sqrt(max(0.0, dd * rr - cross))
    outer = -df - root if df > 0.0 else root - df  # the root of larger size, times A
    if (side == 1) == (df <= 0.0):
        return outer / dd
    return (fx * fx + fy * fy + fz * fz - rr) / outer


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
    sh, low, mh, dh = point_along(p, q, t, step)
    bound = 24.0 * U2 * (abs(p) + abs(mh)) + (1.01 * slack + 4.0 * 2.0**-53 * abs(step)) * abs(dh) + CUT_TINY
    return sh + low, sh + (low - bound) == sh + (low + bound)


@inline
def newton_step(p: Triple, q: Triple, c: Triple, radius: float, t: float, side: int) -> tuple[float, float, bool]:
    """Return the step from `t` to the root where the ball is entered (side 0) or left, its bound, and if that holds.

    Caller guarantees that there are roots. With the sign of F' that the root has, it is at most 2 |F / F'| away.
    """
    x, xl, x_size, dx = place_on(p[0], q[0], c[0], t)
    y, yl, y_size, dy = place_on(p[1], q[1], c[1], t)
    z, zl, z_size, dz = place_on(p[2], q[2], c[2], t)
    h, low = two_prod(-radius, radius)
    size = -h
    for place, tail in ((x, xl), (y, yl), (z, zl)):
        sh, sl = dd_mul(place, tail, place, tail)
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


@merged
def cut_by_ball(p: Triple, q: Triple, c: Triple, radius: float, side: int) -> tuple[float, float, float, float, bool]:
    """Return where p q enters the ball (side 0) or leaves it, t there, and whether all is surely nearest."""
    guess = root_in_doubles(p, q, c, radius * radius, side)
    step, slack, sure = newton_step(p, q, c, radius, guess, side)
    x, is_x = coordinate_at(p[0], q[0], guess, step, slack)
    y, is_y = coordinate_at(p[1], q[1], guess, step, slack)
    z, is_z = coordinate_at(p[2], q[2], guess, step, slack)
    is_t = guess + (step - slack) == guess + (step + slack)
    return x, y, z, guess + step + 0.0, sure & is_x & is_y & is_z & is_t


@called
def cut_by_root(p: Triple, q: Triple, c: Triple, radius: float, side: int) -> tuple[float, float, float, float, bool]:
    """Return what `cut_by_ball` does, by t = (-B -+ sqrt(D)) / A in double-doubles: a line that is nearly tangent.

    A and B are within `DOT_BOUND`, the root within half the bound of D over itself and the 8 u^2 that it is rounded by;
    their sum has 4 u^2, the quotient 16 u^2 of t and what A has.
    """
    h, low, bound = discriminant(p, q, c, radius)
    ah, al, _ = dd_dot(p, q, p, q)
    bh, bl, size = dd_dot(p, q, c, p)
    sign = -1.0 if side == 0 else 1.0
    root = math.sqrt(max(h, 0.0))
    rh, rl = two_prod(root, root)
    tail = 0.0 if root == 0.0 else ((h - rh) + (low - rl)) / (2.0 * root)
    nh, nl = dd_add(-bh, -bl, sign * root, sign * tail)
    th, tl = dd_div(nh, nl, ah, al)
    slack = DOT_BOUND * size + 8.0 * U2 * root + (0.0 if bound == 0.0 else bound / root)
    slack = 1.01 * slack / ah + 64.0 * U2 * abs(th)
    x, is_x = coordinate_at(p[0], q[0], th, tl, slack)
    y, is_y = coordinate_at(p[1], q[1], th, tl, slack)
    z, is_z = coordinate_at(p[2], q[2], th, tl, slack)
    is_t = th + (tl - slack) == th + (tl + slack)
    sure = is_ball_safe(p, q, c, radius) & ((h > bound) | (bound == 0.0))
    return x, y, z, th + tl + 0.0, sure & is_x & is_y & is_z & is_t


@kernel
def fill_on_sphere(
    segments: Any, center: Any, radius: float, items: Any, planes: Any, begin: int, size: int, stop: Any,
    pieces: Pieces, still: Any, n: Any,
) -> None:  # fmt: skip
    """Fill the pieces of ``segments`` ((n, 2, dim) float64): see `fill_on_boxes`."""
    is_flat = center.size == 2
    n_open, c = 0, center_of(center, is_flat)
    for place in range(size):
        if stop[0]:
            return
        i, row = items[place], begin + place
        pieces.source[row] = i
        all_sure = True
        p, q = point_of(segments, i, 0, is_flat), point_of(segments, i, 1, is_flat)
        for end in range(2):
            if planes[place, end] < 0:
                put_own_end(pieces, row, end, segments, i, is_flat)
                continue
            pieces.faces[row, end] = planes[place, end]
            x, y, z, t, sure = cut_by_ball(p, q, c, radius, end)
            if not sure:
                x, y, z, t, sure = cut_by_root(p, q, c, radius, end)
            pieces.t[row, end] = t
            put_end(pieces, row, end, (x, y, z), is_flat)
            all_sure &= sure
        if not all_sure:
            still[n_open] = row
            n_open += 1
    n[0], n[1] = n_open, n_open
