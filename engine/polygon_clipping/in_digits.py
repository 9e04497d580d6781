"""Sutherland-Hodgman in exact multi-digit integers, compiled: for the polygons that in_doubles.py leaves open.

The algorithm of in_integers.py with two accelerations. A cut vertex has the integers (x, y[, z], w) of the point
(x / w, y / w, z / w) and also the doubles nearest to it. Rounding is monotone, so these doubles decide a plane across
an axis unless they lie on it, vertices with different doubles are distinct, and other planes take their sign from
doubles with a bound; integers are used only where that fails. And numbers stay short: parts of an original edge are cut
from the whole edge, and in the plane a cut of an edge along a plane is the intersection of two planes.

What does not fit digits.py (edges of space cut repeatedly, exponents far apart) is left to Python's integers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.compiling.jit import allocating, called, inline
from engine.polygon_clipping.cut_vertices import VALUE_BOUND
from engine.polygon_clipping.rings import (
    EXACT,
    NO_ROOM,
    Clipped,
    Cutting,
    Plane,
    PlaneTables,
    Polygons,
    has_bridges,
    plane_of,
)
from engine.predicates.digits import MOST, SLOT, nearest_quotient, negate, sign_of, store_double, sum_products
from engine.types import OPEN, FlagArray, FloatArray, IntArray

TOO_LONG = -1
"""In place of a number of vertices: exact numbers are too long for digits.py."""
_ONE = 0
_VALUES = SLOT
_FREE = 3 * SLOT
_LOADED = 6 * SLOT
_ROWS = 16 * SLOT
"""Indices into a heap: the number 1, two values, working slots, two loaded vertices, plane rows; then stored numbers.
"""
_TINY = 2.0**-1000
"""Error bound of products that underflow."""


class ExactScratch(NamedTuple):
    """Scratch of `clip_exactly`.

    | field | dtype, shape | meaning |
    | --- | --- | --- |
    | heap, n_rows | int64 | see digits.py; how much of it the planes take |
    | terms | int64 (4, 3) | for sums of products |
    | loaded | int64 (2, dim + 1) | places of two vertices |
    | rows | int64 (planes, dim + 1) | places of the planes' numbers |
    | points | float64 (room, dim) | the doubles nearest to vertices |
    | places | int64 (room, dim + 1) | places of the numbers of cut vertices |
    | rings | int64 (2, room) | a ring as numbers of vertices, and the next one |
    | edges, along | int64 (room,) | the original edge that leaves a vertex; the plane that it runs along; else -1 |
    | signs, on_plane | int64, bool (room,) | of vertices; of places of the ring made |
    | used | int64 (2,) | numbers of vertices, and of used heap places |
    """

    heap: Any
    n_rows: int
    terms: Any
    loaded: Any
    rows: Any
    points: Any
    places: Any
    rings: Any
    edges: Any
    along: Any
    signs: Any
    on_plane: Any
    used: Any


@allocating
def exact_scratch(room: int, dimension: int, row_heap: IntArray, row_places: IntArray) -> Any:
    """Allocate scratch of `clip_exactly` for rings that grow to `room` vertices, dropped ones included. row_heap,
    row_places: of `PlaneTables`."""
    first = _ROWS + row_heap.size
    heap = np.empty(first + 8 * SLOT + 48 * room, np.int64)
    heap[_ONE], heap[_ONE + 1], heap[_ONE + 2] = 1, 0, 1
    for i in range(row_heap.size):
        heap[_ROWS + i] = row_heap[i]
    return ExactScratch(
        heap, row_heap.size, np.empty((4, 3), np.int64), np.empty((2, dimension + 1), np.int64), row_places + _ROWS,
        np.empty((room, dimension)), np.empty((room, dimension + 1), np.int64), np.empty((2, room), np.int64),
        np.empty(room, np.int64), np.empty(room, np.int64), np.empty(room, np.int64), np.empty(room, np.bool_),
        np.empty(2, np.int64),
    )  # fmt: skip


@inline
def load_vertex(s: ExactScratch, v: int, n_ring: int, side: int) -> None:
    """Set ``loaded[side]``, side 0 or 1, to the heap indices of the coordinates x, y[, z], w of vertex v. An original
    vertex (v < n_ring) is stored in the heap first."""
    d = s.points.shape[1]
    for k in range(d + 1):
        if v >= n_ring:
            s.loaded[side, k] = s.places[v, k]
        elif k == d:
            s.loaded[side, k] = _ONE
        else:
            s.loaded[side, k] = _LOADED + (4 * side + k) * SLOT
            store_double(s.heap, s.loaded[side, k], s.points[v, k])


@inline
def value_at(s: ExactScratch, plane: int, side: int, place: int) -> bool:
    """Store the value of a plane at vertex ``loaded[side]`` at heap index `place`; False if it has too many digits."""
    n = s.loaded.shape[1]
    for k in range(n):
        s.terms[k, 0], s.terms[k, 1], s.terms[k, 2] = s.rows[plane, k], s.loaded[side, k], 1
    return sum_products(s.heap, s.terms, n, place)


@inline
def sign_of_vertex(s: ExactScratch, plane: Plane, v: int, n_ring: int) -> tuple[int, bool]:
    """Return the exact sign of a plane's value at vertex v, and True; False if numbers have too many digits."""
    d, number, axis = s.points.shape[1], plane.number, plane.axis
    if axis >= 0:
        x = s.points[v, axis]
        if x != plane.place or v < n_ring:
            sign = 1 if x > plane.place else (-1 if x < plane.place else 0)
            return (sign if plane.high[number, axis] > 0.0 else -sign), True
    else:
        value, size = plane.high[number, d], abs(plane.high[number, d])
        for k in range(d):
            term = plane.high[number, k] * s.points[v, k]
            value += term
            size += abs(term)
        if abs(value) > VALUE_BOUND * size + _TINY:
            return (1 if value > 0.0 else -1), True
    load_vertex(s, v, n_ring, 0)
    is_made = value_at(s, number, 0, _VALUES)
    return sign_of(s.heap, _VALUES), is_made


