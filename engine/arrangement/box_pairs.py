"""Pairs of boxes that meet, by a sweep along x.

Boxes are sorted by their left side; each is held against those that begin before it ends. The result is every pair with
a common point (closed boxes), no pair twice. Cost: n log n plus the pairs that overlap in x.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.errors import CancelledError
from engine.jit import kernel
from engine.parallel import Budget

_POLL = 4096  # box tests between two looks at the cancel flag: about 10 us


@kernel
def _sweep(x_min: Any, x_max: Any, y_min: Any, y_max: Any, order: Any, pairs: Any, flag: Any) -> int:
    """Write the pairs that meet into `pairs`, (capacity, 2) int64, as far as they fit; return how many there are.

    order: the boxes sorted by `x_min`. Returns -1 when `flag` was raised.
    """
    found = 0
    tests = 0
    n_boxes = order.shape[0]
    for place in range(n_boxes):
        box = order[place]
        for later in range(place + 1, n_boxes):
            other = order[later]
            if x_min[other] > x_max[box]:
                break
            tests += 1
            if tests == _POLL:
                tests = 0
                if flag[0] != 0:
                    return -1
            if y_min[other] <= y_max[box] and y_min[box] <= y_max[other]:
                if found < pairs.shape[0]:
                    pairs[found, 0] = min(box, other)
                    pairs[found, 1] = max(box, other)
                found += 1
    return found


def box_pairs(low: FloatArray, high: FloatArray, budget: Budget) -> IntArray:
    """Return the pairs of boxes that have a common point, (n_pairs, 2) int64, smaller index first.

    low, high: (n, 2) float64, the corners of closed boxes.
    """
    # order: the sweep runs along the axis on which the boxes cover less of the whole, so that fewer overlap.
    with np.errstate(all="ignore"):
        extent = high.max(axis=0, initial=-np.inf) - low.min(axis=0, initial=np.inf)
        share = (high / 2 - low / 2).sum(axis=0) / extent
    axis = 1 if share[1] < share[0] else 0
    x_min, x_max = np.ascontiguousarray(low[:, axis]), np.ascontiguousarray(high[:, axis])
    y_min, y_max = np.ascontiguousarray(low[:, 1 - axis]), np.ascontiguousarray(high[:, 1 - axis])
    order = np.argsort(x_min, kind="stable")
    capacity = 4 * len(low) + 64
    while True:  # bound: at most twice; the second time the capacity is the count
        pairs = np.empty((capacity, 2), np.int64)
        found = _sweep(x_min, x_max, y_min, y_max, order, pairs, budget.flag)
        if found < 0:
            budget.check()
            raise CancelledError("another part of the call failed")  # the flag went up for that, not for time
        if found <= capacity:
            break
        capacity = found
    return pairs[:found]
