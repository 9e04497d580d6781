"""How points, lines and polygons lie to each other: the matrix of intersections (DE-9IM), by exact signs; compiled.

Edges that cross strictly settle themselves. All other contacts of an edge are vertices of the input, which lie on it
exactly and are ordered by one coordinate. Between two of them the edge is on the other boundary or line if collinear
edges cover it, else apart from it: then the middle of the two points, located by parity, tells inside from outside.
A middle (p + q) / 2 is not rounded: of its coordinates the sum p + q is an exact pair, and orient2d(c, d, middle) is
half of orient2d(c, d, p) + orient2d(c, d, q).

Source: E. Clementini, P. Di Felice, P. van Oosterom, A small set of formal topological relationships, 1993; OGC
06-103r4, 6.1.15, whose definitions of the predicates GEOS has.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.arrangement.simple_rings import BLOCK, after, next_leaf
from engine.compiling.jit import called, entry_of, inline, kernel
from engine.layers.shapes import AREA, LINE, POINT, Shape, Shapes, shape_of
from engine.predicates.error_free import two_sum, workspace
from engine.predicates.expansion import grow_product, sign
from engine.predicates.orientation import orient2d
from engine.predicates.vectors import as_point2
from engine.running.budget import Budget
from engine.running.parallel import run_chunks
from engine.types import BoolArray, FlagArray, FloatArray, Int8Array, IntArray, Point2

II, IB, IE, BI, BB, BE, EI, EB, LONG, ALIKE, OPPOSED = (1 << k for k in range(11))
"""Bits of a matrix: interior, boundary or exterior of the first with that of the second; LONG: II has a length. Of the
edges of an area, while it is related to another: where these are in that of the other (II, IB, IE), and whether there
is a common stretch with both interiors on one side (ALIKE), or on two (OPPOSED)."""
_MEET: Final = II | IB | BI | BB
_UNKNOWN: Final = 0
_WIDEST: Final = 6
"""Most marks that one contact leaves: four points and an overlap, whose ends are two."""
_SLACK: Final = 2.0**-50

PREDICATES: Final = (
    "intersects", "within", "contains", "touches", "overlaps", "crosses", "covers", "covered_by", "equals",
)  # fmt: skip


def holds(predicate: str, bits: IntArray, dims: Int8Array, their_dims: Int8Array) -> BoolArray:
    """Return (n,) bool: whether a predicate of `PREDICATES` holds. bits, dims, their_dims (n,): by pair its
    intersection matrix, and the dimensions of its first and of its second feature."""
    has = {name: (bits & bit) != 0 for name, bit in (("ii", II), ("ie", IE), ("be", BE), ("ei", EI), ("eb", EB))}
    meet, is_long, is_even = (bits & _MEET) != 0, (bits & LONG) != 0, dims == their_dims
    is_in, is_around = ~has["ie"] & ~has["be"], ~has["ei"] & ~has["eb"]
    if predicate == "overlaps":
        return is_even & has["ii"] & has["ie"] & has["ei"] & ((dims != LINE) | is_long)
    if predicate == "crosses":
        parts = np.where(dims < their_dims, has["ie"], np.where(dims > their_dims, has["ei"], ~is_long))
        return has["ii"] & parts & (~is_even | (dims == LINE))
    made: dict[str, BoolArray] = {
        "intersects": meet, "touches": meet & ~has["ii"], "within": has["ii"] & is_in, "covered_by": meet & is_in,
        "contains": has["ii"] & is_around, "covers": meet & is_around, "equals": has["ii"] & is_in & is_around,
    }  # fmt: skip
    return made[predicate]


def transposed(bits: IntArray) -> IntArray:
    """Return the intersection matrices (n,) of the same pairs with first and second feature exchanged."""
    made = bits & (II | BB | LONG)
    for one, other in ((IB, BI), (IE, EI), (BE, EB)):
        made |= np.where(bits & one, other, 0) | np.where(bits & other, one, 0)
    return made


def matrices(
    left: Shapes, right: Shapes, pairs: IntArray, is_any: bool, budget: Budget, workers: int | None
) -> IntArray:
    """Return (n,) the intersection matrix of each pair (n, 2) of features, as bits (II, IB, ...). Caller guarantees
    scaled coordinates (`in_range`), and a first feature of no larger dimension than the second. is_any: any bit is set
    if the two meet, none else; that is faster."""
    bits = np.zeros(len(pairs), np.int64)
    most = max((int(np.diff(each.firsts).max(initial=0)) for each in (left, right)), default=0)

    def task(start: int, stop: int) -> None:
        room = np.empty((1 if is_any else _WIDEST * most + 2, 3))
        entry_of(_relate_pairs)(left, right, pairs[start:stop], is_any, room, bits[start:stop], budget.flag)
        budget.check()

    run_chunks(task, len(pairs), budget=budget, workers=workers)
    return bits


@kernel
def _relate_pairs(
    left: Shapes, right: Shapes, pairs: IntArray, is_any: bool, room: FloatArray, bits: IntArray, flag: FlagArray
) -> None:
    """Fill bits (n,) with the intersection matrix of each pair (n, 2) of features. is_any, room: as in `_half`."""
    for item in range(len(pairs)):
        if flag[0] != 0:
            return
        i, j = pairs[item, 0], pairs[item, 1]
        bits[item] = _relate(shape_of(left, i), shape_of(right, j), is_any, room, flag)


@called
def _relate(own: Shape, their: Shape, is_any: bool, room: FloatArray, flag: FlagArray) -> int:
    """Return the intersection matrix of two features, as bits. is_any, room: as in `_half`."""
    if own.dim == POINT and their.dim == AREA:
        return _of_points(own, their, is_any, flag)
    bits = _half(own, their, is_any, room, flag)
    if is_any:
        if bits == 0 and their.dim == AREA:
            bits = _of_paths(own, their) & II
        if bits == 0 and own.dim == AREA:
            bits = _of_paths(their, own) & II
        return bits
    if own.dim == AREA:
        return _of_areas(bits, _half(their, own, is_any, room, flag) if bits & IB else _of_paths(their, own))
    bits |= _of_ends(own, their)
    if own.dim != their.dim:
        return bits | EI | EB
    back = _half(their, own, is_any, room, flag) | _of_ends(their, own)
    return bits | (EI if back & IE else 0) | (EB if back & BE else 0)


@inline
def _of_areas(bits: int, back: int) -> int:
    """Return the intersection matrix of two areas. bits: what `_half` gives for the edges of the first in the second;
    back: for those of the second in the first. An edge of one area inside the other has interior and exterior of its
    own area on its two sides, both inside the other."""
    both = bits | back
    return (
        (II if both & (II | ALIKE) else 0) | (IE if bits & IE or back & II or both & OPPOSED else 0)
        | (EI if back & IE or bits & II or both & OPPOSED else 0) | (BB if both & IB else 0)
    )  # fmt: skip


@called
def _half(own: Shape, their: Shape, is_any: bool, room: FloatArray, flag: FlagArray) -> int:
    """Return the bits that the edges of `own` set in the matrix of two features: all but BE, EI, EB and bits of ends
    that meet nothing. is_any: end at the first contact. room (n, 3): scratch, the points where one edge is met (x, y,
    and +1 or -1 where a collinear edge begins or ends). Ends early if flag is set."""
    bits, state, leaves, m = 0, _UNKNOWN, len(their.boxes) // 2, len(their.following)
    for edge in range(len(own.following)):
        if flag[0] != 0:
            return bits
        a, b, n_marks = as_point2(own.points, edge), as_point2(own.points, own.following[edge]), 0
        left, bottom, right, top = min(a.x, b.x), min(a.y, b.y), max(a.x, b.x), max(a.y, b.y)
        leaf = next_leaf(their.boxes, 1, left, bottom, right, top)
        while leaf > 0:  # bound: each leaf once
            for other in range(BLOCK * (leaf - leaves), min(BLOCK * (leaf - leaves + 1), m)):
                c, d = as_point2(their.points, other), as_point2(their.points, their.following[other])
                if not _boxes_meet(a, b, c, d):
                    continue
                more, n_marks = _contact(a, b, c, d, own, their, is_any, room, n_marks)
                bits |= more
                if is_any and bits != 0:
                    return bits
            leaf = next_leaf(their.boxes, after(leaf), left, bottom, right, top)
        if is_any:
            continue
        if own.dim == POINT:
            bits |= IE if n_marks == 0 else 0
        elif a.x != b.x or a.y != b.y:
            needed = IE if their.dim != AREA else II | IE
            if bits & needed != needed:
                if n_marks == 0 and state != _UNKNOWN:
                    bits |= state
                else:
                    more = _of_stretches(a, b, their, room, n_marks)
                    bits |= more
                    state = more if n_marks == 0 else _UNKNOWN
            else:
                state = _UNKNOWN
        if own.following[edge] <= edge or n_marks > 0:
            state = _UNKNOWN
    return bits


@inline
def _boxes_meet(a: Point2, b: Point2, c: Point2, d: Point2) -> bool:
    return (
        (max(a.x, b.x) >= min(c.x, d.x)) & (max(c.x, d.x) >= min(a.x, b.x))
        & (max(a.y, b.y) >= min(c.y, d.y)) & (max(c.y, d.y) >= min(a.y, b.y))
    )  # fmt: skip


@inline
def _is_between(a: Point2, b: Point2, p: Point2) -> bool:
    """Return whether p is in the box of a and b."""
    return (
        (min(a.x, b.x) <= p.x) & (p.x <= max(a.x, b.x)) & (min(a.y, b.y) <= p.y) & (p.y <= max(a.y, b.y))
    )  # fmt: skip


@called
def _contact(
    a: Point2, b: Point2, c: Point2, d: Point2, own: Shape, their: Shape, is_any: bool, room: FloatArray, n: int
) -> tuple[int, int]:
    """Return the bits that the contact of edge ab of `own` with edge cd of `their` sets (0 if they are disjoint), and
    the new number of points in `room`, n before (`_half`). Caller guarantees that their boxes meet."""
    c_side, d_side = orient2d(a, b, c), orient2d(a, b, d)
    if c_side * d_side > 0:
        return 0, n
    a_side, b_side = orient2d(c, d, a), orient2d(c, d, b)
    if a_side * b_side > 0:
        return 0, n
    if c_side * d_side < 0 and a_side * b_side < 0:
        if their.dim == AREA:
            return II | IB | IE | LONG, n
        return (II if is_any else _of_crossing(a, b, c, d, own, their)), n
    bits = 0
    for k in range(4):
        p, q, r = (c if k == 0 else d, a, b) if k < 2 else (a if k == 2 else b, c, d)
        side = c_side if k == 0 else d_side if k == 1 else a_side if k == 2 else b_side
        if side != 0 or not _is_between(q, r, p):
            continue
        if is_any:
            return II, n
        at = 3 if own.dim == LINE and _is_end(own.ends, p) else 0
        to = 1 if their.dim == AREA or (their.dim == LINE and _is_end(their.ends, p)) else 0
        bits |= 1 << (at + to)
        room[n, 0], room[n, 1], room[n, 2] = p.x, p.y, 0.0
        n += 1
    if c_side == 0 and d_side == 0 and a_side == 0 and b_side == 0:
        axis_y = a.x == b.x
        if _key(a, axis_y) > _key(b, axis_y):
            a, b = b, a
        if _key(c, axis_y) > _key(d, axis_y):
            c, d = d, c
        low, high = a if _key(a, axis_y) > _key(c, axis_y) else c, b if _key(b, axis_y) < _key(d, axis_y) else d
        if _key(low, axis_y) < _key(high, axis_y):
            bits |= IB if their.dim == AREA else II | LONG
            if own.dim == AREA:
                bits |= ALIKE if _is_inside(low, high, own) == _is_inside(low, high, their) else OPPOSED
            room[n, 0], room[n, 1], room[n, 2] = low.x, low.y, 1.0
            room[n + 1, 0], room[n + 1, 1], room[n + 1, 2] = high.x, high.y, -1.0
            n += 2
    return bits, n


@called
def _of_crossing(a: Point2, b: Point2, c: Point2, d: Point2, own: Shape, their: Shape) -> int:
    """Return the bit set by the point in which edges ab and cd of two lines cross strictly: II, unless an end of either
    line lies at that point (a line that touches itself)."""
    for k in range(len(own.ends) + len(their.ends)):
        p = as_point2(own.ends, k) if k < len(own.ends) else as_point2(their.ends, k - len(own.ends))
        if _is_between(a, b, p) and _is_between(c, d, p) and orient2d(a, b, p) == 0 and orient2d(c, d, p) == 0:
            return 1 << ((3 if _is_end(own.ends, p) else 0) + (1 if _is_end(their.ends, p) else 0))
    return II


@inline
def _key(p: Point2, axis_y: bool) -> float:
    return p.y if axis_y else p.x


@called
def _of_stretches(a: Point2, b: Point2, their: Shape, room: FloatArray, n: int) -> int:
    """Return the bits (II, IE, LONG) set by the stretches of edge ab between the n points in `room` at which it is met
    (`_half`), those covered by collinear edges left out."""
    for p in (a, b):
        room[n, 0], room[n, 1], room[n, 2] = p.x, p.y, 0.0
        n += 1
    axis = 1 if a.x == b.x else 0
    for k in range(1, n):  # by insertion: they are few
        x, y, step, at = room[k, 0], room[k, 1], room[k, 2], k
        key = y if axis == 1 else x
        while at > 0 and room[at - 1, axis] > key:
            room[at, 0], room[at, 1], room[at, 2] = room[at - 1, 0], room[at - 1, 1], room[at - 1, 2]
            at -= 1
        room[at, 0], room[at, 1], room[at, 2] = x, y, step
    bits, depth = 0, 0.0
    for k in range(n - 1):
        depth += room[k, 2]
        if depth > 0.0 or room[k, axis] == room[k + 1, axis]:
            continue
        if their.dim != AREA:
            return IE
        bits |= (II | LONG) if _is_inside(as_point2(room, k), as_point2(room, k + 1), their) else IE
    return bits


@inline
def _is_end(ends: FloatArray, p: Point2) -> bool:
    """Return whether p is among ends (n, 2), sorted lexicographically."""
    low, high = 0, len(ends)
    while low < high:  # bound: halved each turn
        middle = (low + high) // 2
        if ends[middle, 0] < p.x or (ends[middle, 0] == p.x and ends[middle, 1] < p.y):
            low = middle + 1
        else:
            high = middle
    return low < len(ends) and ends[low, 0] == p.x and ends[low, 1] == p.y


@called
def _of_points(own: Shape, their: Shape, is_any: bool, flag: FlagArray) -> int:
    """Return the bits that the points of `own` set with the area `their`. is_any, flag: as in `_half`."""
    bits = 0
    for vertex in range(len(own.following)):
        bits |= _of_location(_locate(as_point2(own.points, vertex), their), is_any)
        if flag[0] != 0 or (is_any and bits != 0):
            return bits
    return bits


@inline
def _of_location(at: int, is_any: bool) -> int:
    """Return the bits that a point sets with an area. at: its location there, as from `_locate`: 1 inside, 0 on an
    edge, -1 outside. is_any: only bits of common points."""
    bits = II if at > 0 else IB if at == 0 else 0 if is_any else IE
    return bits if is_any else bits | EI | EB


@called
def _of_ends(own: Shape, their: Shape) -> int:
    """Return the bits BI and BE that the ends of a line set with another feature, where they lie on none of its
    edges."""
    bits = 0
    for row in range(len(own.ends)):
        at = _locate(as_point2(own.ends, row), their)
        if at != 0:
            bits |= BI if at > 0 and their.dim == AREA else BE
    return bits


@called
def _of_paths(own: Shape, their: Shape) -> int:
    """Return the bits II and IE that the paths of `own`, none of which meets an edge of the area `their`, set with it:
    one vertex a path is located."""
    bits = 0
    for edge in range(len(own.following)):
        if own.following[edge] <= edge:
            bits |= II if _locate(as_point2(own.points, edge), their) > 0 else IE
    return bits


@inline
def _passed(p: Point2, c: Point2, d: Point2, at: int) -> int:
    """Return the updated state of a parity count along the ray from p to the right, once edge cd is considered: 0 if p
    is on the edge; -at if the ray crosses it; at, the state before (1 odd, -1 even), if not."""
    if (c.x < p.x and d.x < p.x) or (c.y < p.y and d.y < p.y) or (c.y > p.y and d.y > p.y):
        return at
    is_up = d.y > p.y
    side = (1 if is_up else -1) if c.x > p.x and d.x > p.x else orient2d(c, d, p)
    if side == 0:
        return 0  # the box of the edge contains the point
    return -at if (c.y > p.y) != is_up and side == (1 if is_up else -1) else at


@called
def _locate(p: Point2, their: Shape) -> int:
    """Return the location of p in a feature by ray parity: 1 if a ray to the right crosses an odd number of its edges,
    -1 if an even one, 0 if p lies on an edge."""
    at, leaves, m = -1, len(their.boxes) // 2, len(their.following)
    leaf = next_leaf(their.boxes, 1, p.x, p.y, np.inf, p.y)
    while leaf > 0:  # bound: each leaf once
        for other in range(BLOCK * (leaf - leaves), min(BLOCK * (leaf - leaves + 1), m)):
            c, d = as_point2(their.points, other), as_point2(their.points, their.following[other])
            at = _passed(p, c, d, at)
            if at == 0:
                return 0
        leaf = next_leaf(their.boxes, after(leaf), p.x, p.y, np.inf, p.y)
    return at


@called
def _is_inside(p: Point2, q: Point2, their: Shape) -> bool:
    """Return whether the middle of p and q, which is on no edge of an area, is inside: by the parity of the edges that
    a ray to the right crosses. If they are on one edge: whether a point right of the middle is, or above if that edge
    is horizontal."""
    top, rest = two_sum(p.y, q.y)
    x, y = 0.5 * (p.x + q.x), 0.5 * top
    low, high, left = y - _SLACK * abs(y), y + _SLACK * abs(y), x - _SLACK * (abs(p.x) + abs(q.x))
    is_inside, leaves, m = False, len(their.boxes) // 2, len(their.following)
    leaf = next_leaf(their.boxes, 1, left, low, np.inf, high)
    while leaf > 0:  # bound: each leaf once
        for other in range(BLOCK * (leaf - leaves), min(BLOCK * (leaf - leaves + 1), m)):
            c, d = as_point2(their.points, other), as_point2(their.points, their.following[other])
            is_up = _is_above(d, top, rest)
            if _is_above(c, top, rest) != is_up and _middle_side(c, d, p, q) == (1 if is_up else -1):
                is_inside = not is_inside
        leaf = next_leaf(their.boxes, after(leaf), left, low, np.inf, high)
    return is_inside


@inline
def _is_above(c: Point2, top: float, rest: float) -> bool:
    """Return whether 2 c.y > top + rest, an exact pair: |rest| is at most half the way to the next double."""
    return 2.0 * c.y > top or (2.0 * c.y == top and rest < 0.0)


@called
def _middle_side(c: Point2, d: Point2, p: Point2, q: Point2) -> int:
    """Return the sign of orient2d(c, d, (p + q) / 2)."""
    side, their_side = orient2d(c, d, p), orient2d(c, d, q)
    if side == their_side or their_side == 0:
        return side
    if side == 0:
        return their_side
    e, n = workspace(32), 0
    for k in range(2):
        r: Any = p if k == 0 else q
        n = grow_product(e, n, c.x, d.y)
        n = grow_product(e, n, -c.x, r.y)
        n = grow_product(e, n, -r.x, d.y)
        n = grow_product(e, n, -c.y, d.x)
        n = grow_product(e, n, c.y, r.x)
        n = grow_product(e, n, r.y, d.x)
    return sign(e, n)