@inline
def are_same(s: ExactScratch, v: int, u: int, n_ring: int) -> tuple[bool, bool]:
    """Return whether vertices v and u are one point, exactly; and True; False if numbers have too many digits."""
    d = s.points.shape[1]
    for k in range(d):
        if s.points[v, k] != s.points[u, k]:
            return False, True
    if v < n_ring and u < n_ring:
        return True, True
    load_vertex(s, v, n_ring, 0)
    load_vertex(s, u, n_ring, 1)
    for k in range(d):
        s.terms[0, 0], s.terms[0, 1], s.terms[0, 2] = s.loaded[0, k], s.loaded[1, d], 1
        s.terms[1, 0], s.terms[1, 1], s.terms[1, 2] = s.loaded[1, k], s.loaded[0, d], -1
        if not sum_products(s.heap, s.terms, 2, _VALUES):
            return False, False
        if s.heap[_VALUES] != 0:
            return False, True
    return True, True


@inline
def store_sums(s: ExactScratch, place: int, k: int, carry: int) -> bool:
    """Set coordinate k of vertex `place` to the sum of the two products ``terms[:2]``, stored on top of the heap; False
    if it has too many digits. carry: digits to reserve for one."""
    top = s.used[1]
    if top + SLOT > s.heap.size or not sum_products(s.heap, s.terms, 2, top) or s.heap[top] > MOST:
        return False
    s.places[place, k] = top
    s.used[1] = top + 2 + carry + s.heap[top]
    return True


@inline
def cut_edge(s: ExactScratch, plane: int, p: int, q: int, n_ring: int, j: int) -> bool:
    """Set vertex j to the crossing of edge p q with a plane, in exact integers; False if these have too many digits."""
    load_vertex(s, p, n_ring, 0)
    load_vertex(s, q, n_ring, 1)
    if not (value_at(s, plane, 0, _VALUES) and value_at(s, plane, 1, _VALUES + SLOT)):
        return False
    factor = sign_of(s.heap, _VALUES)
    for k in range(s.places.shape[1]):  # |s_p| q + |s_q| p, with values of two signs
        s.terms[0, 0], s.terms[0, 1], s.terms[0, 2] = _VALUES, s.loaded[1, k], factor
        s.terms[1, 0], s.terms[1, 1], s.terms[1, 2] = _VALUES + SLOT, s.loaded[0, k], -factor
        if not store_sums(s, j, k, 0):
            return False
    return True


