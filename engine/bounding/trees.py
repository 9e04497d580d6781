"""Builds the trees of `bvh.py`: in one kernel, of very many items on threads (`large_trees.py`)."""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.bounding.bvh import LEAST, STACK, WIDTH, Bvh, cache_aligned
from engine.bounding.large_trees import build_on_threads, by_range
from engine.bounding.sah import (
    N_BINS,
    BinaryTree,
    Bins,
    Items,
    build_binary_tree,
    collapse_to_eight,
    fill_nodes,
    read_boxes,
)
from engine.bounding.tree_coordinates import measure, place_tree
from engine.compiling.jit import allocating_kernel, kernel
from engine.lanes.boxes import EMPTY
from engine.predicates.vectors import corners_of
from engine.running.budget import poll
from engine.types import Float32Array, FloatArray, Int32Array, IntArray, read_only

MANY: Final = 1 << 15
"""Number of items from which a tree is built on threads; fewer take a few milliseconds."""
_MOST_UNBALANCED: Final = 512
"""Items up to which a tree is as good unstretched."""
_BOX_SECONDS: Final = 1e-8
"""Time for each triangle."""


def build_bvh(boxes: FloatArray, many: int = MANY) -> Bvh:
    """Return the tree over `boxes` (n_items, 6) float64: xmin ymin zmin xmax ymax zmax; n_items >= 1. many: number of
    items from which it is built on threads. Cost: n log n; the two stored arrays take some 45 bytes an item. Raises:
    DeadlineExceededError, CancelledError."""
    return _build(boxes, False, many)[0]


def build_stretched_bvh(boxes: FloatArray, many: int = MANY) -> tuple[Bvh, FloatArray, FloatArray, FloatArray]:
    """Return (tree, origin, scale, ends): the tree over boxes (n_items, 6), stretched along each axis by a
    power of two so that float32, and one slack for all axes, resolve what is small on a short axis; by axis x = origin
    + scale * local, (3,) each; and the box (6,) around all."""
    tree, stretch, ends = _build(boxes, True, many)
    return tree, read_only(tree.origin / stretch), read_only(tree.scale / stretch), ends


def build_balanced_bvh(boxes: FloatArray, many: int = MANY) -> Bvh:
    """Return the tree of `build_bvh` over boxes (n_items, 6); of more than _MOST_UNBALANCED with runs split as if all
    axes had similar extents (`tree_coordinates.py`): by the surface area of a long thin mesh, nodes would be wide
    across its short axes."""
    tree, stretch, _ = _build(boxes, len(boxes) > _MOST_UNBALANCED, many)
    if stretch.tolist() == [1.0, 1.0, 1.0]:
        return tree
    narrowed = tree.boxes * np.tile(1.0 / stretch, 2).astype(np.float32)[:, None]
    np.maximum(narrowed[:, 3:], np.float32(LEAST), out=narrowed[:, 3:])
    narrowed = np.where(tree.child[:, None] == EMPTY, tree.boxes, narrowed)
    return Bvh(cache_aligned(narrowed), tree.child, read_only(tree.origin / stretch), tree.scale, tree.parts)


def boxes_of(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Return the boxes (m, 6) of triangles (m, 3), low corner, then high."""
    vertices, triangles, boxes = read_only(vertices), read_only(triangles), np.empty((len(triangles), 6))

    def fill(start: int, stop: int) -> None:
        _fill_boxes(vertices, triangles[start:stop], boxes[start:stop])

    by_range(fill, len(boxes), _BOX_SECONDS)
    return boxes


@kernel
def _fill_boxes(vertices: FloatArray, triangles: IntArray, boxes: FloatArray) -> None:
    for triangle in range(len(triangles)):
        a, b, c = corners_of(vertices, triangles, triangle)
        boxes[triangle, 0], boxes[triangle, 3] = min(a.x, b.x, c.x), max(a.x, b.x, c.x)
        boxes[triangle, 1], boxes[triangle, 4] = min(a.y, b.y, c.y), max(a.y, b.y, c.y)
        boxes[triangle, 2], boxes[triangle, 5] = min(a.z, b.z, c.z), max(a.z, b.z, c.z)


def _build(boxes: FloatArray, is_stretched: bool, many: int) -> tuple[Bvh, FloatArray, FloatArray]:
    """Return the tree over boxes (n, 6), the factors (3,) by which it is stretched, and their box (6,)."""
    n_items, stretch, ends = len(boxes), np.empty(3), np.empty(6)
    if n_items >= many:
        return build_on_threads(boxes, is_stretched, stretch, ends), stretch, ends
    poll()
    origin, nodes = np.empty(3), np.empty((2 * n_items, 6, WIDTH), np.float32)
    child = np.empty((2 * n_items, WIDTH), np.int32)  # untouched rows take no memory
    with np.errstate(all="ignore"):  # uncompiled runs only
        scale, n_nodes = _build_small(boxes, is_stretched, stretch, ends, origin, nodes, child)
    parts = np.array(((0, 0), (n_nodes, n_items)))
    nodes, child = cache_aligned(nodes[:n_nodes]), cache_aligned(child[:n_nodes])
    return Bvh(nodes, child, read_only(origin), scale, parts), stretch, ends


@allocating_kernel
def _build_small(
    boxes: FloatArray, is_stretched: bool, stretch: FloatArray, ends: FloatArray, origin: FloatArray,
    nodes: Float32Array, child: Int32Array,
) -> tuple[float, int]:  # fmt: skip
    """Fill the outputs of `_build`, and boxes and children of the tree over boxes (n, 6), at most 2 n rows; return its
    scale and the number of rows."""
    n, factors = len(boxes), np.empty(5)
    items = Items(np.empty((n, WIDTH), np.float32), np.empty(n, np.int32))
    halves = BinaryTree(
        np.empty((2 * n, WIDTH), np.float32), np.empty((2 * n, WIDTH), np.float32), np.empty(2 * n, np.int32),
        np.empty((2 * n, 2), np.int32),
    )  # fmt: skip
    rows = np.empty((N_BINS, WIDTH), np.float32), np.empty((N_BINS, WIDTH), np.float32)
    bins = Bins(rows[0], rows[1], np.empty(N_BINS, np.int64), np.empty(N_BINS, np.float32))
    roots, own = np.empty(2 * n, np.int32), np.empty((2 * n, WIDTH), np.int32)
    stack, state = np.zeros((STACK, 2), np.int64), np.array([1, 1, 2 * n, 0])
    measure(boxes, ends)
    scale = place_tree(boxes, ends, is_stretched, stretch, origin, factors)
    read_boxes(boxes, origin, factors, 0, items, bins)
    halves.boxes[0, :], halves.centres[0, :] = bins.boxes[0, :], bins.centres[0, :]
    halves.left[0], halves.runs[0, 0], halves.runs[0, 1] = -1, 0, n
    while state[0] > 0:  # bound: each turn ends a node
        build_binary_tree(items, halves, bins, stack, state)
    roots[0], stack[0, 0], state[0], state[1] = 0, 0, 1, 1
    collapse_to_eight(halves, roots, own, bins.costs, stack, state, 2 * n)
    fill_nodes(items, halves, roots[: state[1]], own, 0, nodes, child[: state[1]])
    return scale, state[1]
