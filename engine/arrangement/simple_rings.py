"""Rings whose edges meet only in common vertices, on which side of them the interior is, and a tree over edges.

The tree is binary and implicit: consecutive edges lie near each other, so `BLOCK` of them make a leaf, node k has the
children 2 k and 2 k + 1, and node 1 is the root. It is descended without a stack, in the order of the edges.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.compiling.jit import allocating_kernel, inline
from engine.predicates.orientation import orient2d
from engine.predicates.vectors import as_point2
from engine.types import UNDECIDED, FlagArray, FloatArray, Int8Array, IntArray, Point2

BLOCK: Final = 8
"""Consecutive edges around which one box lies."""
_SMALLEST, _LARGEST = 2.0**-480, 2.0**480
"""Range of nonzero coordinates (_SMALLEST, _LARGEST) in which orient2d is never UNDECIDED."""
_MOST_STEPS: Final = 1 << 26
"""Largest number of rings times edges for which sides are computed: a tenth of a second."""
_MOST_NEAR, _MORE = 1 << 8, 1 << 13
"""Most pairs of edges near each other that are looked at, by edge, and edges added to those of a body for that: long
edges beside each other would be n^2 pairs."""
_POLL: Final = 0xFF


@inline
def n_leaves(n_edges: int) -> int:
    """Return the number of leaves of the tree over n_edges edges, a power of two."""
    n = 1
    while n * BLOCK < n_edges:  # bound: 60 doublings
        n *= 2
    return n


@inline
def fill_tree(points: FloatArray, following: IntArray, boxes: FloatArray) -> None:
    """Fill boxes (2 n_leaves, 4): low x, low y, high x, high y of each node; inverted where it has no edges."""
    leaves, n = len(boxes) // 2, len(following)
    for leaf in range(leaves):
        x, y, right, top = np.inf, np.inf, -np.inf, -np.inf
        for edge in range(BLOCK * leaf, min(BLOCK * (leaf + 1), n)):
            a, b = as_point2(points, edge), as_point2(points, following[edge])
            x, y, right, top = min(x, a.x, b.x), min(y, a.y, b.y), max(right, a.x, b.x), max(top, a.y, b.y)
        node = leaves + leaf
        boxes[node, 0], boxes[node, 1], boxes[node, 2], boxes[node, 3] = x, y, right, top
    for node in range(leaves - 1, 0, -1):
        for k in range(2):
            boxes[node, k] = min(boxes[2 * node, k], boxes[2 * node + 1, k])
            boxes[node, 2 + k] = max(boxes[2 * node, 2 + k], boxes[2 * node + 1, 2 + k])


@inline
def after(node: int) -> int:
    """Return the next node that is not below `node`, 0 if there is none."""
    while node & 1:  # bound: the height of the tree
        node >>= 1
    return node + 1 if node > 0 else 0


@inline
def next_leaf(boxes: FloatArray, node: int, left: float, bottom: float, right: float, top: float) -> int:
    """Return the first leaf, from `node` on, whose box meets the given one; 0 if there is none. A search begins with
    node 1 and goes on `after` the leaf."""
    while node > 0:  # bound: each node is passed once
        if right < boxes[node, 0] or boxes[node, 2] < left or top < boxes[node, 1] or boxes[node, 3] < bottom:
            node = after(node)
        elif 2 * node >= len(boxes):
            return node
        else:
            node *= 2
    return 0


@inline
def _do_meet(a: Point2, b: Point2, c: Point2, d: Point2) -> bool:
    """Return whether the closed segments ab and cd have a common point; True if a sign is UNDECIDED."""
    if max(a.x, b.x) < min(c.x, d.x) or max(c.x, d.x) < min(a.x, b.x):
        return False
    if max(a.y, b.y) < min(c.y, d.y) or max(c.y, d.y) < min(a.y, b.y):
        return False
    return orient2d(a, b, c) * orient2d(a, b, d) != 1 and orient2d(c, d, a) * orient2d(c, d, b) != 1


@inline
def _is_star_shaped(vertices: FloatArray, following: IntArray) -> bool:
    """Return whether all edges are seen counter-clockwise, or all clockwise, from the mean of the vertices, and once
    around: then they are those of one simple ring."""
    x = y = 0.0
    for vertex in range(len(vertices)):
        x, y = x + vertices[vertex, 0] / len(vertices), y + vertices[vertex, 1] / len(vertices)
    center = Point2(x, y)
    side = n_upward = 0
    for edge in range(len(following)):
        a, b = as_point2(vertices, edge), as_point2(vertices, following[edge])
        turn = orient2d(center, a, b)
        if (turn != 1 and turn != -1) or turn == -side:
            return False
        side = turn
        n_upward += (a.y <= center.y) & (center.y < b.y)
    return n_upward == 1


@inline
def has_simple_edges(vertices: FloatArray, following: IntArray, boxes: FloatArray, stop: FlagArray) -> bool:
    """Return whether edges meet only in the vertices between consecutive ones, and none has length 0; False also if too
    many are near each other, or `stop` is set. boxes: the tree over them."""
    if _is_star_shaped(vertices, following):
        return True
    leaves, n_left = len(boxes) // 2, _MOST_NEAR * (len(following) + _MORE) // BLOCK
    for i in range(len(following)):
        if i & _POLL == 0 and stop[0] != 0:
            return False
        a, b = as_point2(vertices, i), as_point2(vertices, following[i])
        c = as_point2(vertices, following[following[i]])
        if (a.x == b.x and a.y == b.y) or following[following[i]] == i:
            return False
        is_ahead = (b.x - a.x) * (c.x - b.x) + (b.y - a.y) * (c.y - b.y) > 0.0
        if not is_ahead and orient2d(a, b, c) in (0, UNDECIDED):
            return False
        left, bottom, right, top = min(a.x, b.x), min(a.y, b.y), max(a.x, b.x), max(a.y, b.y)
        leaf = next_leaf(boxes, 1, left, bottom, right, top)
        while leaf > 0 and BLOCK * (leaf - leaves) < i:
            n_left -= 1
            for j in range(BLOCK * (leaf - leaves), min(BLOCK * (leaf - leaves + 1), i)):
                if following[i] == j or following[j] == i:
                    continue
                if _do_meet(a, b, as_point2(vertices, j), as_point2(vertices, following[j])):
                    return False
            leaf = next_leaf(boxes, after(leaf), left, bottom, right, top)
        if n_left < 0:
            return False
    return True


@inline
def _find_sides(vertices: FloatArray, following: IntArray, n_rings: int, sides: Int8Array) -> None:
    """Fill sides (n,) int8: 1 if the interior is left of an edge, -1 right, 0 if coordinates are out of range. Caller
    guarantees edges that meet only in vertices. At the lexicographically smallest vertex of a ring the outside of that
    ring is on the left; each enclosing ring flips the side."""
    for vertex in range(len(vertices)):
        for k in range(2):
            size = abs(vertices[vertex, k])
            if not (size == 0.0 or _SMALLEST < size < _LARGEST):
                return
    start = 0
    for edge in range(len(following)):
        if following[edge] > edge:  # not the last of its ring
            continue
        least, before, p = edge, edge, as_point2(vertices, edge)
        for vertex in range(start, edge):
            q = as_point2(vertices, vertex)
            if q.x < p.x or (q.x == p.x and q.y < p.y):
                least, p = vertex, q
        before = edge if least == start else least - 1
        side = orient2d(as_point2(vertices, before), p, as_point2(vertices, following[least]))
        for other in range(len(following) if n_rings > 1 else 0):
            a, b = as_point2(vertices, other), as_point2(vertices, following[other])
            if (a.y <= p.y) != (b.y <= p.y) and not start <= other <= edge:
                if (orient2d(a, b, p) > 0) == (b.y > a.y):
                    side = -side
        for own in range(start, edge + 1):
            sides[own] = side
        start = edge + 1


@allocating_kernel
def find_rings(
    vertices: FloatArray, ring_offsets: IntArray, offsets: IntArray, most: int, following: IntArray, sides: Int8Array,
    stop: FlagArray,
) -> int:  # fmt: skip
    """Fill following (n,), the vertex at the end of each edge counted within its body, and sides (n,) int8, zero on
    entry: 1 if the interior is left of an edge, -1 right, 0 in a body whose edges do not only meet in vertices between
    consecutive ones, or with coordinates out of range. Returns the number of bodies with known sides. Ends early if
    `stop` is set.

    Body k has the rings offsets[k] .. offsets[k + 1] - 1, ring r the vertices ring_offsets[r] .. ring_offsets[r + 1] -
    1. most: bodies with more edges are left out of `sides`."""
    largest = n_known = 0
    for body in range(len(offsets) - 1):
        n = ring_offsets[offsets[body + 1]] - ring_offsets[offsets[body]]
        largest = max(largest, n if n <= most else 0)
    room = np.empty((2 * n_leaves(largest), 4))
    for body in range(len(offsets) - 1):
        if body & _POLL == 0 and stop[0] != 0:
            break
        first, end = ring_offsets[offsets[body]], ring_offsets[offsets[body + 1]]
        for ring in range(offsets[body], offsets[body + 1]):
            for vertex in range(ring_offsets[ring], ring_offsets[ring + 1]):
                following[vertex] = vertex + 1 - first
            following[ring_offsets[ring + 1] - 1] = ring_offsets[ring] - first
        n, n_rings = end - first, offsets[body + 1] - offsets[body]
        if n > most or n * n_rings > _MOST_STEPS or n == 0:
            continue
        own, ends, boxes = vertices[first:end], following[first:end], room[: 2 * n_leaves(n)]
        fill_tree(own, ends, boxes)
        if has_simple_edges(own, ends, boxes, stop):
            _find_sides(own, ends, n_rings, sides[first:end])
            n_known += sides[first] != 0
    return n_known