@inline
def cut_corner(s: ExactScratch, plane: int, other: int, j: int) -> bool:
    """Set vertex j to the intersection of the lines `plane` and `other` of 2D, in exact integers; False if these have
    too many digits."""
    for k in range(3):  # the cross product of both rows
        a, b = (k + 1) % 3, (k + 2) % 3
        s.terms[0, 0], s.terms[0, 1], s.terms[0, 2] = s.rows[plane, a], s.rows[other, b], 1
        s.terms[1, 0], s.terms[1, 1], s.terms[1, 2] = s.rows[plane, b], s.rows[other, a], -1
        if not store_sums(s, j, k, 1):  # one place more, for a carry
            return False
    if sign_of(s.heap, s.places[j, 2]) < 0:
        for k in range(3):
            negate(s.heap, s.places[j, k])
    return True


@inline
def cut_vertex(s: ExactScratch, plane: int, v: int, w: int, is_left: bool, n_ring: int) -> int:
    """Make the vertex at the crossing of edge v w with a plane; return its number, or TOO_LONG. is_left: the edge
    leaves the plane's inner side. Vertices below n_ring are original ones."""
    j, edge, d = s.used[0], s.edges[v], s.points.shape[1]
    if j + 1 >= s.points.shape[0]:
        return TOO_LONG
    if edge >= 0:
        is_made = cut_edge(s, plane, edge, edge + 1 if edge + 1 < n_ring else 0, n_ring, j)
    elif d == 2:
        is_made = cut_corner(s, plane, s.along[v], j)
    else:
        is_made = cut_edge(s, plane, v, w, n_ring, j)
    for k in range(d):
        if is_made:
            x, is_made = nearest_quotient(s.heap, s.terms, s.places[j, k], s.places[j, d], _ONE, _FREE)
            s.points[j, k] = x + 0.0
    s.used[0] = j + 1
    s.edges[j], s.along[j] = (-1, plane) if is_left else (edge, s.along[v])
    return j if is_made else TOO_LONG


@inline
def append_vertex(s: ExactScratch, made: IntArray, n_left: int, v: int, is_on: bool, n_ring: int) -> int:
    """Append vertex v to the ring `made` of n_left vertices; return their number then, or TOO_LONG. is_on: v lies on
    the plane. A duplicate of the previous vertex is merged into it, and its outgoing edge inherited."""
    s.on_plane[n_left] = is_on
    if n_left > 0 and is_on and s.on_plane[n_left - 1]:
        before = made[n_left - 1]
        is_same, is_known = are_same(s, v, before, n_ring)
        if not is_known:
            return TOO_LONG
        if is_same:
            s.edges[before], s.along[before] = s.edges[v], s.along[v]
            return n_left
    made[n_left] = v
    return n_left + 1 if n_left + 1 < s.points.shape[0] else TOO_LONG


@inline
def close_ring(s: ExactScratch, made: IntArray, n_left: int, n_ring: int) -> int:
    """Drop the last vertices of the ring `made` that equal its first; return the number of vertices, or TOO_LONG."""
    while n_left > 1 and s.on_plane[n_left - 1] and s.on_plane[0]:
        is_same, is_known = are_same(s, made[n_left - 1], made[0], n_ring)
        if not is_known:
            return TOO_LONG
        if not is_same:
            break
        n_left -= 1
    return n_left


@inline
def classify(s: ExactScratch, plane: Plane, ring: IntArray, n: int, n_ring: int) -> tuple[int, int]:
    """Set s.signs to the signs of a plane at the n vertices of a ring; return how many are outside (or TOO_LONG), and
    how many on it."""
    n_out, n_on = 0, 0
    for i in range(n):
        s.signs[i], is_known = sign_of_vertex(s, plane, ring[i], n_ring)
        if not is_known:
            return TOO_LONG, 0
        n_out += s.signs[i] < 0
        n_on += s.signs[i] == 0
    return n_out, n_on


