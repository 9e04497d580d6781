"""Boxes of points: the smallest ``low <= p <= high``; comparisons of floats only, so exact. And boxes of float64 that
hold the exact images of boxes and balls under poses; infinite on overflow.

With u = 2^-53, centre c and half widths h of a box, and m its largest coordinate, the image is R c + t, plus or minus
|R| h, and no farther out than the body's points are from c: d + 2 roundings of terms below 2 m + |t|. The margin
2^-49 (3 m + |t|) + 2^-1060 covers them, the rounding of c and h, and its own. Distances grow by 2^-38: a rotation may
stretch lengths by up to 1.5e-12 (`rotations.TOLERANCE`), and a ball under the pose of another body counts as
unposed.

The flat cylinders around the faces below each child of a tree's inner nodes: the input of `lanes/boxes.py`.

A disc stands on the axis through the middle of the child's box along the sum of the normals of its faces; it is as
thick and as wide as their corners reach along that axis and away from it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.compiling.jit import allocating_kernel, inline, kernel
from engine.lanes.boxes import EMPTY
from engine.lanes.tracing import LANES
from engine.predicates.vectors import as_point3, cross, dot, length, minus
from engine.types import Float32Array, FloatArray, Int32Array, IntArray, Point3


def box_of_points(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return low and high ``(dimension,)`` of points ``(n, dimension)``, n at least 1.

    >>> low, high = box_of_points(np.array([[0.0, 5.0], [3.0, 1.0]]))
    >>> low.tolist(), high.tolist()
    ([0.0, 1.0], [3.0, 5.0])
    """
    return points.min(axis=0), points.max(axis=0)


@kernel
def fill_box(vertices: FloatArray, triangles: IntArray, low: FloatArray, high: FloatArray) -> float:
    """Fill low and high (3,) with the box of the vertices of triangles (m, 3); return the square of the largest
    distance from its centre."""
    largest = 0.0
    low[:], high[:] = np.inf, -np.inf
    for turn in range(2):
        for item in range(triangles.shape[0]):
            for corner in range(3):
                vertex, square = triangles[item, corner], 0.0
                for k in range(3):
                    x = vertices[vertex, k]
                    if turn == 0:
                        low[k], high[k] = min(low[k], x), max(high[k], x)
                    else:
                        aside = x - (0.5 * low[k] + 0.5 * high[k])
                        square += aside * aside
                largest = max(largest, square)
    return largest


