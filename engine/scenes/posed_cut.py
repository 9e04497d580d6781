"""Segments on placed balls and convex bodies, compiled: parameters are those of the segment in the body's own frame.

A pose x -> R x + t with det R > 0 keeps parameters and all orientation signs. With M = R^-1 as double-doubles and the
exact differences p - t and q - p,

    p' = M (p - t),    e' = M (q - p),    a plane's values s(p') and s(p') + n . e' at the ends

in double-doubles with running bounds (u = 2^-53): an entry of M carries u^2, its product 5 u^2, two sums 3 u^2 each, so
a coordinate of p' is within 32 u^2 sum |p - t|, and one of e' likewise; entries of M are below 1.01. A body without a
pose is one under the identity, whose p' and e' carry no error. A ball stays in the world, about the image of its
centre. What a bound leaves open (a sign, the order of two parameters, a coordinate that may round either way) is
UNDECIDED. Doubles decide whether a body is met, and by which planes; double-doubles seldom decide what doubles leave
open.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.compiling.jit import inline
from engine.lanes.lanes import array_at
from engine.predicates.error_free import U2, dd_add, dd_div, dd_mul, dd_scale, dd_sub, two_diff
from engine.segment_clipping.ball_cut import Pair, between_roots, difference, meets_ball, sign_of
from engine.segment_clipping.on_boundary.crossing_values import Vector
from engine.segment_clipping.pieces import OWN_END, OWN_START, End, point_of, slack_of
from engine.types import UNDECIDED, FloatArray, IntArray

_FRAME_BOUND: Final = 32.0 * U2

Frame = tuple[Vector, float, Vector, float]


@inline
def _row(m: FloatArray, i: int, v: Vector) -> Pair:
    """Return row i of M times the vector v, in double-double. m (3, 7): the frame of a pose, entries of M as
    double-doubles."""
    ah, al = dd_mul(m[i, 0], m[i, 1], v[0][0], v[0][1])
    bh, bl = dd_mul(m[i, 2], m[i, 3], v[1][0], v[1][1])
    ch, cl = dd_mul(m[i, 4], m[i, 5], v[2][0], v[2][1])
    ah, al = dd_add(ah, al, bh, bl)
    return dd_add(ah, al, ch, cl)


@inline
def _turned(m: FloatArray, v: Vector) -> tuple[Vector, float]:
    """Return M v in double-doubles, for exact v, and an error bound of each coordinate. m (3, 7): frame of a pose."""
    bound = _FRAME_BOUND * (abs(v[0][0]) + abs(v[1][0]) + abs(v[2][0]))
    return (_row(m, 0, v), _row(m, 1, v), _row(m, 2, v)), bound


@inline
def in_frame(body: IntArray, segments: FloatArray, item: int) -> Frame:
    """Return (p', bound, e', bound) of segment ``item`` in the pose frame of a body: start and vector in
    double-doubles, each with the error bound of its coordinates. body: row (4,) of a `Table`; without a pose both
    bounds are 0.0."""
    is_flat = segments.shape[2] == 2
    p, q = point_of(segments, item, 0, is_flat), point_of(segments, item, 1, is_flat)
    way = difference(p, q)
    if body[3] == 0:
        return ((p[0], 0.0), (p[1], 0.0), (p[2], 0.0)), 0.0, way, 0.0
    m = array_at(body[3], (3, 7), np.float64)
    own, blur = _turned(m, (two_diff(p[0], m[0, 6]), two_diff(p[1], m[1, 6]), two_diff(p[2], m[2, 6])))
    along, along_blur = _turned(m, way)
    return own, blur, along, along_blur


@inline
def _plane_at(row: FloatArray, v: Vector, offset: float, blur: float) -> tuple[float, float, float]:
    """Return dot(n, v) + offset as a double-double, and its error bound. row: (4,), its first three numbers are n;
    blur: error of each coordinate of v."""
    ah, al = dd_scale(v[0][0], v[0][1], row[0])
    bh, bl = dd_scale(v[1][0], v[1][1], row[1])
    ch, cl = dd_scale(v[2][0], v[2][1], row[2])
    size = abs(ah) + abs(bh) + abs(ch) + abs(offset)
    ah, al = dd_add(ah, al, bh, bl)
    ah, al = dd_add(ah, al, ch, cl)
    ah, al = dd_add(ah, al, offset, 0.0)
    return ah, al, 16.0 * U2 * size + 1.01 * blur * (abs(row[0]) + abs(row[1]) + abs(row[2]))


@inline
def _value(row: FloatArray, v: Vector, offset: float, blur: float) -> tuple[float, float]:
    """Return dot(n, v) + offset in doubles, and its error bound. row: (4,), its first three numbers are n; blur: error
    of each coordinate of v. Three sums, a product and the low part of v: ``|error| <= 5 u (|x| + |y| + |z| +
    |offset|)``, x, y, z the products.
    """
    x, y, z = row[0] * v[0][0], row[1] * v[1][0], row[2] * v[2][0]
    size = abs(x) + abs(y) + abs(z) + abs(offset)
    return x + y + z + offset, 2.0**-50 * size + 1.01 * blur * (abs(row[0]) + abs(row[1]) + abs(row[2]))


@inline
def _planes_cut(rows: FloatArray, frame: Frame) -> tuple[int, int, int]:
    """Return (meets, first, last), by doubles: 1 if a segment provably meets the intersection of the half-spaces rows
    (n, 4), -1 if not, or UNDECIDED; and the rows of the last plane entered and the first one left, -1 for none. A
    parameter t = -s / d has the error r = 1.01 (s' + t d') / |d| + 2^-51 t for bounds s' and d' < |d| / 1000."""
    own, blur, along, along_blur = frame
    enters, leaves, first, last, is_proven = (-1.0, -1.0), (2.0, 2.0), -1, -1, True
    for face in range(rows.shape[0]):
        s, s_bound = _value(rows[face], own, rows[face, 3], blur)
        d, d_bound = _value(rows[face], along, 0.0, along_blur)
        of_p = sign_of(s, s_bound)
        of_q = sign_of(s + d, 1.01 * (s_bound + d_bound) + 2.0**-51 * (abs(s) + abs(d)))
        if of_p == -1 and of_q == -1:
            return -1, -1, -1
        if of_p == 1 and of_q == 1:
            continue
        if of_p == UNDECIDED or of_q == UNDECIDED or d_bound > 2.0**-10 * abs(d):
            is_proven = False
            continue
        t = -s / d
        r = 1.01 * (s_bound + t * d_bound) / abs(d) + 2.0**-51 * t
        if of_p < 0:
            is_proven &= t - r > enters[1] or t + r < enters[0]
            if t > enters[1]:
                first = face
            enters = (max(enters[0], t - r), max(enters[1], t + r))
        else:
            is_proven &= t + r < leaves[0] or t - r > leaves[1]
            if t < leaves[0]:
                last = face
            leaves = (min(leaves[0], t - r), min(leaves[1], t + r))
    if enters[0] > leaves[1]:
        return -1, -1, -1
    return (1 if is_proven and enters[1] < leaves[0] else UNDECIDED), first, last


@inline
def between_planes(body: IntArray, segments: FloatArray, item: int, is_any: bool) -> tuple[int, End, End]:
    """Return 1 if a segment meets a body bounded by planes, -1 if not, or UNDECIDED; and both ends (t, t_low, slack,
    face) of the piece, not computed if is_any. body: row (4,) of a `Table`."""
    frame, rows = in_frame(body, segments, item), array_at(body[2], (body[1], 4), np.float64)
    own, blur, along, along_blur = frame
    meets, entered, left = _planes_cut(rows, frame)
    first, last = OWN_START, OWN_END
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
def in_ball(body: IntArray, segments: FloatArray, item: int, is_any: bool) -> tuple[int, End, End]:
    """Return 1 if a segment meets a posed ball, -1 if not, or UNDECIDED; and both ends (t, t_low, slack, face) of the
    piece, not computed if is_any. body: row (4,) of a `Table`. d = q - p, and f = p - c for the centre c, off by the
    rounding of the posed c."""
    c, is_flat = array_at(body[2], (7,), np.float64), segments.shape[2] == 2
    p, q = point_of(segments, item, 0, is_flat), point_of(segments, item, 1, is_flat)
    along = difference(p, q)
    own = (dd_sub(p[0], 0.0, c[0], c[1]), dd_sub(p[1], 0.0, c[2], c[3]), dd_sub(p[2], 0.0, c[4], c[5]))
    blur = 8.0 * U2 * max(abs(p[0]), abs(p[1]), abs(p[2]), abs(c[0]), abs(c[2]), abs(c[4]))
    meets, of_p, of_q = meets_ball(along, own, blur, c[6])
    if meets != 1 or is_any:
        return meets, OWN_START, OWN_END
    if of_p == UNDECIDED or of_q == UNDECIDED:
        return UNDECIDED, OWN_START, OWN_END
    return between_roots(along, own, blur, c[6], of_p, of_q)
