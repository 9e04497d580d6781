"""Snap rounding of valid rings to whole numbers: which edges pass the pixels of which vertices.

A pixel is the half-open square of side 1 about a whole point; it is hot if a vertex lies in it. Every edge is led
through the centres of the hot pixels that it passes: edges that met in vertices only do so again, or coincide, and none
moves by more than half a diagonal.

    .-----.       The edge passes the pixel unless a corner tells that it enters and leaves on one side: the corners
    |  .  |_.--   above and below it, as it rises or falls. Sides are exact signs, of doubles and halves of whole
    '--.--'       numbers.

Where no edge passes a pixel but those of its ends, no two vertices share one, and no ring gets a straight vertex, rings
stay what they are.

Source: J. D. Hobby, Practical segment intersection with finite precision output, 1999.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.jit import bare_kernel, called, inline, merged
from engine.polygon_overlay.compiled.clearance import certify
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_tree import (
    DOUBTFUL,
    FEW,
    POLL,
    begin_pairs,
    boxes_meet,
    build_tree,
    next_pairs,
)
from engine.polygon_overlay.compiled.loading import EVERYTHING, RingArrays, fill_boxes, load_rings
from engine.polygon_overlay.compiled.workspace import Buffers, rows_of
from engine.predicates.orientation import orient2d
from engine.types import Point2


@merged
def _pixel(x: float) -> float:
    """Return the whole number whose pixel x lies in, for less than 2^52; a half goes up."""
    near = np.rint(x)
    return near + 1.0 if x - near == 0.5 else near


@called
def _passes(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> bool:
    """Tell whether the segment ab passes the pixel about (x, y)."""
    if bx < ax:
        ax, ay, bx, by = bx, by, ax, ay
    left, right, low, high = x - 0.5, x + 0.5, y - 0.5, y + 0.5
    if not ((bx >= left) & (ax < right) & (max(ay, by) >= low) & (min(ay, by) < high)):
        return False
    if ax == bx or ay == by:
        return True
    a, b = Point2(ax, ay), Point2(bx, by)
    if by > ay:
        return orient2d(a, b, Point2(left, high)) > 0 and orient2d(a, b, Point2(right, low)) < 0
    return orient2d(a, b, Point2(left, low)) <= 0 and orient2d(a, b, Point2(right, high)) > 0


@inline
def _is_simple(edges: Edges, n: int, stop: Any) -> bool:
    """Tell whether every ring, of the pixels of its vertices, turns everywhere and begins where it did."""
    x, y = edges.x, edges.y
    first = 0
    for k in range(n):
        if k & POLL == 0 and stop[0]:
            return False
        i, j = edges.before[k], edges.after[k]
        before, here, after = (
            Point2(_pixel(x[i]), _pixel(y[i])),
            Point2(_pixel(x[k]), _pixel(y[k])),
            Point2(_pixel(x[j]), _pixel(y[j])),
        )
        if orient2d(before, here, after) == 0:
            return False
        if edges.ring[k] != edges.ring[first]:
            first = k
        px, py = _pixel(x[first]), _pixel(y[first])
        if here.x < px or (here.x == px and here.y < py):
            return False
    return True


@bare_kernel
def find_passages(
    vertices: Any, offsets: Any, stop: Any, buffers: Buffers, passages: Any
) -> tuple[int, bool]:  # fmt: skip
    """Fill ``passages``, (m, 2) int32, with an edge, by its first vertex, and a vertex of another pixel that it passes.

    vertices, offsets: valid rings, coordinates below 2^51. Returns how many passages there are, which may be more than
    there is room for, and whether rings stay what they are.
    """
    w = rows_of(buffers)
    edges, tree = w.given.edges, w.tree
    rings, n_rings = RingArrays(vertices, offsets), offsets.shape[0] - 1
    n, _, _ = load_rings(rings, 0, n_rings, 0, True, 0, EVERYTHING, w.given, tree, 0, 0, stop)
    fill_boxes(edges, n, 0.5, tree, stop)
    stays = _is_simple(edges, n, stop)
    x, y, after = edges.x, edges.y, edges.after
    for e in range(n):
        b = after[e]
        if (_pixel(x[e]) == _pixel(x[b])) & (_pixel(y[e]) == _pixel(y[b])):  # it shrinks to a point
            tree.boxes[e, 3] = -np.inf
    if n > FEW:
        build_tree(tree, n, stop)
    m, depth = 0, begin_pairs(tree, n, stop)
    while depth > 0 and not stop[0]:  # bound: the walk through the tree
        found, depth = next_pairs(tree, n, depth)
        for k in range(found):
            e, f = tree.pairs[k, 0], tree.pairs[k, 1]
            if not boxes_meet(tree.boxes, e, tree.boxes, f):
                continue
            for _ in range(2):
                px, py, b = _pixel(x[f]), _pixel(y[f]), after[e]
                at_begin = (px == _pixel(x[e])) & (py == _pixel(y[e]))
                at_end = (px == _pixel(x[b])) & (py == _pixel(y[b]))
                if at_begin or at_end:
                    end = e if at_begin else b
                    stays = stays and x[f] == x[end] and y[f] == y[end]
                elif _passes(x[e], y[e], x[b], y[b], px, py):
                    if m < passages.shape[0]:
                        passages[m, 0], passages[m, 1] = e, f
                    m += 1
                e, f = f, e
    return m, stays and m == 0


@bare_kernel
def stay_apart(vertices: Any, points: Any, offsets: Any, stop: Any, buffers: Buffers) -> bool:
    """Tell whether valid rings surely stay so when vertices move by no more than clearance.py has room for.

    That is a unit in the last place of the largest coordinate. points: (n,) int32, equal for vertices at one place.
    There is scratch for as many contacts as rings.
    """
    w = rows_of(buffers)
    found, rounded, n = w.found, w.rounded, vertices.shape[0]
    for k in range(n):
        rounded.x[k], rounded.y[k], rounded.moved[k] = vertices[k, 0], vertices[k, 1], 1
        found.point[k], found.meets[k] = points[k], DOUBTFUL
    for ring in range(offsets.shape[0]):
        found.offset[ring] = offsets[ring]
    return certify(found, offsets.shape[0] - 1, n, rounded, w.tree, w.chains.at, w.stars.node_of, stop)
