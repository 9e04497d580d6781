"""The numbers that tell how a line and a triangle, posed or not, meet: exact, in multi-digit integers (digits.py).

A pose x -> R x + t of doubles has R^-1 = C / w with the cofactors C of R, transposed, and w = det R > 0. With a line
from p along u in the world,

    P = C (p - t)    E = C u    M = R^T (u x (p - t))

its start is P / w in the frame of the body, its vector E / w, its moment M / w. All times w, of a triangle a b c there:

    ab = E . (a x b) + M . (a - b)        w times the volume of the edge a b and the line; bc and ca likewise
    v  = w a . (b x c) - P . (a x b + b x c + c x a)        t = v / (ab + bc + ca)

In the plane of a triangle, seen along an axis, E x a - M is the side of corner a, and the line passes

    a corner at    t = (w a - P) / E    on the axis along which the line is longest
    a side at      t = (w (a x b) + (b - a) x P) / (E x (b - a))

Numbers have the exponents that doubles have, so sizes do not matter, only how far they differ. If all coordinates are
multiples of one 2^k below 2^(k + 250), so that nonzero ones differ by less than a factor of 2^197, and the numbers of
the pose likewise, they have at most 10 digits of 28 bits, a x b 20, and E, M, w, a . (b x c) 28, 37, 28, 28. Then the
most digits that the shorter factors of a sum have together, `MOST_SUMMED`, are the 3 * 20 + 6 * 10 of ab; and the
longest number is a barycentric of 9 factors, 81 digits, and three more where it is compared with a double: below
`MOST_DIGITS`. Beyond that a number may be too long. Such contacts, and triangles without area, are DEGENERATE.

Source: J. Plucker's line coordinates (E, M), as in K. Shoemake, Plucker coordinate tutorial, 1998.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Final

import numpy as np

from engine.compiling.jit import allocating, called, inline
from engine.lanes.faces import AXES_BEFORE, longest_axis
from engine.predicates.digits import BITS, SLOT, leading, nearest_quotient, negate, sign_of, store_double, sum_products
from engine.predicates.error_free import dd_div
from engine.segment_clipping.hit_contacts import BACK, Line
from engine.segment_clipping.on_boundary.contacts import Bit, Place, decode_place
from engine.types import FloatArray

STEP: Final = SLOT + 8
"""Words of a number, not a power of two: numbers lie in different sets of the cache."""
(
    ONE, TURN, _SHIFT, _COFACTORS, SCALE, FROM, ALONG, _SEEN_FROM, START, WAY, SIDEWAYS, _MOMENT, CORNERS,
    CROSS, EDGES, TOTAL, VOLUME, NORMAL, SIDES, TOP, BOTTOM, TOP_TOO, BOTTOM_TOO, VALUE, _FREE, _END,
) = (
    place * STEP for place in (
        0, 1, 10, 13, 22, 23, 26, 29, 32, 35, 38, 41, 44, 53, 62, 65, 66, 67, 70, 73, 74, 75, 76, 77, 78, 81,
    )
)  # fmt: skip
"""Indices of numbers, or of the first of several: 1; R, t, C, w; p, u, p - t, P, E, u x (p - t), M; the corners of a
triangle, their cross products, ab, bc, ca, their sum, v; the normal; the sides of corners seen along an axis; a
parameter, another, a value; three for `nearest_quotient`."""
_N_TERMS, _N_STATES = 9, 7
AT_START, AT_END, WITHIN = int(Place.START), int(Place.END), int(Place.WITHIN)
IS_LONG, _IS_PLACED, _LOADED, _SEEN, AXIS, _LINE, TURNED = range(_N_STATES)
"""What `state` holds: whether a number was too long; whether the pose is stored; the triangle that is, or -1, and the
axis along which it was seen; the axis along which the line is longest; which line is stored, or -1, and how it is
turned."""
_UNSEEN: Final = -2
Exact = namedtuple("Exact", "heap terms state pose")
"""Scratch of one line: the numbers, terms of a sum (9, 3), `state`, and the pose, see `find_hits`."""


@allocating
def exact_scratch(pose: FloatArray) -> Exact:
    """Allocate the scratch of lines under a pose (`find_hits`)."""
    exact = Exact(np.empty(_END, np.int64), np.empty((_N_TERMS, 3), np.int64), np.empty(_N_STATES, np.int64), pose)
    exact.state[_IS_PLACED], exact.state[_LINE] = 0, -1
    return exact


@inline
def put_term(s: Exact, i: int, a: int, b: int, factor: int) -> None:
    s.terms[i, 0], s.terms[i, 1], s.terms[i, 2] = a, b, factor


@inline
def put_dot_terms(s: Exact, i: int, a: int, b: int, factor: int) -> None:
    """Set three terms from i on to those of factor times the dot product of two vectors."""
    for k in range(3):
        put_term(s, i + k, a + k * STEP, b + k * STEP, factor)


@called
def put_sum(s: Exact, n: int, place: int) -> None:
    """Store the sum of the first n terms as number `place`; 0 if it is too long, which `state` tells."""
    if not sum_products(s.heap, s.terms, n, place):
        s.heap[place], s.heap[place + 1], s.state[IS_LONG] = 0, 0, 1


@called
def _put_cross(s: Exact, a: int, b: int, place: int) -> None:
    for k in range(3):
        i, j = AXES_BEFORE[k] * STEP, AXES_BEFORE[k + 1] * STEP
        put_term(s, 0, a + i, b + j, 1)
        put_term(s, 1, a + j, b + i, -1)
        put_sum(s, 2, place + k * STEP)


@called
def _put_turned(s: Exact, m: int, v: int, place: int) -> None:
    """Store the product of a transposed matrix and a vector."""
    for i in range(3):
        for j in range(3):
            put_term(s, j, m + (3 * j + i) * STEP, v + j * STEP, 1)
        put_sum(s, 3, place + i * STEP)


@inline
def put_copy(s: Exact, a: int, place: int) -> None:
    put_term(s, 0, a, ONE, 1)
    put_sum(s, 1, place)


@called
def put_difference(s: Exact, a: int, b: int, place: int) -> None:
    put_term(s, 0, a, ONE, 1)
    put_term(s, 1, b, ONE, -1)
    put_sum(s, 2, place)


@called
def _set_pose(s: Exact) -> None:
    """Store the pose, its cofactors and its determinant."""
    s.heap[ONE], s.heap[ONE + 1], s.heap[ONE + 2] = 1, 0, 1
    for k in range(12):
        store_double(s.heap, TURN + k * STEP, s.pose[k // 3, k % 3])
    for k in range(3):
        i, j = AXES_BEFORE[k], AXES_BEFORE[k + 1]
        _put_cross(s, TURN + 3 * i * STEP, TURN + 3 * j * STEP, _COFACTORS + 3 * k * STEP)
    put_dot_terms(s, 0, TURN, _COFACTORS, 1)
    put_sum(s, 3, SCALE)


@called
def set_line(s: Exact, line: Line, item: int) -> None:
    """Store line number ``item``, if it is not stored already."""
    if s.state[_LINE] == item and s.state[TURNED] == line.turned:
        return
    s.state[IS_LONG], s.state[_LOADED], s.state[_LINE], s.state[TURNED] = 0, -1, item, line.turned
    if s.state[_IS_PLACED] == 0:
        _set_pose(s)
        s.state[_IS_PLACED] = 1
    way = -1 if line.turned == BACK else 1
    for k in range(3):
        place = k * STEP
        store_double(s.heap, FROM + place, line.p[k] if line.is_placed else line.start[k][0])
        store_double(s.heap, VALUE, line.q[k])
        put_term(s, 0, VALUE, ONE, way)
        put_term(s, 1, FROM + place, ONE, -way)
        put_sum(s, 1 if line.is_ray and line.turned != BACK else 2, ALONG + place)
        put_difference(s, FROM + place, _SHIFT + place, _SEEN_FROM + place)
    _put_turned(s, _COFACTORS, _SEEN_FROM, START)
    _put_turned(s, _COFACTORS, ALONG, WAY)
    _put_cross(s, ALONG, _SEEN_FROM, SIDEWAYS)
    _put_turned(s, TURN, SIDEWAYS, _MOMENT)
    longest = longest_axis((line.way[0][0], line.way[1][0], line.way[2][0]))
    # A line without blur has signs in double-doubles as well, which are perturbed along the axis of the rounded vector.
    for k in range(3 if line.blur > 0.0 else 0):
        here, best = WAY + k * STEP, WAY + longest * STEP
        put_term(s, 0, here, ONE, sign_of(s.heap, here))
        put_term(s, 1, best, ONE, -sign_of(s.heap, best))
        put_sum(s, 2, VALUE)
        longest = k if sign_of(s.heap, VALUE) > 0 else longest
    s.state[AXIS] = longest
    s.state[IS_LONG] |= s.heap[WAY + longest * STEP] == 0  # case: a point, which has no line


@called
def load_triangle(s: Exact, elements: FloatArray, element: int) -> None:
    """Store triangle ``element`` of elements (k, 3, 3), and its volumes with the line."""
    if s.state[_LOADED] == element:
        return
    s.state[_LOADED], s.state[_SEEN] = element, _UNSEEN
    for i in range(3):
        for k in range(3):
            store_double(s.heap, CORNERS + (3 * i + k) * STEP, elements[element, i, k])
    for i in range(3):
        a, b, cross = CORNERS + 3 * i * STEP, CORNERS + 3 * ((i + 1) % 3) * STEP, CROSS + 3 * i * STEP
        _put_cross(s, a, b, cross)
        put_dot_terms(s, 0, WAY, cross, 1)
        put_dot_terms(s, 3, _MOMENT, a, 1)
        put_dot_terms(s, 6, _MOMENT, b, -1)
        put_sum(s, 9, EDGES + i * STEP)
    for i in range(3):
        put_term(s, i, EDGES + i * STEP, ONE, 1)
    put_sum(s, 3, TOTAL)
    put_dot_terms(s, 0, CORNERS, CROSS + 3 * STEP, 1)
    put_sum(s, 3, VALUE)
    for k in range(3):
        for i in range(3):
            put_term(s, i, CROSS + (3 * i + k) * STEP, ONE, 1)
        put_sum(s, 3, NORMAL + k * STEP)
    put_dot_terms(s, 0, START, NORMAL, -1)
    put_term(s, 3, SCALE, VALUE, 1)
    put_sum(s, 4, VOLUME)


@called
def see_corners(s: Exact) -> int:
    """Store the sides of the corners of the triangle, seen along an axis along which it has an area; return the axis,
    -1 if the triangle has no area."""
    if s.state[_SEEN] == _UNSEEN:
        axis = 0 if s.heap[NORMAL] != 0 else 1 if s.heap[NORMAL + STEP] != 0 else 2
        s.state[_SEEN] = axis if s.heap[NORMAL + axis * STEP] != 0 else -1
        i, j = AXES_BEFORE[axis] * STEP, AXES_BEFORE[axis + 1] * STEP
        for corner in range(3):
            x = CORNERS + 3 * corner * STEP
            put_term(s, 0, WAY + i, x + j, 1)
            put_term(s, 1, WAY + j, x + i, -1)
            put_term(s, 2, _MOMENT + axis * STEP, ONE, -1)
            put_sum(s, 3, SIDES + corner * STEP)
    return int(s.state[_SEEN])


@called
def put_pass(s: Exact, place: int, axis: int) -> None:
    """Store the parameter at which the line passes a corner (0 .. 2) or a side (3 .. 5) of a triangle of its plane, its
    denominator positive. axis: of `see_corners`."""
    if place < 3:
        k = s.state[AXIS] * STEP
        put_term(s, 0, SCALE, CORNERS + 3 * place * STEP + k, 1)
        put_term(s, 1, START + k, ONE, -1)
        put_sum(s, 2, TOP)
        put_copy(s, WAY + k, BOTTOM)
    else:
        first, i, j = place - 3, AXES_BEFORE[axis] * STEP, AXES_BEFORE[axis + 1] * STEP
        a, b = CORNERS + 3 * first * STEP, CORNERS + 3 * ((first + 1) % 3) * STEP
        put_term(s, 0, SCALE, CROSS + (3 * first + axis) * STEP, 1)
        put_term(s, 1, b + i, START + j, 1)
        put_term(s, 2, a + i, START + j, -1)
        put_term(s, 3, b + j, START + i, -1)
        put_term(s, 4, a + j, START + i, 1)
        put_sum(s, 5, TOP)
        put_difference(s, SIDES + ((first + 1) % 3) * STEP, SIDES + first * STEP, BOTTOM)
    _make_positive(s)


@inline
def _make_positive(s: Exact) -> None:
    """Make the denominator of a parameter positive."""
    if sign_of(s.heap, BOTTOM) < 0:
        negate(s.heap, TOP)
        negate(s.heap, BOTTOM)


@called
def put_parameter(s: Exact, elements: FloatArray, code: int, element: int) -> int:
    """Store the parameter of a contact with a triangle; return the axis along which a triangle in the plane of the line
    was seen, -1 for any other. code: of the contact."""
    place, axis = decode_place(code), -1
    load_triangle(s, elements, element)
    if Place.START <= place <= Place.END:
        s.heap[TOP], s.heap[BOTTOM] = 0, 0
        put_copy(s, ONE, BOTTOM)
        if place == Place.END:
            put_sum(s, 1, TOP)
        return see_corners(s) if code & Bit.ALONG != 0 else axis
    if code & Bit.ALONG != 0:
        axis = see_corners(s)
        put_pass(s, place, axis)
        return axis
    put_copy(s, VOLUME, TOP)
    put_copy(s, TOTAL, BOTTOM)
    _make_positive(s)
    return axis


@called
def quotient_of(s: Exact, x: int, w: int) -> tuple[float, float, bool]:
    """Return x / w of two numbers, the second not zero, as the nearest double and what is beyond it, within 2^-90 of
    the quotient; and whether the double is proven."""
    if sign_of(s.heap, w) < 0:
        negate(s.heap, w)
        negate(s.heap, x)
    near, is_sure = nearest_quotient(s.heap, s.terms, x, w, ONE, _FREE)
    if s.heap[x] == 0 or not is_sure:
        return 0.0, 0.0, is_sure
    xh, xl, first = leading(s.heap, x)
    wh, wl, second = leading(s.heap, w)
    h, low = dd_div(xh, xl, wh, wl)
    exponent = int(BITS * (first - second))
    return near, (math.ldexp(h, exponent) - near) + math.ldexp(low, exponent), True
