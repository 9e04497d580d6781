"""Relations of many pairs of polygons, triangles and boxes of the plane with simple boundaries; compiled.

One strict crossing of two edges, by signs with a bound, proves overlapping: all combinations of inside and outside
occur around it, since no other edge comes near. If edges meet and none cross, every such place has a vertex: each
interior is a sector there, and three comparisons of sectors decide whether the interiors meet, and which body has a
part outside the other. A ring that meets nothing is located by one vertex. This is complete: an edge enters the other's
interior only at a contact, or its whole ring lies there. Pairs that rounded poses leave open stay UNSETTLED.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, TOUCHING, UNSETTLED
from engine.collision.meshes.placement import PoseArrays, orient2d_near
from engine.collision.result import (
    Kind,
    has_faces,
)
from engine.compiling.jit import allocating_kernel, called, entry_of, inline, kernel
from engine.predicates.error_free import two_sum
from engine.predicates.orientation import orient2d
from engine.predicates.vectors import as_point2
from engine.solids.base import Solid
from engine.solids.polygon import Polygon
from engine.solids.primitives import Aabb
from engine.solids.ragged import next_in_rings
from engine.types import UNDECIDED, FlagArray, FloatArray, Int8Array, IntArray, Point2, read_only

MOST_EDGES = 1024
"""Most edges of a body: for more, testing all pairs of edges takes too long."""

_NONE = np.empty((0, 2)), np.empty(0, np.int64), np.empty(0, np.int8)
APART, CROSSING, UNSURE, _VERTEX_EDGE, _VERTEX_VERTEX = range(5)
"""Classes of a pair of edges: no common point, a strict crossing, undecided, and two kinds of contacts."""
KINDS: dict[int, Kind] = {CROSSING: "edge_edge", _VERTEX_EDGE: "vertex_edge", _VERTEX_VERTEX: "vertex_vertex"}
ON_EDGE = 3
"""Location of a point on an edge, besides 1 inside and 0 outside."""
_IN, _OUT, _MAYBE = 1, 2, 4
"""Bits of the rings of a body: _IN, some are inside the other body; _OUT, some are outside; _MAYBE, some are undecided.
"""
_SMALLEST, _LARGEST = 2.0**-480, 2.0**480
"""Range of nonzero coordinates (_SMALLEST, _LARGEST) in which orient2d is never UNDECIDED."""
BLOCK: Final = 8
"""Consecutive edges around which one box lies."""
_POLL_EVERY = 64


OutlineArrays = namedtuple("OutlineArrays", "vertices following sides firsts")
"""Planar bodies, concatenated.

