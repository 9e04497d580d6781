"""Prepared boundary of a polygon or polyhedron for segment clipping, built once a solid.

A polygon gets a tree of boxes over its edges. Rings are sorted along a space-filling curve through their centres; the
tree is implicit: node i has the children 2 i and 2 i + 1, the second half are leaves of `LEAF_SIZE` edges, and an empty
box has low = +inf. Boxes are exact, so a test without rounding is exact; a test with rounding is conservative.

Source of the order: `morton.py`.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.bounding.bvh import UNUSED, Bvh, empty_rows
from engine.bounding.large_trees import by_range
from engine.bounding.morton import morton_codes
from engine.bounding.trees import MANY, boxes_of, build_stretched_bvh
from engine.compiling.jit import kernel
from engine.containment.methods.rational_locate import next_in_ring
from engine.lanes.boxes import BOX_ROWS, EMPTY
from engine.lanes.faces import CORNER_ROWS
from engine.lanes.tracing import LANES
from engine.predicates.rational import are_all_safe
from engine.segment_clipping.on_boundary.contacts import LEAF_SIZE
from engine.solids.mesh import Polyhedron, Surface
from engine.solids.polygon import Polygon
from engine.solids.primitives import Triangle
from engine.types import Float32Array, FloatArray, Int32Array, IntArray, read_only

_TAKE_SECONDS, _MOVE_SECONDS = 2e-8, 6e-8
"""Time for each triangle."""
_BITS: Final = 20
"""Bits of each coordinate in the Morton code."""


class Outline(NamedTuple):
    """The edges of all rings of a polygon, with a tree of boxes."""

    elements: FloatArray
    """(k, 2, 2): the corners of each edge."""
    are_safe: bool
    """Whether every coordinate is zero or in the range in which kernels have their bounds."""
    faces: IntArray
    """(k,): the caller's number of each edge."""
    order: IntArray
    boxes: FloatArray
    """order, boxes: result of `build_box_tree`."""


class Mesh(NamedTuple):
    """The triangles of a polyhedron or surface, with a tree of boxes."""

    elements: FloatArray
    """(k, 3, 3) the corners of each triangle."""
    are_safe: bool
    """See `Outline`."""
    faces: IntArray
    """(k,) the face of the caller that each triangle is reported as."""
    boxes: Float32Array
    child: Int32Array
    origin: FloatArray
    inverse: FloatArray
    """boxes, child, origin, 1 / scale: result of `build_stretched_bvh`, inner nodes before all leaf blocks, close to
    each other."""
    n_inner: int
    """Number of inner nodes; the first is the root, unless there is one block only."""
    corners: Float32Array
    """(n_blocks, 9, 8), see `_move_nodes`."""


def boundary_of(region: Polygon | Triangle | Polyhedron | Surface) -> Outline | Mesh:
    """Return the boundary of a polygon, planar triangle, polyhedron or surface, built at first use."""

    def build() -> Outline | Mesh:
        if isinstance(region, Polyhedron | Surface):
            return mesh_of(region.vertices, region.triangles, region.triangle_faces)
        following = next_in_ring(region)
        first = np.arange(len(following), dtype=np.int64)  # an edge is named by its first vertex
        offsets = region.ring_offsets if isinstance(region, Polygon) else np.array([0, len(first)])
        return outline_of(region.vertices[np.stack([first, following], axis=1)], first, offsets)

    return region.prepared("clipping_boundary", build)


def outline_of(elements: FloatArray, faces: IntArray, offsets: IntArray) -> Outline:
    """Build the boundary of a polygon from its edges (k, 2, 2). faces: the caller's number of each edge; offsets: of
    rings into edges."""
    low, high = np.minimum(elements[:, 0], elements[:, 1]), np.maximum(elements[:, 0], elements[:, 1])
    order, boxes = build_box_tree(low, high, offsets)
    return Outline(read_only(elements), are_all_safe(elements), read_only(faces), read_only(order), read_only(boxes))


