"""Double-double values (`error_free.py` has bounds); clearance of axis-aligned boxes, balls and half-spaces.

A box is an interval on each axis, a ball one without length and a radius. On each axis two of them have a gap or share
an interval: distance = sqrt(sum(gap^2)) - radii. On shared intervals every point is as near, and `_choose_shared_ends`
selects one.

**Bound.** A coordinate of a body without rotation, translated or not, is an exact double-double; a rotated centre is
off by `error`. A difference of two is off by 3 u^2 of itself (and by `error`), exact if both are doubles; squares,
their sum and its root together are below 32 u^2 of the root. Cases that the bounds leave open go to the search.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from engine.collision.simple.form_relations import IS_BALL, RADIUS
from engine.compiling.jit import called, inline, kernel
from engine.predicates.error_free import (
    U2,
    dd_add,
    dd_div,
    dd_mul,
    dd_sub,
    fast_two_sum,
    is_correctly_rounded,
    two_prod,
    two_sum,
    workspace,
)
from engine.types import FloatArray


class Wide(NamedTuple):
    """A double-double: the number h + low, h being the double nearest to it."""

    h: float
    low: float


class Wide3(NamedTuple):
    """A point or vector of space in double-doubles."""

    x: Wide
    y: Wide
    z: Wide


@inline
def plus(a: Wide, b: Wide) -> Wide:
    """Return a + b in double-double."""
    return Wide(*dd_add(a.h, a.low, b.h, b.low))


@inline
def less(a: Wide, b: Wide) -> Wide:
    """Return a - b in double-double."""
    return Wide(*dd_sub(a.h, a.low, b.h, b.low))


@inline
def times(a: Wide, b: Wide) -> Wide:
    """Return the product a b in double-double."""
    return Wide(*dd_mul(a.h, a.low, b.h, b.low))


@inline
def over(a: Wide, b: Wide) -> Wide:
    """Return a / b in double-double; b is not zero."""
    return Wide(*dd_div(a.h, a.low, b.h, b.low))


@inline
def product(a: float, b: float) -> Wide:
    """Return the exact product of two doubles as a double-double."""
    return Wide(*two_prod(a, b))


@inline
def root(a: Wide) -> Wide:
    """Return the square root of a positive double-double, within 4 u^2 of itself plus half the relative error of a.
    With h the rounded root, sqrt(a) = h + (a - h^2) / 2h + O((u h)^2 / 2h); a - h^2 is < 2.1 u h^2, rounded twice."""
    h = np.sqrt(a.h)
    p, e = two_prod(h, h)
    return Wide(*fast_two_sum(h, ((a.h - p) - e + a.low) / (2.0 * h)))


@inline
def less3(a: Wide3, b: Wide3) -> Wide3:
    """Return the vector a - b in double-double."""
    return Wide3(less(a.x, b.x), less(a.y, b.y), less(a.z, b.z))


@called
def dot3(a: Wide3, b: Wide3) -> Wide:
    """Return the scalar product of a and b in double-double."""
    return plus(plus(times(a.x, b.x), times(a.y, b.y)), times(a.z, b.z))


@inline
def along3(a: Wide3, t: Wide, u: Wide3) -> Wide3:
    """Return the point a + t u in double-double."""
    return Wide3(plus(a.x, times(t, u.x)), plus(a.y, times(t, u.y)), plus(a.z, times(t, u.z)))


UNSURE: Final = -1.0
"""Returned in place of a distance if floats prove none."""
_LARGEST: Final = 2.0**1021
_TINY: Final = 2.0**-1060
_PLANE_TINY: Final = 2.0**-600
_EDGES: Final = (2, 1, 3, 0, 0, 0)
"""Edges of a box of the plane, in the order of its outline, as 2 axis + side (0 low, 1 high)."""
_GAPS, _ROOM = 24, 30


@inline
def _nearest_sides(up: int, down: int, lows: int, highs: int) -> tuple[int, int]:
    """Return for each of two boxes, as bits (1 low, 2 high), the sides of one axis on which it has points nearest to
    the other box. up: sign of the second's low bound less the first's high one; down: sign of the first's low bound
    less the second's high one; lows, highs: signs of the first's low (high) bound less the second's."""
    if up > 0:
        return 2, 1
    if down > 0:
        return 1, 2
    return int(lows >= 0) | int(highs <= 0) << 1, int(lows <= 0) | int(highs >= 0) << 1


