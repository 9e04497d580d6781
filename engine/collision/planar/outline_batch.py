"""Pairs of planar bodies in batches: polygons, triangles and boxes whose edges meet only where they follow each other.

One strict crossing of two edges, by signs with a bound, proves overlapping: about it lie all combinations of inside and
outside, for no other edge comes near. Where all edges are surely apart, a vertex of each ring tells whether it lies in
the other body. Contacts, and what rounded poses leave open, stay UNSETTLED for the exact path.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.collision.codes import DISJOINT, FIRST_INSIDE_SECOND, OVERLAPPING, SECOND_INSIDE_FIRST, UNSETTLED
from engine.collision.meshes.placement import PoseArrays, orient2d_near
from engine.collision.planar.outline import rings_of
from engine.jit import inline, kernel
from engine.predicates.loading import as_point2
from engine.predicates.orientation import orient2d
from engine.solids.base import Solid
from engine.types import UNDECIDED, Point2

MOST_EDGES = 1024
"""Beyond, pairs of edges are too many to look at all of them."""

_NO_RINGS = np.empty((0, 2)), np.zeros(1, np.int64)
_UNSURE = 2
_POLL_EVERY = 64


class OutlineArrays(NamedTuple):
    """Several bodies, one after another. vertices (n, 2); following (n,): the vertex at the end of each edge; firsts
    (n_bodies + 1,): of each body; reach (n_bodies,): the largest magnitude of a coordinate."""

    vertices: FloatArray
    following: IntArray
    firsts: IntArray
    reach: FloatArray


def outline_pool(bodies: Sequence[Solid]) -> tuple[OutlineArrays, IntArray]:
    """Return the bodies as arrays, and for each its number there, -1 for one that the batches do not take."""
    rings = [rings_of(body) if body.type in ("polygon", "triangle", "aabb") else _NO_RINGS for body in bodies]
    firsts = np.append(np.int64(0), np.cumsum([len(vertices) for vertices, _ in rings]))
    starts = np.repeat(firsts[:-1], [len(offsets) - 1 for _, offsets in rings])
    ends = np.concatenate([np.empty(0, np.int64), *(offsets[1:] for _, offsets in rings)]) + starts
    starts += np.concatenate([np.empty(0, np.int64), *(offsets[:-1] for _, offsets in rings)])
    following = np.arange(1, firsts[-1] + 1)
    following[ends - 1] = starts
    vertices = np.concatenate([np.empty((0, 2)), *(vertices for vertices, _ in rings)])
    pool = OutlineArrays(vertices, following, firsts, np.zeros(len(bodies)))
    numbers = np.full(len(bodies), -1, np.int64)
    _find_simple(pool, numbers)
    return pool, numbers


@inline
def _crossing(a: Point2, b: Point2, c: Point2, d: Point2, error: float) -> int:
    """Return 1 if two open edges surely cross in one point, 0 if they are surely apart, else _UNSURE."""
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
    return 1 if by_c * by_d == -1 and by_a * by_b == -1 else _UNSURE


@inline
def _is_simple(vertices: Any, following: Any, first: int, stop: int) -> bool:
    """Tell whether no two edges of these rings meet but in the vertex between them, and none has length 0."""
    for i in range(first, stop):
        a, b, c = (
            as_point2(vertices, i),
            as_point2(vertices, following[i]),
            as_point2(vertices, following[following[i]]),
        )
        if (a.x == b.x and a.y == b.y) or following[following[i]] == i:
            return False
        is_ahead = (b.x - a.x) * (c.x - b.x) + (b.y - a.y) * (c.y - b.y) > 0.0
        if not is_ahead and orient2d(a, b, c) in (0, UNDECIDED):
            return False
        for j in range(first, i):
            if following[i] == j or following[j] == i:
                continue
            if _crossing(a, b, as_point2(vertices, j), as_point2(vertices, following[j]), 0.0) != 0:
                return False
    return True


@kernel
def _find_simple(pool: OutlineArrays, numbers: Any) -> None:
    """Fill reach, and the number of each body whose edges meet only where they follow each other."""
    for body in range(numbers.shape[0]):
        first, stop = pool.firsts[body], pool.firsts[body + 1]
        for vertex in range(first, stop):
            pool.reach[body] = max(pool.reach[body], abs(pool.vertices[vertex, 0]), abs(pool.vertices[vertex, 1]))
        if 0 < stop - first <= MOST_EDGES and _is_simple(pool.vertices, pool.following, first, stop):
            numbers[body] = body


@inline
def _place(pool: OutlineArrays, body: int, poses: PoseArrays, item: int, placed: Any) -> float:
    """Write the rounded posed vertices of a body; return a bound on the error of each coordinate (`placement.py`)."""
    r, t, first = poses.rotations, poses.translations, pool.firsts[body]
    for vertex in range(first, pool.firsts[body + 1]):
        x, y = pool.vertices[vertex, 0], pool.vertices[vertex, 1]
        for axis in range(2):
            value = x if axis == 0 else y
            if item != 0:
                value = r[item, axis, 0] * x + r[item, axis, 1] * y + t[item, axis]
            placed[vertex - first, axis] = value
    shift = max(abs(t[item, 0]), abs(t[item, 1]))
    return 0.0 if item == 0 else 2.0**-49 * (3.0 * pool.reach[body] + shift) + 2.0**-1060


@inline
def _inside(p: Point2, vertices: Any, following: Any, first: int, n: int, error: float) -> int:
    """Return 1 for a point inside the rings, 0 outside, _UNSURE where a bound does not tell."""
    is_inside = 0
    for edge in range(n):
        a, b = as_point2(vertices, edge), as_point2(vertices, following[first + edge] - first)
        if max(a.x, b.x) + 2.0 * error < p.x or min(a.y, b.y) > p.y + 2.0 * error or max(a.y, b.y) + 2.0 * error < p.y:
            continue
        if error != 0.0 and min(abs(a.y - p.y), abs(b.y - p.y)) <= 2.0 * error:
            return _UNSURE
        if (a.y <= p.y) == (b.y <= p.y):
            continue
        side = orient2d_near(a, b, p, error)
        if side == UNDECIDED or side == 0:
            return _UNSURE
        if (side > 0) == (b.y > a.y):
            is_inside = 1 - is_inside
    return is_inside


@inline
def _rings_inside(pool: OutlineArrays, inner: int, points: Any, outer: int, vertices: Any, error: float) -> int:
    """Return 1 if all rings of a body lie inside another one that they do not meet, 0 if none does, else _UNSURE."""
    first, n = pool.firsts[inner], pool.firsts[inner + 1] - pool.firsts[inner]
    their_first, their_n = pool.firsts[outer], pool.firsts[outer + 1] - pool.firsts[outer]
    found = -1
    for vertex in range(n):
        if pool.following[first + vertex] > first + vertex:  # not the last of its ring
            continue
        where = _inside(as_point2(points, vertex), vertices, pool.following, their_first, their_n, error)
        if where == _UNSURE or (found >= 0 and where != found):
            return _UNSURE
        found = where
    return found


@inline
def _relate(pool: OutlineArrays, i: int, j: int, points: Any, vertices: Any, error: float) -> int:
    """Return the relation of two placed bodies, or UNSETTLED."""
    first, n = pool.firsts[i], pool.firsts[i + 1] - pool.firsts[i]
    their_first, their_n = pool.firsts[j], pool.firsts[j + 1] - pool.firsts[j]
    is_unsure = False
    for edge in range(n):
        a, b = as_point2(points, edge), as_point2(points, pool.following[first + edge] - first)
        for other in range(their_n):
            c, d = as_point2(vertices, other), as_point2(vertices, pool.following[their_first + other] - their_first)
            how = _crossing(a, b, c, d, error)
            if how == 1:
                return OVERLAPPING
            is_unsure |= how != 0
    if is_unsure:
        return UNSETTLED
    in_second = _rings_inside(pool, i, points, j, vertices, error)
    in_first = _rings_inside(pool, j, vertices, i, points, error)
    if in_second == 0 and in_first == 0:
        return DISJOINT
    if in_second + in_first == 1:
        return FIRST_INSIDE_SECOND if in_second == 1 else SECOND_INSIDE_FIRST
    return UNSETTLED


@kernel
def relate_outline_pairs(
    pool: OutlineArrays, bodies: Any, rows: Any, poses: PoseArrays, pairs: Any, relations: Any, flag: Any
) -> None:
    """Fill what is UNSETTLED in relations (n,) int8 for pairs (n, 2) of bodies of a scene.

    bodies: of each its number in the pool, or -1; rows: of each the row of its pose, 0 for none. Returns early when the
    flag is raised.
    """
    placed = np.empty((2, MOST_EDGES, 2))
    for item in range(pairs.shape[0]):
        if item % _POLL_EVERY == 0 and flag[0] != 0:
            return
        i, j = bodies[pairs[item, 0]], bodies[pairs[item, 1]]
        if relations[item] != UNSETTLED or i < 0 or j < 0:
            continue
        error = _place(pool, i, poses, rows[pairs[item, 0]], placed[0])
        error = max(error, _place(pool, j, poses, rows[pairs[item, 1]], placed[1]))
        relations[item] = _relate(pool, i, j, placed[0], placed[1], error)