def build_box_tree(low: FloatArray, high: FloatArray, offsets: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the implicit tree over elements with the boxes `low`, `high`, (n, dim) float64 each: (n,) int64, the
    elements in the order of the leaves; and (2 n_leaves, 2, dim) float64, low and high of node i at row i. offsets: of
    the rings into elements."""
    n, dimension = low.shape
    order = _order(low, high, offsets)
    n_leaves = 1
    while n_leaves * LEAF_SIZE < n:
        n_leaves *= 2
    boxes = np.empty((2 * n_leaves, 2, dimension))
    boxes[:, 0], boxes[:, 1] = np.inf, -np.inf
    starts = np.arange(0, n, LEAF_SIZE)
    boxes[n_leaves : n_leaves + len(starts), 0] = np.minimum.reduceat(low[order], starts)
    boxes[n_leaves : n_leaves + len(starts), 1] = np.maximum.reduceat(high[order], starts)
    level = n_leaves
    while level > 1:
        level //= 2
        children = boxes[2 * level : 4 * level].reshape(level, 2, 2, dimension)
        boxes[level : 2 * level, 0] = np.minimum(children[:, 0, 0], children[:, 1, 0])
        boxes[level : 2 * level, 1] = np.maximum(children[:, 0, 1], children[:, 1, 1])
    return order, boxes


def _order(low: FloatArray, high: FloatArray, offsets: IntArray) -> IntArray:
    """Return the elements ring by ring, rings sorted by the Morton codes of their centres. low, high (n, dim): boxes of
    the elements."""
    if len(offsets) == 2:
        return np.arange(len(low))
    starts = offsets[:-1]
    keys = morton_codes(np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts), _BITS)
    return np.argsort(np.repeat(keys, np.diff(offsets)), kind="stable")


def mesh_of(vertices: FloatArray, triangles: IntArray, faces: IntArray, many: int = MANY) -> Mesh:
    """Build the boundary of a mesh from its vertices (n, 3) and triangles (k, 3), on threads from `many` triangles on.
    faces: the caller's number of the face of each."""
    tree, origin, scale, _ = build_stretched_bvh(boxes_of(vertices, triangles), many)
    elements, are_safe = empty_rows((len(triangles), 3, 3), np.float64), []

    def take(first: int, last: int) -> None:
        np.take(vertices, triangles[first:last], axis=0, out=elements[first:last], mode="clip")
        are_safe.append(are_all_safe(elements[first:last]))

    by_range(take, len(triangles), _TAKE_SECONDS)
    with np.errstate(over="ignore"):  # of a mesh of denormal size: what is no number separates nothing
        inverse = read_only(1.0 / scale)
    nodes, child, n_inner, corners = _inner_first(tree, (elements, origin, inverse))
    return Mesh(read_only(elements), all(are_safe), read_only(faces), nodes, child, origin, inverse, n_inner, corners)


def _inner_first(
    tree: Bvh, local: tuple[FloatArray, FloatArray, FloatArray]
) -> tuple[Float32Array, Int32Array, int, Float32Array]:
    """Return boxes and children of a tree with its inner nodes moved before its leaf blocks; the number of inner nodes;
    and the corners of the blocks' triangles, see `_move_nodes`. local: elements (k, 3, 3), origin and 1 / scale
    (3,)."""
    is_block = tree.child[:, 0] < 0
    n_blocks = int(np.count_nonzero(is_block))
    n_inner = len(is_block) - n_blocks
    place = np.where(
        is_block, np.cumsum(is_block, dtype=np.int32) + (n_inner - 1), np.cumsum(~is_block, dtype=np.int32) - 1
    )
    boxes, child = empty_rows(tree.boxes.shape, np.float32), empty_rows(tree.child.shape, np.int32)
    corners = empty_rows((n_blocks, CORNER_ROWS, LANES), np.float32)
    entry = *local, place, n_inner, boxes, child, corners

    def move(nodes: slice, first: int) -> None:
        _move_nodes(tree.boxes, tree.child, nodes.start, nodes.stop, *entry)

    if above := tree.n_above:
        _move_nodes(tree.boxes, tree.child, 0, above, *entry)
    tree.each(move, _MOVE_SECONDS)
    return read_only(boxes), read_only(child), n_inner, read_only(corners)


@kernel
def _move_nodes(
    boxes: Float32Array, child: Int32Array, first: int, last: int, elements: FloatArray, origin: FloatArray,
    inverse: FloatArray, place: Int32Array, n_inner: int, moved: Float32Array, children: Int32Array,
    corners: Float32Array,
) -> None:  # fmt: skip
    """Copy nodes first .. last - 1 of a tree to their places (n_nodes,), which become the numbers of children.

    corners (n_blocks, 9, 8): filled for leaf nodes with the corners of their triangles, in tree coordinates: by row a
    coordinate of a corner, by lane a triangle. Unused lanes lie far from everything."""
    for node in range(first, last):
        to = place[node]
        for lane in range(LANES):
            for row in range(BOX_ROWS):
                moved[to, row, lane] = boxes[node, row, lane]
            entry = child[node, lane]
            children[to, lane] = place[entry] if entry >= 0 else entry
            if to < n_inner:
                continue
            for row in range(CORNER_ROWS):
                corner, k = row // 3, row % 3
                far = -UNUSED
                if entry != EMPTY:
                    far = np.float32(elements[-1 - entry, corner, k] * inverse[k] - origin[k] * inverse[k])
                corners[to - n_inner, row, lane] = far