@inline
def _choose_shared_ends(faces: int, theirs: int, free: int, d: int) -> tuple[int, int]:
    """Select one pair of nearest points of two boxes where many are equally near; return the faces of either box that
    they lie on, as bits.

    A face is bit 2 axis + side. faces, theirs: all with nearest points; free: bits of the axes on which the boxes share
    an interval; d: dimension. Order of choice: the smallest face of the first, then the smallest remaining of the
    second, then the end nearest to the start of the first's face."""
    is_high = False
    for turn in range(2):
        own = theirs if turn else faces
        for place in range(2 * d):
            face = place if d == 3 else _EDGES[place]
            if own >> face & 1:
                is_high = is_high if turn else (d == 2 and (face == 0 or face == 3))
                if free >> (face >> 1) & 1:
                    free &= ~(1 << (face >> 1))
                    faces, theirs = faces & ~(1 << (face ^ 1)), theirs & ~(1 << (face ^ 1))
                break
    for axis in range(d):
        if free >> axis & 1:
            left_out = ~(1 << (2 * axis + (0 if is_high else 1)))
            faces, theirs = faces & left_out, theirs & left_out
    return faces, theirs


@inline
def _sign(x: Wide, error: float) -> int:
    """Return the sign of a number known to +- error: 1, 0, -1, or 2 if that does not prove it."""
    if error > 0.0 and abs(x.h) <= error:
        return 2
    return (1 if x.h > 0.0 else 0) - (1 if x.h < 0.0 else 0)


@inline
def _wide(w: Any, at: int) -> Wide:
    """Return the double-double stored in w[at] and w[at + 1]."""
    return Wide(w[at], w[at + 1])


@inline
def _place(form: FloatArray, turn: FloatArray, move: FloatArray, w: Any, first: int) -> float:
    """Write low and high bound of each axis of a posed box, or twice a ball's centre, to w[first:] as double-doubles;
    return a bound on their error. It is infinite for a rotated box and out of range. A rotated coordinate is three
    exact products and three sums, each off by 4 u^2 of all terms."""
    d, is_turned, size = move.shape[0], False, 0.0
    for k in range(d):
        for m in range(d):
            is_turned = is_turned or turn[k, m] != (1.0 if k == m else 0.0)
    if is_turned and not form[IS_BALL] > 0.0:
        return float("inf")
    for k in range(d):
        for side in range(2):
            x = Wide(*two_sum(form[3 * side + k], move[k]))
            if is_turned:
                x, terms = Wide(move[k], 0.0), abs(move[k])
                for m in range(d):
                    x = plus(x, product(turn[k, m], form[m]))
                    terms += abs(turn[k, m] * form[m])
                size = max(size, terms)
            w[first + 4 * k + 2 * side], w[first + 4 * k + 2 * side + 1] = x.h, x.low
            if not abs(x.h) < _LARGEST:
                return float("inf")
    return 16.0 * U2 * size + _TINY if is_turned else 0.0


@inline
def gap_of_forms(
    form: FloatArray, turn: FloatArray, move: FloatArray, other: FloatArray, their_turn: FloatArray,
    their_move: FloatArray, w: Any,
) -> tuple[float, int, int, Wide, float]:  # fmt: skip
    """Return (distance, faces, their faces, rest, error) of two posed boxes or balls. form: numbers
    (`form_relations.py`), turn, move: pose of each. w (30,): receives the bounds of both bodies, then the gap on each
    axis.

    | result | meaning |
    |---|---|
    | distance | the nearest double; 0.0 if they provably meet; UNSURE |
    | faces, their faces | those with nearest points, as bits 2 axis + side |
    | rest | distance of the boxes or centres alone, as a double-double |
    | error | bound on the error of placed coordinates, both bodies together |
    """
    d, error = move.shape[0], _place(form, turn, move, w, 0) + _place(other, their_turn, their_move, w, 12)
    faces = theirs = free = n_apart = 0
    square, rest = Wide(0.0, 0.0), Wide(0.0, 0.0)
    if not error < float("inf"):
        return UNSURE, 0, 0, rest, error
    is_proven, bound = True, 0.0
    for k in range(d):
        low, high = _wide(w, 4 * k), _wide(w, 4 * k + 2)
        their_low, their_high = _wide(w, 4 * k + 12), _wide(w, 4 * k + 14)
        up, down = less(their_low, high), less(low, their_high)
        above, below = _sign(up, error), _sign(down, error)
        lows, highs = _sign(less(low, their_low), error), _sign(less(high, their_high), error)
        is_proven = is_proven and max(above, below, lows, highs) < 2
        here, there = _nearest_sides(above, below, lows, highs)
        faces, theirs = faces | here << 2 * k, theirs | there << 2 * k
        gap = up if above > 0 else (Wide(-down.h, -down.low) if below > 0 else Wide(0.0, 0.0))
        w[_GAPS + 2 * k], w[_GAPS + 2 * k + 1] = gap.h, gap.low
        if gap.h != 0.0:
            n_apart += 1
            square = plus(square, times(gap, gap))
            rest = Wide(abs(gap.h), gap.low if gap.h > 0.0 else -gap.low)
            is_exact = low.low == 0.0 and high.low == 0.0 and their_low.low == 0.0 and their_high.low == 0.0
            bound = 0.0 if is_exact else 4.0 * U2 * rest.h
        elif above < 0 and below < 0 and form[IS_BALL] + other[IS_BALL] == 0.0:
            free |= 1 << k
    faces, theirs = _choose_shared_ends(faces, theirs, free, d)
    if n_apart > 1:
        is_proven = is_proven and 2.0**-900 < square.h < 2.0**1000
        rest = root(square)
        bound = 32.0 * U2 * rest.h
    radii = Wide(*two_sum(form[RADIUS], other[RADIUS]))
    distance = less(rest, radii)
    bound += 2.0 * error + (4.0 * U2 * abs(distance.h) if radii.h > 0.0 else 0.0)
    if not is_proven:
        return UNSURE, faces, theirs, rest, error
    if distance.h < -bound or (distance.h == 0.0 and bound == 0.0):
        return 0.0, faces, theirs, rest, error
    is_proven = distance.h > bound and is_correctly_rounded(distance.h, distance.low, bound)
    return distance.h if is_proven else UNSURE, faces, theirs, rest, error


