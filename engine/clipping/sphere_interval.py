"""Segments on a closed ball: the interval between two roots of a quadratic, decided exactly, 2D and 3D.

With d = q - p and f = p - c (g = q - c at the other end) the points of the ball have

    A t^2 + 2 B t + C <= 0,     A = d.d,  B = d.f,  C = f.f - r^2,     t = (-B -+ sqrt(D)) / A,

    D = B^2 - A C = A r^2 - |d x f|^2        (Lagrange: no cancellation unless the line is nearly tangent)

The signs of C at either end say which ends are inside. With both outside, the ball is met exactly if D >= 0 and the
foot of the centre lies between the ends: d.f < 0 < d.g. Doubles with a bound settle most items; then double-double;
what is still open (tangent lines, ends on the sphere) goes to integers and their square roots (exact_segments.py).

Source: the textbook's exercise, a segment on a sphere; bounds: see the comments at each constant.
"""

from __future__ import annotations

from typing import Any, Final

from engine.clipping.cohen_sutherland import BEYOND_FILTER, DROPPED, KEPT, OPEN
from engine.clipping.cut_point import is_safe
from engine.clipping.cyrus_beck import is_segment_safe
from engine.jit import inline, kernel
from engine.predicates.double_double import U2, dd_add, dd_div, dd_mul, dd_sqrt, dd_sub, surely_rounded
from engine.predicates.error_free import two_diff, two_prod

ROUGH_BOUND: Final = 32.0 * 2.0**-53
"""Doubles: differences, products and three sums, each term at most (1 + u)^8, squared terms (1 + u)^14."""
SUM_BOUND: Final = 32.0 * U2
"""A sum of at most four products of double-doubles: 5 u^2 for a product, 4 u^2 for each of four sums."""
DISCRIMINANT_BOUND: Final = 96.0 * U2
"""D: A r^2 carries 42 u^2; a squared component of the cross product 2 * 9 + 5 u^2 of (|d_i f_j| + |d_j f_i|)^2."""
TINY: Final = 2.0**-960
"""Added to bounds in doubles for products that underflow."""


@inline
def surely_outside(segment: Any, center: Any, radius: float) -> bool:
    """Tell whether doubles prove that the segment misses the ball; False where unsure (NaN and infinity too)."""
    n = center.size
    ff = gg = df = dg = df_size = dg_size = dd = cross = cross_size = 0.0
    for k in range(n):
        f, g, d = segment[0, k] - center[k], segment[1, k] - center[k], segment[1, k] - segment[0, k]
        ff, gg, dd = ff + f * f, gg + g * g, dd + d * d
        df, df_size = df + d * f, df_size + abs(d * f)
        dg, dg_size = dg + d * g, dg_size + abs(d * g)
        for j in range(k):
            e, h = segment[0, j] - center[j], segment[1, j] - segment[0, j]
            cross += (d * e - h * f) * (d * e - h * f)
            cross_size += (abs(d * e) + abs(h * f)) * (abs(d * e) + abs(h * f))
    rr = radius * radius
    if not (ff - rr > ROUGH_BOUND * (ff + rr) + TINY and gg - rr > ROUGH_BOUND * (gg + rr) + TINY):
        return False
    return (
        df > ROUGH_BOUND * df_size + TINY
        or -dg > ROUGH_BOUND * dg_size + TINY
        or cross - dd * rr > ROUGH_BOUND * (cross_size + dd * rr) + TINY
    )


@inline
def surely_inside(segment: Any, center: Any, radius: float) -> bool:
    """Tell whether doubles prove that both ends lie in the ball; False where unsure."""
    ff = gg = 0.0
    for k in range(center.size):
        f, g = segment[0, k] - center[k], segment[1, k] - center[k]
        ff, gg = ff + f * f, gg + g * g
    rr = radius * radius
    return rr - ff > ROUGH_BOUND * (ff + rr) + TINY and rr - gg > ROUGH_BOUND * (gg + rr) + TINY


@inline
def add_square_product(
    h: float, low: float, size: float, ah: float, al: float, bh: float, bl: float
) -> tuple[float, float, float]:
    """Return (h, low) + a b in double-double, and `size` + |a b|."""
    ph, pl = dd_mul(ah, al, bh, bl)
    h, low = dd_add(h, low, ph, pl)
    return h, low, size + abs(ph)


@inline
def power(point: Any, center: Any, radius: float) -> tuple[float, float, float]:
    """Return |point - center|^2 - radius^2 as a double-double and its bound."""
    h, low = two_prod(-radius, radius)
    size = -h
    for k in range(center.size):
        fh, fl = two_diff(point[k], center[k])
        h, low, size = add_square_product(h, low, size, fh, fl, fh, fl)
    return h, low, SUM_BOUND * size


