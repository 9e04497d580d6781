"""The descent of a segment through a tree of boxes (bvh.py): of a mesh, alone or under a pose, or of a scene's bodies.

Leaves come about in the order in which the segment enters their boxes, and none that it enters behind a bound which the
caller lowers.

The tree holds float32 boxes in coordinates of its own. A segment is brought there in doubles, cut to what lies
near the tree, and stored as its middle and half in float32; the slack covers what all this rounds:

    middle, w = m - c      2^-24 (S + 2) each, S the largest coordinate (the tree's own are at most 2)
    half, quotients        see `enter_boxes`
    cutting                2^-50 of the segment's coordinates before, in either end

16 * 2^-24 (S + 2) for half widths is more than their sum.

Source: I. Wald, C. Benthin, S. Boulos, Getting rid of packets: efficient SIMD single-ray traversal using
multi-branching BVHs, 2008.

Source: I. Wald, C. Benthin, S. Boulos, Getting rid of packets: efficient SIMD single-ray traversal using
multi-branching BVHs, 2008.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.bounding.bvh import STACK, WIDTH
from engine.compiling.jit import allocating, inline, merged
from engine.lanes.boxes import BOX_ROWS, EMPTY, enter_boxes
from engine.lanes.faces import AXES_BEFORE, CORNER_ROWS, longest_axis
from engine.lanes.lanes import lowest_bit, prefetch
from engine.lanes.tracing import LANES
from engine.types import Point3

SLACK: Final = 2.0**-20
CUT_SLACK: Final = 2.0**-45
LIMIT: Final = 4.0
"""Half side of the cube, in tree coordinates, to which segments are cut: far outside of every box."""

_MOST: Final = np.float32(2.0**100)
Way = namedtuple("Way", "middle half inverse slack is_near")
"""A segment in tree coordinates, float32: middle +- half, and its slack. inverse: 1 / half, at most 2^100, where halves
are far below every slack; is_near: whether it comes near the tree."""


@merged
def local_segment(p: Point3, q: Point3, origin: Any, inverse: Any, blur: float) -> Way:
    """Return segment p q in tree coordinates, by axis (x - origin) * inverse, as a `Way`. blur: error of each
    coordinate of p and q."""
    ix, iy, iz = inverse[0], inverse[1], inverse[2]
    px, py, pz = p.x * ix - origin[0] * ix, p.y * iy - origin[1] * iy, p.z * iz - origin[2] * iz
    dx, dy, dz = q.x * ix - p.x * ix, q.y * iy - p.y * iy, q.z * iz - p.z * iz
    size = max(abs(px), abs(py), abs(pz), abs(px + dx), abs(py + dy), abs(pz + dz))
    start, end, is_near = 0.0, 1.0, True
    cut = CUT_SLACK * (size + 2.0)
    if size > LIMIT and size < 2.0**40:
        for at, step in ((px, dx), (py, dy), (pz, dz)):
            if abs(step) < 2.0**-40:
                is_near &= abs(at) <= LIMIT
                continue
            first, last = (-LIMIT - at) / step, (LIMIT - at) / step
            start, end = max(start, min(first, last)), min(end, max(first, last))
        is_near &= start <= end
        size = LIMIT + 1.0
    middle, length = 0.5 * (start + end), 0.5 * (end - start)
    half: Any = np.float32(length * dx), np.float32(length * dy), np.float32(length * dz)
    x, y, z = np.float32(1.0) / half[0], np.float32(1.0) / half[1], np.float32(1.0) / half[2]
    return Way(
        (np.float32(px + middle * dx), np.float32(py + middle * dy), np.float32(pz + middle * dz)),
        half,
        (min(max(x, -_MOST), _MOST), min(max(y, -_MOST), _MOST), min(max(z, -_MOST), _MOST)),
        np.float32(SLACK * (size + 2.0) + cut + 64.0 * blur * max(ix, iy, iz)),
        is_near,
    )


@inline
def far_end(start: Point3, way: Point3, is_ray: bool) -> Point3:
    """Return where a line from `start` ends, in tree coordinates: of a ray a point beyond every box, which is no number
    where its direction is 0, or beyond doubles."""
    size, length = max(abs(start.x), abs(start.y), abs(start.z)), max(abs(way.x), abs(way.y), abs(way.z))
    reach = 1.0
    if is_ray:
        reach = (size + 4.0 * LIMIT) / length if length > 0.0 else np.inf
    return Point3(start.x + reach * way.x, start.y + reach * way.y, start.z + reach * way.z)


@merged
def segment_before(p: Point3, q: Point3, origin: Any, inverse: Any, blur: float) -> Way:
    """Return the line p q before p, from beyond the tree if p is near it, as a `Way`. Its far end is rounded in tree
    coordinates, far below the slack; of a tiny mesh far from the origin it would be lost in the caller's."""
    x, y, z = (q.x - p.x) * inverse[0], (q.y - p.y) * inverse[1], (q.z - p.z) * inverse[2]
    end = Point3(
        p.x * inverse[0] - origin[0] * inverse[0],
        p.y * inverse[1] - origin[1] * inverse[1],
        p.z * inverse[2] - origin[2] * inverse[2],
    )
    reach = 4.0 * LIMIT / max(abs(x), abs(y), abs(z))
    start = Point3(end.x - reach * x, end.y - reach * y, end.z - reach * z)
    return local_segment(start, end, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), blur * max(inverse[0], inverse[1], inverse[2]))


