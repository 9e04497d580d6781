"""Two placed bodies of the plane related by exact signs; compiled.

One strict crossing of two edges, by signs with a bound, proves overlapping: all combinations of inside and outside
occur around it, since no other edge comes near. If edges meet and none cross, every such place has a vertex: each
interior is a sector there, and three comparisons of sectors decide whether the interiors meet, and which body has a
part outside the other. A ring that meets nothing is located by one vertex. This is complete: an edge enters the other's
interior only at a contact, or its whole ring lies there.

Signs are those of rounded poses where these prove them. Else every coordinate r x + s y + t is an exact sum of three
doubles, mostly, and expansions decide (J. R. Shewchuk, 1997).
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import NamedTuple

import numpy as np

from engine.arrangement.simple_rings import BLOCK, after, fill_tree, next_leaf
from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING, UNSETTLED
from engine.collision.meshes.placement import orient2d_near
from engine.compiling.jit import called, inline, merged
from engine.predicates.error_free import two_sum, workspace
from engine.predicates.expansion import add_product, compress, grow, grow_product, sign
from engine.predicates.vectors import as_point2
from engine.types import UNDECIDED, FlagArray, FloatArray, Int8Array, IntArray, Point2, read_only

APART, CROSSING, UNSURE, VERTEX_EDGE, VERTEX_VERTEX = range(5)
"""Classes of a pair of edges: no common point, a strict crossing, undecided, and two kinds of contacts."""
ON_EDGE = 3
"""Location of a point on an edge, besides 1 inside and 0 outside."""
_IN, _OUT, _MAYBE = 1, 2, 4
"""Bits of the rings of a body: _IN, some are inside the other body; _OUT, some are outside; _MAYBE, some are undecided.
"""
IN_BOTH, OUT_OF_SECOND, OUT_OF_FIRST = 1, 2, 4
"""Bits of two bodies: IN_BOTH, the open interiors intersect; OUT_OF_SECOND, a part of the first is outside the second;
OUT_OF_FIRST, vice versa."""


POLL_EVERY = 16

PlacedOutline = namedtuple("PlacedOutline", "points rests following sides boxes")
"""A body under its pose.

