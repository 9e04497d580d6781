"""Sutherland-Hodgman in exact whole numbers, compiled: settles the polygons that in_doubles.py gives up.

It is in_integers.py once more, with two things that keep it fast. A vertex that was cut holds whole numbers
(x, y[, z], w) for the point (x / w, y / w, z / w) and also the doubles nearest to it. Rounding keeps order, so a plane
across an axis is decided by these doubles unless they lie on it, two vertices whose doubles differ are two points, and
other planes take their sign from doubles with a bound; whole numbers are asked only where that fails. And numbers stay
short: parts of an original edge are cut from the whole edge, and in the plane a cut of an edge that runs along a plane
is where two planes meet.

What does not fit digits.py (edges of space cut anew several times, sizes far apart) is left to Python's integers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.jit import inline
from engine.polygon_clipping.cut_vertices import VALUE_BOUND
from engine.polygon_clipping.in_doubles import GIVEN_UP, NO_ROOM
from engine.predicates.digits import (
    MOST,
    SLOT,
    nearest_quotient,
    negate,
    put_double,
    sign_of,
    sum_products,
)

_ONE = 0
_VALUES = SLOT
_FREE = 3 * SLOT
_LOADED = 6 * SLOT
_ROWS = 16 * SLOT
"""Places of a heap: the number 1, two values, slots to work in, two loaded vertices, rows; then numbers that stay."""
_TINY = 2.0**-1000
"""Products that underflow."""


class ExactScratch(NamedTuple):
    """heap: int64, see digits.py; n_rows: how much of it the planes take. terms: (4, 3) int64, for sums. loaded:
    (2, dim + 1) int64, places of two vertices. rows: (planes, dim + 1) int64, places of the planes' numbers.

    points: (room, dim) float64, the doubles nearest to vertices; places: (room, dim + 1) int64, numbers of cut ones.
    rings: (2, room) int64, a ring as numbers of vertices. edges, along: (room,) int64, the original edge that goes on
    from a vertex, by its first vertex, and the plane that it runs along, else -1. signs: (room,) int64. on_plane:
    (room,) bool, for places of the ring made.
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


@inline
def exact_scratch(room: int, dimension: int, row_heap: Any, row_places: Any) -> Any:
    """Return what `clip_exactly` works in: for rings that grow to `room` vertices, those that were dropped included."""
    first = _ROWS + row_heap.size
    heap = np.empty(first + 8 * SLOT + 48 * room, np.int64)
    heap[_ONE], heap[_ONE + 1], heap[_ONE + 2] = 1, 0, 1
    for i in range(row_heap.size):
        heap[_ROWS + i] = row_heap[i]
    return ExactScratch(
        heap,
        row_heap.size,
        np.empty((4, 3), np.int64),
        np.empty((2, dimension + 1), np.int64),
        row_places + _ROWS,
        np.empty((room, dimension)),
        np.empty((room, dimension + 1), np.int64),
        np.empty((2, room), np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.bool_),
    )


@inline
def load_vertex(s: Any, v: int, n_ring: int, side: int) -> None:
    """Set ``loaded[side]`` to the places of vertex v's numbers; those of an original vertex are made there."""
    d = s.points.shape[1]
    for k in range(d + 1):
        if v >= n_ring:
            s.loaded[side, k] = s.places[v, k]
        elif k == d:
            s.loaded[side, k] = _ONE
        else:
            s.loaded[side, k] = _LOADED + (4 * side + k) * SLOT
            put_double(s.heap, s.loaded[side, k], s.points[v, k])


@inline
def value_at(s: Any, plane: int, side: int, place: int) -> bool:
    """Put the value of a plane at a loaded vertex at `place`; False where it is too long."""
    n = s.loaded.shape[1]
    for k in range(n):
        s.terms[k, 0], s.terms[k, 1], s.terms[k, 2] = s.rows[plane, k], s.loaded[side, k], 1
    return sum_products(s.heap, s.terms, n, place)