@merged
def shear_of(way: Way) -> Any:
    """Return the arguments of `near_triangles` for a segment: the axes (i, j, k), k the one along which it is longest;
    its middle on these; the slopes r and s; reach; slack."""
    k, middle, half = longest_axis(way.half), way.middle, way.half
    i, j = AXES_BEFORE[k], AXES_BEFORE[k + 1]
    slack = np.float32(2.0) * way.slack  # 32 u (S + 2) of lanes/faces.py, and twice what cutting loses
    place = middle[i], middle[j], middle[k]
    return (i, j, k), place, half[i] / half[k], half[j] / half[k], abs(half[k]) + slack, slack


Descent = namedtuple("Descent", "stack keys entered depth leaf")
"""Scratch of one descent: stack (STACK,) int32 and keys (STACK,) float32, nodes and where the segment enters their
boxes; entered (1, WIDTH) float32, see `enter_boxes`; depth and leaf (1,) int64."""


@allocating
def allocate_descent() -> Descent:
    """Allocate the scratch of a descent."""
    counts = np.empty(2, np.int64)
    return Descent(
        np.empty(STACK, np.int32), np.empty(STACK, np.float32), np.empty((1, WIDTH), np.float32), counts[:1], counts[1:]
    )


@inline
def begin_descent(descent: Descent) -> None:
    """Begin the descent of a segment from the root; of one that is not near there is none."""
    descent.stack[0], descent.keys[0], descent.depth[0] = 0, np.float32(-1.0), 1


@inline
def descend(tree: Any, way: Way, is_ordered: bool, last: Any, descent: Descent, leaves: Any) -> int:
    """Set `leaves` to those that a segment may enter: nodes from tree.n_inner on, or items, negative; return how many,
    0 at the end. is_ordered: one, the next in about the order of entry, before parameter `last`; else as many as there
    is room for in eights, in no order. tree: boxes, child, n_inner, and corners by block, which are prefetched."""
    stack, keys, entered, depth, n = descent.stack, descent.keys, descent.entered, descent.depth[0], 0
    while depth > 0 and (n + WIDTH <= leaves.size or (is_ordered and n == 0)):  # bound: each node is on the stack once
        depth -= 1
        node = stack[depth]
        if is_ordered and keys[depth] > last:
            continue
        if node < 0 or node >= tree.n_inner:
            leaves[n], n = node, n + 1
            continue
        bits, bottom = enter_boxes(tree.boxes, node, way.middle, way.inverse, way.slack, last, entered), depth
        while bits != 0:
            lane = lowest_bit(bits)
            bits &= bits - 1
            below, at = tree.child[node, lane], depth
            if below == EMPTY:  # case: numbers that are none, which nothing separates
                continue
            if below >= 0:
                prefetch(tree.child, below * WIDTH)
            if below >= tree.n_inner:
                for row in range(0, CORNER_ROWS * LANES, 16):
                    prefetch(tree.corners, (below - tree.n_inner) * (CORNER_ROWS * LANES) + row)
            elif below >= 0:
                for row in range(0, BOX_ROWS * WIDTH, 16):
                    prefetch(tree.boxes, below * (BOX_ROWS * WIDTH) + row)
            if not is_ordered and below >= tree.n_inner:
                leaves[n], n = below, n + 1
                continue
            while is_ordered and at > bottom and keys[at - 1] < entered[0, lane]:
                stack[at], keys[at] = stack[at - 1], keys[at - 1]
                at -= 1
            stack[at], depth = below, depth + 1
            if is_ordered:
                keys[at] = entered[0, lane]
    descent.depth[0] = depth
    return n


@inline
def next_leaf(tree: Any, way: Way, last: Any, descent: Descent) -> int:
    """Return the next leaf of `descend` before parameter `last`; EMPTY if there is no more."""
    return descent.leaf[0] if descend(tree, way, True, last, descent, descent.leaf) > 0 else EMPTY