@inline
def direction_product(segment: Any, point: Any, center: Any) -> tuple[float, float, float]:
    """Return (q - p) . (point - center) as a double-double and its bound."""
    h = low = size = 0.0
    for k in range(center.size):
        dh, dl = two_diff(segment[1, k], segment[0, k])
        fh, fl = two_diff(point[k], center[k])
        h, low, size = add_square_product(h, low, size, dh, dl, fh, fl)
    return h, low, SUM_BOUND * size


@inline
def discriminant(segment: Any, center: Any, radius: float, ah: float, al: float) -> tuple[float, float, float]:
    """Return A r^2 - |d x f|^2 as a double-double and its bound."""
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
    return h, low, DISCRIMINANT_BOUND * size


@inline
def cut(segment: Any, nh: float, nl: float, n_bound: float, ah: float, al: float, point: Any) -> tuple[float, bool]:
    """Set `point` to p + d n / A, n known within `n_bound`; return t = n / A and whether all is surely nearest.

    The quotient adds (32 + 16) u^2 |t|, product and sum of a coordinate 9 u^2 (|p| + |d|); 2 u^2 for the test.
    """
    th, tl = dd_div(nh, nl, ah, al)
    t_bound = 1.01 * n_bound / ah + 64.0 * U2 * abs(th)
    sure = surely_rounded(th, tl, t_bound)
    for k in range(point.size):
        p = segment[0, k]
        dh, dl = two_diff(segment[1, k], p)
        if dh == 0.0:
            point[k] = p
            continue
        mh, ml = dd_mul(th, tl, dh, dl)
        xh, xl = dd_add(mh, ml, p, 0.0)
        bound = 1.01 * t_bound * abs(dh) + 16.0 * U2 * (abs(p) + abs(mh))
        point[k] = xh + xl
        sure = sure and surely_rounded(xh, xl, bound)
    return th + tl, sure


@inline
def clip_crossing(segment: Any, center: Any, radius: float, start: Any, end: Any, t: Any, faces: Any) -> int:
    """Clip one segment in double-double; `start` and `end` hold its end points. Return its state."""
    if not is_segment_safe(segment) or not is_safe(radius):
        return OPEN
    for k in range(center.size):
        if not is_safe(center[k]):
            return OPEN
    ch, _, c_bound = power(segment[0], center, radius)
    gh, _, g_bound = power(segment[1], center, radius)
    if abs(ch) <= c_bound or abs(gh) <= g_bound:
        return OPEN  # case: an end on the sphere
    p_in, q_in = ch < 0.0, gh < 0.0
    if p_in and q_in:
        return KEPT
    ah, al, _ = direction_product(segment, segment[1], segment[0])
    if ah == 0.0:
        return DROPPED  # case: a point
    bh, bl, b_bound = direction_product(segment, segment[0], center)
    if not p_in and not q_in:
        eh, _, e_bound = direction_product(segment, segment[1], center)
        if bh > b_bound or -eh > e_bound:
            return DROPPED
        if abs(bh) <= b_bound or abs(eh) <= e_bound:
            return OPEN
    dh, dl, d_bound = discriminant(segment, center, radius, ah, al)
    if not p_in and not q_in and -dh > d_bound:
        return DROPPED
    if not 0.001 * dh > d_bound:
        return OPEN  # case: tangent, or nearly so
    hh, hl = dd_sqrt(dh, dl)
    n_bound = b_bound + 0.51 * d_bound / hh + 12.0 * U2 * (hh + abs(bh))
    sure = True
    if not p_in:
        faces[0] = 0
        nh, nl = dd_sub(-bh, -bl, hh, hl)
        t[0], sure = cut(segment, nh, nl, n_bound, ah, al, start)
    if not q_in:
        faces[1] = 0
        nh, nl = dd_add(-bh, -bl, hh, hl)
        t[1], is_sure = cut(segment, nh, nl, n_bound, ah, al, end)
        sure = sure and is_sure
    return KEPT if sure else OPEN


@kernel
def clip_on_sphere(
    segments: Any,
    center: Any,
    radius: float,
    first: int,
    last: int,
    start: Any,
    end: Any,
    t: Any,
    faces: Any,
    state: Any,
) -> None:
    """Clip ``segments[first:last]`` ((n, 2, dim) float64) on the closed ball.

    start, end: (n, dim) float64. t: (n, 2) float64. faces: (n, 2) int64. state: (n,) uint8. Rows of segments that are
    not kept are undefined.
    """
    for i in range(first, last):
        segment = segments[i]
        if surely_outside(segment, center, radius):
            state[i] = DROPPED
            continue
        for k in range(center.size):
            start[i, k], end[i, k] = segment[0, k], segment[1, k]
        t[i, 0], t[i, 1], faces[i, 0], faces[i, 1] = 0.0, 1.0, -1, -1
        if surely_inside(segment, center, radius):
            state[i] = KEPT
            continue
        answer = clip_crossing(segment, center, radius, start[i], end[i], t[i], faces[i])
        state[i] = answer | BEYOND_FILTER if answer == OPEN else answer
