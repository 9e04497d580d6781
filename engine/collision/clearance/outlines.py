"""How far apart two small bodies of the plane are, polygons, triangles, boxes and balls: every vertex and every edge.

Outlines that do not cross are nearest at a vertex of one and an edge of the other, or its end. Doubles leave the pairs
that may be it (`_look`); double-doubles measure those, and say whether the distance is sure, and of one pair.

**Bound.** Coordinates as given are doubles, their differences double-doubles without error; placed ones are off by
`error`, and a distance by no more than twice that of both bodies. The height of a vertex over an edge u is a cross
product over |u|: its two largest products cancel without loss, all others are below 2^-50 of those, so that it is off
by 2^-98 of itself and 2^-148 of the longest vector. Over an edge along an axis it is a difference, exact, and equal
ones are a tie. The sign of a scalar product is known where its products are exact: a sum is off by a part of itself.
A foot moves by what moves the corners, times the distance of the vertex over the length of the edge.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final, NamedTuple

import numpy as np

from engine.collision.clearance.closed_forms import UNSURE
from engine.collision.clearance.wide import Wide, less, over, plus, product, root, times
from engine.collision.codes import DISJOINT, UNSETTLED
from engine.collision.planar.outline_batch import inside, relate_placed
from engine.jit import allocating, allocating_kernel, called, inline
from engine.predicates.double_double import U2, surely_rounded
from engine.predicates.error_free import two_sum
from engine.predicates.loading import as_point2
from engine.types import Point2

_SMALLEST, _LARGEST = 2.0**-140, 2.0**200
"""Of distances, and of coordinates, that the bounds hold for."""
_SHORTEST: Final = 2.0**-400
"""Of edges with a length, and of factors of exact products."""


class Wide2(NamedTuple):
    """A point or vector of the plane."""

    x: Wide
    y: Wide


Placed = namedtuple("Placed", "points following error reach")
"""An outline under a pose: points (n, 4), both coordinates rounded, then what they lack; the vertex at the end of
each edge; a bound on the error of coordinates; the largest of them, infinite beyond what bounds hold for."""

Found = namedtuple("Found", "distance bound foot error is_first first second face their_face")
"""How far a vertex is from an edge, and a bound on the error of that; the point of the edge that is nearest and the
error of that; whether the vertex is the first body's; of both bodies the vertex, or the number of vertices + the
edge, and the least edge that this lies on."""


@allocating
def _place(vertices: Any, following: Any, turn: Any, move: Any) -> Placed:
    """Return an outline under a pose; each sum of three is off by 12 u^2 of its terms.

    Where axes are turned onto axes sums are exact, and where each is a double that is what is given.
    """
    n, reach, is_given = len(vertices), 0.0, True
    points = np.empty((n, 4))
    for k in range(2):
        reach = max(reach, abs(move[k]))
        is_given = is_given and (turn[k, k] == 0.0 or abs(turn[k, k]) == 1.0) and turn[0, k] * turn[1, k] == 0.0
    for vertex in range(n):
        p = as_point2(vertices, vertex)
        reach = max(reach, abs(p.x), abs(p.y))
        for k in range(2):
            x = plus(plus(product(turn[k, 0], p.x), product(turn[k, 1], p.y)), Wide(move[k], 0.0))
            is_given = is_given and x.low == 0.0
            points[vertex, k], points[vertex, 2 + k] = x.h, x.low
    for edge in range(n):
        u = _minus(_point(points, following[edge]), _point(points, edge))
        if not (_size(u) == 0.0 or _size(u) > _SHORTEST):
            reach = np.inf
    error = 0.0 if is_given else 2.0**-100 * reach + 2.0**-1000
    return Placed(points, following, error, reach if reach < _LARGEST else np.inf)


@inline
def _point(points: Any, vertex: int) -> Wide2:
    return Wide2(Wide(points[vertex, 0], points[vertex, 2]), Wide(points[vertex, 1], points[vertex, 3]))


@inline
def _minus(a: Wide2, b: Wide2) -> Wide2:
    return Wide2(less(a.x, b.x), less(a.y, b.y))


@inline
def _size(a: Wide2) -> float:
    return max(abs(a.x.h), abs(a.y.h))


@inline
def _magnitude(a: Wide) -> Wide:
    return a if a.h > 0.0 else Wide(-a.h, -a.low)


@inline
def _is_whole(a: Wide) -> bool:
    """Tell whether a number is a double that can be a factor of an exact product."""
    return a.low == 0.0 and (a.h == 0.0 or abs(a.h) > _SHORTEST)


@inline
def _cross(u: Wide2, w: Wide2) -> Wide:
    """Return u.x w.y - u.y w.x; order: the products of the high parts first, which may cancel."""
    total = less(product(u.x.h, w.y.h), product(u.y.h, w.x.h))
    total = plus(total, less(product(u.x.h, w.y.low), product(u.y.h, w.x.low)))
    total = plus(total, less(product(u.x.low, w.y.h), product(u.y.low, w.x.h)))
    return plus(total, Wide(u.x.low * w.y.low - u.y.low * w.x.low, 0.0))


@inline
def _dot(u: Wide2, w: Wide2) -> Wide:
    return _cross(u, Wide2(Wide(-w.y.h, -w.y.low), w.x))


@inline
def _slack(u: Wide2, w: Wide2, value: float, error: float) -> float:
    """Return a bound on the error of u . w, whose rounded value is given, 0.0 where its sign is sure."""
    if error == 0.0 and _is_whole(u.x) and _is_whole(u.y) and _is_whole(w.x) and _is_whole(w.y):
        return 0.0
    reach = max(_size(u), _size(w))
    return 2.0**-98 * abs(value) + 2.0**-146 * _size(u) * reach + 16.0 * error * reach


@inline
def _along_axis(u: Wide2, w: Wide2) -> float:
    """Return a number of the sign of u . w, for u along an axis."""
    x, way = (w.y.h, u.y.h) if u.x.h == 0.0 else (w.x.h, u.x.h)
    return x if way > 0.0 else -x


@called
def _measure(p: Wide2, a: Wide2, b: Wide2, own: float, their: float) -> tuple[Wide, float, Wide2, float, int]:
    """Return the first four of `Found`, and on what of the edge a b, which has a length, the foot of p lies: its start
    0, its end 1, between 2, or not sure -1.

    own, their: errors of a coordinate, of the point and of the edge.
    """
    error = own + their
    u, w, v = _minus(b, a), _minus(p, a), _minus(b, p)
    length, reach, is_level = _size(u), max(_size(u), _size(w)), error == 0.0 and (u.x.h == 0.0 or u.y.h == 0.0)
    along, before = _dot(u, w), _dot(u, v).h
    after, slack, their_slack = along.h, _slack(u, w, along.h, error), _slack(u, v, before, error)
    if is_level:
        after, before, slack, their_slack = _along_axis(u, w), _along_axis(u, v), 0.0, 0.0
    if after <= -slack or before <= -their_slack:
        end = a if after <= -slack else b
        gap = _minus(p, end)
        if error == 0.0 and (gap.x.h == 0.0 or gap.y.h == 0.0):
            return _magnitude(gap.y if gap.x.h == 0.0 else gap.x), 0.0, end, 0.0, 0 if after <= -slack else 1
        size = root(_dot(gap, gap))
        return size, 2.0**-98 * size.h + 4.0 * error, end, their, 0 if after <= -slack else 1
    if is_level:
        foot = Wide2(a.x, p.y) if u.x.h == 0.0 else Wide2(p.x, a.y)
        return _magnitude(w.x if u.x.h == 0.0 else w.y), 0.0, foot, 0.0, 2
    where = 2 if after > slack and before > their_slack else -1
    square = _dot(u, u)
    height, share = over(_magnitude(_cross(u, w)), root(square)), over(along, square)
    bound = 2.0**-98 * height.h + 2.0**-148 * reach + 4.0 * error
    if where < 0:  # case: the foot may lie beyond an end, by this at most
        bound += 2.0 * (slack + their_slack) / length
    foot = Wide2(plus(a.x, times(share, u.x)), plus(a.y, times(share, u.y)))
    return height, bound, foot, 2.0**-98 * (_size(a) + reach) + 16.0 * error * (1.0 + reach / length), where


@inline
def _look(p: Point2, a: Point2, b: Point2) -> float:
    """Return about how far a point is from an edge, infinity for one without a length.

    Off by less than 2^-47 of all coordinates: the foot is some point of the edge, moved along it by some part of the
    distance that is 2^-50 of all coordinates over the length, or by the length: the less of both moves it away less.
    """
    ux, uy, wx, wy = b.x - a.x, b.y - a.y, p.x - a.x, p.y - a.y
    square = ux * ux + uy * uy
    if not square > 0.0:
        return np.inf
    share = min(max((ux * wx + uy * wy) / square, 0.0), 1.0)
    x, y = wx - share * ux, wy - share * uy
    return float(np.sqrt(x * x + y * y))


@inline
def _least_face(following: Any, vertex: int) -> int:
    """Return the lesser edge at a vertex."""
    for edge in range(vertex):
        if following[edge] == vertex:
            return edge
    return vertex


@inline
def _found(a: Placed, b: Placed, vertex: int, edge: int, is_first: bool) -> tuple[Found, bool]:
    """Return how far a vertex of `a` is from an edge of `b`, and whether its foot's place is sure; is_first: whether
    `a` is the first body."""
    end = b.following[edge]
    distance, bound, foot, error, where = _measure(
        _point(a.points, vertex), _point(b.points, edge), _point(b.points, end), a.error, b.error
    )
    feature, face = len(b.following) + edge, edge
    if where == 0 or where == 1:
        feature = edge if where == 0 else end
        face = _least_face(b.following, feature)
    own = _least_face(a.following, vertex)
    first, second, face, theirs = (vertex, feature, own, face) if is_first else (feature, vertex, face, own)
    return Found(distance, bound, foot, error, is_first, first, second, face, theirs), where >= 0


@allocating
def _search(a: Placed, b: Placed) -> tuple[Found, float, bool]:
    """Return the nearest pair, of equal ones that of the least faces; by how much another may be nearer; and whether
    this is surely the one."""
    n, slack, least = len(a.following), 2.0**-46 * (a.reach + b.reach), np.inf
    near = np.full(n + len(b.following), np.inf)
    for turn in range(2):
        own, other, start = (a, b, 0) if turn == 0 else (b, a, n)
        for vertex in range(len(own.following)):
            p = as_point2(own.points, vertex)
            for edge in range(len(other.following)):
                away = _look(p, as_point2(other.points, edge), as_point2(other.points, other.following[edge]))
                near[start + vertex] = min(near[start + vertex], away)
            least = min(least, near[start + vertex])
    most, none, is_sure = least + 2.0 * slack, Wide(np.inf, 0.0), True
    best, rival = Found(none, 0.0, Wide2(none, none), 0.0, True, -1, -1, 0, 0), none
    for turn in range(2):
        own, other, start = (a, b, 0) if turn == 0 else (b, a, n)
        for vertex in range(len(own.following)):
            if near[start + vertex] > most:
                continue
            p = as_point2(own.points, vertex)
            for edge in range(len(other.following)):
                c, d = as_point2(other.points, edge), as_point2(other.points, other.following[edge])
                if not _look(p, c, d) <= most:
                    continue
                found, is_placed = _found(own, other, vertex, edge, turn == 0)
                more = less(found.distance, best.distance).h if best.first >= 0 else -np.inf
                bound = 1.001 * (found.bound + best.bound)
                is_same = is_placed and is_sure and found.first == best.first and found.second == best.second
                if more > bound or is_same:
                    continue
                if not more < -bound and bound > 0.0:
                    further = best if more < 0.0 else found
                    low = less(further.distance, Wide(further.bound, 0.0))
                    rival = low if low.h < rival.h or (low.h == rival.h and low.low < rival.low) else rival
                if more < 0.0 or (bound == 0.0 and (found.face, found.their_face) < (best.face, best.their_face)):
                    best, is_sure = found, is_placed
    if rival.h == np.inf:
        return best, 0.0, is_sure
    behind = less(rival, best.distance).h
    return best, max(-behind, 0.0) + 2.0**-98 * best.distance.h, is_sure and behind > 1.001 * best.bound


@inline
def _are_apart(a: Placed, b: Placed) -> int:
    """Return 1 for bodies without a common point, 0 for others, -1 where this is not sure, or distances may not be."""
    error = 2.0**-51 * max(a.reach if a.error > 0.0 else 0.0, b.reach if b.error > 0.0 else 0.0)
    error += 2.0**-1000 if error > 0.0 else 0.0
    if not a.reach + b.reach < np.inf:
        return -1
    if len(a.following) == 1 or len(b.following) == 1:
        ball, other = (a, b) if len(a.following) == 1 else (b, a)
        where = inside(as_point2(ball.points, 0), other.points, other.following, error)
        return 1 - where if where < 2 else -1
    relation, _, _ = relate_placed(a.points, a.following, b.points, b.following, error)
    return -1 if relation == UNSETTLED else (1 if relation == DISJOINT else 0)


@inline
def _write(
    at: Wide2, error: float, errors: float, found: Found, way: Wide2, radius: float, points: Any, end: int
) -> bool:
    """Write the point at a radius from another along a way that is as long as is found; tell whether it is sure.

    error, errors: of that point, and of both ends of the way together.
    """
    is_sure = True
    for k in range(2):
        x, bound = (at.x if k == 0 else at.y), error
        if radius > 0.0:
            x = plus(x, times(over(way.x if k == 0 else way.y, found.distance), Wide(radius, 0.0)))
            bound += radius * (4.0 * errors / found.distance.h + 2.0**-98) + 2.0**-100 * abs(x.h)
        is_sure = is_sure and surely_rounded(x.h, x.low, bound) and (bound == 0.0 or abs(x.h) > 2.0**-800)
        points[end, k] = x.h + 0.0
    return is_sure


@allocating_kernel
def nearest_of_outlines(
    vertices: Any, following: Any, turn: Any, move: Any, other: Any, their_following: Any, their_turn: Any,
    their_move: Any, radii: tuple[float, float], points: Any,
) -> tuple[float, int, int]:  # fmt: skip
    """Return the distance of two placed bodies, 0.0 where they surely meet, or UNSURE; of each body the vertex, or the
    number of vertices + the edge, that the points (2, 2) written lie on; -1 where these are not sure.

    A ball is one vertex and a radius.
    """
    a, b = _place(vertices, following, turn, move), _place(other, their_following, their_turn, their_move)
    are_apart = _are_apart(a, b)
    if are_apart != 1:
        return 0.0 if are_apart == 0 else UNSURE, -1, -1
    best, nearer, is_sure = _search(a, b)
    if not _SMALLEST < best.distance.h < _LARGEST:
        return UNSURE, -1, -1
    both = Wide(*two_sum(radii[0], radii[1]))
    distance, bound = less(best.distance, both), best.bound + nearer
    bound += 4.0 * U2 * abs(distance.h) if both.h > 0.0 else 0.0
    if distance.h < -bound:
        return 0.0, -1, -1
    if not (distance.h > bound and surely_rounded(distance.h, distance.low, bound)):
        return UNSURE, -1, -1
    vertex = _point(a.points, best.first) if best.is_first else _point(b.points, best.second)
    p, q = (vertex, best.foot) if best.is_first else (best.foot, vertex)
    error, their_error = (a.error, best.error) if best.is_first else (best.error, b.error)
    errors = error + their_error
    is_sure = _write(p, error, errors, best, _minus(q, p), radii[0], points, 0) and is_sure
    is_sure = _write(q, their_error, errors, best, _minus(p, q), radii[1], points, 1) and is_sure
    return distance.h, best.first if is_sure else -1, best.second