| field | shape | meaning |
|---|---|---|
| points | (n, 2 or more) | vertices, rounded |
| rests | (n, 4) | what rounding took, exactly: two more parts of x, then of y; (1, 4): unknown, see `rounded` |
| following, sides | (n,) | as in `OutlineArrays`; sides may be (0,): unknown |
| boxes | (2 n_leaves, 4) | tree over the edges |
"""
Body = namedtuple("Body", "vertices following sides turn move")
"""A body before its pose, with the two rows of its rotation and its translation, each a `Point2`."""


NO_SIDES = read_only(np.empty(0, np.int8))
"""Sides of a body that are unknown."""


class Spot(NamedTuple):
    """A placed vertex: x and y rounded, and two further parts of each; x1 is NaN if these are unknown."""

    x: float
    y: float
    x1: float
    x2: float
    y1: float
    y2: float


@inline
def _is_in_sector(by_start: int, by_end: int, turn: int, is_start: bool) -> bool:
    """Return whether a direction x lies in the half-open sector from direction s (included) counter-clockwise to e
    (excluded). by_start, by_end, turn: the signs of the turns from s to x, from x to e and from s to e; is_start: s and
    x are equal."""
    if is_start or turn == 0:
        return is_start or by_start > 0
    return (by_start > 0 and by_end > 0) if turn > 0 else (by_start > 0 or by_end > 0)


@inline
def _is_same_way(p: Spot, s: Spot, t: Spot, side: int, error: float) -> bool:
    """Return whether s and t, placed vertices, lie in one direction from p. side: the sign of the turn from s to t
    about p; error: bound on each coordinate."""
    if side != 0 or order(s, p, 0, error) != order(t, p, 0, error):
        return False
    return order(s, p, 1, error) == order(t, p, 1, error)


@merged
def _sector_bits(p: Spot, before: Spot, later: Spot, side: int, c: Spot, d: Spot, their_side: int, error: float) -> int:
    """Return the bits IN_BOTH, OUT_OF_SECOND, OUT_OF_FIRST that two boundaries through a point p prove near p. before,
    later: neighbours of p on one boundary; c, d: on the other. side, their_side: 1 if the interior is on the left, -1
    if on the right. The interiors are sectors from s counter-clockwise to e, and from t to f; two sectors intersect if
    one begins in the other."""
    s, e = (later, before) if side > 0 else (before, later)
    t, f = (d, c) if their_side > 0 else (c, d)
    s_e, t_f, s_t = _side(p, s, e, error), _side(p, t, f, error), _side(p, s, t, error)
    s_f, e_t, e_f = _side(p, s, f, error), _side(p, e, t, error), _side(p, e, f, error)
    are_starts = _is_same_way(p, s, t, s_t, error)
    starts_at_end, ends_at_start = _is_same_way(p, s, f, s_f, error), _is_same_way(p, e, t, e_t, error)
    is_in_both = _is_in_sector(s_t, -e_t, s_e, are_starts) or _is_in_sector(-s_t, s_f, t_f, are_starts)
    is_out = _is_in_sector(s_f, -e_f, s_e, starts_at_end) or _is_in_sector(-s_f, s_t, -t_f, starts_at_end)
    is_theirs_out = _is_in_sector(-e_t, e_f, t_f, ends_at_start) or _is_in_sector(e_t, -s_t, -s_e, ends_at_start)
    return IN_BOTH * is_in_both + OUT_OF_SECOND * is_out + OUT_OF_FIRST * is_theirs_out


@called
def _contact_bits(own: PlacedOutline, edge: int, their: PlacedOutline, other: int, error: float) -> int:
    """Return the bits IN_BOTH, OUT_OF_SECOND, OUT_OF_FIRST that are proven by the vertices at which edge `edge` of
    `own` meets edge `other` of `their`. A vertex that is the start of one of these edges is left out: it is the end of
    the edge before."""
    after_edge, after_other = own.following[edge], their.following[other]
    a, b, c, d = spot_of(own, edge), spot_of(own, after_edge), spot_of(their, other), spot_of(their, after_other)
    side, their_side, bits = own.sides[edge], their.sides[other], 0
    if not _are_same(b, c, error) and _is_in_box(b, c, d, error) and _side(c, d, b, error) == 0:
        their_later = spot_of(their, their.following[after_other]) if _are_same(b, d, error) else d
        later = spot_of(own, own.following[after_edge])
        bits = _sector_bits(b, a, later, side, c, their_later, their_side, error)
    is_inner = not _are_same(d, a, error) and not _are_same(d, b, error)
    if is_inner and _is_in_box(d, a, b, error) and _side(a, b, d, error) == 0:
        their_later = spot_of(their, their.following[after_other])
        bits |= _sector_bits(d, a, b, side, c, their_later, their_side, error)
    return bits


@inline
def rounded(points: FloatArray, following: IntArray, sides: Int8Array, boxes: FloatArray) -> PlacedOutline:
    """Return a body of which only rounded vertices are known: a tree has no node in the first row of its boxes."""
    boxes[0, 0] = np.nan
    return PlacedOutline(points, boxes[:1], following, sides, boxes)


@inline
def spot_of(body: PlacedOutline, i: int) -> Spot:
    """Return vertex i of a placed body."""
    rest = body.rests[min(i, len(body.rests) - 1)]
    return Spot(body.points[i, 0], body.points[i, 1], rest[0], rest[1], rest[2], rest[3])


@called
def _set_difference(e: FloatArray, a: float, a1: float, a2: float, b: float, b1: float, b2: float) -> int:
    """Write a + a1 + a2 - (b + b1 + b2) as an expansion to e, six places; return its length."""
    n = 0
    for part in (a2, a1, a, -b2, -b1, -b):
        n = grow(e, n, part) if part != 0.0 else n
    return compress(e, n)


@inline
def order(p: Spot, q: Spot, axis: int, error: float) -> int:
    """Return the sign of a coordinate of p less that of q; UNDECIDED if rounding, of at most `error` a coordinate,
    leaves it open."""
    gap = p[axis] - q[axis]
    if error == 0.0 or abs(gap) > 2.0 * error:
        return int(gap > 0.0) - int(gap < 0.0)
    return _order_exactly(p, q, axis)


@called
def _order_exactly(p: Spot, q: Spot, axis: int) -> int:
    """Return the exact sign of a coordinate of p less that of q, or UNDECIDED."""
    if math.isnan(p.x1) or math.isnan(q.x1):
        return UNDECIDED
    e, at = workspace(6), 2 + 2 * axis
    return sign(e, _set_difference(e, p[axis], p[at], p[at + 1], q[axis], q[at], q[at + 1]))


@called
def _side_exactly(p: Spot, q: Spot, r: Spot) -> int:
    """Return the exact sign of orient2d of three placed vertices, or UNDECIDED. Coordinates are below
    2^303 and multiples of 2^-508 (`set_rests`), products of differences multiples of 2^-1016."""
    if math.isnan(p.x1) or math.isnan(q.x1) or math.isnan(r.x1):
        return UNDECIDED
    ax, ay, bx, by, e = workspace(6), workspace(6), workspace(6), workspace(6), workspace(144)
    m_ax = _set_difference(ax, p.x, p.x1, p.x2, r.x, r.x1, r.x2)
    m_by = _set_difference(by, q.y, q.y1, q.y2, r.y, r.y1, r.y2)
    m_ay = _set_difference(ay, r.y, r.y1, r.y2, p.y, p.y1, p.y2)  # its negative
    m_bx = _set_difference(bx, q.x, q.x1, q.x2, r.x, r.x1, r.x2)
    n = add_product(e, 0, ax, m_ax, by, m_by)
    return sign(e, add_product(e, n, ay, m_ay, bx, m_bx))


@inline
def _side(p: Spot, q: Spot, r: Spot, error: float) -> int:
    """Return the sign of orient2d of three placed vertices, or UNDECIDED."""
    side = orient2d_near(Point2(p.x, p.y), Point2(q.x, q.y), Point2(r.x, r.y), error)
    return _side_exactly(p, q, r) if side == UNDECIDED and error > 0.0 else side


@inline
def _are_same(p: Spot, q: Spot, error: float) -> bool:
    """Return whether two placed vertices are equal."""
    if error == 0.0:
        return p.x == q.x and p.y == q.y
    return order(p, q, 0, error) == 0 and order(p, q, 1, error) == 0


@inline
def _is_in_box(p: Spot, a: Spot, b: Spot, error: float) -> bool:
    """Return whether p lies in the box around segment ab."""
    if error == 0.0:
        return min(a.x, b.x) <= p.x <= max(a.x, b.x) and min(a.y, b.y) <= p.y <= max(a.y, b.y)
    return order(p, a, 0, error) * order(p, b, 0, error) <= 0 and order(p, a, 1, error) * order(p, b, 1, error) <= 0


@inline
def _classify_edges(own: PlacedOutline, edge: int, their: PlacedOutline, other: int, error: float) -> int:
    """Return the class of edge `edge` of one body and `other` of another: CROSSING if they provably cross in one point
    inside both, APART, VERTEX_EDGE or VERTEX_VERTEX for a contact, or UNSURE. error: bound on each coordinate."""
    p, q = as_point2(own.points, edge), as_point2(own.points, own.following[edge])
    r, s = as_point2(their.points, other), as_point2(their.points, their.following[other])
    slack = 2.0 * error
    if max(p.x, q.x) + slack < min(r.x, s.x) or max(r.x, s.x) + slack < min(p.x, q.x):
        return APART
    if max(p.y, q.y) + slack < min(r.y, s.y) or max(r.y, s.y) + slack < min(p.y, q.y):
        return APART
    a, b = spot_of(own, edge), spot_of(own, own.following[edge])
    c, d = spot_of(their, other), spot_of(their, their.following[other])
    by_c, by_d = _side(a, b, c, error), _side(a, b, d, error)
    if by_c * by_d == 1:  # UNDECIDED is 2
        return APART
    by_a, by_b = _side(c, d, a, error), _side(c, d, b, error)
    if by_a * by_b == 1:
        return APART
    if by_c * by_d == -1 and by_a * by_b == -1:
        return CROSSING
    if UNDECIDED in (by_a, by_b, by_c, by_d):
        return UNSURE
    is_met = (by_a == 0 and _is_in_box(a, c, d, error)) or (by_b == 0 and _is_in_box(b, c, d, error))
    is_met = is_met or (by_c == 0 and _is_in_box(c, a, b, error)) or (by_d == 0 and _is_in_box(d, a, b, error))
    if not is_met:
        return APART
    is_vertex = _are_same(a, c, error) or _are_same(a, d, error) or _are_same(b, c, error) or _are_same(b, d, error)
    return VERTEX_VERTEX if is_vertex else VERTEX_EDGE


@inline
def rows_of(turn: FloatArray) -> tuple[Point2, Point2]:
    """Return the rows of a rotation (2, 2)."""
    return as_point2(turn, 0), as_point2(turn, 1)


@inline
def place(body: Body, placed: FloatArray) -> float:
    """Write the vertices of a body under its pose, rounded, to `placed`; return a bound on the error of a coordinate,
    0.0 if nothing was rounded (`placement.py`)."""
    reach, is_exact, turn, move = 0.0, True, body.turn, body.move
    for axis in range(2):  # a turn by the lattice
        x, y = turn[axis]
        is_exact = is_exact and x * y == 0.0 and abs(x + y) == 1.0
    for vertex in range(len(body.vertices)):
        x, y = body.vertices[vertex, 0], body.vertices[vertex, 1]
        reach = max(reach, abs(x), abs(y))
        for axis in range(2):
            value, lost = two_sum(turn[axis].x * x + turn[axis].y * y, move[axis])
            is_exact = is_exact and lost == 0.0
            placed[vertex, axis] = value
    if is_exact:
        return 0.0
    return 2.0**-49 * (3.0 * reach + max(abs(move[0]), abs(move[1]))) + 2.0**-1060


@inline
def _is_factor(x: float, smallest: float) -> bool:
    """Return whether x is 0 or a magnitude from `smallest` to 2^300."""
    return x == 0.0 or smallest <= abs(x) <= 2.0**300


@called
def set_rests(body: Body, points: FloatArray, rests: FloatArray) -> bool:
    """Write the exact placed vertices of a body, each coordinate in three parts, to points (n, 2) and rests (n, 4);
    return False if one needs more. A factor of at least 2^-100 (rotation) or 2^-300 is a multiple of 2^-152 or 2^-352,
    so coordinates are multiples of 2^-504, below 2^302."""
    e, turn, move = workspace(5), body.turn, body.move
    for axis in range(2):
        is_safe = _is_factor(turn[axis].x, 2.0**-100) and _is_factor(turn[axis].y, 2.0**-100)
        if not (is_safe and _is_factor(move[axis], 2.0**-300)):
            return False
        for vertex in range(len(body.vertices)):
            x, y = body.vertices[vertex, 0], body.vertices[vertex, 1]
            if not (_is_factor(x, 2.0**-300) and _is_factor(y, 2.0**-300)):
                return False
            n = grow_product(e, grow_product(e, 0, turn[axis].x, x), turn[axis].y, y)
            n = compress(e, grow(e, n, move[axis]) if move[axis] != 0.0 else n)
            if n > 3:
                return False
            points[vertex, axis] = e[n - 1] if n > 0 else 0.0
            rests[vertex, 2 * axis] = e[n - 2] if n > 1 else 0.0
            rests[vertex, 2 * axis + 1] = e[n - 3] if n > 2 else 0.0
    return True


@inline
def inside(p: Spot, body: PlacedOutline, error: float) -> int:
    """Return 1 if p is inside the rings of a placed body (even-odd), 0 outside, ON_EDGE, or UNSURE. error: bound on
    each coordinate."""
    is_inside, leaves, slack = 0, len(body.boxes) // 2, 2.0 * error
    leaf = next_leaf(body.boxes, 1, p.x - slack, p.y - slack, np.inf, p.y + slack)
    while leaf > 0:  # bound: each leaf once
        for edge in range(BLOCK * (leaf - leaves), min(BLOCK * (leaf - leaves + 1), len(body.following))):
            a, b = spot_of(body, edge), spot_of(body, body.following[edge])
            if max(a.x, b.x) + slack < p.x or min(a.y, b.y) > p.y + slack or max(a.y, b.y) + slack < p.y:
                continue
            from_a, from_b = order(a, p, 1, error), order(b, p, 1, error)
            if from_a == UNDECIDED or from_b == UNDECIDED:
                return UNSURE
            if from_a == 0 and (from_b == 0 or order(a, p, 0, error) == 0) and _is_in_box(p, a, b, error):
                return ON_EDGE
            if (from_a <= 0) == (from_b <= 0):
                continue
            side = _side(a, b, p, error)
            if side == UNDECIDED or side == 0:
                return ON_EDGE if side == 0 else UNSURE
            if (side > 0) == (from_b > from_a):
                is_inside = 1 - is_inside
        leaf = next_leaf(body.boxes, after(leaf), p.x - slack, p.y - slack, np.inf, p.y + slack)
    return is_inside


@inline
def _rings_inside(own: PlacedOutline, their: PlacedOutline, error: float, stop: FlagArray) -> int:
    """Return where the rings of one body lie in another, by one vertex of each, as bits: _IN some inside, _OUT some
    outside, _MAYBE some undecided. A vertex on an edge of the other adds no bit."""
    bits = 0
    for vertex in range(len(own.following)):
        if own.following[vertex] > vertex:  # not the last of its ring
            continue
        if stop[0] != 0:
            return _MAYBE
        where = inside(spot_of(own, vertex), their, error)
        if where != ON_EDGE:
            bits |= _IN if where == 1 else (_OUT if where == 0 else _MAYBE)
    return bits


@called
def relate_placed(
    own: PlacedOutline, their: PlacedOutline, error: float, is_boolean: bool, stop: FlagArray
) -> tuple[int, int, int, int, int]:
    """Relate two placed bodies; the first one's tree is filled here. error: bound on each coordinate; is_boolean: end
    at the first contact, as TOUCHING. UNSETTLED if `stop` is set.

    | result | meaning |
    |---|---|
    | 0 | the relation, or UNSETTLED; only DISJOINT if a boundary is not simple, or its sides are unknown |
    | 1 | the bits IN_BOTH, OUT_OF_SECOND, OUT_OF_FIRST that are proven |
    | 2, 3 | the first edges of either body that meet, -1 for none; the first body's -1 if they may not be the first |
    | 4 | the class of these two edges, APART for none; of UNSETTLED bodies not APART if they provably meet |
    """
    is_unsure, bits, first, second, kind = False, 0, -1, -1, APART
    slack, leaves, n = 2.0 * error, len(their.boxes) // 2, len(their.following)
    is_simple = len(own.sides) > 0 and len(their.sides) > 0 and own.sides[0] != 0 and their.sides[0] != 0
    for edge in range(len(own.following)):
        if edge % POLL_EVERY == 0 and stop[0] != 0:
            return UNSETTLED, 0, -1, -1, APART
        a, b = as_point2(own.points, edge), as_point2(own.points, own.following[edge])
        left, bottom = min(a.x, b.x) - slack, min(a.y, b.y) - slack
        right, top = max(a.x, b.x) + slack, max(a.y, b.y) + slack
        leaf = next_leaf(their.boxes, 1, left, bottom, right, top)
        while leaf > 0:  # bound: each leaf once
            for other in range(BLOCK * (leaf - leaves), min(BLOCK * (leaf - leaves + 1), n)):
                how = _classify_edges(own, edge, their, other, error)
                if how == APART:
                    continue
                if how == UNSURE:
                    is_unsure = True
                    continue
                if kind == APART:
                    first, second, kind = (-1 if is_unsure else edge), other, how
                if is_boolean:
                    return TOUCHING, 0, -1, -1, kind
                if not is_simple:
                    return UNSETTLED, 0, -1, -1, kind
                if how == CROSSING:
                    return OVERLAPPING, IN_BOTH | OUT_OF_FIRST | OUT_OF_SECOND, first, second, kind
                bits |= _contact_bits(own, edge, their, other, error)
            leaf = next_leaf(their.boxes, after(leaf), left, bottom, right, top)
    if is_unsure:
        return UNSETTLED, 0, -1, -1, kind
    fill_tree(own.points, own.following, own.boxes)
    own_bits, bits_of_their = _rings_inside(own, their, error, stop), _rings_inside(their, own, error, stop)
    if (own_bits | bits_of_their) & _MAYBE:
        return UNSETTLED, 0, -1, -1, kind
    if not is_simple and (own_bits | bits_of_their) & _IN:
        return (TOUCHING if is_boolean else UNSETTLED), 0, -1, -1, CROSSING
    if kind == APART and own_bits == _IN and bits_of_their == _OUT:
        return FIRST_INSIDE_SECOND, IN_BOTH | OUT_OF_FIRST, -1, -1, kind
    if kind == APART and own_bits == _OUT and bits_of_their == _IN:
        return SECOND_INSIDE_FIRST, IN_BOTH | OUT_OF_SECOND, -1, -1, kind
    bits |= (IN_BOTH | OUT_OF_FIRST if own_bits & _IN else 0) | (OUT_OF_SECOND if own_bits & _OUT else 0)
    bits |= (IN_BOTH | OUT_OF_SECOND if bits_of_their & _IN else 0) | (OUT_OF_FIRST if bits_of_their & _OUT else 0)
    if bits & IN_BOTH:
        return OVERLAPPING, bits, first, second, kind
    return (DISJOINT if kind == APART else TOUCHING), bits, first, second, kind
