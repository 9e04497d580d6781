"""Snap rounding of valid rings to integer points: which edges pass the pixels of which vertices.

A pixel is the half-open unit square about an integer point; it is hot if a vertex lies in it. Every edge is routed
through the centres of the hot pixels that it passes: edges that met in vertices only still do, or coincide, and none
moves by more than half a diagonal.

    .-----.       The edge passes the pixel unless one corner proves that it enters and leaves on one side: the corners
    |  .  |_.--   above and below it, as it rises or falls. Sides are exact signs, of doubles and half-integers.
    '--.--'

Where no edge passes a pixel but those of its ends, and vertices share one only where they are one point, rings keep
their topology, but for vertices that become straight: a point of ab and the one that divides the moved edge in the same
ratio differ by less than a pixel during the whole motion, so c can come to lie on the edge only if ab passes its pixel.

Source: J. D. Hobby, Practical segment intersection with finite precision output, 1999.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.compiling.jit import called, inline, kernel, merged
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_tree import FEW, POLL, begin_pairs, build_tree, next_pairs
from engine.polygon_overlay.compiled.loading import EVERYTHING, RingArrays, fill_boxes, is_before, load_rings
from engine.polygon_overlay.compiled.workspace import workspace_at
from engine.predicates.orientation import BOUND_2D, orient2d
from engine.types import FlagArray, FloatArray, Int32Array, IntArray, Point2

FOLDS: Final = -1
"""Result value: snapping changes the topology or the canonical order of rings."""


@merged
def _pixel(x: float) -> float:
    """Return the nearest integer for |x| < 2^52; halves go up."""
    near = np.rint(x)
    return near + 1.0 if x - near == 0.5 else near


@called
def _passes(ax: float, ay: float, bx: float, by: float, x: float, y: float, reach: float) -> bool:
    """Return whether the segment ab meets the square of half-side ``reach`` about (x, y), which contains its left and
    lower side, not the others. Exact."""
    if bx < ax:
        ax, ay, bx, by = bx, by, ax, ay
    left, right, low, high = x - reach, x + reach, y - reach, y + reach
    if not ((bx >= left) & (ax < right) & (max(ay, by) >= low) & (min(ay, by) < high)):
        return False
    if ax == bx or ay == by:
        return True
    a, b = Point2(ax, ay), Point2(bx, by)
    if by > ay:
        return orient2d(a, b, Point2(left, high)) > 0 and orient2d(a, b, Point2(right, low)) < 0
    return orient2d(a, b, Point2(left, low)) <= 0 and orient2d(a, b, Point2(right, high)) > 0


@kernel
def scale(
    values: FloatArray,
    divisor: float,
    factor: float,
    more: float,
    near_integer: float,
    least: float,
    scaled: FloatArray,
) -> float:
    """Fill ``scaled``, (n, 2), with ``values / divisor * factor * more``; return the largest of these magnitudes. The
    factors convert between coordinates and multiples of a grid (`Grid.into`, `Grid.back`). near_integer: a value within
    this relative distance of an integer becomes that integer; least: one of smaller magnitude becomes 0.0."""
    largest = 0.0
    for k in range(values.shape[0]):
        for axis in range(2):
            value = values[k, axis] / divisor * factor * more
            largest = max(largest, abs(value))
            near = np.rint(value)
            value = near if abs(value - near) <= near_integer * abs(value) else value
            scaled[k, axis] = 0.0 if abs(value) < least else value + 0.0
    return largest


@inline
def _find_pixels(vertices: FloatArray, pixels: FloatArray, stop: FlagArray) -> int:
    """Fill ``pixels`` with the integer point nearest to each vertex; return how many vertices differ from it."""
    n_moved = 0
    for k in range(vertices.shape[0]):
        if k & POLL == 0 and stop[0]:
            return 0
        pixels[k, 0], pixels[k, 1] = _pixel(vertices[k, 0]) + 0.0, _pixel(vertices[k, 1]) + 0.0
        n_moved += (pixels[k, 0] != vertices[k, 0]) | (pixels[k, 1] != vertices[k, 1])
    return n_moved


@inline
def _find_corners(
    pixels: FloatArray, offsets: IntArray, pieces: IntArray, corners: Int32Array, starts: IntArray, stop: FlagArray
) -> int:
    """Fill ``corners`` with the vertices at which the snapped rings turn, and ``starts`` with the offsets of rings into
    them; return the number of corners. FOLDS instead if a ring turns back on itself, no longer begins at its smallest
    vertex, or rings are no longer in canonical order, and if ``stop`` is set. pixels (n, 2): the integer point of each
    vertex; offsets: of rings into the vertices; pieces: of pieces, each a shell and its holes, into the rings."""
    piece = n = 0
    for ring in range(offsets.shape[0] - 1):
        first, last = offsets[ring], offsets[ring + 1]
        before = ring - 1  # of the same kind, or none
        if piece < pieces.shape[0] - 1 and ring == pieces[piece]:
            before = pieces[piece - 1] if piece > 0 else -1
            piece += 1
        elif before == pieces[piece - 1]:
            before = -1
        if before >= 0 and not is_before(pixels, offsets[before], first):
            return FOLDS
        i, starts[ring] = last - 1, n
        for j in range(first, last):
            if j & POLL == 0 and stop[0]:
                return FOLDS
            k = j + 1 if j + 1 < last else first
            ux, uy = pixels[j, 0] - pixels[i, 0], pixels[j, 1] - pixels[i, 1]
            vx, vy = pixels[k, 0] - pixels[j, 0], pixels[k, 1] - pixels[j, 1]
            left, right = ux * vy, uy * vx
            corners[n] = j
            n += 1
            size = abs(left) + abs(right)  # of whole numbers, so that nothing underflows, and up to 2^53 all is exact
            if left == right if size < 2.0**53 else not abs(left - right) > BOUND_2D * size:
                a, b = Point2(pixels[i, 0], pixels[i, 1]), Point2(pixels[j, 0], pixels[j, 1])
                if size < 2.0**53 or orient2d(a, b, Point2(pixels[k, 0], pixels[k, 1])) == 0:
                    if not ux * vx + uy * vy > 0.0:
                        return FOLDS
                    n -= 1
            if is_before(pixels, j, first):
                return FOLDS
            i = j
    starts[offsets.shape[0] - 1] = n
    return n


@merged
def _add_passage(passages: Int32Array, m: int, edges: Edges, e: int, f: int, px: float, py: float) -> int:
    """Write (e, f) to row m of ``passages`` if edge e passes the pixel (px, py) of vertex f; return the number of
    passages then, which may exceed the room."""
    x, y, b = edges.x, edges.y, edges.after[e]
    if not _passes(x[e], y[e], x[b], y[b], px, py, 0.5):
        return m
    if m < passages.shape[0]:
        passages[m, 0], passages[m, 1] = e, f
    return m + 1


@kernel
def snap(
    vertices: FloatArray, offsets: IntArray, pieces: IntArray, stop: FlagArray, addresses: IntArray, pixels: FloatArray,
    corners: Int32Array, starts: IntArray, passages: Int32Array,
) -> tuple[int, int, int, bool]:  # fmt: skip
    """Snap valid rings, coordinates below 2^51, to integer points. offsets, pieces: of rings and pieces; addresses: of
    a `Scratch`.

    | filled | dtype, shape | meaning |
    | --- | --- | --- |
    | pixels | float64 (n, 2) | the integer point of each vertex; if none moved, nothing else is filled |
    | corners, starts | | see `_find_corners` |
    | passages | int32 (m, 2) | an edge, by its first vertex, and a vertex whose pixel it passes, not that of its ends |

    Returns the number of vertices that are no integer points; of passages, which may exceed the room; of corners, or
    FOLDS where the topology changes; and whether no edge passes within a cell of a vertex that is not its end.
    """
    n_moved = _find_pixels(vertices, pixels, stop)
    if n_moved == 0:
        return 0, 0, vertices.shape[0], False
    w = workspace_at(addresses)
    edges, tree = w.given.edges, w.tree
    rings, n_rings = RingArrays(vertices, offsets), offsets.shape[0] - 1
    n, _, _ = load_rings(rings, 0, n_rings, 0, True, 0, EVERYTHING, w.given, 0, 0, stop)
    fill_boxes(edges, n, 0.5, tree, stop)
    n_corners = _find_corners(pixels, offsets, pieces, corners, starts, stop)
    x, y, after = edges.x, edges.y, edges.after
    for e in range(n):
        b = after[e]
        if (pixels[e, 0] == pixels[b, 0]) & (pixels[e, 1] == pixels[b, 1]):  # it shrinks to a point
            tree.boxes[e, 3] = -np.inf
    if n > FEW:
        build_tree(tree, n, stop)
    meets, shares, are_apart = False, False, True
    m, depth = 0, begin_pairs(tree)
    while depth > 0 and not stop[0]:  # bound: the walk through the tree
        n_pairs, depth = next_pairs(tree, n, depth)
        for k in range(n_pairs):
            e, f = tree.pairs[k, 0], tree.pairs[k, 1]
            for _ in range(2):
                px, py, b = pixels[f, 0], pixels[f, 1], after[e]
                at_begin = (px == pixels[e, 0]) & (py == pixels[e, 1])
                at_end = (px == pixels[b, 0]) & (py == pixels[b, 1])
                if at_begin or at_end:
                    end = e if at_begin else b
                    meets |= end != f
                    shares |= (x[f] != x[end]) | (y[f] != y[end])
                elif _passes(x[e], y[e], x[b], y[b], px, py, 1.0):
                    are_apart = False
                    m = _add_passage(passages, m, edges, e, f, px, py)
                e, f = f, e
    if m > 0 or shares or (meets and n_corners < n):  # a straight vertex stays where rings meet in it
        n_corners = FOLDS
    return n_moved, m, n_corners, are_apart
