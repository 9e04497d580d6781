"""The pieces of segments whose contacts are all proper crossings, compiled: the common case on meshes and polygons.

Every crossing turns the location over, so only the first end's location and the order of the crossings along the
segment matter. With s(x) = ((b - a) x (c - a)) . (x - a), in the plane (b - a) x (x - a), a crossing is at

    t = s(p) / d,    d = s(p) - s(q) = ((b - a) x (c - a)) . (p - q),    x = p + t (q - p),

all in double-double with a running bound. Parameters that are surely rounded and differ as doubles are in their exact
order. A segment with two crossings that round alike, or a coordinate that may round either way, is left open for
exact_pieces.py. The location of an end that is not known is the parity of its crossings on the way to the nearest side
of the boundary's box: the same kind of segment.

**The bound.** With u = 2^-53, differences of coordinates are pairs without error, tails below u of the head. A
component n = U V - X Y of the normal is kept as h + low, with m = |u v| + |x y|: products of two tails are left out
(2 u^2 m), products with one tail are rounded (2 u^2 m), and so are the six sums of terms below u m, 2 u m, 3 u m and
4 u m (12 u^2 m): 16 u^2 m, and |low| <= 4.1 u m. Its product with a difference w leaves out low w' (4.1 u^2), rounds
the other two products (5.1 u^2), their sum (5.1 u^2) and that with the head's tail (6.1 u^2), and carries the normal's
error (16.1 u^2): below 37 u^2 m |w|. Three of them are added up with exact heads, their tails, below 6.2 u m |w| each,
in four sums (29 u^2): 66 u^2 of the sum of m |w|. `VALUE_BOUND` has room for the rounding of that sum and for terms of
third order.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.clipping.box_tree import DEEPEST
from engine.clipping.contacts import PROPER, gather_edge_contacts
from engine.clipping.cut_point import is_safe, point_at
from engine.clipping.cyrus_beck import is_segment_safe
from engine.clipping.mesh_contacts import STACK, gather_mesh_contacts
from engine.clipping.plane_meeting import T_BOUND
from engine.jit import inline, kernel, merged
from engine.predicates.double_double import U2, dd_div
from engine.predicates.error_free import two_diff, two_prod, two_sum
from engine.types import UNDECIDED

SETTLED: Final = 0
OPEN: Final = 1
"""Exact arithmetic must cut the segment."""
UNLOCATED: Final = 2
"""The location of the first end must be told."""
VALUE_BOUND: Final = 80.0 * U2
FIRST_ROOM: Final = 64


@merged
def minor(
    u: float, u_low: float, v: float, v_low: float, x: float, x_low: float, y: float, y_low: float
) -> tuple[float, float, float]:
    """Return U V - X Y for pairs without error as a sum of two doubles, and |u v| + |x y|."""
    ph, pl = two_prod(u, v)
    qh, ql = two_prod(x, y)
    h, tail = two_diff(ph, qh)
    low = tail + ((pl - ql) + ((u * v_low + u_low * v) - (x * y_low + x_low * y)))
    return h, low, abs(ph) + abs(qh)


@merged
def product(n: tuple[float, float, float], w: float, w_low: float) -> tuple[float, float, float]:
    """Return (h + low) (w + w_low) for what `minor` returns as a sum of two doubles, and its size m |w|."""
    g, tail = two_prod(n[0], w)
    return g, tail + (n[0] * w_low + n[1] * w), n[2] * abs(w)


@merged
def dot(
    nx: tuple[float, float, float],
    ny: tuple[float, float, float],
    nz: tuple[float, float, float],
    wx: tuple[float, float],
    wy: tuple[float, float],
    wz: tuple[float, float],
) -> tuple[float, float, float]:
    """Return n . w as a double-double, and its bound."""
    x, x_low, x_size = product(nx, wx[0], wx[1])
    y, y_low, y_size = product(ny, wy[0], wy[1])
    z, z_low, z_size = product(nz, wz[0], wz[1])
    h, first = two_sum(x, y)
    h, second = two_sum(h, z)
    h, low = two_sum(h, ((x_low + y_low) + (z_low + first)) + second)
    return h, low, VALUE_BOUND * (x_size + y_size + z_size)


@merged
def line_values(edge: Any, segment: Any) -> tuple[Any, Any]:
    """Return s(p) and d for an edge of the plane as double-doubles, each with its bound."""
    u, u_low = two_diff(edge[1, 0], edge[0, 0])
    v, v_low = two_diff(edge[1, 1], edge[0, 1])
    x, x_low = two_diff(segment[0, 0], edge[0, 0])
    y, y_low = two_diff(segment[0, 1], edge[0, 1])
    h, low, size = minor(u, u_low, y, y_low, v, v_low, x, x_low)
    h, low = two_sum(h, low)
    x, x_low = two_diff(segment[0, 0], segment[1, 0])
    y, y_low = two_diff(segment[0, 1], segment[1, 1])
    g, g_low, g_size = minor(u, u_low, y, y_low, v, v_low, x, x_low)
    g, g_low = two_sum(g, g_low)
    return (h, low, VALUE_BOUND * size), (g, g_low, VALUE_BOUND * g_size)


@merged
def plane_values(triangle: Any, segment: Any) -> tuple[Any, Any]:
    """Return s(p) and d for a triangle of space as double-doubles, each with its bound."""
    ux, ux_low = two_diff(triangle[1, 0], triangle[0, 0])
    uy, uy_low = two_diff(triangle[1, 1], triangle[0, 1])
    uz, uz_low = two_diff(triangle[1, 2], triangle[0, 2])
    vx, vx_low = two_diff(triangle[2, 0], triangle[0, 0])
    vy, vy_low = two_diff(triangle[2, 1], triangle[0, 1])
    vz, vz_low = two_diff(triangle[2, 2], triangle[0, 2])
    nx = minor(uy, uy_low, vz, vz_low, uz, uz_low, vy, vy_low)
    ny = minor(uz, uz_low, vx, vx_low, ux, ux_low, vz, vz_low)
    nz = minor(ux, ux_low, vy, vy_low, uy, uy_low, vx, vx_low)
    at_p = dot(
        nx,
        ny,
        nz,
        two_diff(segment[0, 0], triangle[0, 0]),
        two_diff(segment[0, 1], triangle[0, 1]),
        two_diff(segment[0, 2], triangle[0, 2]),
    )
    along = dot(
        nx,
        ny,
        nz,
        two_diff(segment[0, 0], segment[1, 0]),
        two_diff(segment[0, 1], segment[1, 1]),
        two_diff(segment[0, 2], segment[1, 2]),
    )
    return at_p, along


@merged
def is_element_safe(element: Any) -> bool:
    """Tell whether every coordinate of an element is zero or of a size for which double-doubles keep their bounds."""
    safe = True
    for corner in range(element.shape[0]):
        for k in range(element.shape[1]):
            safe = safe and is_safe(element[corner, k])
    return safe


@merged
def cut_at(segment: Any, element: Any, at_p: Any, along: Any, point: Any) -> tuple[float, bool]:
    """Set `point` to where a segment crosses an element; return t and whether all is surely the nearest double."""
    s, s_low, s_bound = at_p
    d, d_low, d_bound = along
    th, tl = dd_div(s, s_low, d, d_low)
    r = 1.01 * (s_bound / abs(s) + d_bound / abs(d))
    sure = (r < 0.001) & (abs(d) >= 2.0**-400) & (abs(d) <= 2.0**400) & (abs(s) >= 2.0**-500)
    bound = (T_BOUND + r) * th
    sure &= th + (tl - bound) == th + (tl + bound)
    for k in range(point.size):
        level = element[0, k]
        is_level = True
        for corner in range(1, element.shape[0]):
            is_level &= element[corner, k] == level
        if is_level:  # case: a face or edge across an axis, whose coordinate is the point's
            point[k] = level
            continue
        x, is_x = point_at(segment[0, k], segment[1, k], th, tl, r)
        point[k] = x + 0.0
        sure &= is_x
    return th + tl, sure


class Crossings(NamedTuple):
    """Room for what one segment meets."""

    met: Any
    kinds: Any
    t: Any
    points: Any
    order: Any


class Rows(NamedTuple):
    """Where pieces are written, see `SegmentPieces`."""

    source: Any
    start: Any
    end: Any
    t: Any
    faces: Any


@inline
def crossings_for(n: int, dimension: int) -> Crossings:
    """Return room for n contacts."""
    return Crossings(
        np.empty(n, np.int64), np.empty(n, np.uint8), np.empty(n), np.empty((n, dimension)), np.empty(n, np.int64)
    )


@inline
def sort_crossings(cuts: Crossings, n: int) -> bool:
    """Set the order of n crossings by t; False where two are equal."""
    t, order = cuts.t, cuts.order
    for i in range(n):
        order[i] = i
    gap = n // 2
    while gap > 0:  # bound: gap is halved; Shell's sort, n^1.5 steps
        for i in range(gap, n):
            moved, j = order[i], i
            while j >= gap and t[order[j - gap]] > t[moved]:
                order[j] = order[j - gap]
                j -= gap
            order[j] = moved
        gap //= 2
    differ = True
    for i in range(1, n):
        differ &= t[order[i - 1]] != t[order[i]]
    return differ


@inline
def emit(segment: Any, item: int, is_inside: bool, cuts: Crossings, n: int, faces: Any, row: int, out: Rows) -> int:
    """Write the pieces between n crossings to the rows of `out` from `row` on; return the row after them."""
    if is_inside:
        out.source[row], out.t[row, 0], out.faces[row, 0] = item, 0.0, -1
        for k in range(segment.shape[1]):
            out.start[row, k] = segment[0, k] + 0.0
    for place in range(n):
        i = cuts.order[place]
        if is_inside:
            out.t[row, 1], out.faces[row, 1] = cuts.t[i], faces[cuts.met[i]]
            for k in range(segment.shape[1]):
                out.end[row, k] = cuts.points[i, k]
            row += 1
        else:
            out.source[row], out.t[row, 0], out.faces[row, 0] = item, cuts.t[i], faces[cuts.met[i]]
            for k in range(segment.shape[1]):
                out.start[row, k] = cuts.points[i, k]
        is_inside = not is_inside
    if is_inside:
        out.t[row, 1], out.faces[row, 1] = 1.0, -1
        for k in range(segment.shape[1]):
            out.end[row, k] = segment[1, k] + 0.0
        row += 1
    return row


@inline
def all_proper(kinds: Any, n: int) -> bool:
    """Tell whether the first n contacts are proper crossings."""
    are_proper = True
    for i in range(n):
        are_proper &= kinds[i] == PROPER
    return are_proper


@inline
def way_out(segment: Any, beyond: Any, way: Any) -> int:
    """Set `way` (2, dim) to the shortest way, along an axis, from an end of a segment to a side of the boundary's box.

    Returns the end (0 or 1); -1 and -2 where the end 0 or 1 lies outside: its location is known; -3 where no way has a
    length that a double holds.
    """
    shortest, nearest, axis, target = np.inf, -3, 0, 0.0
    for end in range(2):
        for k in range(segment.shape[1]):
            x, low, high = segment[end, k], beyond[0, k], beyond[1, k]
            if x <= low or x >= high:
                return -1 - end
            if x - low < shortest:
                shortest, nearest, axis, target = x - low, end, k, low
            if high - x < shortest:
                shortest, nearest, axis, target = high - x, end, k, high
    for k in range(segment.shape[1]):
        way[0, k] = way[1, k] = segment[max(nearest, 0), k]
    way[1, axis] = target
    return nearest


@inline
def is_point(segment: Any) -> bool:
    """Tell whether a segment has no length."""
    are_equal = True
    for k in range(segment.shape[1]):
        are_equal &= segment[0, k] == segment[1, k]
    return are_equal


@kernel
def cut_on_outline(
    segments: Any, chosen: Any, locations: Any, outline: Any, stop: Any, out: Rows, state: Any, n: Any
) -> None:
    """Cut the ``chosen`` of some segments (n, 2, 2) float64 on a polygon, as far as double-doubles and filters go.

    chosen: (m,) int64. locations: (m,) int8 of their first ends, UNDECIDED where they are not known. outline: see
    `Outline`. stop: one uint8, polled. state: (m,) uint8, SETTLED, OPEN or UNLOCATED. n: the place in `chosen` to begin
    with, afterwards where to go on, short of the end where there is no room; how many rows are filled; and for how many
    contacts of one segment there is to be room.
    """
    stack, way, cuts, row = np.empty(DEEPEST, np.int64), np.empty((2, 2)), crossings_for(n[2], 2), 0
    for place in range(n[0], chosen.size):
        n[0], n[1] = place, row
        item = chosen[place]
        segment, location, found = segments[item], locations[place], 0
        if stop[0]:
            return
        if not is_point(segment):
            found = gather_edge_contacts(outline, segment, stack, cuts.met, cuts.kinds, 0)
        if found < 0:
            n[2] = 2 * cuts.met.size
            return
        state[place] = OPEN
        if not all_proper(cuts.kinds, found) or (found > 0 and location == 0):
            continue
        if location == UNDECIDED:
            end, turns = way_out(segment, outline.beyond, way), 0
            if end >= 0:
                turns = gather_edge_contacts(outline, way, stack, cuts.met[found:], cuts.kinds[found:], 0)
            if end == -3 or turns < 0 or not all_proper(cuts.kinds[found:], turns):
                state[place] = UNLOCATED
                continue
            turns += found if end == 1 or end == -2 else 0
            location = 1 if turns % 2 == 1 else -1
        if row + found // 2 + 1 > out.source.size:
            return
        sure = found == 0 or is_segment_safe(segment)
        for i in range(found):
            element = outline.elements[cuts.met[i]]
            if not (sure and is_element_safe(element)):
                sure = False
                break
            at_p, along = line_values(element, segment)
            cuts.t[i], sure = cut_at(segment, element, at_p, along, cuts.points[i])
        if sure and sort_crossings(cuts, found):
            row = emit(segment, item, location >= 0, cuts, found, outline.faces, row, out)
            state[place] = SETTLED
    n[0], n[1] = chosen.size, row


@kernel
def cut_on_mesh(
    segments: Any, chosen: Any, locations: Any, mesh: Any, stop: Any, out: Rows, state: Any, n: Any
) -> None:
    """Cut the ``chosen`` of some segments (n, 2, 3) float64 on a polyhedron, `Mesh`: see `cut_on_outline`."""
    stack, way, cuts, row = np.empty(STACK, np.int64), np.empty((2, 3)), crossings_for(n[2], 3), 0
    for place in range(n[0], chosen.size):
        n[0], n[1] = place, row
        item = chosen[place]
        segment, location, found = segments[item], locations[place], 0
        if stop[0]:
            return
        if not is_point(segment):
            found = gather_mesh_contacts(mesh, segment, stack, cuts.met, cuts.kinds, 0)
        if found < 0:
            n[2] = 2 * cuts.met.size
            return
        state[place] = OPEN
        if not all_proper(cuts.kinds, found) or (found > 0 and location == 0):
            continue
        if location == UNDECIDED:
            end, turns = way_out(segment, mesh.beyond, way), 0
            if end >= 0:
                turns = gather_mesh_contacts(mesh, way, stack, cuts.met[found:], cuts.kinds[found:], 0)
            if end == -3 or turns < 0 or not all_proper(cuts.kinds[found:], turns):
                state[place] = UNLOCATED
                continue
            turns += found if end == 1 or end == -2 else 0
            location = 1 if turns % 2 == 1 else -1
        if row + found // 2 + 1 > out.source.size:
            return
        sure = found == 0 or is_segment_safe(segment)
        for i in range(found):
            element = mesh.elements[cuts.met[i]]
            if not (sure and is_element_safe(element)):
                sure = False
                break
            at_p, along = plane_values(element, segment)
            cuts.t[i], sure = cut_at(segment, element, at_p, along, cuts.points[i])
        if sure and sort_crossings(cuts, found):
            row = emit(segment, item, location >= 0, cuts, found, mesh.faces, row, out)
            state[place] = SETTLED
    n[0], n[1] = chosen.size, row
