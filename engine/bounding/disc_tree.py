"""The flat cylinders around the faces below each child of a tree's inner nodes: what `lanes/discs.py` asks.

A disc stands on the axis through the middle of the child's box along the sum of the normals of its faces; it is as
thick and as wide as their corners reach along that axis and away from it.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.jit import inline, kernel
from engine.lanes.boxes import EMPTY
from engine.lanes.tracing import LANES

_ENLARGED: Final = 2.0**-20


@kernel
def fill_discs(blocks: Any, child: Any, boxes: Any, discs: Any) -> None:
    """Fill discs (n_nodes, 8, 8), of inner nodes only, from blocks (`lanes/faces.py`) and boxes of the same tree."""
    n_nodes = child.shape[0]
    parents = np.full(n_nodes, -1, np.int64)  # 8 times the parent, and the lane
    for node in range(n_nodes):
        for lane in range(LANES):
            if child[node, lane] >= 0:
                parents[child[node, lane]] = LANES * node + lane
    normals = np.zeros((n_nodes, 3))
    _set_normals(blocks, child, parents, normals)
    reached = np.zeros((n_nodes, 3))
    reached[:, 0], reached[:, 1] = np.inf, -np.inf
    _set_reached(blocks, child, boxes, parents, normals, reached)
    for node in range(n_nodes):
        if child[node, 0] < 0:
            continue
        for lane in range(LANES):
            below = child[node, lane]
            if below == EMPTY:
                discs[node, :, lane] = 0.0
                continue
            middle = 0.5 * (reached[below, 0] + reached[below, 1])
            for k in range(3):
                discs[node, k, lane] = boxes[node, k, lane] + normals[below, k] * middle
                discs[node, 3 + k, lane] = normals[below, k]
            radius, half = np.sqrt(max(0.0, reached[below, 2])), 0.5 * (reached[below, 1] - reached[below, 0])
            discs[node, 6, lane] = radius * (1.0 + _ENLARGED) + _ENLARGED
            discs[node, 7, lane] = half * (1.0 + _ENLARGED) + _ENLARGED


@inline
def _set_normals(blocks: Any, child: Any, parents: Any, normals: Any) -> None:
    """Set normals (n_nodes, 3), zeros, to the direction of the sum of the normals of all faces below a node."""
    for node in range(len(child)):
        if child[node, 0] >= 0:
            continue
        x = y = z = 0.0
        for lane in range(LANES):
            if child[node, lane] == EMPTY:
                continue
            b = blocks[node, :, lane]
            ux, uy, uz = float(b[3]) - b[0], float(b[4]) - b[1], float(b[5]) - b[2]
            vx, vy, vz = float(b[6]) - b[0], float(b[7]) - b[1], float(b[8]) - b[2]
            x, y, z = x + (uy * vz - uz * vy), y + (uz * vx - ux * vz), z + (ux * vy - uy * vx)
        above = node
        while above >= 0:  # bound: the depth of the tree
            normals[above, 0] += x
            normals[above, 1] += y
            normals[above, 2] += z
            above = parents[above] >> 3 if parents[above] >= 0 else -1
    for node in range(len(child)):
        size = np.sqrt(normals[node, 0] ** 2 + normals[node, 1] ** 2 + normals[node, 2] ** 2)
        for k in range(3):
            normals[node, k] = normals[node, k] / size if size > 1e-100 else (1.0 if k == 2 else 0.0)


@inline
def _set_reached(blocks: Any, child: Any, boxes: Any, parents: Any, normals: Any, reached: Any) -> None:
    """Set reached (n_nodes, 3) to the least and largest product of a corner below with the normal, and the largest
    squared distance from the axis, counted from the middle of the node's box."""
    for node in range(len(child)):
        if child[node, 0] >= 0:
            continue
        for lane in range(LANES):
            if child[node, lane] == EMPTY:
                continue
            b = blocks[node, :, lane]
            for corner in range(3):
                px, py, pz = b[3 * corner], b[3 * corner + 1], b[3 * corner + 2]
                below, up = node, parents[node]
                while up >= 0:  # bound: the depth of the tree
                    at, lane_above = up >> 3, up & 7
                    x = float(px) - boxes[at, 0, lane_above]
                    y = float(py) - boxes[at, 1, lane_above]
                    z = float(pz) - boxes[at, 2, lane_above]
                    along = x * normals[below, 0] + y * normals[below, 1] + z * normals[below, 2]
                    reached[below, 0] = min(reached[below, 0], along)
                    reached[below, 1] = max(reached[below, 1], along)
                    reached[below, 2] = max(reached[below, 2], x * x + y * y + z * z - along * along)
                    below, up = at, parents[at]
