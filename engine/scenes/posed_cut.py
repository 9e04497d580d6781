"""Segments on placed balls and convex bodies, compiled: parameters are those of the segment in the body's own frame.

A pose x -> R x + t with det R > 0 keeps parameters and all orientation signs. With M = R^-1 as double-doubles and the
exact differences p - t and q - p,

    p' = M (p - t),    e' = M (q - p),    a plane's values s(p') and s(p') + n . e' at the ends

in double-doubles with running bounds (u = 2^-53): an entry of M carries u^2, its product 5 u^2, two sums 3 u^2 each, so
a coordinate of p' is within 32 u^2 sum |p - t|, and one of e' likewise; entries of M are below 1.01. A body without a
pose is one under the identity, whose p' and e' carry no error. A ball stays in the world, about the image of its
centre. What a bound leaves open (a sign, the order of two parameters, a coordinate that may round either way) is
UNDECIDED. Doubles tell whether a body is met, and by which planes: what they leave open, double-doubles seldom tell.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from engine.jit import inline
from engine.lanes.addresses import array_at
from engine.predicates.cut_point import T_BOUND, point_at
from engine.predicates.double_double import U2, dd_add, dd_div, dd_mul, dd_scale, dd_sub
from engine.predicates.error_free import fma, two_diff, two_prod
from engine.segment_clipping.on_boundary.crossing_values import Vector
from engine.segment_clipping.pieces import Pieces, point_of, put_own_end
from engine.types import UNDECIDED

_FRAME_BOUND: Final = 32.0 * U2

_OWN_START, _OWN_END = (-1.0, 0.0, 0.0, -1), (2.0, 0.0, 0.0, -1)
"""Ends of a piece, as `put_piece` takes them, that are those of the segment."""

Pair = tuple[float, float]
Frame = tuple[Vector, float, Vector, float]


@inline
def _row(m: Any, i: int, v: Vector) -> Pair:
    ah, al = dd_mul(m[i, 0], m[i, 1], v[0][0], v[0][1])
    bh, bl = dd_mul(m[i, 2], m[i, 3], v[1][0], v[1][1])
    ch, cl = dd_mul(m[i, 4], m[i, 5], v[2][0], v[2][1])
    ah, al = dd_add(ah, al, bh, bl)
    return dd_add(ah, al, ch, cl)


@inline
def _turned(m: Any, v: Vector) -> tuple[Vector, float]:
    """Return M v for a vector of pairs without error, and the bound of each coordinate."""
    bound = _FRAME_BOUND * (abs(v[0][0]) + abs(v[1][0]) + abs(v[2][0]))
    return (_row(m, 0, v), _row(m, 1, v), _row(m, 2, v)), bound


@inline
def in_frame(body: Any, segments: Any, item: int) -> Frame:
    """Return p' and e' of a segment in the frame of a body (4,) with their bounds, 0 for one without a pose."""
    is_flat = segments.shape[2] == 2
    p, q = point_of(segments, item, 0, is_flat), point_of(segments, item, 1, is_flat)
    way = (two_diff(q[0], p[0]), two_diff(q[1], p[1]), two_diff(q[2], p[2]))
    if body[3] == 0:
        return ((p[0], 0.0), (p[1], 0.0), (p[2], 0.0)), 0.0, way, 0.0
    m = array_at(body[3], (3, 7), np.float64)
    own, blur = _turned(m, (two_diff(p[0], m[0, 6]), two_diff(p[1], m[1, 6]), two_diff(p[2], m[2, 6])))
    along, along_blur = _turned(m, way)
    return own, blur, along, along_blur


@inline
def _plane_at(row: Any, v: Vector, offset: float, blur: float) -> tuple[float, float, float]:
    """Return n . v + offset as a double-double, and its bound; blur: of each coordinate of v."""
    ah, al = dd_scale(v[0][0], v[0][1], row[0])
    bh, bl = dd_scale(v[1][0], v[1][1], row[1])
    ch, cl = dd_scale(v[2][0], v[2][1], row[2])
    size = abs(ah) + abs(bh) + abs(ch) + abs(offset)
    ah, al = dd_add(ah, al, bh, bl)
    ah, al = dd_add(ah, al, ch, cl)
    ah, al = dd_add(ah, al, offset, 0.0)
    return ah, al, 16.0 * U2 * size + 1.01 * blur * (abs(row[0]) + abs(row[1]) + abs(row[2]))


@inline
def _sign(value: float, bound: float) -> int:
    if value > bound:
        return 1
    return -1 if value < -bound else UNDECIDED


@inline
def slack_of(s: float, s_bound: float, d: float, d_bound: float) -> float:
    """Return the relative error that s / d has from its parts; infinite where their sizes have no range for it."""
    if not (2.0**-400 <= abs(d) <= 2.0**400 and abs(s) >= 2.0**-500):
        return np.inf
    return 1.01 * (s_bound / abs(s) + d_bound / abs(d))


@inline
def put_point(point: Any, segments: Any, item: int, t: float, low: float, slack: float) -> bool:
    """Write the point at t, known within slack of itself; tell whether that and t are surely nearest."""
    bound = (T_BOUND + slack) * abs(t)
    sure = (slack < 0.001) & (t + (low - bound) == t + (low + bound))
    for k in range(segments.shape[2]):
        x, is_x = point_at(segments[item, 0, k], segments[item, 1, k], t, low, slack)
        point[k] = x + 0.0
        sure &= is_x
    return sure


@inline
def put_piece(out: Pieces, row: int, source: int, segments: Any, item: int, first: Any, last: Any) -> bool:
    """Write a piece between two ends (parameter, its low part, slack, face; face -1 for the segment's own)."""
    sure = True
    out.source[row] = source
    for end in range(2):
        t, low, slack, face = first if end == 0 else last
        if face < 0:
            put_own_end(out, row, end, segments, item, segments.shape[2] == 2)
        else:
            sure &= put_point(out.ends[end, row], segments, item, t, low, slack)
            out.t[row, end], out.faces[row, end] = t + low, face
    return sure


@inline
def _value(row: Any, v: Vector, offset: float, blur: float) -> tuple[float, float]:
    """Return n . v + offset by doubles, and its bound: three sums, a product and the tail of v lose 5 u of the size."""
    x, y, z = row[0] * v[0][0], row[1] * v[1][0], row[2] * v[2][0]
    size = abs(x) + abs(y) + abs(z) + abs(offset)
    return x + y + z + offset, 2.0**-50 * size + 1.01 * blur * (abs(row[0]) + abs(row[1]) + abs(row[2]))


@inline
def _planes_cut(rows: Any, frame: Frame) -> tuple[int, int, int]:
    """Return 1, -1 or UNDECIDED for a segment that surely meets all half-spaces, or not, and where it does the planes
    that cut it first and last, -1 for none; by doubles.

    Each parameter t = -s / d is known within r = 1.01 (s' + t d') / |d| + 2^-51 t for bounds s' and d' < |d| / 1000.
    """
    own, blur, along, along_blur = frame
    enters, leaves, first, last, is_sure = (-1.0, -1.0), (2.0, 2.0), -1, -1, True
    for face in range(rows.shape[0]):
        s, s_bound = _value(rows[face], own, rows[face, 3], blur)
        d, d_bound = _value(rows[face], along, 0.0, along_blur)
        of_p = _sign(s, s_bound)
        of_q = _sign(s + d, 1.01 * (s_bound + d_bound) + 2.0**-51 * (abs(s) + abs(d)))
        if of_p == -1 and of_q == -1:
            return -1, -1, -1
        if of_p == 1 and of_q == 1:
            continue
        if of_p == UNDECIDED or of_q == UNDECIDED or d_bound > 2.0**-10 * abs(d):
            is_sure = False
            continue
        t = -s / d
        r = 1.01 * (s_bound + t * d_bound) / abs(d) + 2.0**-51 * t
        if of_p < 0:
            is_sure &= t - r > enters[1] or t + r < enters[0]
            if t > enters[1]:
                first = face
            enters = (max(enters[0], t - r), max(enters[1], t + r))
        else:
            is_sure &= t + r < leaves[0] or t - r > leaves[1]
            if t < leaves[0]:
                last = face
            leaves = (min(leaves[0], t - r), min(leaves[1], t + r))
    if enters[0] > leaves[1]:
        return -1, -1, -1
    return (1 if is_sure and enters[1] < leaves[0] else UNDECIDED), first, last


@inline
def between_planes(body: Any, segments: Any, item: int, is_any: bool) -> tuple[int, Any, Any]:
    """Return 1, -1 or UNDECIDED for a segment that meets all half-spaces of a body, or not, or may, and the ends of its
    piece as `put_piece` takes them, unless `is_any`."""
    frame, rows = in_frame(body, segments, item), array_at(body[2], (body[1], 4), np.float64)
    own, blur, along, along_blur = frame
    meets, entered, left = _planes_cut(rows, frame)
    first, last = _OWN_START, _OWN_END
    for face in (entered, left):
        if meets == 1 and face >= 0 and not is_any:
            s, s_low, s_bound = _plane_at(rows[face], own, rows[face, 3], blur)
            d, d_low, d_bound = _plane_at(rows[face], along, 0.0, along_blur)
            t, t_low = dd_div(-s, -s_low, d, d_low)
            if face == entered:
                first = (t, t_low, slack_of(s, s_bound, d, d_bound), face)
            else:
                last = (t, t_low, slack_of(s, s_bound, d, d_bound), face)
    return meets, first, last


@inline
def _dot(a: Vector, b: Vector) -> Pair:
    xh, xl = dd_mul(a[0][0], a[0][1], b[0][0], b[0][1])
    yh, yl = dd_mul(a[1][0], a[1][1], b[1][0], b[1][1])
    zh, zl = dd_mul(a[2][0], a[2][1], b[2][0], b[2][1])
    xh, xl = dd_add(xh, xl, yh, yl)
    return dd_add(xh, xl, zh, zl)


@inline
def in_ball(body: Any, segments: Any, item: int, is_any: bool) -> tuple[int, Any, Any]:
    """Return what `between_planes` does for a ball: d = q - p, and f = p - c off by the rounding of the image c."""
    c, is_flat = array_at(body[2], (7,), np.float64), segments.shape[2] == 2
    p, q = point_of(segments, item, 0, is_flat), point_of(segments, item, 1, is_flat)
    along = (two_diff(q[0], p[0]), two_diff(q[1], p[1]), two_diff(q[2], p[2]))
    own = (dd_sub(p[0], 0.0, c[0], c[1]), dd_sub(p[1], 0.0, c[2], c[3]), dd_sub(p[2], 0.0, c[4], c[5]))
    blur = 8.0 * U2 * max(abs(p[0]), abs(p[1]), abs(p[2]), abs(c[0]), abs(c[2]), abs(c[4]))
    meets, of_p, of_q = _meets_ball(along, own, blur, c[6])
    if meets != 1 or is_any or (of_p == -1 and of_q == -1):
        return meets, _OWN_START, _OWN_END
    if of_p == UNDECIDED or of_q == UNDECIDED:
        return UNDECIDED, _OWN_START, _OWN_END
    return _between_roots(along, own, blur, c[6], of_p, of_q)


@inline
def _meets_ball(d: Vector, f: Vector, blur: float, radius: float) -> tuple[int, int, int]:
    """Return whether a segment meets a ball, as `in_ball` does, and whether either end surely lies within (-1) or
    without (1), by the heads of the pairs: sums of three products lose 6 u of their size."""
    d_size, f_size = abs(d[0][0]) + abs(d[1][0]) + abs(d[2][0]), abs(f[0][0]) + abs(f[1][0]) + abs(f[2][0])
    a = d[0][0] * d[0][0] + d[1][0] * d[1][0] + d[2][0] * d[2][0]
    b = d[0][0] * f[0][0] + d[1][0] * f[1][0] + d[2][0] * f[2][0]
    c = f[0][0] * f[0][0] + f[1][0] * f[1][0] + f[2][0] * f[2][0] - radius * radius
    at_q = a + 2.0 * b + c
    a_bound, b_bound = 2.0**-50 * a, (2.0**-50 * f_size + 1.01 * blur) * d_size
    c_bound = 2.0**-50 * (f_size * f_size + radius * radius) + 2.02 * blur * (f_size + 2.0 * blur)
    q_bound = 1.01 * (a_bound + 2.0 * b_bound + c_bound) + 2.0**-50 * (a + 2.0 * abs(b) + abs(c))
    d_bound = 1.01 * ((2.0 * abs(b) + b_bound) * b_bound + a * c_bound + (abs(c) + c_bound) * a_bound)
    d_bound += 2.0**-50 * (b * b + a * abs(c))
    gap, past, of_p, of_q = (
        b * b - a * c,
        a_bound + b_bound + 2.0**-50 * (a + abs(b)),
        _sign(c, c_bound),
        _sign(at_q, q_bound),
    )
    if of_p == -1 or of_q == -1 or (gap > d_bound and b < -b_bound and a + b > past):
        return 1, of_p, of_q
    is_out = of_p == 1 and of_q == 1 and (b > b_bound or a + b < -past or gap < -d_bound)
    return (-1 if is_out else UNDECIDED), of_p, of_q


@inline
def _between_roots(d: Vector, f: Vector, blur: float, radius: float, of_p: int, of_q: int) -> tuple[int, Any, Any]:
    """Return what `in_ball` does of a segment that meets the ball, its ends without it where of_p and of_q are 1:
    a t^2 + 2 b t + c <= 0 with a = d . d, b = d . f, c = f . f - r^2, f known to `blur` a coordinate; sums of squares
    and products carry 12 u^2 of their size."""
    first, last = _OWN_START, _OWN_END
    d_size, f_size = abs(d[0][0]) + abs(d[1][0]) + abs(d[2][0]), abs(f[0][0]) + abs(f[1][0]) + abs(f[2][0])
    ah, al = _dot(d, d)
    bh, bl = _dot(d, f)
    ch, cl = _dot(f, f)
    rh, rl = two_prod(radius, radius)
    a_bound, b_bound = 16.0 * U2 * ah, 16.0 * U2 * d_size * f_size + 1.01 * blur * d_size
    c_bound = 16.0 * U2 * (f_size * f_size + rh) + 2.02 * blur * (f_size + 2.0 * blur)
    ch, cl = dd_sub(ch, cl, rh, rl)
    bbh, bbl = dd_mul(bh, bl, bh, bl)
    ach, acl = dd_mul(ah, al, ch, cl)
    dh, dl = dd_sub(bbh, bbl, ach, acl)
    d_bound = 1.01 * (2.0 * abs(bh) * b_bound + ah * c_bound + abs(ch) * a_bound + b_bound * b_bound)
    d_bound += 32.0 * U2 * (bbh + abs(ach))
    if not dh > 1024.0 * d_bound:
        return UNDECIDED, first, last
    sh = math.sqrt(dh)
    sl = (fma(-sh, sh, dh) + dl) / (2.0 * sh)
    s_bound = d_bound / (1.9 * sh) + 16.0 * U2 * sh
    for end in range(2):
        if (of_p if end == 0 else of_q) < 0:
            continue
        way = -1.0 if end == 0 else 1.0
        nh, nl = dd_add(-bh, -bl, way * sh, way * sl)
        slack = slack_of(nh, b_bound + s_bound + 4.0 * U2 * (abs(bh) + sh), ah, a_bound)
        t, t_low = dd_div(nh, nl, ah, al)
        if end == 0:
            first = (t, t_low, slack, 0)
        else:
            last = (t, t_low, slack, 0)
    return 1, first, last
