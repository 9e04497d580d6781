"""Pairs of boxes with a common point: sorted by their start on one axis, swept, the other axes compared.

Right for boxes of similar or mixed size that are spread along some axis; the axis is the one on which the boxes cover
the smallest share of the whole width. Infinite bounds are welcome: such a box meets everything that its finite bounds
allow.

Source: D. Baraff, Dynamic simulation of non-penetrating rigid bodies, 1992 (sweep and prune), here for one instant.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from engine.jit import kernel

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

_ROOM = 1024


def meeting_boxes(low: FloatArray, high: FloatArray, flag: Any) -> IntArray:
    """Return ``(n_pairs, 2)`` pairs first < second, sorted, of closed boxes ``(n, d)`` with a common point.

    Cost: n log n for the sort, then one comparison for each pair that meets on the axis swept. Polls `flag` (1,) uint8
    and returns early when it is set. Allocates the result, grown by doubling.
    """
    axis = sweep_axis(low, high)
    order = np.argsort(low[:, axis], kind="stable")
    low, high = np.ascontiguousarray(low[order]), np.ascontiguousarray(high[order])
    found = np.empty((_ROOM, 2), np.int64)
    n_found = _sweep(low, high, axis, found, flag)
    if n_found > len(found):
        found = np.empty((n_found, 2), np.int64)
        n_found = min(_sweep(low, high, axis, found, flag), len(found))
    pairs = np.sort(order[found[:n_found]], axis=1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def sweep_axis(low: FloatArray, high: FloatArray) -> int:
    """Return the axis on which the boxes are thin against the width of the whole."""
    with np.errstate(all="ignore"):
        finite = np.isfinite(low) & np.isfinite(high)
        width = np.where(finite, high, -np.inf).max(axis=0) - np.where(finite, low, np.inf).min(axis=0)
        share = np.where(finite, high - low, 0.0).sum(axis=0) / width
    return int(np.argmin(np.where(np.isfinite(share), share, np.inf)))


@kernel
def _sweep(low: Any, high: Any, axis: int, found: Any, flag: Any) -> int:
    """Write meeting pairs into found (room, 2), boxes sorted by low on `axis`; return how many there are."""
    n_found = 0
    n_boxes, n_axes = low.shape
    for box in range(n_boxes):
        if flag[0] != 0:
            break
        end = high[box, axis]
        for other in range(box + 1, n_boxes):
            if low[other, axis] > end:
                break
            meets = True
            for k in range(n_axes):
                meets &= low[other, k] <= high[box, k] and low[box, k] <= high[other, k]
            if meets:
                if n_found < found.shape[0]:
                    found[n_found, 0] = box
                    found[n_found, 1] = other
                n_found += 1
    return n_found