@kernel
def nearest_of_forms(
    form: FloatArray, turn: FloatArray, move: FloatArray, other: FloatArray, their_turn: FloatArray,
    their_move: FloatArray, points: FloatArray,
) -> tuple[float, int, int]:  # fmt: skip
    """Return (distance, faces, their faces) of two posed boxes or balls (`gap_of_forms`), and fill points (2, d) with
    their nearest points; valid unless the first faces are -1: not proven, or the bodies meet. form: numbers of the
    first body (`form_relations.py`); turn, move: rotation and translation of its pose; other, their_turn, their_move:
    those of the second. faces: bit 2 axis + side for each face of the box with the nearest point."""
    w = workspace(_ROOM)
    distance, faces, theirs, size, error = gap_of_forms(form, turn, move, other, their_turn, their_move, w)
    if not distance > 0.0:
        return distance, -1, -1
    d, is_proven, n_apart = move.shape[0], True, 0
    for k in range(d):
        n_apart += w[_GAPS + 2 * k] != 0.0
    for end in range(2):
        radius, own, across = (form[RADIUS], faces, theirs) if end == 0 else (other[RADIUS], theirs, faces)
        for k in range(d):
            is_own = own >> 2 * k & 3 != 0  # else the other's bound is within
            face, first = (own if is_own else across) >> 2 * k, (12 * end if is_own else 12 - 12 * end)
            at = first + 4 * k + (0 if face & 1 else 2)
            x, gap, bound = _wide(w, at), _wide(w, _GAPS + 2 * k), error
            if radius > 0.0 and gap.h != 0.0:
                share = over(gap, size)
                is_whole = n_apart == 1 and abs(share.h) == 1.0 and share.low == 0.0  # else the step is shorter
                step = times(share, Wide(radius if end == 0 else -radius, 0.0))
                bound = 0.0 if is_whole and x.low == 0.0 and error == 0.0 else 4.0 * U2
                x = plus(x, step)
                bound *= abs(x.h)
                if not is_whole:
                    bound += 96.0 * U2 * abs(step.h) + _TINY * (1.0 + radius + radius / size.h)
                bound += error * (1.0 + 4.0 * radius / size.h)
            points[end, k] = x.h + 0.0
            is_proven = is_proven and is_correctly_rounded(x.h, x.low, bound)
    return distance, faces if is_proven else -1, theirs


@inline
def is_power_of_two(x: float) -> bool:
    """Return whether |x| is a power of two."""
    return math.frexp(abs(x))[0] == 0.5


@inline
def value_on_axis(d: float, n: float, x: float, y: float) -> tuple[Wide, bool]:
    """Return d + n x + n y, and whether it is exact. n: a power of two, within 2^-200 .. 2^200 in magnitude."""
    b, c = n * x, n * y
    total, lost = two_sum(d, b)
    total, lost_too = two_sum(total, c)
    rest, lost = two_sum(lost, lost_too)
    return Wide(*two_sum(total, rest)), lost == 0.0 and b / n == x and c / n == y  # else products underflow


