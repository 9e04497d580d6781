"""Sutherland-Hodgman over batches: doubles and double-doubles for nearly every ring, multi-digit integers for the
others.

Each plane takes the sign of every vertex, retains those on its inner side and cuts the edges that change sides:

    s_p > 0 > s_q        p ------ x -- q            x = (p |s_q| + q |s_p|) / (|s_p| + |s_q|)

A later plane decides about x itself, not about the doubles nearest to it. `clip_in_doubles` does that for vertices in
double-double, as long as the error bounds decide; at the first doubt `clip_exactly` clips the polygon again in
multi-digit integers. What is too long for those is left open for Python's integers (in_integers.py).

A plane that has all original vertices inside is left out, for what other planes leave lies between them; one that has
all of them outside leaves nothing.

Source: I. E. Sutherland, G. W. Hodgman, Reentrant polygon clipping, 1974; the textbook's section on clipping polygons.
"""

from __future__ import annotations

from typing import Any

from engine.compiling.jit import allocating_kernel, inline
from engine.polygon_clipping.cut_vertices import DOUBT
from engine.polygon_clipping.in_digits import clip_exactly, exact_scratch
from engine.polygon_clipping.in_doubles import clip_in_doubles, scratch_for
from engine.polygon_clipping.rings import NO_ROOM, Clipped, PlaneTables, Polygons
from engine.types import BoolArray, FlagArray, FloatArray, IntArray


@inline
def room_for(ring_offsets: IntArray, first: int, last: int, n_planes: int) -> int:
    """Return the number of vertices, dropped ones included, to which one of the rings first .. last - 1 may grow; a
    polygon that exceeds it is left open. A convex ring gains one vertex a plane."""
    largest = 0
    for ring in range(first, last):
        largest = max(largest, ring_offsets[ring + 1] - ring_offsets[ring])
    return 4 * largest + 4 * n_planes + 16


@allocating_kernel
def clip_rings(
    vertices: FloatArray, ring_offsets: IntArray, polygon_offsets: IntArray, planes: PlaneTables, first: int, last: int,
    stop: FlagArray, out: FloatArray, sizes: IntArray, state: FlagArray, may_have_bridges: BoolArray, names: Any,
) -> tuple[int, int]:  # fmt: skip
    """Clip polygons first .. last - 1 by all planes; return the polygon reached and the number of vertices written.
    vertices .. polygon_offsets: see `Polygons`; out .. may_have_bridges: fields of `Clipped`. stop: one uint8, polled.
    names: its length is the dimension (`Vertices`). Stops before a polygon that does not fit `out`."""
    polygons, clipped = Polygons(vertices, ring_offsets, polygon_offsets), Clipped(out, sizes, state, may_have_bridges)
    n_planes = planes.high.shape[0]
    room = room_for(ring_offsets, polygon_offsets[first], polygon_offsets[last], n_planes)
    scratch = scratch_for(room, n_planes, names)
    is_ready, exact = False, exact_scratch(0, len(names), planes.row_heap[:0], planes.row_places[:0])
    polygon, written = first, 0
    while polygon < last:
        polygon, written, outcome, n_cutting = clip_in_doubles(
            polygons, planes, polygon, last, stop, clipped, written, scratch
        )
        if outcome != DOUBT:
            break
        if not is_ready:
            is_ready, exact = True, exact_scratch(2 * room, len(names), planes.row_heap, planes.row_places)
        end = clip_exactly(exact, polygons, polygon, planes, scratch.cutting, n_cutting, stop, clipped, written)
        if end == NO_ROOM:
            break
        polygon, written = polygon + 1, end
    return polygon, written