@inline
def cut_ring(s: ExactScratch, plane: int, ring: IntArray, n: int, made: IntArray, n_ring: int) -> tuple[int, int]:
    """Clip a ring of n vertices, whose signs are set, by plane number `plane`, and write the rest to `made`; return the
    number of its vertices (or TOO_LONG), and of cuts."""
    n_left, n_cuts = 0, 0
    for i in range(n):
        following = i + 1 if i + 1 < n else 0
        v, sign, sign_after = ring[i], s.signs[i], s.signs[following]
        if sign >= 0:
            if sign == 0 and sign_after < 0:
                s.edges[v], s.along[v] = -1, plane
            n_left = append_vertex(s, made, n_left, v, sign == 0, n_ring)
        if sign * sign_after < 0 and n_left >= 0:
            n_cuts += 1
            j = cut_vertex(s, plane, v, ring[following], sign > 0, n_ring)
            n_left = append_vertex(s, made, n_left, j, True, n_ring) if j >= 0 else TOO_LONG
        if n_left < 0:
            return TOO_LONG, 0
    return close_ring(s, made, n_left, n_ring), n_cuts


@inline
def load_ring(s: ExactScratch, vertices: FloatArray, first: int, last: int) -> int:
    """Load the ring of vertices first .. last - 1, repeated ones merged, also the last with the first; return their
    number. vertices: flat."""
    n, d = 0, s.points.shape[1]
    for i in range(first, last):
        is_same = n > 0
        for k in range(d):
            is_same = is_same and s.points[n - 1, k] == vertices[i * d + k]
            s.points[n, k] = vertices[i * d + k] + 0.0
        s.rings[0, n], s.edges[n], s.along[n] = n, n, -1
        n += not is_same
    while n > 1:
        is_same = True
        for k in range(d):
            is_same = is_same and s.points[n - 1, k] == s.points[0, k]
        if not is_same:
            break
        n -= 1
    s.used[0], s.used[1] = n, _ROWS + s.n_rows
    return n


@inline
def cut_by_planes(
    s: ExactScratch, planes: PlaneTables, cutting: Cutting, n_cutting: int, n_ring: int, stop: FlagArray
) -> tuple[int, int]:
    """Clip the loaded ring by the n_cutting planes of `cutting` in order; return the number of its vertices, or
    TOO_LONG or NO_ROOM, and its row in `rings`. Adds to `cutting.contacts` the points in which each plane was met, and
    notes in `dropped` which one dropped a vertex."""
    n, now = n_ring, 0
    for i_plane in range(n_cutting):
        if n <= 0:
            break
        if stop[0]:
            return NO_ROOM, now
        plane, n_cuts = plane_of(planes, cutting.planes[i_plane]), 0
        n_out, n_on = classify(s, plane, s.rings[now], n, n_ring)
        if n_out > 0:
            n, n_cuts = cut_ring(s, plane.number, s.rings[now], n, s.rings[1 - now], n_ring)
            cutting.dropped[i_plane], now = True, 1 - now
        elif n_out < 0:
            return TOO_LONG, now
        cutting.contacts[i_plane] += n_on + n_cuts
    return n, now


@called
def clip_exactly(
    s: ExactScratch, polygons: Polygons, polygon: int, planes: PlaneTables, cutting: Cutting, n_cutting: int,
    stop: FlagArray, clipped: Clipped, written: int,
) -> int:  # fmt: skip
    """Clip a polygon by the n_cutting planes of `cutting`, whose contacts are reset, and write its vertices to
    `clipped` after the `written` ones there. Returns the number of vertices then, or NO_ROOM. A polygon whose numbers
    have too many digits is left OPEN."""
    written_before, d = written, s.points.shape[1]
    first_ring, last_ring = polygons.polygon_offsets[polygon], polygons.polygon_offsets[polygon + 1]
    for i in range(n_cutting):
        cutting.contacts[i], cutting.dropped[i] = 0, False
    clipped.state[polygon] = EXACT
    for ring in range(first_ring, last_ring):
        n_ring = load_ring(s, polygons.vertices, polygons.ring_offsets[ring], polygons.ring_offsets[ring + 1])
        n, now = cut_by_planes(s, planes, cutting, n_cutting, n_ring, stop)
        if n == TOO_LONG:
            clipped.state[polygon] = OPEN
            for other in range(first_ring, last_ring):
                clipped.sizes[other] = 0
            return written_before
        if n == NO_ROOM or (written + n) * d > clipped.vertices.size:
            return NO_ROOM
        for i in range(n):
            for k in range(d):
                clipped.vertices[(written + i) * d + k] = s.points[s.rings[now, i], k]
        clipped.sizes[ring] = n
        written += n
    clipped.may_have_bridges[polygon] = written > written_before and has_bridges(cutting, n_cutting)
    return written
