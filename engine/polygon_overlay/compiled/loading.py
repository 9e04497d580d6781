"""Rings of two polygons as one set of edges: without repeated points, and without what lies far outside the result.

What lies outside the other polygon's box and cannot be in the result is shortened: of consecutive vertices beyond one
side of the common box the first and the last stay, which moves the boundary there only.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.compiling.jit import inline, kernel, merged
from engine.polygon_overlay.compiled.crossing_signs import INFINITESIMAL, Edges
from engine.polygon_overlay.compiled.edge_tree import ANYWHERE, BENT, POLL, RUN, BoxTree, heading
from engine.predicates.expansion import SMALLEST
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.types import FlagArray, FloatArray, Int32Array, IntArray

Box = tuple[float, float, float, float]
"""An axis-aligned box: x_min, x_max, y_min, y_max."""
EVERYTHING: Final = (-np.inf, np.inf, -np.inf, np.inf)


LEFT_OUT: Final = -2
"""Second source of a vertex after which input vertices are omitted up to the next source; `expand_rings` inserts them.
"""


class RingArrays(NamedTuple):
    """Rings as read-only arrays: vertices (n, 2) float64, and ``offsets`` (n_rings + 1,) int64; a ring may be empty."""

    vertices: FloatArray
    offsets: IntArray


class Given(NamedTuple):
    """The loaded rings of both polygons. edges: by vertex; origins: by vertex its number in the input; tops, masks: by
    ring its last vertex (x, then y), and its source: bit 0 the subject, bit 1 the clip, or the number of the ring."""

    edges: Edges
    origins: Any
    tops: Any
    masks: Any


class Loaded(NamedTuple):
    """What was loaded. n, n_rings: numbers of vertices and rings; n_runs: number of edges that replace several (runs);
    largest: the largest |coordinate|."""

    n: int
    n_rings: int
    n_runs: int
    largest: float


@merged
def is_before(vertices: FloatArray, i: int, j: int) -> bool:
    """Return whether vertex i is lexicographically smaller than j (x, then y)."""
    return vertices[i, 0] < vertices[j, 0] or (vertices[i, 0] == vertices[j, 0] and vertices[i, 1] < vertices[j, 1])


@inline
def end_ring(given: Given, start: int, n: int, n_rings: int, mask: int) -> tuple[int, int]:
    """Close the ring of the vertices ``start`` .. n - 1 of ``given`` as ring number n_rings, with mask ``mask``; drop
    it if fewer than three vertices are distinct from their neighbours. Return the numbers of vertices and rings then.
    """
    edges = given.edges
    x, y = edges.x, edges.y
    while n > start + 1 and x[n - 1] == x[start] and y[n - 1] == y[start]:
        n -= 1
    if n - start < 3:  # a point, or an edge there and back
        return start, n_rings
    for k in range(start, n):
        edges.after[k], edges.before[k], edges.ring[k] = k + 1, k - 1, n_rings
    edges.after[n - 1], edges.before[start] = start, n - 1
    top, px, py = start, x[start], y[start]
    for k in range(start + 1, n):
        if x[k] > px or (x[k] == px and y[k] > py):
            top, px, py = k, x[k], y[k]
    given.tops[n_rings], given.masks[n_rings] = top, mask
    return n, n_rings + 1


@inline
def load_rings(
    rings: RingArrays, first_ring: int, last_ring: int, mask: int, is_named: bool, base: int, box: Box, given: Given,
    n: int, n_rings: int, stop: FlagArray,
) -> tuple[int, int, bool]:  # fmt: skip
    """Append the rings first_ring .. last_ring - 1, repeated points merged, to ``given``, after its n vertices and
    n_rings rings; return the numbers of vertices and rings then, and whether every |coordinate| is 0, infinitesimal or
    SMALLEST and above.

    mask: of each ring; is_named: the mask is the ring's number from ``first_ring`` on instead. base: added to vertex
    numbers in ``origins``. box: of consecutive vertices beyond one of its sides only the first and the last are loaded.
    """
    vertices, offsets = rings.vertices, rings.offsets
    x_min, x_max, y_min, y_max = box
    x, y, origins = given.edges.x, given.edges.y, given.origins
    is_in_range = True
    for ring in range(first_ring, last_ring):
        start = n
        qx = qy = np.nan  # the last vertex
        sides = sides_before = 0  # of the last vertex and of the one before it: which sides of the box it is beyond
        for k in range(offsets[ring], offsets[ring + 1]):
            if k & POLL == 0 and stop[0]:
                return 0, 0, False
            px, py = vertices[k, 0], vertices[k, 1]
            is_in_range &= (abs(px) >= SMALLEST) | (abs(px) < INFINITESIMAL)
            is_in_range &= (abs(py) >= SMALLEST) | (abs(py) < INFINITESIMAL)
            if px == qx and py == qy:
                origins[n - 1] = base + k  # the next edge begins here
                continue
            beyond = 1 * (px < x_min) + 2 * (px > x_max) + 4 * (py < y_min) + 8 * (py > y_max)
            if beyond & sides & sides_before:  # a triangle beyond that side changes no label in the box
                n -= 1
                if x[n - 1] == px and y[n - 1] == py:
                    origins[n - 1] = base + k  # the next edge begins here
                    sides, sides_before, qx, qy = sides_before, 0, px, py
                    continue
            else:
                sides_before = sides
            sides, qx, qy = beyond, px, py
            x[n], y[n], origins[n] = px, py, base + k
            n += 1
        n, n_rings = end_ring(given, start, n, n_rings, ring - first_ring if is_named else mask)
    return n, n_rings, is_in_range


@inline
def box_of(vertices: FloatArray, first: int, last: int) -> Box:
    """Return the box of ``vertices[first:last]``; inverted (minimum above maximum) if there is none."""
    x_min = y_min = np.inf
    x_max = y_max = -np.inf
    for k in range(first, last):
        px, py = vertices[k, 0], vertices[k, 1]
        x_min, x_max = min(x_min, px), max(x_max, px)
        y_min, y_max = min(y_min, py), max(y_max, py)
    return x_min, x_max, y_min, y_max


@inline
def magnitude(box: Box) -> float:
    """Return the largest magnitude of a coordinate of a box; 0 for an inverted one."""
    return max(-box[0], box[1], -box[2], box[3]) if box[0] <= box[1] else 0.0


@inline
def common_box(box: Box, other: Box) -> Box:
    """Return the intersection of two boxes."""
    return max(box[0], other[0]), min(box[1], other[1]), max(box[2], other[2]), min(box[3], other[3])


@inline
def is_empty(box: Box) -> bool:
    """Return whether a box has no point."""
    return box[0] > box[1] or box[2] > box[3]


@inline
def fill_boxes(edges: Edges, n: int, margin: float, tree: BoxTree, stop: FlagArray) -> float:
    """Fill ``tree.boxes`` with the box of each of n edges, enlarged by the margin, and ``tree.marks`` with its
    direction bits (`heading`). Returns the least max(|dx|, |dy|) of an edge; 0.0 if ``stop`` is set. BENT is added
    where the turn from the edge before, by the filter of `turns`, proves that both share one vertex only."""
    x, y, boxes, marks = edges.x, edges.y, tree.boxes, tree.marks
    shortest = np.inf
    first = 0
    while first < n:  # bound: each turn passes one ring
        last = edges.before[first]
        px, py = x[last], y[last]
        qx, qy = x[first], y[first]
        vx, vy = qx - px, qy - py
        for i in range(first, last + 1):
            if i & POLL == 0 and stop[0]:
                return 0.0
            j = i + 1 if i < last else first
            ox, oy, px, py, qx, qy = px, py, qx, qy, x[j], y[j]
            ux, uy = qx - px, qy - py
            boxes[i, 0], boxes[i, 1] = min(px, qx) - margin, max(px, qx) + margin
            boxes[i, 2], boxes[i, 3] = min(py, qy) - margin, max(py, qy) + margin
            left, right, size = vx * uy, vy * ux, 0.0
            if i > first:
                left, right, size = vx * (qy - oy), vy * (qx - ox), 2.0 * abs(vx * vy)
            is_bent = abs(left - right) > BOUND_2D * max(size, abs(left) + abs(right)) + GUARD_2D
            marks[i] = BENT * is_bent | (heading(ux, uy) if i < last else ANYWHERE)
            shortest = min(shortest, max(abs(ux), abs(uy)))
            vx, vy = ux, uy
        first = last + 1
    return shortest


@inline
def mark_runs(edges: Edges, runs: Int32Array, n_runs: int, tree: BoxTree) -> None:
    """Mark the edges ``runs[:n_runs]``, which replace several, as RUN, with boxes that intersect none; the ring turns
    at both of their ends (BENT)."""
    for k in range(n_runs):
        e = runs[k]
        tree.marks[e] = ANYWHERE | BENT | RUN
        tree.marks[edges.after[e]] |= BENT
        tree.boxes[e, 3] = -np.inf


@kernel
def largest_counts(ring_offsets: IntArray, polygon_offsets: IntArray) -> tuple[int, int]:
    """Return the largest number of vertices of one polygon, and the largest number of rings of one. ring_offsets: of
    rings into vertices; polygon_offsets: of polygons into rings."""
    n_vertices = n_rings = 0
    for k in range(polygon_offsets.shape[0] - 1):
        first, end = polygon_offsets[k], polygon_offsets[k + 1]
        n_vertices, n_rings = max(n_vertices, ring_offsets[end] - ring_offsets[first]), max(n_rings, end - first)
    return n_vertices, n_rings


@kernel
def boxes_of_runs(vertices: FloatArray, starts: IntArray, low: FloatArray, high: FloatArray) -> None:
    """Fill low, high (n, 2) with the corners of the box of the vertices from each start to the next, or to the end."""
    n = starts.shape[0]
    for k in range(n):
        low[k, 0], high[k, 0], low[k, 1], high[k, 1] = box_of(
            vertices, starts[k], starts[k + 1] if k + 1 < n else vertices.shape[0]
        )
