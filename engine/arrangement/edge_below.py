"""The edge straight below a node, exactly.

Floats prune, integers decide. The stab runs from the node down, an infinitesimal step to its right: it counts edges
that begin at the node's x and leaves out those that end there, and vertical ones.
"""

from __future__ import annotations

import numpy as np

from engine.arrangement.arrange import Arrangement, Line, side
from engine.arrangement.nodes import Homogeneous


class EdgesBelow:
    """The edges of an arrangement, ready for stabs; arrays of rounded coordinates prune (rounding is monotone)."""

    __slots__ = ("_arrangement", "_high", "_low", "_x_max", "_x_min")

    def __init__(self, arrangement: Arrangement) -> None:
        xs, ys = np.array(arrangement.nodes.xs), np.array(arrangement.nodes.ys)
        tails, heads = np.array(arrangement.tails, np.int64), np.array(arrangement.heads, np.int64)
        self._arrangement = arrangement
        self._x_min, self._x_max = xs[tails], xs[heads]
        self._low, self._high = np.minimum(ys[tails], ys[heads]), np.maximum(ys[tails], ys[heads])

    def find(self, node: int) -> int:
        """Return the edge next below `node` (the node not on it), -1 where there is none."""
        nodes, lines = self._arrangement.nodes, self._arrangement.lines
        tails, heads = self._arrangement.tails, self._arrangement.heads
        x, y, point = nodes.xs[node], nodes.ys[node], nodes.points[node]
        near = np.flatnonzero((self._x_min <= x) & (self._x_max >= x) & (self._low <= y))
        # An edge that surely spans x and surely lies below bounds the answer from below.
        sure = near[(self._x_min[near] < x) & (self._x_max[near] > x) & (self._high[near] < y)]
        if len(sure):
            near = near[self._high[near] >= self._low[sure].max()]
        best = -1
        for edge in near.tolist():
            tail, head = nodes.points[tails[edge]], nodes.points[heads[edge]]
            # spans: tail.x <= x < head.x; then the node lies above where it lies to the left.
            if tail[0] * point[2] <= point[0] * tail[2] and point[0] * head[2] < head[0] * point[2]:
                if side(lines[edge], point) > 0 and (best < 0 or _is_above(lines[edge], lines[best], point)):
                    best = edge
        return best


def _is_above(first: Line, second: Line, point: Homogeneous) -> bool:
    """Tell whether `first` runs above `second` just right of `point`; both run to the right."""
    # On a x + b y + c w = 0 with b > 0 and w = 1: y = -(a x + c) / b, and the slope is -a / b.
    height = (first[0] * point[0] + first[2] * point[2]) * second[1]
    other = (second[0] * point[0] + second[2] * point[2]) * first[1]
    if height != other:
        return height < other
    return first[0] * second[1] < second[0] * first[1]