@inline
def gap_of_values(value: Wide, square: Wide, slack: float, radius: float) -> float:
    """Return the distance of a body from a half-space with the normal n, correctly rounded, 0.0 if they provably meet,
    or UNSURE. value: of n . x + d at the body's extreme point, off by `slack`, where 0.0 means a normal with one
    component, a power of two; square: n . n; radius: of a ball about that point. Eight operations of at most 16 u^2
    each are below 128 u^2."""
    if not (2.0**-400 < square.h < 2.0**400 and slack < 2.0**500):
        return UNSURE
    norm = root(square)
    if slack == 0.0 and 0.0 < -value.h < 2.0**-500:
        return UNSURE  # case: quotients underflow
    if slack == 0.0 and radius == 0.0:
        return max(-value.h / norm.h, 0.0) + 0.0
    away = over(value, norm)
    distance = less(Wide(-away.h, -away.low), Wide(radius, 0.0))
    bound = 2.0 * slack / norm.h + 128.0 * U2 * abs(away.h) + 4.0 * U2 * abs(distance.h)
    if distance.h < -bound:
        return 0.0
    if not (distance.h > bound and is_correctly_rounded(distance.h, distance.low, bound)):
        return UNSURE
    return distance.h


@kernel
def nearest_of_plane(row: Any, form: Any, turn: Any, move: Any, points: Any) -> tuple[float, int, int]:
    """Return (distance, status, faces) of a posed box or ball and the half-space row (d + 1,): n, d with n . x + d >=
    0; fill points (2, d), the foot on the plane first.

    Distance: 0.0 if they meet, or UNSURE. Status: 0, or -1 if the points are not proven. Faces: of the body's nearest
    point, as bits 2 axis + side, the low ones of several. With v = dot(n, x) + d at the body's extreme point, off by
    `slack`, distance = -v / |n| - radius (`gap_of_values`), and foot = x - v n / dot(n, n)."""
    w, d = workspace(_ROOM), move.shape[0]
    error = _place(form, turn, move, w, 0)
    value, square, terms, size, faces = Wide(row[d], 0.0), Wide(0.0, 0.0), abs(row[d]), 0.0, 0
    axis, n_axes = 0, 0
    for k in range(d):
        side = 1 if row[k] > 0.0 else 0
        if row[k] != 0.0:
            axis, n_axes = k, n_axes + 1
        x = _wide(w, 4 * k + 2 * side)
        faces |= 1 << (2 * k + side)
        value, square = plus(value, times(product(row[k], 1.0), x)), plus(square, product(row[k], row[k]))
        terms, size = terms + abs(row[k] * x.h), size + abs(row[k])
    slack = 32.0 * U2 * terms + size * error + _PLANE_TINY
    if n_axes == 1 and error == 0.0 and is_power_of_two(row[axis]):
        x = _wide(w, 4 * axis + (2 if row[axis] > 0.0 else 0))
        total, is_exact = value_on_axis(row[d], row[axis], x.h, x.low)
        if is_exact:
            value, slack = total, 0.0
    distance = UNSURE
    if terms < 2.0**500 and error < float("inf"):
        distance = gap_of_values(value, square, slack, form[RADIUS])
    if not distance > 0.0:
        return distance, -1, faces
    norm = root(square)
    is_proven = True
    for k in range(d):
        x, n = _wide(w, 4 * k + (2 if row[k] > 0.0 else 0)), Wide(row[k], 0.0)
        step, outward = over(times(n, value), square), over(times(n, Wide(form[RADIUS], 0.0)), norm)
        foot, p = less(x, step), (plus(x, outward) if row[k] != 0.0 and form[RADIUS] > 0.0 else x)
        points[0, k], points[1, k] = foot.h + 0.0, p.h + 0.0
        bound = 0.0
        if row[k] != 0.0:
            bound = 128.0 * U2 * abs(step.h) + 2.0 * slack * abs(row[k]) / square.h + 4.0 * U2 * abs(foot.h)
            is_proven = is_proven and is_correctly_rounded(foot.h, foot.low, bound + error + _PLANE_TINY)
            bound = 128.0 * U2 * abs(outward.h) + 4.0 * U2 * abs(p.h) + _PLANE_TINY if form[RADIUS] > 0.0 else 0.0
        is_proven = is_proven and is_correctly_rounded(p.h, p.low, bound + error)
    return distance, 0 if is_proven else -1, faces