| field | shape | meaning |
|---|---|---|
| vertices | (n, 2) | vertices, ring after ring |
| following | (n,) | the vertex at the end of each edge, counted within its body |
| sides | (n,) | `find_sides` of each edge |
| firsts | (n_bodies + 1,) | offset of each body |
"""


def outline_pool(bodies: Sequence[Solid]) -> tuple[OutlineArrays, IntArray]:
    """Return bodies in one set of arrays, and by body its index there, -1 for a body that the batch kernels do not
    take: without edges, with more than MOST_EDGES, or with a boundary that is not simple."""
    outlines = [outline_arrays(body) if has_faces(body) else _NONE for body in bodies]
    firsts = np.append(np.int64(0), np.cumsum([len(vertices) for vertices, _, _ in outlines]))
    vertices, following, sides = map(np.concatenate, zip(_NONE, *outlines))
    numbers = [
        number if 0 < len(points) <= MOST_EDGES and is_simple_body(body) else -1
        for number, (body, (points, _, _)) in enumerate(zip(bodies, outlines))
    ]
    return OutlineArrays(vertices, following, sides, firsts), np.array(numbers, np.int64)


def rings_of(body: Any) -> tuple[FloatArray, IntArray]:
    """Return vertices (n, 2) and ring offsets (n_rings + 1,) of a polygon, triangle or box of the plane."""
    if isinstance(body, Polygon):
        body.check_not_empty()
    if isinstance(body, Aabb):
        (x0, y0), (x1, y1) = body.min, body.max
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]), np.array([0, 4])
    return body.vertices, body.ring_offsets


def outline_arrays(solid: Solid) -> tuple[FloatArray, IntArray, Int8Array]:
    """Return vertices (n, 2), following (n,) and sides (n,) of a polygon, triangle or box of the plane: edge k runs
    from vertex k to vertex following[k], with the interior on its left (1), its right (-1), or unknown (0). Cached."""
    return solid.prepared("outline", lambda: _arrays(*rings_of(solid)))


def _arrays(vertices: FloatArray, offsets: IntArray) -> tuple[FloatArray, IntArray, Int8Array]:
    """Build the arrays of `outline_arrays` from rings."""
    vertices, following = read_only(vertices), read_only(next_in_rings(offsets))
    sides = np.zeros(len(vertices), np.int8)
    if len(vertices) <= MOST_EDGES:
        entry_of(find_sides)(vertices, following, sides)
    return vertices, following, read_only(sides)


@kernel
def find_sides(vertices: FloatArray, following: IntArray, sides: Int8Array) -> None:
    """Fill sides (n,) int8: 1 if the interior is left of an edge, -1 right, 0 if coordinates are out of range. Caller
    guarantees edges that meet only in vertices. At the lexicographically smallest vertex of a ring the outside of that
    ring is on the left; each enclosing ring flips the side."""
    for vertex in range(len(vertices)):
        for k in range(2):
            size = abs(vertices[vertex, k])
            if not (size == 0.0 or _SMALLEST < size < _LARGEST):
                return
    start = 0
    for edge in range(len(following)):
        if following[edge] > edge:  # not the last of its ring
            continue
        least, before, p = edge, edge, as_point2(vertices, edge)
        for vertex in range(start, edge):
            q = as_point2(vertices, vertex)
            if q.x < p.x or (q.x == p.x and q.y < p.y):
                least, p = vertex, q
        before = edge if least == start else least - 1
        side = orient2d(as_point2(vertices, before), p, as_point2(vertices, following[least]))
        for other in range(len(following)):
            a, b = as_point2(vertices, other), as_point2(vertices, following[other])
            if (a.y <= p.y) != (b.y <= p.y) and not start <= other <= edge:
                if (orient2d(a, b, p) > 0) == (b.y > a.y):
                    side = -side
        for own in range(start, edge + 1):
            sides[own] = side
        start = edge + 1


@inline
def _classify_edges(a: Point2, b: Point2, c: Point2, d: Point2, error: float) -> int:
    """Return the class of edges ab and cd: CROSSING if they provably cross in one point inside both, APART,
    _VERTEX_EDGE or _VERTEX_VERTEX for a contact, or UNSURE. error: bound on each coordinate."""
    slack = 2.0 * error
    if max(a.x, b.x) + slack < min(c.x, d.x) or max(c.x, d.x) + slack < min(a.x, b.x):
        return APART
    if max(a.y, b.y) + slack < min(c.y, d.y) or max(c.y, d.y) + slack < min(a.y, b.y):
        return APART
    by_c, by_d = orient2d_near(a, b, c, error), orient2d_near(a, b, d, error)
    if by_c * by_d == 1:  # UNDECIDED is 2
        return APART
    by_a, by_b = orient2d_near(c, d, a, error), orient2d_near(c, d, b, error)
    if by_a * by_b == 1:
        return APART
    if by_c * by_d == -1 and by_a * by_b == -1:
        return CROSSING
    if UNDECIDED in (by_a, by_b, by_c, by_d):
        return UNSURE
    is_met = (by_a == 0 and is_in_box(a, c, d)) or (by_b == 0 and is_in_box(b, c, d))
    is_met = is_met or (by_c == 0 and is_in_box(c, a, b)) or (by_d == 0 and is_in_box(d, a, b))
    if not is_met:
        return APART
    return _VERTEX_VERTEX if a in (c, d) or b in (c, d) else _VERTEX_EDGE


@kernel
def has_simple_edges(vertices: FloatArray, following: IntArray) -> bool:
    """Return whether edges meet only in the vertices between consecutive ones, and none has length 0."""
    for i in range(len(vertices)):
        a, b = as_point2(vertices, i), as_point2(vertices, following[i])
        c = as_point2(vertices, following[following[i]])
        if (a.x == b.x and a.y == b.y) or following[following[i]] == i:
            return False
        is_ahead = (b.x - a.x) * (c.x - b.x) + (b.y - a.y) * (c.y - b.y) > 0.0
        if not is_ahead and orient2d(a, b, c) in (0, UNDECIDED):
            return False
        for j in range(i):
            if following[i] == j or following[j] == i:
                continue
            if _classify_edges(a, b, as_point2(vertices, j), as_point2(vertices, following[j]), 0.0) != APART:
                return False
    return True


@inline
def _place(vertices: FloatArray, turn: FloatArray, move: FloatArray, placed: FloatArray) -> float:
    """Write the vertices of a body under rotation `turn` (2, 2) and translation `move` (2,), rounded, to `placed`;
    return a bound on the error of a coordinate, 0.0 if nothing was rounded (`placement.py`)."""
    reach, is_exact = 0.0, True
    for axis in range(2):  # a turn by the lattice
        x, y = turn[axis, 0], turn[axis, 1]
        is_exact = is_exact and x * y == 0.0 and abs(x + y) == 1.0
    for vertex in range(len(vertices)):
        x, y = vertices[vertex, 0], vertices[vertex, 1]
        reach = max(reach, abs(x), abs(y))
        for axis in range(2):
            value, lost = two_sum(turn[axis, 0] * x + turn[axis, 1] * y, move[axis])
            is_exact = is_exact and lost == 0.0
            placed[vertex, axis] = value
    if is_exact:
        return 0.0
    return 2.0**-49 * (3.0 * reach + max(abs(move[0]), abs(move[1]))) + 2.0**-1060


@inline
def n_blocks(n_edges: int) -> int:
    """Return the number of blocks of `BLOCK` edges."""
    return (n_edges + BLOCK - 1) // BLOCK


@inline
def box_blocks(points: FloatArray, following: IntArray, boxes: FloatArray) -> None:
    """Write the box of each block of edges to `boxes` (n_blocks, 4): low x, low y, high x, high y."""
    for edge in range(len(following)):
        a, b, block = as_point2(points, edge), as_point2(points, following[edge]), edge // BLOCK
        x, y, right, top = min(a.x, b.x), min(a.y, b.y), max(a.x, b.x), max(a.y, b.y)
        if edge % BLOCK:
            x, y = min(x, boxes[block, 0]), min(y, boxes[block, 1])
            right, top = max(right, boxes[block, 2]), max(top, boxes[block, 3])
        boxes[block, 0], boxes[block, 1], boxes[block, 2], boxes[block, 3] = x, y, right, top


@inline
def _is_clear_of_block(boxes: FloatArray, block: int, a: Point2, b: Point2, slack: float) -> bool:
    """Return whether edge ab is more than `slack` away from the box of block `block`, along x or y."""
    if max(a.x, b.x) + slack < boxes[block, 0] or boxes[block, 2] + slack < min(a.x, b.x):
        return True
    return max(a.y, b.y) + slack < boxes[block, 1] or boxes[block, 3] + slack < min(a.y, b.y)


@inline
def inside(p: Point2, vertices: FloatArray, following: IntArray, error: float) -> int:
    """Return 1 if p is inside the rings of a body (even-odd), 0 outside, ON_EDGE, or UNSURE. Edge k runs from vertex k
    to following[k]. error: bound on each coordinate."""
    is_inside = 0
    for edge in range(len(following)):
        a, b = as_point2(vertices, edge), as_point2(vertices, following[edge])
        if max(a.x, b.x) + 2.0 * error < p.x or min(a.y, b.y) > p.y + 2.0 * error or max(a.y, b.y) + 2.0 * error < p.y:
            continue
        if error != 0.0 and min(abs(a.y - p.y), abs(b.y - p.y)) <= 2.0 * error:
            return UNSURE
        if a == p or (a.y == b.y and min(a.x, b.x) <= p.x):
            return ON_EDGE
        if (a.y <= p.y) == (b.y <= p.y):
            continue
        side = orient2d_near(a, b, p, error)
        if side == UNDECIDED or side == 0:
            return ON_EDGE if side == 0 else UNSURE
        if (side > 0) == (b.y > a.y):
            is_inside = 1 - is_inside
    return is_inside


@inline
def _rings_inside(points: FloatArray, following: IntArray, vertices: FloatArray, theirs: IntArray, error: float) -> int:
    """Return where the rings of one body (points, following) lie in another (vertices, theirs), by one vertex of each,
    as bits: _IN some inside, _OUT some outside, _MAYBE some undecided. A vertex on an edge of the other adds no bit."""
    bits = 0
    for vertex in range(len(following)):
        if following[vertex] > vertex:  # not the last of its ring
            continue
        where = inside(as_point2(points, vertex), vertices, theirs, error)
        if where != ON_EDGE:
            bits |= _IN if where == 1 else (_OUT if where == 0 else _MAYBE)
    return bits


@inline
def relate_placed(
    points: FloatArray, following: IntArray, sides: Any, vertices: FloatArray, theirs: IntArray, their_sides: Any,
    boxes: FloatArray, error: float,
) -> tuple[int, int, int, int, int]:  # fmt: skip
    """Relate two placed bodies, (points, following, sides) and (vertices, theirs, their_sides). boxes: of the second
    body's blocks of edges; error: bound on each coordinate. sides: as `find_sides` has them; empty: contacts give
    UNSETTLED.

    | result | meaning |
    |---|---|
    | 0 | the relation, or UNSETTLED; if a boundary is not simple it only says whether the bodies meet |
    | 1 | the bits IN_BOTH, OUT_OF_SECOND, OUT_OF_FIRST that are proven |
    | 2, 3 | the first edges of either body that meet, -1 for none; the first body's -1 if they may not be the first |
    | 4 | the class of these two edges, APART for none |
    """
    is_unsure, bits, first, second, kind = False, 0, -1, -1, APART
    for edge in range(len(following)):
        a, b = as_point2(points, edge), as_point2(points, following[edge])
        for block in range(n_blocks(len(theirs))):
            if _is_clear_of_block(boxes, block, a, b, 2.0 * error):
                continue
            for other in range(BLOCK * block, min(BLOCK * (block + 1), len(theirs))):
                c, d = as_point2(vertices, other), as_point2(vertices, theirs[other])
                how = _classify_edges(a, b, c, d, error)
                if how == APART:
                    continue
                if how == UNSURE:
                    is_unsure = True
                elif kind == APART:
                    first, second, kind = (-1 if is_unsure else edge), other, how
                if how == CROSSING:
                    return OVERLAPPING, IN_BOTH | OUT_OF_FIRST | OUT_OF_SECOND, first, second, kind
                if how > UNSURE:
                    if len(sides) == 0 or len(their_sides) == 0 or sides[edge] == 0 or their_sides[other] == 0:
                        return UNSETTLED, 0, -1, -1, kind
                    side, their_side = sides[edge], their_sides[other]
                    bits |= contact_bits(points, following, edge, side, vertices, theirs, other, their_side)
    if is_unsure:
        return UNSETTLED, 0, -1, -1, kind
    own = _rings_inside(points, following, vertices, theirs, error)
    their = _rings_inside(vertices, theirs, points, following, error)
    if (own | their) & _MAYBE:
        return UNSETTLED, 0, -1, -1, kind
    if kind == APART and own == _IN and their == _OUT:
        return FIRST_INSIDE_SECOND, IN_BOTH | OUT_OF_FIRST, -1, -1, kind
    if kind == APART and own == _OUT and their == _IN:
        return SECOND_INSIDE_FIRST, IN_BOTH | OUT_OF_SECOND, -1, -1, kind
    bits |= (IN_BOTH | OUT_OF_FIRST if own & _IN else 0) | (OUT_OF_SECOND if own & _OUT else 0)
    bits |= (IN_BOTH | OUT_OF_SECOND if their & _IN else 0) | (OUT_OF_FIRST if their & _OUT else 0)
    if bits & IN_BOTH:
        return OVERLAPPING, bits, first, second, kind
    return (DISJOINT if kind == APART else TOUCHING), bits, first, second, kind


@allocating_kernel
def relate_outline_pairs(
    pool: OutlineArrays, bodies: IntArray, poses: PoseArrays, pairs: IntArray, has_detail: bool, relations: Int8Array,
    flag: FlagArray,
) -> None:  # fmt: skip
    """Replace the UNSETTLED entries of relations (n,) int8 by the relation codes of pairs (n, 2) of rows where floats
    prove one. A row is a body under a pose: bodies (n_rows,), its index in the pool or -1; poses, one a row.
    has_detail: overlaps other than PO stay UNSETTLED. Returns early when the flag is set."""
    placed, others = np.empty((MOST_EDGES, 2)), np.empty((MOST_EDGES, 2))
    boxes = np.empty((n_blocks(MOST_EDGES), 4))
    r, t = poses.rotations, poses.translations
    for item in range(pairs.shape[0]):
        if item % _POLL_EVERY == 0 and flag[0] != 0:
            return
        i, j = pairs[item, 0], pairs[item, 1]
        if relations[item] != UNSETTLED or bodies[i] < 0 or bodies[j] < 0:
            continue
        own = slice(pool.firsts[bodies[i]], pool.firsts[bodies[i] + 1])
        their = slice(pool.firsts[bodies[j]], pool.firsts[bodies[j] + 1])
        following, theirs, vertices = pool.following[own], pool.following[their], pool.vertices
        error = max(_place(vertices[own], r[i], t[i], placed), _place(vertices[their], r[j], t[j], others))
        box_blocks(others, theirs, boxes)
        sides, their_sides = pool.sides[own], pool.sides[their]
        relation, bits, _, _, _ = relate_placed(placed, following, sides, others, theirs, their_sides, boxes, error)
        if not has_detail or relation != OVERLAPPING or bits == IN_BOTH | OUT_OF_FIRST | OUT_OF_SECOND:
            relations[item] = relation


@allocating_kernel
def relate_two(
    vertices: FloatArray, following: IntArray, sides: Int8Array, turn: FloatArray, move: FloatArray, other: FloatArray,
    theirs: IntArray, their_sides: Int8Array, their_turn: FloatArray, their_move: FloatArray,
) -> tuple[int, int, int, int, int]:  # fmt: skip
    """Relate two outlines, each under a rotation (2, 2) and a translation (2,); the five results are those of
    `relate_placed`: relation, bits, two edges that meet, and their class."""
    placed, others, boxes = np.empty((len(vertices), 2)), np.empty((len(other), 2)), np.empty((n_blocks(len(other)), 4))
    error = max(_place(vertices, turn, move, placed), _place(other, their_turn, their_move, others))
    box_blocks(others, theirs, boxes)
    return relate_placed(placed, following, sides, others, theirs, their_sides, boxes, error)


def is_simple_body(solid: Solid) -> bool:
    """Return `has_simple_edges` of a body; cached."""
    return solid.prepared("is_simple", lambda: bool(has_simple_edges(*outline_arrays(solid)[:2])))


IN_BOTH, OUT_OF_SECOND, OUT_OF_FIRST = 1, 2, 4
"""Bits of two bodies: IN_BOTH, the open interiors intersect; OUT_OF_SECOND, a part of the first is outside the second;
OUT_OF_FIRST, vice versa."""


@inline
def is_in_box(p: Point2, a: Point2, b: Point2) -> bool:
    """Return whether p lies in the box around segment ab."""
    return min(a.x, b.x) <= p.x <= max(a.x, b.x) and min(a.y, b.y) <= p.y <= max(a.y, b.y)


@inline
def _is_in_sector(p: Point2, s: Point2, e: Point2, x: Point2) -> bool:
    """Return whether the direction from p to x lies in the half-open sector at p that runs from the direction of s
    (included) counter-clockwise to that of e (excluded)."""
    by_s, by_e, turn = orient2d(p, s, x), orient2d(p, x, e), orient2d(p, s, e)
    if by_s == 0 and (s.x > p.x) == (x.x > p.x) and (s.x < p.x) == (x.x < p.x):
        if (s.y > p.y) == (x.y > p.y) and (s.y < p.y) == (x.y < p.y):
            return True
    if turn == 0:
        return by_s > 0
    return (by_s > 0 and by_e > 0) if turn > 0 else (by_s > 0 or by_e > 0)


@called
def _sectors_intersect(p: Point2, s: Point2, e: Point2, t: Point2, f: Point2) -> bool:
    """Return whether two open sectors at p intersect: the one from the direction of s counter-clockwise to e, and the
    one from t to f."""
    return _is_in_sector(p, s, e, t) or _is_in_sector(p, t, f, s)


@inline
def _sector_bits(p: Point2, before: Point2, after: Point2, side: int, c: Point2, d: Point2, their_side: int) -> int:
    """Return the bits IN_BOTH, OUT_OF_SECOND, OUT_OF_FIRST that two boundaries through a point p prove near p. before,
    after: neighbours of p on one boundary; c, d: on the other. side, their_side: 1 if the interior is on the left, -1
    if on the right."""
    s, e = (after, before) if side > 0 else (before, after)
    t, f = (d, c) if their_side > 0 else (c, d)
    bits = IN_BOTH if _sectors_intersect(p, s, e, t, f) else 0
    bits |= OUT_OF_SECOND if _sectors_intersect(p, s, e, f, t) else 0
    return bits | (OUT_OF_FIRST if _sectors_intersect(p, t, f, e, s) else 0)


@called
def contact_bits(
    points: FloatArray, following: IntArray, edge: int, side: int, vertices: FloatArray, theirs: IntArray, other: int,
    their_side: int,
) -> int:  # fmt: skip
    """Return the bits IN_BOTH, OUT_OF_SECOND, OUT_OF_FIRST proven near the points where edge `edge` of one placed body
    meets edge `other` of another, if these are vertices but not the start of either edge: there the edge before ends.
    side, their_side: 1 if the interior is on the left of the edge, -1 on the right."""
    a, b = as_point2(points, edge), as_point2(points, following[edge])
    c, d = as_point2(vertices, other), as_point2(vertices, theirs[other])
    bits = 0
    if b != c and is_in_box(b, c, d) and orient2d(c, d, b) == 0:
        after = as_point2(points, following[following[edge]])
        their_after = as_point2(vertices, theirs[theirs[other]]) if b == d else d
        bits = _sector_bits(b, a, after, side, c, their_after, their_side)
    if d != a and d != b and is_in_box(d, a, b) and orient2d(a, b, d) == 0:
        bits |= _sector_bits(d, a, b, side, c, as_point2(vertices, theirs[theirs[other]]), their_side)
    return bits
