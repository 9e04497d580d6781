"""A tree of boxes over the edges of a boundary, for the elements near a segment.

The rings of elements are put in the order of a space-filling curve through their centres; the tree over them is
implicit: node i has the children 2 i and 2 i + 1, the second half are leaves of `LEAF_SIZE` elements, and a box that
holds nothing has low = +inf. Boxes are the exact ones of the doubles given, so a test without rounding errs on neither
side; where the test rounds, it keeps.

Source: the order is that of G. M. Morton, A computer oriented geodetic data base, 1966; the separating axes of segment
and box stand in C. Ericson, Real-time collision detection, 2005, section 5.3.3.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from engine.arrays import FloatArray, IntArray
from engine.jit import inline

LEAF_SIZE: Final = 4
DEEPEST: Final = 64
"""Places on the traversal's stack: a tree of depth d holds at most d + 1 nodes at once, and d < 60."""
_BITS: Final = 20  # of each coordinate in the curve's order
SLACK: Final = 2.0**-46
"""Bound of the axis test: about 24 roundings of 2^-53, in terms up to 4 times the largest product."""
TOO_LARGE: Final = 2.0**500
"""Beyond this products may overflow, and only the boxes are compared."""


def build_box_tree(low: FloatArray, high: FloatArray, offsets: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the tree over elements with the boxes `low`, `high`, (n, dim) float64 each; offsets: of their rings.

    (n,) int64, elements by leaf; (2 n_leaves, 2, dim) float64, low and high of node i at row i.
    """
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
    """Return elements ring by ring, in the order of the curve; those of a ring follow one another in space too."""
    if len(offsets) == 2:
        return np.arange(len(low))
    starts = offsets[:-1]
    keys = _curve(np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts))
    return np.argsort(np.repeat(keys, np.diff(offsets)), kind="stable")


def _curve(low: FloatArray, high: FloatArray) -> npt.NDArray[np.uint64]:
    """Return the place of each box's centre on the curve; any order is right, a good one is fast."""
    centers = low / 2 + high / 2
    smallest = centers.min(axis=0)
    extent = (centers / 2 - smallest / 2).max(axis=0)
    extent[extent == 0.0] = 1.0
    with np.errstate(all="ignore"):
        cells = np.nan_to_num((centers / 2 - smallest / 2) / extent * (2**_BITS - 1), nan=0.0)
    cells = np.clip(cells, 0, 2**_BITS - 1).astype(np.uint64)
    key = np.zeros(len(low), np.uint64)
    dimension = low.shape[1]
    for bit in range(_BITS):
        for k in range(dimension):
            key |= ((cells[:, k] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(bit * dimension + k)
    return key


@inline
def may_meet(segment: Any, box: Any) -> bool:
    """Tell whether a segment may meet a closed box; False only where some axis surely separates them."""
    n = segment.shape[1]
    largest = 0.0
    for k in range(n):
        p, q, low, high = segment[0, k], segment[1, k], box[0, k], box[1, k]
        if (p < low and q < low) or (p > high and q > high):
            return False
        largest = max(largest, abs(p), abs(q), abs(low), abs(high))
    if largest > TOO_LARGE:
        return True
    for k in range(n):
        for j in range(k):
            u, v = segment[1, j] - segment[0, j], segment[1, k] - segment[0, k]
            center_u, center_v = box[0, j] + box[1, j], box[0, k] + box[1, k]  # twice the centre, and so on
            half_u, half_v = box[1, j] - box[0, j], box[1, k] - box[0, k]
            from_u, from_v = center_u - 2.0 * segment[0, j], center_v - 2.0 * segment[0, k]
            reach = half_u * abs(v) + half_v * abs(u)
            slack = SLACK * largest * (abs(u) + abs(v)) + 2.0**-1000
            if abs(from_u * v - from_v * u) > reach + slack:
                return False
    return True