@inline
def sign_of_vertex(s: Any, high: Any, axis: int, at: float, plane: int, v: int, n_ring: int) -> tuple[int, bool]:
    """Return the exact sign of a plane at vertex v; False where numbers are too long."""
    d = s.points.shape[1]
    if axis >= 0:
        x = s.points[v, axis]
        if x != at or v < n_ring:
            sign = 1 if x > at else (-1 if x < at else 0)
            return (sign if high[plane, axis] > 0.0 else -sign), True
    else:
        value, size = high[plane, d], abs(high[plane, d])
        for k in range(d):
            term = high[plane, k] * s.points[v, k]
            value += term
            size += abs(term)
        if abs(value) > VALUE_BOUND * size + _TINY:
            return (1 if value > 0.0 else -1), True
    load_vertex(s, v, n_ring, 0)
    is_made = value_at(s, plane, 0, _VALUES)
    return sign_of(s.heap, _VALUES), is_made


@inline
def are_same(s: Any, v: int, u: int, n_ring: int) -> tuple[bool, bool]:
    """Tell whether two vertices are the same point; the second is False where numbers are too long."""
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
def cut_edge(s: Any, plane: int, p: int, q: int, n_ring: int, j: int, top: int) -> int:
    """Make vertex j where the edge p q crosses a plane, its numbers at `top`; return the new top, -1 if too long."""
    d = s.points.shape[1]
    load_vertex(s, p, n_ring, 0)
    load_vertex(s, q, n_ring, 1)
    if not (value_at(s, plane, 0, _VALUES) and value_at(s, plane, 1, _VALUES + SLOT)):
        return -1
    factor = sign_of(s.heap, _VALUES)
    for k in range(d + 1):  # |s_p| q + |s_q| p, with values of two signs
        s.terms[0, 0], s.terms[0, 1], s.terms[0, 2] = _VALUES, s.loaded[1, k], factor
        s.terms[1, 0], s.terms[1, 1], s.terms[1, 2] = _VALUES + SLOT, s.loaded[0, k], -factor
        if top + SLOT > s.heap.size or not sum_products(s.heap, s.terms, 2, top) or s.heap[top] > MOST:
            return -1
        s.places[j, k] = top
        top += 2 + s.heap[top]
    return top


@inline
def cut_corner(s: Any, plane: int, other: int, j: int, top: int) -> int:
    """Make vertex j where two lines of the plane meet, its numbers at `top`; return the new top, -1 if too long."""
    for k in range(3):  # the cross product of both rows
        a, b = (k + 1) % 3, (k + 2) % 3
        s.terms[0, 0], s.terms[0, 1], s.terms[0, 2] = s.rows[plane, a], s.rows[other, b], 1
        s.terms[1, 0], s.terms[1, 1], s.terms[1, 2] = s.rows[plane, b], s.rows[other, a], -1
        if top + SLOT > s.heap.size or not sum_products(s.heap, s.terms, 2, top) or s.heap[top] > MOST:
            return -1
        s.places[j, k] = top
        top += 3 + s.heap[top]  # one place more, for a carry
    if sign_of(s.heap, s.places[j, 2]) < 0:
        for k in range(3):
            negate(s.heap, s.places[j, k])
    return top


