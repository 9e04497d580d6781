"""Relations of many pairs of polygons, triangles and boxes of the plane, and of one pair; compiled.

UNSETTLED stay pairs of which one boundary is not simple, unless they are disjoint, and pairs out of the range of exact
signs (`placed_outline.py`).
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from engine.arrangement.simple_rings import fill_tree, find_rings, n_leaves
from engine.collision.codes import OVERLAPPING, UNSETTLED
from engine.collision.meshes.placement import PoseArrays
from engine.collision.placed_outline import (
    APART,
    CROSSING,
    IN_BOTH,
    OUT_OF_FIRST,
    OUT_OF_SECOND,
    POLL_EVERY,
    VERTEX_EDGE,
    VERTEX_VERTEX,
    Body,
    PlacedOutline,
    place,
    relate_placed,
    rounded,
    rows_of,
    set_rests,
)
from engine.collision.result import Kind, has_faces
from engine.compiling.jit import allocating_kernel, entry_of, inline
from engine.predicates.vectors import as_point2
from engine.running.budget import UNLIMITED, Budget
from engine.solids.base import Solid
from engine.solids.primitives import Aabb
from engine.solids.ragged import summed
from engine.types import FlagArray, FloatArray, Int8Array, Int32Array, IntArray, Point2, read_only

_NONE = np.empty((0, 2)), np.zeros(1, np.int64)
KINDS: dict[int, Kind] = {CROSSING: "edge_edge", VERTEX_EDGE: "vertex_edge", VERTEX_VERTEX: "vertex_vertex"}
_AT_ONCE: Final = 64
"""Most edges of a body whose arrays are built together with those of other bodies, and not cached with it."""

OutlineArrays = namedtuple("OutlineArrays", "vertices following sides firsts")
"""Planar bodies, concatenated.

