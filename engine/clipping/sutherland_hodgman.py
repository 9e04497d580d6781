"""Sutherland-Hodgman in double-double: settles the polygons whose every decision and coordinate it can prove.

A vertex is a point of double-doubles with a bound for each coordinate; an original vertex has the bound zero. Each
plane takes the sign of every vertex (doubles with a bound, then an expansion for original vertices, then
double-double), keeps those on its inner side and cuts the edges that change sides:

    s_p > 0 > s_q        p ------ x -- q            x = (p |s_q| + q |s_p|) / (|s_p| + |s_q|)

A later plane decides about x from its double-doubles: their bound contains every rounding since the original input,
so a sign beyond it is the exact one. A sign within it, a coordinate that may round either way, two vertices in a plane
that may coincide: what is known of the vertex may say that it is exactly zero or the same (vertex_origins.py). Else the
polygon is left open, and exact integers settle it (exact_contours.py).

A plane that has all original vertices inside is left out, for what other planes leave lies between them; one that has
all of them outside leaves nothing.

Source: I. E. Sutherland, G. W. Hodgman, Reentrant polygon clipping, 1974; the textbook's section on clipping polygons.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.clipping.cut_point import is_safe
from engine.clipping.cut_vertices import (
    compare_vertices,
    copy_vertex,
    cut_edge,
    is_exact,
    sign_across,
    sign_at,
)
from engine.clipping.plain_rings import GIVEN_UP, NO_ROOM, OPEN, clip_plainly
from engine.clipping.vertex_origins import (
    COLUMNS,
    CORNER,
    CUT_EDGE,
    CUT_PLANE,
    EDGE,
    MOST_BITS,
    PLANES,
    corner_planes,
    relation_of,
    settle_corner,
    settle_zeros,
    sign_on_edge,
)
from engine.jit import inline, kernel
from engine.predicates.double_double import U2, surely_rounded
from engine.types import UNDECIDED


@inline
def clip_ring(
    high: Any,
    low: Any,
    axes: Any,
    at: Any,
    cutting: Any,
    i_plane: int,
    source: Any,
    n: int,
    origins: Any,
    ring: Any,
    n_ring: int,
    signs: Any,
    target: Any,
    target_origins: Any,
    on_plane: Any,
) -> tuple[int, int, bool]:
    """Cut a ring of n vertices by plane ``cutting[i_plane]`` into `target`; `signs`, `on_plane`: scratch.

    ring: the original n_ring vertices; parts of its edges are cut from the whole ones. origins, and so target_origins:
    see vertex_origins.py, for each vertex of `source`.
    Returns the number of vertices left (-1: open; the ring itself where nothing is dropped), in how many points the
    plane was met, and whether a vertex was dropped.
    """
    n_contacts, has_dropped = 0, False
    plane = cutting[i_plane]
    axis, own_bit = axes[plane], 1 << i_plane if i_plane < MOST_BITS else 0
    sense = 1.0
    if axis >= 0 and high[plane, axis] < 0.0:
        sense = -1.0
    for i in range(n):
        if axis >= 0:
            signs[i] = sign_across(sense, axis, at[plane], source, i)
        else:
            signs[i] = sign_at(high[plane], low[plane], source, i)
        if signs[i] == UNDECIDED and origins[i, CUT_EDGE] >= 0:
            edge, by = origins[i, CUT_EDGE], origins[i, CUT_PLANE]
            signs[i] = sign_on_edge(high, low, cutting, ring, n_ring, edge, by, plane)
        if signs[i] == UNDECIDED:
            return -1, 0, False
        if signs[i] == 0:
            n_contacts += 1
            origins[i, PLANES] |= own_bit
        has_dropped = has_dropped or signs[i] < 0
    if not has_dropped:
        return n, n_contacts, False
    kept = 0
    for i in range(n):
        following = i + 1 if i + 1 < n else 0
        for step in range(2):
            if step == 0:
                if signs[i] < 0:
                    continue
                copy_vertex(source, i, target, kept)
                on_plane[kept] = signs[i] == 0
                target_origins[kept, EDGE] = -1 if signs[i] == 0 and signs[following] < 0 else origins[i, EDGE]
                for column in range(PLANES, COLUMNS):
                    target_origins[kept, column] = origins[i, column]
            else:
                if signs[i] * signs[following] >= 0:
                    continue
                n_contacts += 1
                if kept + 1 >= target.shape[0]:
                    return -1, 0, False
                edge = origins[i, EDGE]
                if edge < 0:
                    is_cut = cut_edge(high[plane], low[plane], axis, at[plane], source, i, following, target, kept)
                else:
                    after = edge + 1 if edge + 1 < n_ring else 0
                    is_cut = cut_edge(high[plane], low[plane], axis, at[plane], ring, edge, after, target, kept)
                if not is_cut:
                    return -1, 0, False
                on_plane[kept] = True
                shared = origins[i, PLANES] & origins[following, PLANES]
                corner = corner_planes(high, cutting, shared, i_plane)
                if corner != 0 and not is_exact(target, kept):
                    settle_corner(high, low, cutting, corner, target, kept)
                if shared != 0 and source.shape[1] == 3:
                    settle_zeros(high, low, cutting, shared, i_plane, target, kept)
                target_origins[kept, EDGE] = edge if signs[i] < 0 else -1
                target_origins[kept, PLANES], target_origins[kept, CORNER] = shared | own_bit, corner
                target_origins[kept, CUT_EDGE], target_origins[kept, CUT_PLANE] = edge, i_plane
            if kept > 0 and on_plane[kept] and on_plane[kept - 1]:
                relation = relation_of(target, target_origins, kept, kept - 1)
                if relation == UNDECIDED:
                    return -1, 0, False
                if relation == 0:
                    target_origins[kept - 1, EDGE] = target_origins[kept, EDGE]
                    target_origins[kept - 1, PLANES] |= target_origins[kept, PLANES]
                    continue
            kept += 1
            if kept >= target.shape[0]:
                return -1, 0, False
    while kept > 1 and on_plane[kept - 1] and on_plane[0]:
        relation = relation_of(target, target_origins, kept - 1, 0)
        if relation == UNDECIDED:
            return -1, 0, False
        if relation == 1:
            break
        kept -= 1
    return kept, n_contacts, True


@inline
def load_ring(vertices: Any, first: int, last: int, points: Any) -> int:
    """Load a ring without vertices equal to the one before, around the ring; return how many, -1 out of range."""
    n = 0
    for i in range(first, last):
        is_same = n > 0
        for k in range(vertices.shape[1]):
            x = vertices[i, k]
            if not is_safe(x):
                return -1
            is_same = is_same and points[n - 1, k, 0] == x
            points[n, k, 0], points[n, k, 1], points[n, k, 2] = x, 0.0, 0.0
        if not is_same:
            n += 1
    while n > 1 and compare_vertices(points, n - 1, 0) == 0:
        n -= 1
    return n


@inline
def store_ring(points: Any, n: int, out: Any, first: int) -> bool:
    """Write the nearest doubles of a ring to ``out[first:]``; False where one is not sure."""
    for i in range(n):
        for k in range(points.shape[1]):
            h, low, bound = points[i, k, 0], points[i, k, 1], points[i, k, 2]
            if bound > 0.0 and not surely_rounded(h, low, bound + 2.0 * U2 * abs(h)):
                return False
            out[first + i, k] = h + low
    return True


@inline
def careful_scratch(room: int, largest: int, dimension: int) -> tuple[Any, ...]:
    """Return what `clip_carefully` works in: for rings of at most `largest` vertices that grow to `room`."""
    return (
        np.empty((room, dimension, 3)),
        np.empty((room, dimension, 3)),
        np.empty((largest, dimension, 3)),
        np.empty((room, COLUMNS), np.int64),
        np.empty((room, COLUMNS), np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.bool_),
    )


@inline
def clip_carefully(
    vertices: Any,
    ring_offsets: Any,
    first: int,
    last: int,
    high: Any,
    low: Any,
    axes: Any,
    at: Any,
    cutting: Any,
    n_cutting: int,
    scratch: Any,
    contacts: Any,
    dropped: Any,
    out: Any,
    written: int,
    sizes: Any,
) -> int:
    """Clip rings first .. last - 1, one polygon, by the planes of `cutting` into ``out[written:]``; fills their sizes.

    Adds to contacts, dropped. Returns the vertices left, GIVEN_UP or NO_ROOM.
    """
    here, there, ring_points, origins, new_origins, signs, on_plane = scratch
    begun = written
    for ring in range(first, last):
        n = load_ring(vertices, ring_offsets[ring], ring_offsets[ring + 1], here)
        n_ring = n
        for i in range(n):
            copy_vertex(here, i, ring_points, i)
            origins[i, EDGE], origins[i, PLANES], origins[i, CORNER], origins[i, CUT_EDGE] = i, 0, 0, -1
        for i_plane in range(n_cutting):
            if n <= 0:
                break
            plane = cutting[i_plane]
            n, met, has_dropped = clip_ring(
                high,
                low,
                axes,
                at,
                cutting,
                i_plane,
                here,
                n,
                origins,
                ring_points,
                n_ring,
                signs,
                there,
                new_origins,
                on_plane,
            )
            contacts[plane] += met
            if has_dropped:
                dropped[plane] = True
                here, there = there, here
                origins, new_origins = new_origins, origins
        if n > 0 and written + n > out.shape[0]:
            return NO_ROOM
        if n < 0 or not store_ring(here, n, out, written):
            return GIVEN_UP
        sizes[ring] = n
        written += n
    return written - begun


@kernel
def clip_rings(
    vertices: Any,
    ring_offsets: Any,
    polygon_offsets: Any,
    high: Any,
    low: Any,
    axes: Any,
    at: Any,
    first: int,
    last: int,
    stop: Any,
    out: Any,
    sizes: Any,
    state: Any,
    may_have_bridges: Any,
) -> tuple[int, int]:
    """Clip polygons first .. last - 1 by all planes; returns the polygon reached and the vertices written.

    vertices: (m, dim) float64 with the offsets of rings and polygons. high, low: (planes, dim + 1) float64, rows as
    double-doubles, every number zero or in the safe range. axes, at: for a plane across one axis that axis and its
    coordinate, else -1. stop: one uint8, polled. out: (room, dim) float64, rings one after another; sizes: (n_rings,)
    int64, vertices left of each. state: (n,) uint8, CLIPPED or OPEN; an open polygon has sizes 0 and writes nothing.
    Stops before a polygon that has no room in `out`.
    """
    n_planes, dimension = high.shape[0], vertices.shape[1]
    largest = 0
    for ring in range(polygon_offsets[first], polygon_offsets[last]):
        largest = max(largest, ring_offsets[ring + 1] - ring_offsets[ring])
    room = 2 * largest + 2 * n_planes + 8  # a convex ring gains one vertex a plane; one that outgrows this is left open
    pool, edges = np.empty((2 * room, dimension, 3)), np.empty(2 * room, np.int32)
    rings, inside = np.empty((2, room), np.int32), np.empty(room, np.bool_)
    contacts, dropped = np.empty(n_planes, np.int64), np.empty(n_planes, np.bool_)
    cutting, slack = np.empty(n_planes, np.int64), np.empty(n_planes)
    reach, lows, highs = np.empty(dimension), np.empty(dimension), np.empty(dimension)
    scratch = careful_scratch(0, 0, dimension)
    polygon, written = first, 0
    while polygon < last:
        polygon, written, outcome, n_cutting = clip_plainly(
            vertices,
            ring_offsets,
            polygon_offsets,
            high,
            low,
            axes,
            at,
            polygon,
            last,
            stop,
            out,
            written,
            sizes,
            state,
            may_have_bridges,
            pool,
            edges,
            rings,
            inside,
            contacts,
            dropped,
            cutting,
            slack,
            reach,
            lows,
            highs,
        )
        if outcome != GIVEN_UP:
            break
        if scratch[0].shape[0] == 0:
            scratch = careful_scratch(room, largest, dimension)
        for i in range(n_cutting):
            contacts[cutting[i]], dropped[cutting[i]] = 0, False
        first_ring, last_ring = polygon_offsets[polygon], polygon_offsets[polygon + 1]
        n = clip_carefully(
            vertices,
            ring_offsets,
            first_ring,
            last_ring,
            high,
            low,
            axes,
            at,
            cutting,
            n_cutting,
            scratch,
            contacts,
            dropped,
            out,
            written,
            sizes,
        )
        if n == NO_ROOM:
            break
        if n == GIVEN_UP:
            state[polygon] = OPEN
            for ring in range(first_ring, last_ring):
                sizes[ring] = 0
        else:
            written += n
            for i in range(n_cutting):
                if n > 0 and dropped[cutting[i]] and contacts[cutting[i]] > 2:
                    may_have_bridges[polygon] = True
        polygon += 1
    return polygon, written
