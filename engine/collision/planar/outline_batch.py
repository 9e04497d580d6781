"""Pairs of planar bodies in compiled code: polygons, triangles and boxes whose edges meet only where they follow each
other.

One strict crossing of two edges, by signs with a bound, proves overlapping: about it lie all combinations of inside and
outside, for no other edge comes near. Where all edges are surely apart, a vertex of each ring tells whether it lies in
the other body. Contacts, and what rounded poses leave open, stay UNSETTLED for the exact path.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, UNSETTLED
from engine.collision.meshes.placement import PoseArrays, orient2d_near
from engine.collision.planar.outline import collide_outline_outline, rings_of
from engine.collision.result import FIRST_WITHIN, OUTLINES, SECOND_WITHIN, UNNAMED, Collision, Poses, Witness, Work
from engine.direct import entry_of
from engine.jit import allocating_kernel, inline, kernel
from engine.predicates.orientation import orient2d
from engine.predicates.vectors import as_point2
from engine.solids.base import Solid
from engine.solids.pose import motion_of
from engine.solids.ragged import next_in_rings
from engine.types import UNDECIDED, Point2, Relation

MOST_EDGES = 1024
"""Beyond, pairs of edges are too many to look at all of them."""

_NONE = np.empty((0, 2)), np.empty(0, np.int64)
UNSURE = 2
BLOCK: Final = 8
"""Edges that follow each other in number, in one box: what that box misses, they miss."""
_POLL_EVERY = 64


OutlineArrays = namedtuple("OutlineArrays", "vertices following firsts")
"""Several bodies, one after another. vertices (n, 2); following (n,): the vertex at the end of each edge, counted
within its body; firsts (n_bodies + 1,): of each body."""


def outline_pool(bodies: Sequence[Solid]) -> tuple[OutlineArrays, IntArray]:
    """Return the bodies as arrays, and for each its number there, -1 for one that the batches do not take."""
    outlines = [outline_arrays(body) if body.type in OUTLINES else _NONE for body in bodies]
    firsts = np.append(np.int64(0), np.cumsum([len(vertices) for vertices, _ in outlines]))
    vertices, following = map(np.concatenate, zip(_NONE, *outlines))
    numbers = [
        number if 0 < len(points) <= MOST_EDGES and _is_simple(body) else -1
        for number, (body, (points, _)) in enumerate(zip(bodies, outlines))
    ]
    return OutlineArrays(vertices, following, firsts), np.array(numbers, np.int64)


def outline_arrays(solid: Solid) -> tuple[FloatArray, IntArray]:
    """Return the vertices (n, 2) of a polygon, triangle or box, and for each edge the vertex at its end."""
    return solid.prepared("outline", lambda: _arrays(*rings_of(solid)))


def _arrays(vertices: FloatArray, offsets: IntArray) -> tuple[FloatArray, IntArray]:
    return read_only(vertices), read_only(next_in_rings(offsets))


@inline
def _is_in_box(p: Point2, a: Point2, b: Point2) -> bool:
    """Tell whether a point lies in the box of an edge."""
    return min(a.x, b.x) <= p.x <= max(a.x, b.x) and min(a.y, b.y) <= p.y <= max(a.y, b.y)


@inline
def _crossing(a: Point2, b: Point2, c: Point2, d: Point2, error: float) -> int:
    """Return 1 if two open edges surely cross in one point, 0 if they are surely apart, else UNSURE."""
    slack = 2.0 * error
    if max(a.x, b.x) + slack < min(c.x, d.x) or max(c.x, d.x) + slack < min(a.x, b.x):
        return 0
    if max(a.y, b.y) + slack < min(c.y, d.y) or max(c.y, d.y) + slack < min(a.y, b.y):
        return 0
    by_c, by_d = orient2d_near(a, b, c, error), orient2d_near(a, b, d, error)
    if by_c * by_d == 1:  # UNDECIDED is 2
        return 0
    by_a, by_b = orient2d_near(c, d, a, error), orient2d_near(c, d, b, error)
    if by_a * by_b == 1:
        return 0
    if by_c * by_d == -1 and by_a * by_b == -1:
        return 1
    if UNDECIDED in (by_a, by_b, by_c, by_d):
        return UNSURE
    is_met = (by_a == 0 and _is_in_box(a, c, d)) or (by_b == 0 and _is_in_box(b, c, d))
    is_met = is_met or (by_c == 0 and _is_in_box(c, a, b)) or (by_d == 0 and _is_in_box(d, a, b))
    return UNSURE if is_met else 0


@kernel
def is_simple(vertices: Any, following: Any) -> bool:
    """Tell whether no two edges of these rings meet but in the vertex between them, and none has length 0."""
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
            if _crossing(a, b, as_point2(vertices, j), as_point2(vertices, following[j]), 0.0) != 0:
                return False
    return True


@inline
def _place(vertices: Any, turn: Any, move: Any, is_posed: bool, placed: Any) -> float:
    """Write the rounded posed vertices of a body; return a bound on the error of each coordinate (`placement.py`)."""
    reach = 0.0
    for vertex in range(len(vertices)):
        x, y = vertices[vertex, 0], vertices[vertex, 1]
        reach = max(reach, abs(x), abs(y))
        for axis in range(2):
            value = x if axis == 0 else y
            if is_posed:
                value = turn[axis, 0] * x + turn[axis, 1] * y + move[axis]
            placed[vertex, axis] = value
    return 2.0**-49 * (3.0 * reach + max(abs(move[0]), abs(move[1]))) + 2.0**-1060 if is_posed else 0.0


@inline
def n_blocks(n_edges: int) -> int:
    """Return how many blocks so many edges have."""
    return (n_edges + BLOCK - 1) // BLOCK


@inline
def box_blocks(points: Any, following: Any, boxes: Any) -> None:
    """Write the box of each block of edges: low x, low y, high x, high y."""
    for edge in range(len(following)):
        a, b, block = as_point2(points, edge), as_point2(points, following[edge]), edge // BLOCK
        x, y, right, top = min(a.x, b.x), min(a.y, b.y), max(a.x, b.x), max(a.y, b.y)
        if edge % BLOCK:
            x, y = min(x, boxes[block, 0]), min(y, boxes[block, 1])
            right, top = max(right, boxes[block, 2]), max(top, boxes[block, 3])
        boxes[block, 0], boxes[block, 1], boxes[block, 2], boxes[block, 3] = x, y, right, top


@inline
def _misses(boxes: Any, block: int, a: Point2, b: Point2, slack: float) -> bool:
    """Tell whether an edge a b is further than a slack from the box of a block."""
    if max(a.x, b.x) + slack < boxes[block, 0] or boxes[block, 2] + slack < min(a.x, b.x):
        return True
    return max(a.y, b.y) + slack < boxes[block, 1] or boxes[block, 3] + slack < min(a.y, b.y)


@inline
def inside(p: Point2, vertices: Any, following: Any, error: float) -> int:
    """Return 1 for a point inside the rings, 0 outside, UNSURE where a bound does not tell."""
    is_inside = 0
    for edge in range(len(following)):
        a, b = as_point2(vertices, edge), as_point2(vertices, following[edge])
        if max(a.x, b.x) + 2.0 * error < p.x or min(a.y, b.y) > p.y + 2.0 * error or max(a.y, b.y) + 2.0 * error < p.y:
            continue
        if error != 0.0 and min(abs(a.y - p.y), abs(b.y - p.y)) <= 2.0 * error:
            return UNSURE
        if (a.y <= p.y) == (b.y <= p.y):
            continue
        side = orient2d_near(a, b, p, error)
        if side == UNDECIDED or side == 0:
            return UNSURE
        if (side > 0) == (b.y > a.y):
            is_inside = 1 - is_inside
    return is_inside


@inline
def _rings_inside(points: Any, following: Any, vertices: Any, their_following: Any, error: float) -> int:
    """Return 1 if all rings of a body lie inside another one that they do not meet, 0 if none does, else UNSURE."""
    found = -1
    for vertex in range(len(following)):
        if following[vertex] > vertex:  # not the last of its ring
            continue
        where = inside(as_point2(points, vertex), vertices, their_following, error)
        if where == UNSURE or (found >= 0 and where != found):
            return UNSURE
        found = where
    return found


@inline
def relate_placed(
    points: Any, following: Any, vertices: Any, theirs: Any, boxes: Any, error: float
) -> tuple[int, int, int]:
    """Return the relation of two placed bodies, or UNSETTLED, and the edges that cross, -1 for none or not the first.

    Of bodies that are not simple OVERLAPPING says no more than that they meet. boxes: of the second's blocks. error: of
    each coordinate.
    """
    is_unsure = False
    for edge in range(len(following)):
        a, b = as_point2(points, edge), as_point2(points, following[edge])
        for block in range(n_blocks(len(theirs))):
            if _misses(boxes, block, a, b, 2.0 * error):
                continue
            for other in range(BLOCK * block, min(BLOCK * (block + 1), len(theirs))):
                c, d = as_point2(vertices, other), as_point2(vertices, theirs[other])
                how = _crossing(a, b, c, d, error)
                if how == 1:
                    return OVERLAPPING, (-1 if is_unsure else edge), other
                is_unsure |= how != 0
    if is_unsure:
        return UNSETTLED, -1, -1
    in_second = _rings_inside(points, following, vertices, theirs, error)
    in_first = _rings_inside(vertices, theirs, points, following, error)
    if in_second == 0 and in_first == 0:
        return DISJOINT, -1, -1
    if in_second + in_first == 1:
        return FIRST_INSIDE_SECOND if in_second == 1 else SECOND_INSIDE_FIRST, -1, -1
    return UNSETTLED, -1, -1


@allocating_kernel
def relate_outline_pairs(
    pool: OutlineArrays, bodies: Any, rows: Any, poses: PoseArrays, pairs: Any, relations: Any, flag: Any
) -> None:
    """Fill what is UNSETTLED in relations (n,) int8 for pairs (n, 2) of bodies of a scene.

    bodies: of each its number in the pool, or -1; rows: of each the row of its pose, 0 for none. Returns early when the
    flag is raised.
    """
    placed, boxes = np.empty((2, MOST_EDGES, 2)), np.empty((n_blocks(MOST_EDGES), 4))
    for item in range(pairs.shape[0]):
        if item % _POLL_EVERY == 0 and flag[0] != 0:
            return
        i, j = bodies[pairs[item, 0]], bodies[pairs[item, 1]]
        if relations[item] != UNSETTLED or i < 0 or j < 0:
            continue
        i_row, j_row = rows[pairs[item, 0]], rows[pairs[item, 1]]
        own, their = slice(pool.firsts[i], pool.firsts[i + 1]), slice(pool.firsts[j], pool.firsts[j + 1])
        r, t = poses.rotations, poses.translations
        error = _place(pool.vertices[own], r[i_row], t[i_row], i_row != 0, placed[0])
        error = max(error, _place(pool.vertices[their], r[j_row], t[j_row], j_row != 0, placed[1]))
        box_blocks(placed[1], pool.following[their], boxes)
        relations[item], _, _ = relate_placed(
            placed[0], pool.following[own], placed[1], pool.following[their], boxes, error
        )


@allocating_kernel
def _relate_two(
    vertices: Any, following: Any, turn: Any, move: Any, other: Any, their_following: Any, their_turn: Any,
    their_move: Any, are_posed: tuple[bool, bool],
) -> tuple[int, int, int]:  # fmt: skip
    """Return what `relate_placed` does, of two bodies under poses."""
    n = len(vertices)
    placed, boxes = np.empty((n + len(other), 2)), np.empty((n_blocks(len(other)), 4))
    error = _place(vertices, turn, move, are_posed[0], placed[:n])
    error = max(error, _place(other, their_turn, their_move, are_posed[1], placed[n:]))
    box_blocks(placed[n:], their_following, boxes)
    return relate_placed(placed[:n], following, placed[n:], their_following, boxes, error)


def collide_outlines(first: Solid, second: Solid, poses: Poses, work: Work) -> Collision:
    """Return what `collide_outline_outline` does, which decides what is not sure here."""
    (vertices, following), (other, their_following) = outline_arrays(first), outline_arrays(second)
    if max(len(following), len(their_following)) > MOST_EDGES:
        return collide_outline_outline(first, second, poses, work)
    own, their = motion_of(poses[0], 2), motion_of(poses[1], 2)
    relation, i, j = entry_of(_relate_two)(
        vertices, following, *own, other, their_following, *their, (poses[0] is not None, poses[1] is not None)
    )
    is_sure = relation != UNSETTLED and (relation == DISJOINT or (_is_simple(first) and _is_simple(second)))
    if not is_sure or (relation == OVERLAPPING and work.witness and i < 0):
        return collide_outline_outline(first, second, poses, work)
    if relation == DISJOINT or not work.witness:
        return UNNAMED[relation]
    if relation == OVERLAPPING:
        return Collision(Relation.OVERLAPPING, Witness("edge_edge", i, j))
    return FIRST_WITHIN if relation == FIRST_INSIDE_SECOND else SECOND_WITHIN


def _is_simple(solid: Solid) -> bool:
    return solid.prepared("is_simple", lambda: bool(is_simple(*outline_arrays(solid))))