@inline
def cut_ring(
    s: Any, high: Any, axis: int, at: float, plane: int, now: int, n: int, n_ring: int, size: int, top: int
) -> tuple[int, int, bool, int, int]:
    """Cut the ring ``rings[now]`` of n vertices by a plane into the other one.

    size, top: how many vertices and how much of the heap are in use. Returns the vertices left (-1: too long; the ring
    stays where it is if nothing is dropped), in how many points the plane was met, whether a vertex was dropped, and
    the new size and top.
    """
    n_contacts, has_dropped, d = 0, False, s.points.shape[1]
    for i in range(n):
        s.signs[i], is_known = sign_of_vertex(s, high, axis, at, plane, s.rings[now, i], n_ring)
        if not is_known:
            return -1, 0, False, size, top
        n_contacts += s.signs[i] == 0
        has_dropped = has_dropped or s.signs[i] < 0
    if not has_dropped:
        return n, n_contacts, False, size, top
    kept, other = 0, 1 - now
    for i in range(n):
        following = i + 1 if i + 1 < n else 0
        v, w = s.rings[now, i], s.rings[now, following]
        for step in range(2):
            if step == 0:
                if s.signs[i] < 0:
                    continue
                made = v
                s.on_plane[kept] = s.signs[i] == 0
                if s.signs[i] == 0 and s.signs[following] < 0:
                    s.edges[v], s.along[v] = -1, plane
            else:
                if s.signs[i] * s.signs[following] >= 0:
                    continue
                n_contacts += 1
                made, edge = size, s.edges[v]
                if size + 1 >= s.points.shape[0]:
                    return -1, 0, False, size, top
                if edge >= 0:
                    top = cut_edge(s, plane, edge, edge + 1 if edge + 1 < n_ring else 0, n_ring, made, top)
                elif d == 2:
                    top = cut_corner(s, plane, s.along[v], made, top)
                else:
                    top = cut_edge(s, plane, v, w, n_ring, made, top)
                if top < 0:
                    return -1, 0, False, size, top
                for k in range(d):
                    x, is_known = nearest_quotient(s.heap, s.terms, s.places[made, k], s.places[made, d], _ONE, _FREE)
                    s.points[made, k] = x + 0.0
                    if not is_known:
                        return -1, 0, False, size, top
                size += 1
                s.on_plane[kept] = True
                s.edges[made], s.along[made] = (-1, plane) if s.signs[i] > 0 else (edge, s.along[v])
            if kept > 0 and s.on_plane[kept] and s.on_plane[kept - 1]:
                before = s.rings[other, kept - 1]
                is_same, is_known = are_same(s, made, before, n_ring)
                if not is_known:
                    return -1, 0, False, size, top
                if is_same:
                    s.edges[before], s.along[before] = s.edges[made], s.along[made]
                    continue
            s.rings[other, kept] = made
            kept += 1
            if kept >= s.points.shape[0]:
                return -1, 0, False, size, top
    while kept > 1 and s.on_plane[kept - 1] and s.on_plane[0]:
        is_same, is_known = are_same(s, s.rings[other, kept - 1], s.rings[other, 0], n_ring)
        if not is_known:
            return -1, 0, False, size, top
        if not is_same:
            break
        kept -= 1
    return kept, n_contacts, True, size, top


@inline
def load_ring(s: Any, vertices: Any, first: int, last: int) -> int:
    """Load a ring without vertices equal to the one before, around the ring; return how many."""
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
    return n


@inline
def clip_exactly(
    s: Any,
    vertices: Any,
    ring_offsets: Any,
    first: int,
    last: int,
    high: Any,
    axes: Any,
    at: Any,
    cutting: Any,
    n_cutting: int,
    contacts: Any,
    dropped: Any,
    stop: Any,
    out: Any,
    written: int,
    sizes: Any,
) -> int:
    """Clip rings first .. last - 1, one polygon, by the planes of `cutting` into ``out[written:]``; fills their sizes.

    Adds to contacts, dropped. Returns the vertices left, GIVEN_UP or NO_ROOM.
    """
    begun, d = written, s.points.shape[1]
    for ring in range(first, last):
        n = load_ring(s, vertices, ring_offsets[ring], ring_offsets[ring + 1])
        n_ring, size, now, top = n, n, 0, _ROWS + s.n_rows
        for i_plane in range(n_cutting):
            if n <= 0:
                break
            if stop[0]:
                return NO_ROOM
            plane = cutting[i_plane]
            n, met, has_dropped, size, top = cut_ring(s, high, axes[plane], at[plane], plane, now, n, n_ring, size, top)
            contacts[i_plane] += met
            if has_dropped:
                dropped[i_plane] = True
                now = 1 - now
        if n < 0:
            return GIVEN_UP
        if (written + n) * d > out.size:
            return NO_ROOM
        for i in range(n):
            for k in range(d):
                out[(written + i) * d + k] = s.points[s.rings[now, i], k]
        sizes[ring] = n
        written += n
    return written - begun
