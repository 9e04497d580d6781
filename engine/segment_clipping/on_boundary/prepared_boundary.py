"""Prepared boundary of a polygon or polyhedron for segment clipping, built once a solid.

A polygon gets a tree of boxes over its edges. Rings are sorted along a space-filling curve through their centres; the
tree is implicit: node i has the children 2 i and 2 i + 1, the second half are leaves of `LEAF_SIZE` edges, and an empty
box has low = +inf. Boxes are exact, so a test without rounding is exact; a test with rounding is conservative.

Source of the order: `morton.py`.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.bounding.bvh import UNUSED, Bvh, build_stretched_bvh, cache_aligned
from engine.bounding.morton import morton_codes
from engine.containment.methods.rational_locate import next_in_ring
from engine.lanes.boxes import EMPTY
from engine.lanes.faces import CORNER_ROWS
from engine.lanes.tracing import LANES
from engine.predicates.rational import are_all_safe
from engine.running.budget import poll
from engine.segment_clipping.on_boundary.contacts import LEAF_SIZE
from engine.solids.mesh import Polyhedron, Surface
from engine.solids.polygon import Polygon
from engine.solids.primitives import Triangle
from engine.types import Float32Array, FloatArray, Int32Array, IntArray, read_only

_ITEMS: Final = 1 << 16
"""Triangles placed between two checks of the deadline."""
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
    """(n_blocks, 9, 8), see `corners_of`."""


def boundary_of(region: Polygon | Triangle | Polyhedron | Surface) -> Outline | Mesh:
    """Return the boundary of a polygon, planar triangle, polyhedron or surface, built at first use."""

    def build() -> Outline | Mesh:
        if isinstance(region, Polyhedron | Surface):
            return mesh_of(region.vertices[region.triangles], region.triangle_faces)
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


def mesh_of(elements: FloatArray, faces: IntArray) -> Mesh:
    """Build the boundary of a mesh from its triangles (k, 3, 3). faces: the caller's number of the face of each."""
    low, high = (pick(pick(elements[:, 0], elements[:, 1]), elements[:, 2]) for pick in (np.minimum, np.maximum))
    poll()
    stretched, origin, scale = build_stretched_bvh(np.concatenate([low, high], axis=1))
    tree, n_inner = _inner_first(stretched)
    with np.errstate(over="ignore"):  # of a mesh of denormal size: what is no number separates nothing
        inverse = 1.0 / scale
    return Mesh(
        cache_aligned(elements), are_all_safe(elements), read_only(faces), tree.boxes, tree.child, origin,
        read_only(inverse), n_inner, corners_of(tree, n_inner, (elements, origin, inverse)),
    )  # fmt: skip


def _inner_first(tree: Bvh) -> tuple[Bvh, int]:
    """Return a tree with its inner nodes moved before its leaf blocks, and the number of inner nodes."""
    is_block = tree.child[:, 0] < 0
    order = np.argsort(is_block, kind="stable")
    place = np.empty(len(order), np.int32)
    place[order] = np.arange(len(order))
    child = tree.child[order]
    child = np.where(child >= 0, place[np.maximum(child, 0)], child)
    return Bvh(cache_aligned(tree.boxes[order]), cache_aligned(child), tree.origin, tree.scale), int((~is_block).sum())


def corners_of(tree: Bvh, n_inner: int, local: tuple[FloatArray, FloatArray, FloatArray]) -> Float32Array:
    """Return the corners (n_blocks, 9, 8) float32 of the triangles of each leaf block, in tree coordinates: by row a
    coordinate of a corner, by lane a triangle. Unused lanes lie far from everything. n_inner: number of inner nodes,
    which come first in the tree; local: elements (k, 3, 3), origin and 1 / scale (3,)."""
    child = tree.child[n_inner:]
    is_item = child != EMPTY
    block, lane = np.nonzero(is_item)
    corners = np.full((len(child), CORNER_ROWS, LANES), -UNUSED, np.float32)
    elements, origin, inverse = local
    items = -1 - child[is_item]
    for first in range(0, len(items), _ITEMS):
        poll()
        some = slice(first, first + _ITEMS)
        with np.errstate(all="ignore"):  # what underflows here is far below what the lanes round
            places = elements[items[some]] * inverse - origin * inverse
        corners[block[some], :, lane[some]] = places.reshape(-1, CORNER_ROWS)
    return cache_aligned(corners)
