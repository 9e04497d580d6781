"""The common part of a line and a triangle of its plane, compiled.

Seen from the start p along an axis along which the triangle has an area, with A = a - p and so on, and e the vector of
the line, products of two vectors are numbers, computed as expansions, of which two doubles are taken.

    a corner on the line is at   t = A_k / e_k,                  k the axis along which the line is longest
    a side that it crosses at    t = A x B / e x (b - a),        weights of its ends: e x B, -e x A over e x (b - a)
    p, if it is in the triangle  t = 0,                          weights: B x C, C x A, A x B over (b - a) x (c - a)

The line enters a triangle that turns left where the boundary passes from the left of the line to the right.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

from engine.compiling.jit import called, inline
from engine.lanes.faces import AXES_BEFORE, longest_axis
from engine.predicates.error_free import U2, dd_div, fast_two_sum, workspace
from engine.predicates.expansion import compress
from engine.predicates.parameters import minor as exact_minor
from engine.segment_clipping.hit_contacts import Line, _away, _negative, _quotient, _sign
from engine.segment_clipping.on_boundary.contacts import Bit, Kind, Place, code_of
from engine.segment_clipping.on_boundary.crossing_values import Vector
from engine.segment_clipping.on_boundary.triangle_contacts import flat_axis
from engine.segment_clipping.pieces import Triple
from engine.types import Point3

Stretch = namedtuple("Stretch", "code t low first second third end_code t_end low_end")
"""The common part: the code of the contact where it begins, Kind.APART for none, DEGENERATE for an open one; its
parameter, and barycentrics there; the code of the contact where it ends, 0 if it is a point, and its parameter."""
_NONE, _OPEN = (Stretch(int(kind), 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0.0, 0.0) for kind in (Kind.APART, Kind.DEGENERATE))
_START, _END = int(Place.START), int(Place.END)
_RELATIVE: Final = 8.0 * U2
_Pass = namedtuple("_Pass", "place top bottom")
"""Where the line passes the boundary: at a corner (0 .. 2) or a side (3 .. 5), at t = top / bottom."""


@inline
def _at(x: Point3) -> Vector:
    return (x.x, 0.0), (x.y, 0.0), (x.z, 0.0)


@called
def _product(u: Any, v: Any, i: int, j: int) -> Triple:
    """Return the product of two vectors of exact pairs, seen on axes i and j, as (h, low, error bound); the bound is 0
    if two doubles hold it."""
    m = workspace(16)
    n = compress(m, exact_minor(m, u[i][0], u[i][1], u[j][0], u[j][1], v[i][0], v[i][1], v[j][0], v[j][1]))
    if n == 0:
        return 0.0, 0.0, 0.0
    h, low = fast_two_sum(m[n - 1], m[n - 2] if n > 1 else 0.0)
    return h, low, _RELATIVE * abs(h) if n > 2 else 0.0


@inline
def _ratio(top: Triple, bottom: Triple) -> tuple[float, float, bool]:
    """Return top / bottom as a double-double, and whether its leading double is the proven nearest."""
    h, low = dd_div(1.0, 0.0, bottom[0], bottom[1])
    x, rest, is_sure = _quotient(top, (h, low, 1.01 * bottom[2] * abs(h) + 16.0 * U2))
    return x, rest, is_sure and 2.0**-400 <= abs(bottom[0]) <= 2.0**400


@inline
def places_of(corners: Any, signs: Any, turn: int, k: int, is_forth: bool) -> tuple[int, int]:
    """Return where a line enters and leaves a triangle that it meets: corners 0 .. 2 or sides 3 .. 5, the same if it
    touches a corner. signs: sides of the corners; is_forth: whether the line goes up axis k."""
    enter, leave = -1, -1
    for corner in range(3):
        before, at, after = signs[(corner + 2) % 3], signs[corner], signs[(corner + 1) % 3]
        other = (corner + 1) % 3
        if at == 0 and after == 0:  # case: along an edge
            return (corner, other) if (corners[other][k] > corners[corner][k]) == is_forth else (other, corner)
        if at == 0 and before == after:  # case: touched in a corner
            return corner, corner
        if at * after < 0 or (at == 0 and before * after < 0):
            place = 3 + corner if at != 0 else corner
            enter, leave = (place, leave) if (after < 0) == (turn > 0) else (enter, place)
    return enter, leave


@inline
def _pass_at(place: int, line: Line, k: int, i: int, j: int, corners: Any) -> _Pass:
    """Return where the line passes a corner or a side of a triangle."""
    way = line.way
    if place < 3:
        seen = _away(corners[place], line.start)[k]
        return _Pass(place, (seen[0], seen[1], 0.0), (way[k][0], way[k][1], 0.0))
    a, b = corners[place - 3], corners[(place - 2) % 3]
    top = _product(_away(a, line.start), _away(b, line.start), i, j)
    return _Pass(place, top, _product(way, _away(b, _at(a)), i, j))


@inline
def _beyond_end(at: _Pass, line: Line, k: int, i: int, j: int, corners: Any) -> int:
    """Return the sign of t - 1 for a segment: seen from its far end q the numerator is another, the rest the same."""
    if at.place < 3:
        x, y = corners[at.place][k], line.q[k]
        return (1 if x > y else -1 if x < y else 0) * _sign(at.bottom)
    q = _at(line.q)
    return _sign(_product(_away(corners[at.place - 3], q), _away(corners[(at.place - 2) % 3], q), i, j)) * _sign(
        at.bottom
    )


@inline
def _weights(at: _Pass, begin: int, line: Line, i: int, j: int, corners: Any) -> Any:
    """Return (barycentrics, whether they are proven) of where the line passes the boundary or, if it begins in the
    triangle, of its start."""
    a, b, c = corners
    if begin == _START:
        u, v, w = _away(a, line.start), _away(b, line.start), _away(c, line.start)
        area = _product(_away(b, _at(a)), _away(c, _at(a)), i, j)
        x, y, z = (
            _ratio(_product(v, w, i, j), area),
            _ratio(_product(w, u, i, j), area),
            _ratio(_product(u, v, i, j), area),
        )
        return (x[0], y[0], z[0]), x[2] & y[2] & z[2]
    if at.place < 3:
        return (1.0 if at.place == 0 else 0.0, 1.0 if at.place == 1 else 0.0, 1.0 if at.place == 2 else 0.0), True
    first = at.place - 3
    x = _ratio(_product(line.way, _away(corners[(first + 1) % 3], line.start), i, j), at.bottom)
    y = _ratio(_negative(_product(line.way, _away(corners[first], line.start), i, j)), at.bottom)
    if first == 0:
        return (x[0], y[0], 0.0), x[2] & y[2]
    return ((0.0, x[0], y[0]) if first == 1 else (y[0], 0.0, x[0])), x[2] & y[2]


@called
def flat_stretch(line: Line, a: Point3, b: Point3, c: Point3) -> Stretch:
    """Return the common part of a line and a triangle of its plane; both of safe sizes, the line without a pose. It is
    open if the triangle has no area, or a number is not proven to be the nearest double."""
    axis, turn = flat_axis(a, b, c)
    if abs(turn) != 1:
        return _OPEN
    i, j, way, corners = AXES_BEFORE[axis], AXES_BEFORE[axis + 1], line.way, (a, b, c)
    k = longest_axis((way[0][0], way[1][0], way[2][0]))
    signs = (
        _sign(_product(way, _away(a, line.start), i, j)), _sign(_product(way, _away(b, line.start), i, j)),
        _sign(_product(way, _away(c, line.start), i, j)),
    )  # fmt: skip
    if min(signs) > 0 or max(signs) < 0:
        return _NONE
    enter, leave = places_of(corners, signs, turn, k, way[k][0] > 0.0)
    first, last = _pass_at(enter, line, k, i, j, corners), _pass_at(leave, line, k, i, j, corners)
    of_first, of_last = _sign(first.top) * _sign(first.bottom), _sign(last.top) * _sign(last.bottom)
    first_beyond = last_beyond = -1
    if not line.is_ray:
        first_beyond = _beyond_end(first, line, k, i, j, corners)
        last_beyond = _beyond_end(last, line, k, i, j, corners)
    if of_last < 0 or first_beyond > 0:
        return _NONE
    t, low, is_sure = _ratio(first.top, first.bottom)
    t_end, low_end, is_last_sure = _ratio(last.top, last.bottom)
    begin = enter
    if of_first <= 0:
        begin, t, low, is_sure = _START, 0.0, 0.0, True
    elif first_beyond == 0:
        begin, t, low, is_sure = _END, 1.0, 0.0, True
    if last_beyond >= 0:
        leave, t_end, low_end, is_last_sure = _END, 1.0, 0.0, True
    weights, are_sure = _weights(first, begin, line, i, j, corners)
    is_point = enter == leave or begin == _END or of_last == 0
    if not (is_sure and are_sure and (is_last_sure or is_point)):
        return _OPEN
    code, end_code = code_of(begin, False) | Bit.ALONG, 0
    if not is_point:
        code, end_code = code | Bit.BEGINS, code_of(leave, False) | Bit.ALONG | Bit.CEASES
    return Stretch(code, t, low, weights[0], weights[1], weights[2], end_code, t_end, low_end)
