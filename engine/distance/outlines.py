"""Distance of two small planar bodies, polygons, triangles, boxes and balls, by all vertices and edges.

Outlines that do not cross are nearest at a vertex of one and an edge of the other, or its end. Doubles select
candidates; double-doubles (`vertex_edge.py`) rank them and prove the result; ties of parallel edges are proven.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrangement.simple_rings import BLOCK, n_leaves
from engine.collision.codes import DISJOINT, UNSETTLED
from engine.collision.placed_outline import NO_SIDES, PlacedOutline, inside, relate_placed, rounded, spot_of
from engine.compiling.jit import allocating_kernel, called, inline
from engine.distance.closed_forms import UNSURE, Wide, less, over, plus, times
from engine.distance.vertex_edge import LARGEST, Placed, VertexEdge, Wide2, foot_of, measure, minus2, place, point
from engine.predicates.error_free import U2, is_correctly_rounded, two_sum, workspace
from engine.predicates.orientation import smaller_nonzero
from engine.predicates.parameters import compare_differences
from engine.predicates.vectors import as_point2
from engine.types import FlagArray, FloatArray, IntArray, Point2

MOST_NEAR: Final = 64
"""Most candidate pairs of a vertex and an edge; if more are tied, the pair of bodies is left to the search."""
ROOM: Final = 4 * MOST_NEAR
_LEAST_SQUARE: Final = 2.0**-1000
"""Squared length below which an edge is replaced by its first vertex."""
_LEAST_FACTOR: Final = 2.0**-300
"""Smallest coordinate whose differences may be factors of exact products."""


class Look(NamedTuple):
    """State of a scan in doubles for pairs of vertex and edge that may be nearest (candidates). n: rows in `near`;
    least: least squared distance; most: largest squared distance of a candidate; slack: error bound of a distance."""

    n: int
    least: float
    most: float
    slack: float


class Line(NamedTuple):
    """An edge prepared for distances: start a, vector u to its end, share = 1 / |u|^2 (0.0 for an edge without
    length)."""

    a: Point2
    u: Point2
    share: float


@inline
def line_of(other: Placed, edge: int) -> Line:
    """Return edge `edge` of an outline, prepared."""
    a, b = as_point2(other.points, edge), as_point2(other.points, other.following[edge])
    u = Point2(b.x - a.x, b.y - a.y)
    square = u.x * u.x + u.y * u.y
    return Line(a, u, 1.0 / square if square > _LEAST_SQUARE else 0.0)


@inline
def way_to(p: Point2, line: Line) -> Point2:
    """Return p minus the nearest point of an edge, in doubles. error: less than 2^-47 of all coordinates. The foot is a
    point of the edge, displaced along it by 2^-50 of all coordinates over the length times the distance, or by at most
    the length; the lesser displacement is below the bound."""
    wx, wy = p.x - line.a.x, p.y - line.a.y
    share = min(max((line.u.x * wx + line.u.y * wy) * line.share, 0.0), 1.0)
    return Point2(wx - share * line.u.x, wy - share * line.u.y)


@inline
def _of_blocks(own: Placed, other: Placed, blocks: tuple[int, int], is_first: bool, near: Any, look: Look) -> Look:
    """Append to `near` the candidates among the vertices of block blocks[0] of `own` and the edges of block blocks[1]
    of `other`. Row: squared distance, whether the vertex is the first body's (is_first), the vertex, the edge. Returns
    the new state; n above MOST_NEAR: rows are missing."""
    n, least, most, slack = look
    for edge in range(BLOCK * blocks[1], min(BLOCK * (blocks[1] + 1), len(other.following))):
        line = line_of(other, edge)
        for vertex in range(BLOCK * blocks[0], min(BLOCK * (blocks[0] + 1), len(own.following))):
            way = way_to(as_point2(own.points, vertex), line)
            square = way.x * way.x + way.y * way.y
            if square < least:
                least = square
                most = (np.sqrt(square) + slack) ** 2
            if square <= most:
                if n == MOST_NEAR:
                    n = _retain_near(near, n, most)
                if n < MOST_NEAR:
                    near[4 * n], near[4 * n + 1], near[4 * n + 2], near[4 * n + 3] = square, is_first, vertex, edge
                n += 1
    return Look(n, least, most, slack)


@inline
def row_of(near: Any, row: int) -> tuple[bool, int, int]:
    """Return, of a row of `near`, whether the vertex is the first body's, the vertex, and the edge."""
    return near[4 * row + 1] != 0.0, int(near[4 * row + 2]), int(near[4 * row + 3])