| field | shape | meaning |
|---|---|---|
| vertices | (n, 2) | vertices, ring after ring |
| following | (n,) | the vertex at the end of each edge, counted within its body |
| sides | (n,) | of each edge: 1 if the interior is on its left, -1 on its right, 0 if the boundary is not simple |
| firsts | (n_bodies + 1,) | offset of each body |
"""
Room = namedtuple("Room", "points rests boxes")
"""Work space for a `PlacedOutline`."""


def outline_pool(bodies: Sequence[Solid], budget: Budget = UNLIMITED) -> tuple[OutlineArrays, IntArray]:
    """Return bodies in one set of arrays, and by body its index there, -1 for a body without edges."""
    of_kind = dict(zip(map(type, bodies), bodies))
    has_edges = {kind: has_faces(body) for kind, body in of_kind.items()}
    rings: list[tuple[Any, Any]] = [rings_of(body) if has_edges[type(body)] else _NONE for body in bodies]
    sizes = np.array([len(vertices) for vertices, _ in rings], np.int64)
    vertices = np.frombuffer(b"".join([vertices for vertices, _ in rings])).reshape(-1, 2)
    counts = np.array([len(offsets) for _, offsets in rings], np.int64)
    joined = np.frombuffer(b"".join([offsets for _, offsets in rings]), np.int64)
    lengths = np.delete(np.diff(joined, append=0), np.cumsum(counts) - 1)
    following, sides, firsts = np.empty(len(vertices), np.int64), np.zeros(len(vertices), np.int8), summed(sizes)
    groups = summed(lengths), summed(counts - 1)
    if len(vertices):
        entry_of(find_rings)(vertices, *groups, _AT_ONCE, following, sides, budget.flag)
        budget.check()
    for number in np.flatnonzero(sizes > _AT_ONCE).tolist():
        sides[firsts[number] : firsts[number + 1]] = outline_arrays(bodies[number], budget)[2]
    pool = OutlineArrays(vertices, read_only(following), read_only(sides), firsts)
    return pool, np.where(sizes > 0, np.arange(len(bodies)), -1)


def rings_of(body: Any) -> tuple[FloatArray, IntArray]:
    """Return vertices (n, 2) and ring offsets (n_rings + 1,) of a polygon, triangle or box of the plane."""
    if isinstance(body, Aabb):
        (x0, y0), (x1, y1) = body.min, body.max
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]), np.array([0, 4])
    if not len(body.vertices):
        body.check_not_empty()
    return body.vertices, body.ring_offsets


def outline_arrays(solid: Solid, budget: Budget = UNLIMITED) -> tuple[FloatArray, IntArray, Int8Array]:
    """Return vertices (n, 2), following (n,) and sides (n,) of a polygon, triangle or box of the plane: edge k runs
    from vertex k to vertex following[k], with the interior on its left (1), its right (-1), or unknown (0), if edges
    meet elsewhere than in the vertices between consecutive ones. Cached."""
    cached: tuple[FloatArray, IntArray, Int8Array] | None = solid.cached("outline")
    return solid.prepared("outline", lambda: _arrays(*rings_of(solid), budget)) if cached is None else cached


def _arrays(vertices: FloatArray, offsets: IntArray, budget: Budget) -> tuple[FloatArray, IntArray, Int8Array]:
    """Build the arrays of `outline_arrays` from rings."""
    n, vertices = len(vertices), read_only(vertices)
    following, sides = np.empty(n, np.int64), np.zeros(n, np.int8)
    whole = read_only(np.array([0, len(offsets) - 1]))
    entry_of(find_rings)(vertices, read_only(offsets), whole, n, following, sides, budget.flag)
    budget.check()
    return vertices, read_only(following), read_only(sides)


@inline
def _relate(
    own: Body, their: Body, room: Room, their_room: Room, is_boolean: bool, is_named: bool, stop: FlagArray
) -> tuple[int, int, int, int, int]:
    """Relate two bodies under their poses, as `relate_placed`: with rounded coordinates, then with exact ones, if also
    is_named and rounded ones leave open which edges meet first."""
    n, m = len(own.vertices), len(their.vertices)
    points, others = room.points[:n], their_room.points[:m]
    boxes, their_boxes = room.boxes[: 2 * n_leaves(n)], their_room.boxes[: 2 * n_leaves(m)]
    error = max(place(own, points), place(their, others))
    fill_tree(others, their.following, their_boxes)
    a = rounded(points, own.following, own.sides, boxes)
    b = rounded(others, their.following, their.sides, their_boxes)
    answer = relate_placed(a, b, error, is_boolean, stop)
    is_open = answer[0] == UNSETTLED or (is_named and answer[4] != APART and answer[2] < 0)
    if not is_open or error == 0.0:
        return answer
    rests, their_rests = room.rests[:n], their_room.rests[:m]
    if not (set_rests(own, points, rests) and set_rests(their, others, their_rests)):
        return answer
    a = PlacedOutline(points, rests, own.following, own.sides, boxes)
    b = PlacedOutline(others, their_rests, their.following, their.sides, their_boxes)
    return relate_placed(a, b, error, is_boolean, stop)


@allocating_kernel
def relate_outline_pairs(
    pool: OutlineArrays, bodies: IntArray, poses: PoseArrays, pairs: IntArray, is_boolean: bool, has_detail: bool,
    relations: Int8Array, contacts: Int32Array, stop: FlagArray,
) -> None:  # fmt: skip
    """Replace the UNSETTLED entries of relations (n,) int8 by the relation codes of pairs (n, 2) of rows where signs
    prove one. A row is a body under a pose: bodies (n_rows,), its index in the pool or -1; poses, one a row.
    is_boolean: a contact may be given as TOUCHING whatever else is true. has_detail: overlaps other than PO stay
    UNSETTLED. contacts (n, 3), or (0, 3): filled with the first edges that meet, -1 for none, and their class. Returns
    early when `stop` is set."""
    largest = 0
    for body in range(len(pool.firsts) - 1):
        largest = max(largest, pool.firsts[body + 1] - pool.firsts[body])
    points, boxes = np.empty((2, largest, 6)), np.empty((2, 2 * n_leaves(largest), 4))
    flat = points.reshape(-1)
    at = 2 * largest
    room = Room(flat[:at].reshape(largest, 2), flat[at : 3 * at].reshape(largest, 4), boxes[0])
    other = Room(flat[3 * at : 4 * at].reshape(largest, 2), flat[4 * at :].reshape(largest, 4), boxes[1])
    r, t = poses.rotations, poses.translations
    for item in range(pairs.shape[0]):
        if item % POLL_EVERY == 0 and stop[0] != 0:
            return
        i, j = pairs[item, 0], pairs[item, 1]
        if relations[item] != UNSETTLED or bodies[i] < 0 or bodies[j] < 0:
            continue
        own = slice(pool.firsts[bodies[i]], pool.firsts[bodies[i] + 1])
        their = slice(pool.firsts[bodies[j]], pool.firsts[bodies[j] + 1])
        relation, bits, first, second, kind = _relate(
            Body(pool.vertices[own], pool.following[own], pool.sides[own], rows_of(r[i]), as_point2(t, i)),
            Body(pool.vertices[their], pool.following[their], pool.sides[their], rows_of(r[j]), as_point2(t, j)),
            room, other, is_boolean, len(contacts) > 0, stop,
        )  # fmt: skip
        if not has_detail or relation != OVERLAPPING or bits == IN_BOTH | OUT_OF_FIRST | OUT_OF_SECOND:
            relations[item] = relation
            if len(contacts) > 0:
                contacts[item, 0], contacts[item, 1], contacts[item, 2] = first, second, kind


@allocating_kernel
def relate_two(
    vertices: FloatArray, following: IntArray, sides: Int8Array, turn: FloatArray, move: FloatArray, other: FloatArray,
    theirs: IntArray, their_sides: Int8Array, their_turn: FloatArray, their_move: FloatArray, is_boolean: bool,
    is_named: bool, stop: FlagArray,
) -> tuple[int, int, int, int, int]:  # fmt: skip
    """Relate two outlines as `relate_placed` does. vertices .. sides, and other .. their_sides: arrays of each, as from
    `outline_arrays`; turn (2, 2), move (2,), and their_turn, their_move: rotation and translation of each. is_boolean,
    is_named: as in `_relate`."""
    n, m = len(vertices), len(other)
    flat = np.empty(6 * (n + m))
    boxes = np.empty((2 * (n_leaves(n) + n_leaves(m)), 4))
    at, end = 2 * n_leaves(n), 6 * n + 2 * m
    return _relate(
        Body(vertices, following, sides, rows_of(turn), Point2(move[0], move[1])),
        Body(other, theirs, their_sides, rows_of(their_turn), Point2(their_move[0], their_move[1])),
        Room(flat[: 2 * n].reshape(n, 2), flat[2 * n : 6 * n].reshape(n, 4), boxes[:at]),
        Room(flat[6 * n : end].reshape(m, 2), flat[end:].reshape(m, 4), boxes[at:]), is_boolean, is_named, stop,
    )  # fmt: skip