def corners_of_box(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the ``(2 ** dimension, dimension)`` corners of a box; bit k of a row's number says high (1) or low (0) on
    axis k."""
    dimension = len(low)
    is_high = np.arange(2**dimension)[:, None] >> np.arange(dimension) & 1
    return np.where(is_high == 1, high, low)


@kernel
def place_boxes(
    boxes: FloatArray, reaches: FloatArray, radii: FloatArray, kinds: IntArray, rows: IntArray, rotations: FloatArray,
    translations: FloatArray, low: FloatArray, high: FloatArray,
) -> None:  # fmt: skip
    """Fill low and high (n, d) with boxes around posed bodies, rounded outward.

    boxes (n_kinds, 2, d): low and high corner of each distinct body, of a ball its centre twice. reaches (n_kinds,):
    largest distance of the body's points (of a ball: its centre) from the middle of the box. radii (n_kinds,): of
    balls, 0.0 for others. kinds (n,) int64: row in these of each body. rows (n,) int64: row of its pose in rotations
    (n_poses, d, d) and translations (n_poses, d), -1 for none."""
    dimension = low.shape[1]
    for body in range(low.shape[0]):
        kind, pose = kinds[body], rows[body]
        radius = radii[kind]
        for axis in range(dimension):
            low[body, axis], high[body, axis] = boxes[kind, 0, axis], boxes[kind, 1, axis]
        if pose >= 0:
            largest = shift = 0.0
            for axis in range(dimension):
                largest = max(largest, abs(low[body, axis]), abs(high[body, axis]))
                shift = max(shift, abs(translations[pose, axis]))
            margin = 2.0**-49 * (3.0 * largest + shift) + 2.0**-1060
            radius *= 1.0 + 2.0**-38
            for axis in range(dimension):
                middle, reach = translations[pose, axis], margin
                for k in range(dimension):
                    turn = rotations[pose, axis, k]
                    middle += turn * (0.5 * boxes[kind, 0, k] + 0.5 * boxes[kind, 1, k])
                    reach += abs(turn) * (0.5 * boxes[kind, 1, k] - 0.5 * boxes[kind, 0, k])
                reach = min(reach, margin + reaches[kind] * (1.0 + 2.0**-38))
                below, above = middle - reach, middle + reach
                low[body, axis] = below if below == below else -np.inf
                high[body, axis] = above if above == above else np.inf
        if radius > 0.0:
            for axis in range(dimension):
                low[body, axis] = np.nextafter(low[body, axis] - radius, -np.inf)
                high[body, axis] = np.nextafter(high[body, axis] + radius, np.inf)


_ENLARGED: Final = 2.0**-20


@allocating_kernel
def fill_discs(blocks: Float32Array, child: Int32Array, boxes: Float32Array, discs: Float32Array, first: int) -> None:
    """Fill discs (n_nodes, 8, 8) float32 of whole subtrees: rows cx cy cz nx ny nz r t, one flat cylinder a lane around
    the triangles below each child of an inner node. blocks (n_nodes, 9, 8): corners of the triangles at leaf nodes;
    child, boxes: of the tree (`bvh.py`), in whose coordinates all is; first: number of the first of these nodes. Unused
    lanes get zeros; leaf nodes are not set."""
    n_nodes = child.shape[0]
    parents = np.full(n_nodes, -1, np.int64)  # 8 times the parent, and the lane
    for node in range(n_nodes):
        for lane in range(LANES):
            if child[node, lane] >= 0:
                parents[child[node, lane] - first] = LANES * node + lane
    normals = np.zeros((n_nodes, 3))
    _set_normals(blocks, child, parents, normals)
    reached = np.zeros((n_nodes, 3))
    reached[:, 0], reached[:, 1] = np.inf, -np.inf
    _set_reached(blocks, child, boxes, parents, normals, reached)
    for node in range(n_nodes):
        if child[node, 0] < 0:
            continue
        for lane in range(LANES):
            if child[node, lane] == EMPTY:
                discs[node, :, lane] = 0.0
                continue
            below = child[node, lane] - first
            middle = 0.5 * (reached[below, 0] + reached[below, 1])
            for k in range(3):
                discs[node, k, lane] = boxes[node, k, lane] + normals[below, k] * middle
                discs[node, 3 + k, lane] = normals[below, k]
            radius, half = np.sqrt(max(0.0, reached[below, 2])), 0.5 * (reached[below, 1] - reached[below, 0])
            discs[node, 6, lane] = radius * (1.0 + _ENLARGED) + _ENLARGED
            discs[node, 7, lane] = half * (1.0 + _ENLARGED) + _ENLARGED


@inline
def _corner(rows: Float32Array, node: int, lane: int, corner: int) -> Point3:
    """Return corner 0, 1 or 2 of the triangle in a lane of a node's block (n_nodes, 9, 8); of rows of boxes (n_nodes,
    6, 8), corner 0 is the centre."""
    x, y, z = rows[node, 3 * corner, lane], rows[node, 3 * corner + 1, lane], rows[node, 3 * corner + 2, lane]
    return Point3(float(x), float(y), float(z))


@inline
def _set_normals(blocks: Float32Array, child: Int32Array, parents: IntArray, normals: FloatArray) -> None:
    """Set normals (n_nodes, 3), zero on entry, to the unit vector along the sum of the normals, weighted by area, of
    all triangles below each node; z where the sum is about 0. parents (n_nodes,): 8 * parent node + lane; -1 for the
    root."""
    for node in range(len(child)):
        if child[node, 0] >= 0:
            continue
        x = y = z = 0.0
        for lane in range(LANES):
            if child[node, lane] == EMPTY:
                continue
            p = _corner(blocks, node, lane, 0)
            n = cross(minus(_corner(blocks, node, lane, 1), p), minus(_corner(blocks, node, lane, 2), p))
            x, y, z = x + n.x, y + n.y, z + n.z
        above = node
        while above >= 0:  # bound: the depth of the tree
            normals[above, 0] += x
            normals[above, 1] += y
            normals[above, 2] += z
            above = parents[above] >> 3  # of the root -1
    for node in range(len(child)):
        size = length(as_point3(normals, node))
        for k in range(3):
            normals[node, k] = normals[node, k] / size if size > 1e-100 else (1.0 if k == 2 else 0.0)


@inline
def _set_reached(
    blocks: Float32Array, child: Int32Array, boxes: Float32Array, parents: IntArray, normals: FloatArray,
    reached: FloatArray,
) -> None:  # fmt: skip
    """Set reached (n_nodes, 3), (inf, -inf, 0) on entry, for each node but the root: least and largest dot(v, normal),
    and largest squared distance from the axis along the normal, over the corners of the triangles below it; v: a corner
    minus the centre of the node's box. parents: as in `_set_normals`."""
    for node in range(len(child)):
        if child[node, 0] >= 0:
            continue
        for lane in range(LANES):
            if child[node, lane] == EMPTY:
                continue
            for corner in range(3):
                p, below, up = _corner(blocks, node, lane, corner), node, parents[node]
                while up >= 0:  # bound: the depth of the tree
                    v = minus(p, _corner(boxes, up >> 3, up & 7, 0))
                    along = dot(v, as_point3(normals, below))
                    reached[below, 0] = min(reached[below, 0], along)
                    reached[below, 1] = max(reached[below, 1], along)
                    reached[below, 2] = max(reached[below, 2], dot(v, v) - along * along)
                    below, up = up >> 3, parents[up >> 3]
