"""Bounding volume hierarchy (broad phase): a tree of boxes over many small boxes, eight children a node, in flat
arrays.

    node     boxes (n_nodes, 6, 8) float32: rows cx cy cz hx hy hz,      child (n_nodes, 8) int32
             centre and half width of each child, one child to a lane
    inner    boxes that hold whole subtrees                              index of the child's node
    block    at most eight items, first lane always filled               -1 - item
    unused   centre 0, half width -1e30: intersects no box            EMPTY

Node 0 is the root. Coordinates are those of the tree: x = origin + scale * local with a power of two for scale, so that
every local coordinate is at most 2 in magnitude and float32 will do. The origin lies where most items are, in the
median of a few: there float32 is fine enough for details that are small against the whole. Half widths are enlarged by
what the conversion may lose: a child's box holds its items. `lanes/boxes.py` tests all eight lanes at the same time, so
a block of eight items costs as much as one item.

`trees.py` builds it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from engine.lanes.lanes import aligned
from engine.running.parallel import share
from engine.types import Float32Array, FloatArray, Int32Array, IntArray

WIDTH = 8
HEURISTIC_DEPTH = 40
"""Below this depth runs are halved, so no block lies deeper than `MAX_DEPTH`."""
MAX_DEPTH = HEURISTIC_DEPTH + 40  # 2^40 items and more do not fit into memory
STACK = WIDTH * (MAX_DEPTH + 1)
"""Bound on the number of nodes on the stack while a tree is descended: eight for each level."""
UNUSED = np.float32(-1e30)
ENLARGED = 2.0**-21
"""Enlargement of half widths relative to |centre| + half width: low and high are rounded by 2^-24 of themselves, so are
their mean and half difference, and both results once more."""
LEAST = 2.0**-100
"""Absolute enlargement of half widths: above all underflow, below every difference that a query can detect."""
_FEW_ROWS = 64


class Bvh(NamedTuple):
    """A tree of boxes: boxes (n_nodes, 6, 8) and child (n_nodes, 8) as in the table of this module; tree coordinates
    are (x - origin) / scale."""

    boxes: Float32Array
    child: Int32Array
    origin: FloatArray
    """(3,)"""
    scale: float
    parts: IntArray
    """(n_parts + 1, 2): first node, and number of the first item in the order of the nodes, of each subtree of a large
    tree, of a small one of the whole; and the ends. A subtree's nodes follow each other."""

    @property
    def n_above(self) -> int:
        """Number of nodes above the subtrees, before them; they hold no items."""
        return int(self.parts[0, 0])

    def each(self, fill: Callable[[slice, int], object], seconds: float) -> None:
        """Call ``fill(nodes, first_item)`` for ranges of subtrees, on threads where that pays. seconds: time for an
        item. Raises: DeadlineExceededError, CancelledError, what `fill` raises."""
        if len(self.parts) == 2:
            fill(slice(0, len(self.child)), 0)
            return
        parts = self.parts.tolist()

        def fill_parts(first: int, last: int) -> None:
            fill(slice(parts[first][0], parts[last][0]), parts[first][1])

        share(fill_parts, len(parts) - 1, seconds * parts[-1][1] / (len(parts) - 1))


def empty_rows(shape: tuple[int, ...], dtype: Any) -> Any:
    """Return an uninitialised array, aligned to a cache line unless it has few rows."""
    return aligned(shape, dtype) if shape[0] > _FEW_ROWS else np.empty(shape, dtype)


def cache_aligned(array: Any) -> Any:
    """Return a read-only copy of an array, aligned to a cache line unless it is small."""
    aligned_copy = empty_rows(array.shape, array.dtype)
    aligned_copy[:] = array
    aligned_copy.setflags(write=False)
    return aligned_copy