@inline
def _retain_near(near: Any, n: int, most: float) -> int:
    """Move the rows of `near` with squared distance at most `most` to the front; return their number."""
    n_retained = 0
    for row in range(n):
        if near[4 * row] <= most:
            for k in range(4):
                near[4 * n_retained + k] = near[4 * row + k]
            n_retained += 1
    return n_retained


@inline
def _gap(boxes: FloatArray, block: int, others: FloatArray, other: int) -> float:
    """Return the squared distance of box `block` of boxes and box `other` of others, (n, 4) each, in rounded
    doubles."""
    x = max(boxes[block, 0] - others[other, 2], others[other, 0] - boxes[block, 2], 0.0)
    y = max(boxes[block, 1] - others[other, 3], others[other, 1] - boxes[block, 3], 0.0)
    return float(x * x + y * y)


@inline
def look_for(a: Placed, b: Placed, near: Any) -> Look:
    """Write the candidate pairs of vertex and edge to `near`, nearest blocks first; return the state of the scan, with
    n above MOST_NEAR if they do not fit."""
    least, first, second = np.inf, 0, 0
    boxes, others = a.boxes[len(a.boxes) // 2 :], b.boxes[len(b.boxes) // 2 :]
    n, m = (len(a.following) + BLOCK - 1) // BLOCK, (len(b.following) + BLOCK - 1) // BLOCK
    for i in range(n):
        for j in range(m):
            gap = _gap(boxes, i, others, j)
            if gap < least:
                least, first, second = gap, i, j
    look = Look(0, np.inf, np.inf, 2.0**-44 * (a.reach + b.reach))
    look = _of_blocks(a, b, (first, second), True, near, look)
    look = _of_blocks(b, a, (second, first), False, near, look)
    for i in range(n):
        for j in range(m):
            if _gap(boxes, i, others, j) <= look.most and (i != first or j != second):
                look = _of_blocks(a, b, (i, j), True, near, look)
                look = _of_blocks(b, a, (j, i), False, near, look)
    if look.n <= MOST_NEAR:
        look = Look(_retain_near(near, look.n, look.most), look.least, look.most, look.slack)
    return look


@inline
def _least_face(following: IntArray, vertex: int) -> int:
    """Return the lower-numbered of the two edges at a vertex; following: the end vertex of each edge."""
    for edge in range(vertex):
        if following[edge] == vertex:
            return edge
    return vertex


@inline
def _measure_pair(a: Placed, b: Placed, vertex: int, edge: int, is_first: bool) -> tuple[VertexEdge, bool]:
    """Return the distance of vertex number `vertex` of body a from edge number `edge` of b, and whether the position of
    the foot (at an end or between) is proven. is_first: whether `a` is the first body."""
    end = b.following[edge]
    p, c, d = point(a.points, vertex), point(b.points, edge), point(b.points, end)
    distance, bound, where = measure(p, c, d, a.error + b.error)
    feature, face = len(b.following) + edge, edge
    if where == 0 or where == 1:
        feature = edge if where == 0 else end
        face = _least_face(b.following, feature)
    own = _least_face(a.following, vertex)
    first, second, face, theirs = (vertex, feature, own, face) if is_first else (feature, vertex, face, own)
    return VertexEdge(distance, bound, is_first, first, second, face, theirs), where >= 0


@inline
def _offset_between(a: Placed, b: Placed, pair: VertexEdge) -> Wide2:
    """Return the vector from the second body's vertex of a pair to the first's; both features of the pair are
    vertices."""
    return minus2(point(a.points, pair.first), point(b.points, pair.second))


@called
def _are_tied(a: Placed, b: Placed, one: VertexEdge, two: VertexEdge) -> bool:
    """Return whether two pairs of vertex and edge are provably at equal distances, without rounded coordinates. Three
    cases are recognised: all four features are vertices, with equal offsets; two vertices of one body over one edge of
    the other, on a parallel of it; a vertex of either body over an edge of the other, the edges being parallel and
    ending in these vertices."""
    n, m = len(a.following), len(b.following)
    if a.error + b.error > 0.0:
        return False
    if max(one.first, two.first) < n and max(one.second, two.second) < m:
        return _offset_between(a, b, one) == _offset_between(a, b, two)
    if one.is_first == two.is_first:
        own, other, p, q = (a, b, one.first, two.first) if one.is_first else (b, a, one.second, two.second)
        edge, same = (one.second - m, two.second - m) if one.is_first else (one.first - n, two.first - n)
        if edge != same or edge < 0:
            return False
    else:
        own, other, of_first, of_second = a, b, (one if one.is_first else two), (two if one.is_first else one)
        p, edge = of_second.first - n, of_first.second - m
        if p < 0 or edge < 0 or of_second.second not in (edge, b.following[edge]):
            return False
        q = a.following[p]
        if of_first.first != p and of_first.first != q:
            return False
    u, v = as_point2(own.points, p), as_point2(own.points, q)
    c, d = as_point2(other.points, edge), as_point2(other.points, other.following[edge])
    least = smaller_nonzero(smaller_nonzero(smaller_nonzero(smaller_nonzero(np.inf, u.x), u.y), v.x), v.y)
    if smaller_nonzero(smaller_nonzero(smaller_nonzero(smaller_nonzero(least, c.x), c.y), d.x), d.y) < _LEAST_FACTOR:
        return False
    return compare_differences(v.x, u.x, d.y, c.y, v.y, u.y, d.x, c.x, workspace(16)) == 0


@inline
def _rank(pair: VertexEdge) -> tuple[int, int, int, int]:
    """Return the key by which tied pairs are ordered: the faces (edges) of both bodies, then the features."""
    return pair.face, pair.their_face, pair.first, pair.second


@inline
def search(a: Placed, b: Placed, near: Any, n: int) -> tuple[VertexEdge, float, bool]:
    """Return (pair, rival, is_proven): the nearest of the n candidates in `near`, of equal ones that with the lowest
    faces; a bound on how much nearer another one may be; and whether the pair of features is proven."""
    none, is_proven = Wide(np.inf, 0.0), True
    best, rival = VertexEdge(none, 0.0, True, -1, -1, 0, 0), none
    for row in range(n):
        is_first, vertex, edge = row_of(near, row)
        other = b if is_first else a
        if point(other.points, edge) == point(other.points, other.following[edge]):
            continue  # case: no length; the edges next to it end there
        candidate, is_placed = (
            _measure_pair(a, b, vertex, edge, True) if is_first else _measure_pair(b, a, vertex, edge, False)
        )
        more = less(candidate.distance, best.distance).h if best.first >= 0 else -np.inf
        bound = 1.001 * (candidate.bound + best.bound)
        if more > bound or (
            is_placed and is_proven and candidate.first == best.first and candidate.second == best.second
        ):
            continue
        if abs(more) <= bound and (bound == 0.0 or (is_placed and is_proven and _are_tied(a, b, candidate, best))):
            if _rank(candidate) < _rank(best):
                best, is_proven = candidate, is_placed
            continue
        if abs(more) <= bound:
            further = best if more < 0.0 else candidate
            low = less(further.distance, Wide(further.bound, 0.0))
            rival = low if low.h < rival.h or (low.h == rival.h and low.low < rival.low) else rival
        if more < 0.0:
            best, is_proven = candidate, is_placed
    if rival.h == np.inf:
        return best, 0.0, is_proven
    behind = less(rival, best.distance).h
    return best, max(-behind, 0.0) + 2.0**-98 * best.distance.h, is_proven and behind > 1.001 * best.bound


_SMALLEST: Final = 2.0**-140
"""Smallest distance for which the bounds are valid."""
_POLL_EVERY: Final = 16


@inline
def _has_separating_line(own: Placed, other: Placed, vertex: int, edge: int) -> bool:
    """Return whether the line perpendicular to the connection of a vertex of `own` and an edge of `other` provably
    separates the two bodies. error: for a direction n a product dot(n, x) is off by less than 8 u |n| of the largest
    coordinate."""
    way, low, high = way_to(as_point2(own.points, vertex), line_of(other, edge)), np.inf, -np.inf
    for vertex in range(len(own.following)):
        low = min(low, way.x * own.points[vertex, 0] + way.y * own.points[vertex, 1])
    for vertex in range(len(other.following)):
        high = max(high, way.x * other.points[vertex, 0] + way.y * other.points[vertex, 1])
    return low - high > 2.0**-50 * (abs(way.x) + abs(way.y)) * (own.reach + other.reach) + 2.0**-1000


@inline
def _outline(a: Placed) -> PlacedOutline:
    """Return a placed body for signs, without sides and what rounding took."""
    return rounded(a.points, a.following, NO_SIDES, a.boxes)


@called
def _related(a: Placed, b: Placed, error: float, stop: FlagArray) -> int:
    """Return 1 for disjoint bodies, 0 for bodies that meet, -1 if unproven. error: bound on a rounded coordinate."""
    relation, _, _, _, _ = relate_placed(_outline(a), _outline(b), error, True, stop)
    return -1 if relation == UNSETTLED else (1 if relation == DISJOINT else 0)


@inline
def _are_apart(a: Placed, b: Placed, near: Any, look: Look, stop: FlagArray) -> int:
    """Return 1 for disjoint bodies, 0 for bodies that meet, -1 if unproven or out of range. near, look: the candidates,
    whose nearest gives the line to try first."""
    error = 2.0**-51 * max(a.reach if a.error > 0.0 else 0.0, b.reach if b.error > 0.0 else 0.0)
    error += 2.0**-1000 if error > 0.0 else 0.0
    if not (a.reach + b.reach < np.inf and look.least < np.inf):
        return -1
    for row in range(min(look.n, MOST_NEAR)):
        if near[4 * row] == look.least:
            is_first, vertex, edge = row_of(near, row)
            if _has_separating_line(a, b, vertex, edge) if is_first else _has_separating_line(b, a, vertex, edge):
                return 1
            break
    if len(a.following) == 1 or len(b.following) == 1:
        ball, other = (a, b) if len(a.following) == 1 else (b, a)
        where = inside(spot_of(_outline(ball), 0), _outline(other), error)
        return 1 - where if where < 2 else -1
    return _related(a, b, error, stop)


@inline
def _write_offset_point(
    at: Wide2, error: float, errors: float, pair: VertexEdge, way: Wide2, radius: float, points: FloatArray, end: int
) -> bool:
    """Write at + radius way / |way| to points[end] (2,); return whether both coordinates are correctly rounded. way:
    from `at` to the other end of the connection `pair`. error: bound on a coordinate of `at`; errors: of both ends
    together."""
    is_proven = True
    for k in range(2):
        x, bound = (at.x if k == 0 else at.y), error
        if radius > 0.0:
            x = plus(x, times(over(way.x if k == 0 else way.y, pair.distance), Wide(radius, 0.0)))
            bound += radius * (4.0 * errors / pair.distance.h + 2.0**-98) + 2.0**-100 * abs(x.h)
        is_proven = is_proven and is_correctly_rounded(x.h, x.low, bound) and (bound == 0.0 or abs(x.h) > 2.0**-800)
        points[end, k] = x.h + 0.0
    return is_proven


@inline
def _nearest(
    a: Placed, b: Placed, radius: float, their_radius: float, points: FloatArray, stop: FlagArray
) -> tuple[float, int, int]:
    """Return (distance, feature, other feature) of two placed bodies with radii; fill points (2, 2) with nearest
    points.

    Distance: the nearest double, 0.0 if they provably meet, or UNSURE. Feature: a vertex, or the number of vertices +
    the edge; the first is -1 if the points are unproven. A ball is one vertex and a radius."""
    near = workspace(ROOM)
    look = look_for(a, b, near)
    are_apart = _are_apart(a, b, near, look, stop)
    if are_apart != 1 or look.n > MOST_NEAR:
        return 0.0 if are_apart == 0 else UNSURE, -1, -1
    best, nearer, is_proven = search(a, b, near, look.n)
    if not _SMALLEST < best.distance.h < LARGEST:
        return UNSURE, -1, -1
    both = Wide(*two_sum(radius, their_radius))
    distance, bound = less(best.distance, both), best.bound + nearer
    bound += 4.0 * U2 * abs(distance.h) if both.h > 0.0 else 0.0
    if distance.h < -bound:
        return 0.0, -1, -1
    if not (distance.h > bound and is_correctly_rounded(distance.h, distance.low, bound)):
        return UNSURE, -1, -1
    if not is_proven:
        return distance.h, -1, -1
    if best.is_first:
        (p, error), (q, their_error) = (point(a.points, best.first), a.error), foot_of(a, b, best.first, best.second)
    else:
        (p, error), (q, their_error) = foot_of(b, a, best.second, best.first), (point(b.points, best.second), b.error)
    errors = error + their_error
    is_proven = _write_offset_point(p, error, errors, best, minus2(q, p), radius, points, 0)
    is_proven = _write_offset_point(q, their_error, errors, best, minus2(p, q), their_radius, points, 1) and is_proven
    return distance.h, best.first if is_proven else -1, best.second


@inline
def _n_rows(following: IntArray) -> int:
    """Return the number of rows that the points and the boxes of an outline take in the work space."""
    return len(following) + 2 * n_leaves(len(following))


@allocating_kernel
def nearest_under_poses(
    vertices: FloatArray, following: IntArray, radius: float, turns: FloatArray, moves: FloatArray, other: FloatArray,
    their_following: IntArray, their_radius: float, their_turns: FloatArray, their_moves: FloatArray,
    distances: FloatArray, points: FloatArray, flag: FlagArray,
) -> tuple[float, int, int]:  # fmt: skip
    """Fill distances with the distance of two outlines with radii under each pose of the second, unless empty; return
    the distance and features that `_nearest` gives for the last pose, its points in `points`. turns (n, 2, 2), moves
    (n, 2): poses of the first, as many as of the second, or one. Stops early when the flag is set."""
    n, m, k = len(following), len(their_following), _n_rows(following)
    room = np.empty((k + _n_rows(their_following), 4))
    at, boxes, their_at, their_boxes = room[:n], room[n:k], room[k : k + m], room[k + m :]
    error, reach, nearest = 0.0, np.inf, (UNSURE, -1, -1)
    for item in range(len(their_turns)):
        if item % _POLL_EVERY == 0 and flag[0] != 0:
            break
        if item < len(turns):
            error, reach = place(vertices, following, turns[item], moves[item], at, boxes)
        turn, move = their_turns[item], their_moves[item]
        their_error, their_reach = place(other, their_following, turn, move, their_at, their_boxes)
        a = Placed(at, following, boxes, error, reach)
        b = Placed(their_at, their_following, their_boxes, their_error, their_reach)
        nearest = _nearest(a, b, radius, their_radius, points, flag)
        if len(distances) > 0:
            distances[item] = nearest[0]
    return nearest
