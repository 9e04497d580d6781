"""Sutherland-Hodgman over batches: doubles and double-doubles for nearly every ring, whole numbers for the others.

Each plane takes the sign of every vertex, keeps those on its inner side and cuts the edges that change sides:

    s_p > 0 > s_q        p ------ x -- q            x = (p |s_q| + q |s_p|) / (|s_p| + |s_q|)

A later plane decides about x itself, not about the doubles nearest to it. `plain_rings` does that for vertices known
as double-doubles, as long as the bounds of their errors leave nothing open; at the first doubt a polygon is begun anew
by `exact_rings`, in whole numbers. What is too long for those is left open, and Python's integers settle it
(in_integers.py).

A plane that has all original vertices inside is left out, for what other planes leave lies between them; one that has
all of them outside leaves nothing.

Source: I. E. Sutherland, G. W. Hodgman, Reentrant polygon clipping, 1974; the textbook's section on clipping polygons.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.jit import kernel
from engine.polygon_clipping.in_digits import clip_exactly, exact_scratch
from engine.polygon_clipping.in_doubles import EXACT, GIVEN_UP, NO_ROOM, OPEN, clip_plainly


@kernel
def clip_rings(
    vertices: Any,
    ring_offsets: Any,
    polygon_offsets: Any,
    high: Any,
    low: Any,
    axes: Any,
    at: Any,
    row_heap: Any,
    row_places: Any,
    first: int,
    last: int,
    stop: Any,
    out: Any,
    sizes: Any,
    state: Any,
    may_have_bridges: Any,
    names: Any,
) -> tuple[int, int]:
    """Clip polygons first .. last - 1 by all planes; returns the polygon reached and the vertices written.

    vertices: (m * dim,) float64, with the offsets of rings and polygons. high, low: (planes, dim + 1) float64, rows as
    double-doubles, every number zero or in the safe range. axes, at: for a plane across one axis that axis and its
    coordinate, else -1. row_heap, row_places: the rows in whole numbers, see digits.py. stop: one uint8, polled. out:
    (room * dim,) float64, rings one after another; sizes: (n_rings,) int64, vertices left of each. state: (n,) uint8,
    CLIPPED, EXACT or OPEN; an open polygon has sizes 0 and writes nothing. names: see `clip_plainly`.
    Stops before a polygon that has no room in `out`.
    """
    n_planes, dimension = high.shape[0], len(names)
    largest = 0
    for ring in range(polygon_offsets[first], polygon_offsets[last]):
        largest = max(largest, ring_offsets[ring + 1] - ring_offsets[ring])
    room = (
        4 * largest + 4 * n_planes + 16
    )  # a convex ring gains one vertex a plane; one that outgrows this is left open
    pool, rests = np.empty(room * dimension), np.empty(2 * room * dimension)
    ends, codes = np.empty(room, np.int32), np.empty(room, np.int32)
    edges, rings, signs = np.empty(room, np.int32), np.empty(2 * room, np.int32), np.empty(room, np.int8)
    contacts, dropped = np.empty(n_planes, np.int64), np.empty(n_planes, np.bool_)
    cutting, slack = np.empty(n_planes, np.int64), np.empty(n_planes)
    lows, highs = np.empty(3), np.empty(3)
    is_ready, scratch = False, exact_scratch(0, dimension, row_heap[:0], row_places[:0])
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
            names,
            pool,
            rests,
            edges,
            ends,
            codes,
            rings,
            signs,
            contacts,
            dropped,
            cutting,
            slack,
            lows,
            highs,
        )
        if outcome != GIVEN_UP:
            break
        if not is_ready:
            is_ready, scratch = True, exact_scratch(2 * room, dimension, row_heap, row_places)
        for i in range(n_cutting):
            contacts[i], dropped[i] = 0, False
        first_ring, last_ring = polygon_offsets[polygon], polygon_offsets[polygon + 1]
        n = clip_exactly(
            scratch,
            vertices,
            ring_offsets,
            first_ring,
            last_ring,
            high,
            axes,
            at,
            cutting,
            n_cutting,
            contacts,
            dropped,
            stop,
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
            state[polygon] = EXACT
            written += n
            for i in range(n_cutting):
                if n > 0 and dropped[i] and contacts[i] > 2:
                    may_have_bridges[polygon] = True
        polygon += 1
    return polygon, written
