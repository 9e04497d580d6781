"""Sutherland-Hodgman on rings whose decisions and coordinates are proven by doubles and double-doubles.

That is nearly every ring: vertices stay in place and a ring is a list of their numbers; only cuts are computed in
double-double (cut_vertices.py). A cut is accepted only where its doubles are certainly the nearest. Rounding is
monotone: where such a double lies off a wall of a box so does the vertex, and vertices with different doubles are
distinct. Original vertices are doubles, so on a wall they are decided too. At the first doubt the polygon is left open,
and in_digits.py starts again.

    load a ring -> group into runs -> for each plane: classify, cut -> emit

Consecutive vertices on the same side of every plane are clipped together: a long ring is first grouped into runs, each
represented by its first vertex, up to ``ends`` of it.

Slack of planes across no axis: every vertex lies in the box of its polygon, so
``|value - exact| < 2^-49 * (|row| at the box)``.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import allocating, called, merged
from engine.lanes.lanes import move
from engine.polygon_clipping.cut_vertices import (
    DOUBT,
    N_HEAP,
    TINY,
    VALUE_BOUND,
    Vertices,
    are_same,
    cut_edge,
    sameness,
)
from engine.polygon_clipping.rings import (
    CLIPPED,
    DONE,
    NO_ROOM,
    Clipped,
    Cutting,
    Plane,
    PlaneTables,
    Polygons,
    has_bridges,
    plane_of,
)
from engine.types import FlagArray, FloatArray, Int32Array

_SLACK: Final = 2.0**-45
LONG: Final = 8
"""Smallest number of vertices of a ring that is grouped into runs; in shorter rings most vertices are runs of their
own."""
MOST_BITS: Final = 30
ALONE: Final = 1 << MOST_BITS
"""Mark of a vertex on a plane, or near one: it is a run of its own."""


class Scratch(NamedTuple):
    """Scratch for clipping rings.

    | field | dtype, shape | meaning |
    | --- | --- | --- |
    | rings | int32 (2, room) | the ring as numbers of vertices, and the next one |
    | signs | int8 (room,) | of its vertices |
    | ends, codes | int32 (room,) | by original vertex the last one of its run; planes it is outside of; new numbers |
    | lows, highs | float64 (3,) | the box of a polygon |
    """

    vertices: Vertices
    cutting: Cutting
    rings: Any
    signs: Any
    ends: Any
    codes: Any
    lows: Any
    highs: Any


@allocating
def scratch_for(room: int, n_planes: int, names: Any) -> Scratch:
    """Allocate scratch for rings that grow to `room` vertices, dropped ones included, and n_planes planes. names: its
    length is the dimension."""
    d = len(names)
    heap, terms = np.empty(N_HEAP, np.int64), np.empty((6, 3), np.int64)
    return Scratch(
        Vertices(np.empty(room * d), np.empty(2 * room * d), np.empty(room, np.int32), names, heap, terms),
        Cutting(
            np.empty(n_planes, np.int64), np.empty(n_planes), np.empty(n_planes, np.int64), np.empty(n_planes, np.bool_)
        ),
        np.empty((2, room), np.int32),
        np.empty(room, np.int8),
        np.empty(room, np.int32),
        np.empty(room, np.int32),
        np.empty(3),
        np.empty(3),
    )


@merged
def load_ring(
    s: Scratch, vertices: FloatArray, begin: int, end: int
) -> tuple[int, float, float, float, float, float, float]:
    """Load the ring of vertices begin .. end - 1 (flat array), repeated ones merged; return (number of vertices, x_low,
    x_high, y_low, y_high, z_low, z_high). Zeros become +0.0. The first vertex may still be repeated at the end."""
    pool, d = s.vertices.pool, len(s.vertices.names)
    x, y, z = vertices[begin * d], vertices[begin * d + 1], 0.0 if d == 2 else vertices[begin * d + 2]
    pool[0], pool[1] = x + 0.0, y + 0.0
    if d == 3:
        pool[2] = z + 0.0
    n, x_low, x_high, y_low, y_high, z_low, z_high = 1, x, x, y, y, z, z
    for i in range(begin + 1, end):
        u, v, w = vertices[i * d], vertices[i * d + 1], 0.0 if d == 2 else vertices[i * d + 2]
        pool[n * d], pool[n * d + 1] = u + 0.0, v + 0.0
        if d == 3:
            pool[n * d + 2] = w + 0.0
        n += (u != x) | (v != y) | (w != z)
        x, y, z = u, v, w
        x_low, x_high = x if x < x_low else x_low, x if x > x_high else x_high
        y_low, y_high = y if y < y_low else y_low, y if y > y_high else y_high
        z_low, z_high = z if z < z_low else z_low, z if z > z_high else z_high
    return n, x_low, x_high, y_low, y_high, z_low, z_high


@merged
def load_box(s: Scratch, polygons: Polygons, first: int, last: int) -> int:
    """Set s.lows and s.highs to the box of rings first .. last - 1; return the number of vertices of the last ring,
    which stays loaded."""
    vertices, offsets = polygons.vertices, polygons.ring_offsets
    n, x_low, x_high, y_low, y_high, z_low, z_high = load_ring(s, vertices, offsets[first], offsets[first + 1])
    for ring in range(first + 1, last):
        n, x, x_most, y, y_most, z, z_most = load_ring(s, vertices, offsets[ring], offsets[ring + 1])
        x_low, x_high = min(x, x_low), max(x_most, x_high)
        y_low, y_high = min(y, y_low), max(y_most, y_high)
        z_low, z_high = min(z, z_low), max(z_most, z_high)
    s.lows[0], s.lows[1], s.lows[2] = x_low, y_low, z_low
    s.highs[0], s.highs[1], s.highs[2] = x_high, y_high, z_high
    return n


@merged
def choose_planes(s: Scratch, planes: PlaneTables) -> tuple[int, bool]:
    """List the planes that may cut a polygon in s.cutting; return their number, and whether one has all of it outside.
    A plane with all vertices inside cuts nothing: later planes see convex combinations of the vertices."""
    cutting, lows, highs, d = s.cutting, s.lows, s.highs, len(s.vertices.names)
    n, is_outside = 0, False
    for number in range(planes.high.shape[0]):
        plane = plane_of(planes, number)
        axis, place = plane.axis, plane.place
        if axis >= 0:
            is_up, low, high, size = plane.high[number, axis] > 0.0, lows[axis], highs[axis], 0.0
            is_cut = (low < place) if is_up else (high > place)
            is_outside = (high < place) if is_up else (low > place)
        else:
            least = most = plane.high[number, d]
            size = abs(least)
            for k in range(d):
                x, y = plane.high[number, k] * lows[k], plane.high[number, k] * highs[k]
                least, most, size = least + min(x, y), most + max(x, y), size + max(abs(x), abs(y))
            is_cut, is_outside = not least > VALUE_BOUND * size, -most > VALUE_BOUND * size + TINY
        cutting.planes[n], cutting.slack[n] = number, _SLACK * size + TINY
        cutting.contacts[n], cutting.dropped[n] = 0, False
        n += is_cut
        if is_outside:
            break
    return n, is_outside


@merged
def row_of(s: Scratch, plane: Plane) -> tuple[float, float, float, float]:
    """Return the row (a, b, c, d) of a plane in doubles, c = 0 in 2D; read once for all vertices."""
    d, rows, number = len(s.vertices.names), plane.high, plane.number
    return rows[number, 0], rows[number, 1], 0.0 if d == 2 else rows[number, 2], rows[number, d]


@merged
def value_at(s: Scratch, row: tuple[float, float, float, float], v: int) -> float:
    """Return the value of a plane, given by its row, at vertex v, in doubles."""
    pool, d = s.vertices.pool, len(s.vertices.names)
    value = row[3] + row[0] * pool[v * d] + row[1] * pool[v * d + 1]
    return value if d == 2 else value + row[2] * pool[v * d + 2]


@merged
def mark_sides(s: Scratch, planes: PlaneTables, n_cutting: int, n: int) -> None:
    """Set s.codes of the n loaded vertices: bit i for the side of plane i of s.cutting on which the vertex lies, ALONE
    if it is on or near one of the n_cutting planes."""
    pool, codes, d = s.vertices.pool, s.codes, len(s.vertices.names)
    for i in range(n):
        codes[i] = 0
    for i_plane in range(n_cutting):
        plane, near, bit = plane_of(planes, s.cutting.planes[i_plane]), s.cutting.slack[i_plane], 1 << i_plane
        axis, place = plane.axis, plane.place
        if axis >= 0:
            for i in range(n):
                x = pool[i * d + axis]
                codes[i] |= bit if x < place else (ALONE if x == place else 0)
        else:
            row = row_of(s, plane)
            for i in range(n):
                value = value_at(s, row, i)
                codes[i] |= bit if value < -near else (ALONE if value <= near else 0)


@merged
def group_into_runs(s: Scratch, planes: PlaneTables, n_cutting: int, n_ring: int) -> int:
    """Group the loaded ring into runs of vertices on the same sides of all planes; return the number of runs."""
    ring, edges, ends, codes = s.rings[0], s.vertices.edges, s.ends, s.codes
    if n_cutting == 0:
        ring[0], ends[0] = 0, n_ring - 1
        return 1
    if n_ring < LONG or n_cutting > MOST_BITS:
        for i in range(n_ring):
            ring[i] = edges[i] = ends[i] = i
        return n_ring
    mark_sides(s, planes, n_cutting, n_ring)
    n, before = 0, -1
    for i in range(n_ring):
        ring[n] = i
        n += (codes[i] != before) | (codes[i] >= ALONE)
        before = codes[i]
    ring[n] = n_ring
    for i in range(n):
        edges[ring[i]] = ends[ring[i]] = ring[i + 1] - 1
    return n


@merged
def classify_across(s: Scratch, plane: Plane, ring: Int32Array, n: int, n_ring: int) -> tuple[int, int]:
    """Set s.signs of n vertices at a plane across an axis; return how many are inside or on it (or DOUBT), and how many
    on it. Vertices below n_ring are original ones."""
    pool, rests, d, axis, place = s.vertices.pool, s.vertices.rests, len(s.vertices.names), plane.axis, plane.place
    sense, n_in, n_on = 1 if plane.high[plane.number, axis] > 0.0 else -1, 0, 0
    for i in range(n):
        v = ring[i]
        x = pool[v * d + axis]
        sign = sense * (int(x > place) - int(x < place))
        if sign == 0 and v >= n_ring:
            rest, bound = rests[2 * (v * d + axis)], rests[2 * (v * d + axis) + 1]
            if abs(rest) > bound:
                sign = sense if rest > 0.0 else -sense
            elif bound > 0.0:
                return DOUBT, 0
        s.signs[i] = sign
        n_in += sign >= 0
        n_on += sign == 0
    return n_in, n_on


@merged
def classify_by_value(s: Scratch, plane: Plane, near: float, ring: Int32Array, n: int) -> tuple[int, int]:
    """Set s.signs of n vertices at an oblique plane by float values; return (number of vertices inside, 0), or (DOUBT,
    0) if a value is within `near` of zero: no vertex is proven to be on the plane."""
    row, n_in = row_of(s, plane), 0
    for i in range(n):
        value = value_at(s, row, ring[i])
        if abs(value) <= near:
            return DOUBT, 0
        s.signs[i] = 1 if value > 0.0 else -1
        n_in += value > 0.0
    return n_in, 0


@merged
def cut_ring(
    s: Scratch, plane: Plane, ring: Int32Array, n: int, made: Int32Array, n_ring: int, n_made: int
) -> tuple[int, int]:
    """Clip a ring of n vertices, whose signs are set, by a plane into `made`: append, cross or drop each edge. A vertex
    on the plane that is the same point as the one before it is merged into that one, which inherits its edge. Returns
    the number of vertices left, or DOUBT; and the number of vertices of all kinds then, n_made before, cut ones being
    numbered from there on."""
    signs, edges = s.signs, s.vertices.edges
    n_left, was_on, first_on, same = 0, False, False, 0
    signs[n] = signs[0]
    for i in range(n):
        v, sign, sign_after = ring[i], signs[i], signs[i + 1]
        if sign >= 0:
            if sign == 0 and sign_after < 0:
                edges[v] = -1
            same = sameness(s.vertices, v, made[n_left - 1], n_ring) if sign == 0 and was_on else 0
            if same == DOUBT:
                return DOUBT, n_made
            if same == 1:
                edges[made[n_left - 1]] = edges[v]
            else:
                was_on = sign == 0
                first_on = was_on if n_left == 0 else first_on
                made[n_left] = v
                n_left += 1
        if sign * sign_after >= 0:
            continue
        if not cut_edge(s.vertices, plane, v, ring[i + 1] if i + 1 < n else ring[0], n_ring, n_made):
            return DOUBT, n_made
        edges[n_made] = -1 if sign > 0 else edges[v]
        same = sameness(s.vertices, n_made, made[n_left - 1], n_ring) if was_on else 0
        if same == DOUBT:
            return DOUBT, n_made
        if same == 1:
            edges[made[n_left - 1]] = edges[n_made]
        else:
            was_on, first_on = True, first_on or n_left == 0
            made[n_left] = n_made
            n_left += 1
        n_made += 1
    if n_left > 1 and was_on and first_on:
        same = sameness(s.vertices, made[n_left - 1], made[0], n_ring)
        n_left = DOUBT if same == DOUBT else n_left - same
    return n_left, n_made


@merged
def renumber(s: Scratch, ring: Int32Array, n: int, n_ring: int, n_made: int) -> int:
    """Give the cut vertices of a ring of n the lowest numbers from n_ring on, for new ones to take those of dropped
    ones; return the number of vertices of all kinds then, n_made before."""
    pool, rests, edges, codes, d = s.vertices.pool, s.vertices.rests, s.vertices.edges, s.codes, len(s.vertices.names)
    codes[n_ring:n_made] = 0
    for i in range(n):
        codes[ring[i]] = 1
    n_left = n_ring
    for v in range(n_ring, n_made):
        if codes[v] != 0:
            for k in range(2 * d):
                rests[2 * n_left * d + k] = rests[2 * v * d + k]
            for k in range(d):
                pool[n_left * d + k] = pool[v * d + k]
            codes[v], edges[n_left] = n_left, edges[v]
            n_left += 1
    for i in range(n):
        ring[i] = codes[ring[i]] if ring[i] >= n_ring else ring[i]
    return n_left


@merged
def cut_by_planes(s: Scratch, planes: PlaneTables, n_cutting: int, n: int, n_ring: int) -> tuple[int, int]:
    """Clip the ring of n runs by the n_cutting planes of s.cutting in order; return the number of vertices left (or
    DOUBT), and its row in `rings`. Vertices below n_ring are original ones."""
    n_made, now, cutting = n_ring, 0, s.cutting
    for i_plane in range(n_cutting):
        plane = plane_of(planes, cutting.planes[i_plane])
        ring = s.rings[now]
        if plane.axis >= 0:
            n_in, n_on = classify_across(s, plane, ring, n, n_ring)
        else:
            n_in, n_on = classify_by_value(s, plane, cutting.slack[i_plane], ring, n)
        cutting.contacts[i_plane] += n_on
        if n_in == n:
            continue
        if n_in != DOUBT and n_made + n > s.signs.size:
            n_made = renumber(s, ring, n, n_ring, n_made)
        if n_in == DOUBT or n_made + n > s.signs.size:
            return DOUBT, now
        cutting.dropped[i_plane] = True
        n_before = n_made
        n, n_made = cut_ring(s, plane, ring, n, s.rings[1 - now], n_ring, n_made)
        cutting.contacts[i_plane] += n_made - n_before
        now = 1 - now
        if n <= 0:
            break
    return n, now


@merged
def emit(s: Scratch, ring: Int32Array, n: int, n_ring: int, out: FloatArray, place: int) -> int:
    """Write the coordinates of a ring of n vertices to the flat array `out` from index `place` on; return the index
    after them. ring: numbers of vertices; an original one (below n_ring) stands for its run, v .. ``s.ends[v]``, others
    were made by cuts."""
    d = len(s.vertices.names)
    for i in range(n):
        v = ring[i]
        last = s.ends[v] if v < n_ring else v
        n_numbers = (last + 1 - v) * d
        move(out, place, s.vertices.pool, v * d, n_numbers)
        place += n_numbers
    return place


@called
def clip_in_doubles(
    polygons: Polygons, planes: PlaneTables, first: int, last: int, stop: FlagArray, clipped: Clipped, written: int,
    s: Scratch,
) -> tuple[int, int, int, int]:  # fmt: skip
    """Clip polygons first .. last - 1 until doubles do not decide one; write vertices after the `written` ones of
    earlier polygons. Returns the polygon reached, the vertices written, DONE, DOUBT or NO_ROOM, and how many planes may
    cut that polygon."""
    d, offsets = len(s.vertices.names), polygons.ring_offsets
    for polygon in range(first, last):
        if stop[0]:
            return polygon, written, NO_ROOM, 0
        first_ring, last_ring = polygons.polygon_offsets[polygon], polygons.polygon_offsets[polygon + 1]
        clipped.state[polygon], clipped.may_have_bridges[polygon] = CLIPPED, False
        n_ring = load_box(s, polygons, first_ring, last_ring)
        n_cutting, is_outside = choose_planes(s, planes)
        if is_outside:
            for ring in range(first_ring, last_ring):
                clipped.sizes[ring] = 0
            continue
        written_before = written
        for ring in range(first_ring, last_ring):
            if last_ring > first_ring + 1:
                n_ring = load_ring(s, polygons.vertices, offsets[ring], offsets[ring + 1])[0]
            while n_ring > 1 and are_same(s.vertices, n_ring - 1, 0):
                n_ring -= 1
            n = group_into_runs(s, planes, n_cutting, n_ring)
            n, now = cut_by_planes(s, planes, n_cutting, n, n_ring)
            if n == DOUBT:
                return polygon, written_before, DOUBT, n_cutting
            if (written + n_ring + n) * d > clipped.vertices.size:
                return polygon, written_before, NO_ROOM, n_cutting
            end = emit(s, s.rings[now], n, n_ring, clipped.vertices, written * d) // d
            clipped.sizes[ring], written = end - written, end
        if written > written_before:
            clipped.may_have_bridges[polygon] = has_bridges(s.cutting, n_cutting)
    return last, written, DONE, 0
