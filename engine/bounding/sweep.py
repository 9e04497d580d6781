"""Pairs of boxes with a common point: sorted by their start on one axis, swept, the other axes compared.

Right for boxes of similar or mixed size that are spread along some axis; the axis is the one on which the boxes cover
the smallest share of the whole width. Infinite bounds are welcome: such a box meets everything that its finite bounds
allow.

Source: D. Baraff, Dynamic simulation of non-penetrating rigid bodies, 1992 (sweep and prune), here for one instant.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.budget import Budget
from engine.jit import inline, kernel

BLOCK = 1 << 18
"""Pairs given out at once: a scene in which all meet all has n^2 / 2, which need not fit into memory. Sorting one block
takes some 20 ms."""


def meeting_boxes(low: FloatArray, high: FloatArray, flag: Any, block: int = BLOCK) -> Iterator[IntArray]:
    """Yield ``(n_pairs, 2)`` pairs first < second of closed boxes ``(n, d)`` with a common point, block by block.

    All pairs together are sorted by first, then second; a block has `block` pairs, or those of one first box if these
    are more. Cost: n log n for the sort, then for each block one comparison for each pair that meets on the axis swept.
    Polls `flag` (1,) uint8 and ends early, with wrong blocks, when it is set: the caller looks at it after each.
    """
    axis, n_boxes = sweep_axis(low, high), len(low)
    order = np.argsort(low[:, axis], kind="stable")
    low, high = np.ascontiguousarray(low[order]), np.ascontiguousarray(high[order])
    counts = np.zeros(n_boxes, np.int64)
    _sweep(low, high, order, axis, counts, 0, 0, np.empty(0, np.int64), flag)
    ends = np.cumsum(counts)
    start = done = 0
    while done < ends[-1]:  # bound: start grows
        stop = max(start + 1, int(np.searchsorted(ends, done + block, side="right")))
        keys = np.empty(int(ends[stop - 1]) - done, np.int64)
        _sweep(low, high, order, axis, counts, start, stop, keys, flag)
        keys.sort()
        yield np.stack([keys // n_boxes, keys % n_boxes], axis=1)
        start, done = stop, int(ends[stop - 1])


def pairs_of_boxes(low: FloatArray, high: FloatArray, budget: Budget) -> IntArray:
    """Return all of `meeting_boxes` at once. Raises as `Budget.check` when the call must end."""
    blocks = [np.zeros((0, 2), np.int64)]
    if len(low):
        for block in meeting_boxes(low, high, budget.flag):
            budget.check()
            blocks.append(block)
    budget.check()
    return np.concatenate(blocks)


def sweep_axis(low: FloatArray, high: FloatArray) -> int:
    """Return the axis on which the boxes are thin against the width of the whole."""
    with np.errstate(all="ignore"):
        finite = np.isfinite(low) & np.isfinite(high)
        width = np.where(finite, high, -np.inf).max(axis=0) - np.where(finite, low, np.inf).min(axis=0)
        share = np.where(finite, high - low, 0.0).sum(axis=0) / width
    return int(np.argmin(np.where(np.isfinite(share), share, np.inf)))


@inline
def _meet(low: Any, high: Any, box: int, other: int) -> bool:
    """Tell whether two closed boxes have a common point."""
    meets = True
    for k in range(low.shape[1]):
        meets &= low[other, k] <= high[box, k] and low[box, k] <= high[other, k]
    return meets


@kernel
def _sweep(low: Any, high: Any, ids: Any, axis: int, counts: Any, start: int, stop: int, keys: Any, flag: Any) -> None:
    """Count into counts (n,) the pairs of which each box is the first by number; boxes sorted by low on `axis`. Where
    `keys` has room: write first * n + second of the pairs with start <= first < stop instead, which just fit."""
    n_boxes, n_keys, n_found = low.shape[0], keys.shape[0], 0
    keys[:] = 0
    for box in range(n_boxes):
        if flag[0] != 0:
            return
        for other in range(box + 1, n_boxes):
            if low[other, axis] > high[box, axis]:
                break
            if not _meet(low, high, box, other):
                continue
            first, second = min(ids[box], ids[other]), max(ids[box], ids[other])
            if n_keys == 0:
                counts[first] += 1
            elif start <= first < stop and n_found < n_keys:
                keys[n_found] = first * n_boxes + second
                n_found += 1
