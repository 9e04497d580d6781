"""Clips segments to a closed ball or disc: the piece is the interval between the two roots of a quadratic, 2D and 3D.

With d = q - p and f = p - c the points of the ball satisfy

    a t^2 + 2 b t + c' <= 0,     a = d.d,  b = d.f,  c' = f.f - r^2,     t = (-b -+ sqrt(D)) / a,     D = b^2 - a c'

The signs of c' and a + 2 b + c' decide whether p and q are inside. If both are outside, the segment meets the ball if
and only if D >= 0 and the foot of the centre is between the ends: b < 0 < a + b. Doubles with a bound decide most
segments, double-doubles those that are nearly tangent or end near the sphere. The rest (tangents, ends on the sphere, a
coordinate that may round either way) goes to the exact fallback (profiles.py).

blur: error bound of each coordinate of a posed ball's centre. A sum of products of size s has the error 6 u s in
doubles and 12 u^2 s in double-doubles (u = 2^-53).

Source: the textbook's exercise, a segment on a sphere.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from engine.compiling.jit import called, inline, kernel
from engine.predicates.error_free import U2, dd_add, dd_div, dd_mul, dd_sub, fma, two_diff, two_prod
from engine.segment_clipping.on_boundary.crossing_values import Vector
from engine.segment_clipping.pieces import OWN_END, OWN_START, End, Pieces, Triple, point_of, put_piece, slack_of
from engine.types import UNDECIDED, FlagArray, FloatArray, Int32Array, IntArray

_LOST: Final = 2.0**-1060
"""Error bound of a sum of products that underflow."""

Pair = tuple[float, float]


class _Quadratic(NamedTuple):
    """The quadratic a t^2 + 2 b t + c' of a segment and a ball. a, b, gap: double-doubles, gap = b^2 - a c'; c, at_q:
    its values at t = 0 and t = 1; each with an error bound."""

    a: Pair
    b: Pair
    c: float
    at_q: float
    gap: Pair
    a_bound: float
    b_bound: float
    c_bound: float
    q_bound: float
    gap_bound: float


@inline
def difference(p: Triple, q: Triple) -> Vector:
    """Return q - p, each coordinate an exact pair of doubles (rounded difference, its rounding error)."""
    return two_diff(q[0], p[0]), two_diff(q[1], p[1]), two_diff(q[2], p[2])


@inline
def sign_of(value: float, bound: float) -> int:
    """Return the sign (1, -1) of a value known to +- bound, or UNDECIDED."""
    if value > bound:
        return 1
    return -1 if value < -bound else UNDECIDED


@inline
def _size(v: Vector) -> float:
    """Return the 1-norm of a vector of pairs (head, tail), by the heads alone."""
    return abs(v[0][0]) + abs(v[1][0]) + abs(v[2][0])


@inline
def _dot(a: Vector, b: Vector) -> Pair:
    """Return the scalar product of two vectors of pairs (head, tail), as a double-double."""
    xh, xl = dd_mul(a[0][0], a[0][1], b[0][0], b[0][1])
    yh, yl = dd_mul(a[1][0], a[1][1], b[1][0], b[1][1])
    zh, zl = dd_mul(a[2][0], a[2][1], b[2][0], b[2][1])
    xh, xl = dd_add(xh, xl, yh, yl)
    return dd_add(xh, xl, zh, zl)


@inline
def _in_doubles(d: Vector, f: Vector, blur: float, radius: float) -> _Quadratic:
    """Return the quadratic of a segment and a ball, computed in doubles from the heads of d = q - p and f = p - c.
    blur: error of each coordinate of f."""
    d_size, f_size = _size(d), _size(f)
    a = d[0][0] * d[0][0] + d[1][0] * d[1][0] + d[2][0] * d[2][0]
    b = d[0][0] * f[0][0] + d[1][0] * f[1][0] + d[2][0] * f[2][0]
    c = f[0][0] * f[0][0] + f[1][0] * f[1][0] + f[2][0] * f[2][0] - radius * radius
    a_bound, b_bound = 2.0**-50 * a + _LOST, (2.0**-50 * f_size + 1.01 * blur) * d_size + _LOST
    c_bound = 2.0**-50 * (f_size * f_size + radius * radius) + 2.02 * blur * (f_size + 2.0 * blur) + _LOST
    q_bound = 1.01 * (a_bound + 2.0 * b_bound + c_bound) + 2.0**-50 * (a + 2.0 * abs(b) + abs(c))
    gap_bound = 1.01 * ((2.0 * abs(b) + b_bound) * b_bound + a * c_bound + (abs(c) + c_bound) * a_bound)
    gap_bound += 2.0**-50 * (b * b + a * abs(c)) + _LOST
    at_q, gap = a + 2.0 * b + c, b * b - a * c
    return _Quadratic((a, 0.0), (b, 0.0), c, at_q, (gap, 0.0), a_bound, b_bound, c_bound, q_bound, gap_bound)


@inline
def _in_double_doubles(d: Vector, f: Vector, blur: float, radius: float) -> _Quadratic:
    """Return the quadratic of a segment and a ball, computed in double-doubles from d = q - p and f = p - c. blur:
    error of each coordinate of f."""
    d_size, f_size = _size(d), _size(f)
    ah, al = _dot(d, d)
    bh, bl = _dot(d, f)
    ch, cl = _dot(f, f)
    rh, rl = two_prod(radius, radius)
    a_bound, b_bound = 16.0 * U2 * ah + _LOST, (16.0 * U2 * f_size + 1.01 * blur) * d_size + _LOST
    c_bound = 16.0 * U2 * (f_size * f_size + rh) + 2.02 * blur * (f_size + 2.0 * blur) + _LOST
    ch, cl = dd_sub(ch, cl, rh, rl)
    qh, ql = dd_add(ah, al, 2.0 * bh, 2.0 * bl)
    qh, ql = dd_add(qh, ql, ch, cl)
    q_bound = 1.01 * (a_bound + 2.0 * b_bound + c_bound) + 16.0 * U2 * (ah + 2.0 * abs(bh) + abs(ch))
    bbh, bbl = dd_mul(bh, bl, bh, bl)
    ach, acl = dd_mul(ah, al, ch, cl)
    gh, gl = dd_sub(bbh, bbl, ach, acl)
    gap_bound = 1.01 * ((2.0 * abs(bh) + b_bound) * b_bound + ah * c_bound + (abs(ch) + c_bound) * a_bound)
    gap_bound += 32.0 * U2 * (bbh + abs(ach)) + _LOST
    return _Quadratic((ah, al), (bh, bl), ch, qh, (gh, gl), a_bound, b_bound, c_bound, q_bound, gap_bound)


@inline
def _meets(e: _Quadratic) -> tuple[int, int, int]:
    """Return what `meets_ball` does (meets, p outside, q outside; each 1, -1 or UNDECIDED) as far as a quadratic with
    bounds proves it."""
    a, b, gap = e.a[0], e.b[0], e.gap[0]
    past = e.a_bound + e.b_bound + 2.0**-50 * (a + abs(b))
    of_p, of_q = sign_of(e.c, e.c_bound), sign_of(e.at_q, e.q_bound)
    if of_p == -1 or of_q == -1 or (gap > e.gap_bound and b < -e.b_bound and a + b > past):
        return 1, of_p, of_q
    is_out = of_p == 1 and of_q == 1 and (b > e.b_bound or a + b < -past or gap < -e.gap_bound)
    return (-1 if is_out else UNDECIDED), of_p, of_q


@called
def _meets_in_double_doubles(d: Vector, f: Vector, blur: float, radius: float) -> tuple[int, int, int]:
    """Return what `meets_ball` does (meets, p outside, q outside; each 1, -1 or UNDECIDED), by double-doubles. d = q -
    p, f = p - c; blur: error of each coordinate of f."""
    return _meets(_in_double_doubles(d, f, blur, radius))


@inline
def meets_ball(d: Vector, f: Vector, blur: float, radius: float) -> tuple[int, int, int]:
    """Return whether a segment meets a ball, and on which side of the sphere its ends p and q lie.

    | result | 1 | -1 | UNDECIDED |
    |---|---|---|---|
    | first | meets | misses | not proven |
    | second, third (p, q) | outside | inside | not proven |

    d = q - p, f = p - c; blur: error of each coordinate of f.
    """
    meets, of_p, of_q = _meets(_in_doubles(d, f, blur, radius))
    if meets == UNDECIDED or (meets == 1 and (of_p == UNDECIDED or of_q == UNDECIDED)):
        return _meets_in_double_doubles(d, f, blur, radius)
    return meets, of_p, of_q


@inline
def between_roots(d: Vector, f: Vector, blur: float, radius: float, of_p: int, of_q: int) -> tuple[int, End, End]:
    """Return 1 and both ends (t, t_low, slack, face) of the piece of a segment in a ball; or UNDECIDED and any ends. d
    = q - p, f = p - c; blur: error of each coordinate of f. of_p, of_q: 1 if that end is outside, so that a root
    replaces it, -1 if inside."""
    first, last = OWN_START, OWN_END
    if of_p < 0 and of_q < 0:
        return 1, first, last
    e = _in_double_doubles(d, f, blur, radius)
    dh, dl = e.gap
    if not dh > 1024.0 * e.gap_bound:
        return UNDECIDED, first, last
    sh = math.sqrt(dh)
    sl = (fma(-sh, sh, dh) + dl) / (2.0 * sh)
    s_bound = e.gap_bound / (1.9 * sh) + 16.0 * U2 * sh
    for end in range(2):
        if (of_p if end == 0 else of_q) < 0:
            continue
        way = -1.0 if end == 0 else 1.0
        nh, nl = dd_add(-e.b[0], -e.b[1], way * sh, way * sl)
        slack = slack_of(nh, e.b_bound + s_bound + 4.0 * U2 * (abs(e.b[0]) + sh), e.a[0], e.a_bound)
        t, t_low = dd_div(nh, nl, e.a[0], e.a[1])
        if end == 0:
            first = (t, t_low, slack, 0)
        else:
            last = (t, t_low, slack, 0)
    return 1, first, last


@inline
def _ball_of(segments: FloatArray, item: int, center: FloatArray) -> tuple[Vector, Vector]:
    """Return d = q - p and f = p - c of segment ``item``, p q, and a ball's centre c, by coordinate exact pairs, z
    being 0 in 2D."""
    is_flat = segments.shape[2] == 2
    p, c = point_of(segments, item, 0, is_flat), (center[0], center[1], 0.0 if is_flat else center[2])
    return difference(p, point_of(segments, item, 1, is_flat)), difference(c, p)


@kernel
def decide_on_sphere(
    segments: FloatArray, center: FloatArray, radius: float, first: int, last: int, stop: FlagArray, items: Int32Array,
    planes: Int32Array, still: Int32Array, n: IntArray,
) -> None:  # fmt: skip
    """Decide which ``segments[first:last]`` ((n, 2, dim) float64) meet the closed ball; the other arguments are in the
    table of `decide_on_boxes`. planes: 0 for an end on the sphere, -1 for an end of the segment."""
    n_accepted, n_open = 0, 0
    for i in range(first, last):
        if stop[0]:
            return
        d, f = _ball_of(segments, i, center)
        meets, of_p, of_q = meets_ball(d, f, 0.0, radius)
        if meets == UNDECIDED or (meets == 1 and (of_p == UNDECIDED or of_q == UNDECIDED)):
            still[n_open] = i
            n_open += 1
        elif meets == 1:
            items[n_accepted], planes[n_accepted, 0], planes[n_accepted, 1] = i, min(of_p, 0), min(of_q, 0)
            n_accepted += 1
    n[0], n[1], n[2] = n_accepted, n_open, 0


@kernel
def fill_on_sphere(
    segments: FloatArray, center: FloatArray, radius: float, items: Int32Array, planes: Int32Array, begin: int,
    size: int, stop: FlagArray, pieces: Pieces, still: Int32Array, n: IntArray,
) -> None:  # fmt: skip
    """Write the pieces of ``segments`` ((n, 2, dim) float64) in the ball; arguments: table of `fill_on_boxes`."""
    n_open = 0
    for place in range(size):
        if stop[0]:
            return
        i, row = items[place], begin + place
        d, f = _ball_of(segments, i, center)
        state, first, last = between_roots(d, f, 0.0, radius, 1 + 2 * planes[place, 0], 1 + 2 * planes[place, 1])
        if not put_piece(pieces, row, i, segments, i, first, last) or state == UNDECIDED:
            still[n_open] = row
            n_open += 1
    n[0], n[1] = n_open, n_open
