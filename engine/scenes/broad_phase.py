"""Which bodies of a scene may a segment, or another body, meet: a tree over the boxes of all bodies with bounds.

Boxes are rounded outward (posed_boxes.py), so no body is missed; those without bounds stand apart and are always named.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.bounding.bvh import UNUSED, WIDTH, Bvh, build_bvh
from engine.direct import entry_of
from engine.lanes.boxes import BOX_ROWS, EMPTY
from engine.parallel import Budget, run_chunks
from engine.scenes.near_boxes import list_near

_FEW: Final = 64
"""Items that are asked about in one piece of work."""


BodyTree = namedtuple("BodyTree", "low high tree inverse bounded listed")
"""The boxes of bodies, low and high (n, dimension), infinite where they may have no bounds; a `Bvh` over those that are
bounded, where they are not few, 1 / its scale, and which body is where in it; the others, looked at one by one."""
Where = namedtuple("Where", "together moved names")
"""Where the bodies of a scene are: the `BodyTree` of n of them together, and of those that moved since, which count
from n on; what these are called in the scene, ascending."""


def body_tree(low: FloatArray, high: FloatArray, most_listed: int) -> BodyTree:
    """Return the tree over bodies by their boxes (n, dimension); up to so many have none."""
    n, dimension = low.shape
    if n <= most_listed:
        return BodyTree(low, high, _NO_TREE, 1.0, _NOBODY, np.arange(n))
    is_bounded = (np.isfinite(low) & np.isfinite(high)).all(axis=1)
    bounded, listed = np.flatnonzero(is_bounded), np.flatnonzero(~is_bounded & (low <= high).all(axis=1))
    flat = np.zeros((len(bounded), 6))  # in the plane z is 0
    flat[:, :dimension], flat[:, 3 : 3 + dimension] = low[bounded], high[bounded]
    tree = build_bvh(flat) if len(bounded) else _NO_TREE
    return BodyTree(low, high, tree, 1.0 / tree.scale, bounded, listed)


_NOBODY: Final = np.empty(0, np.int64)
_NO_TREE: Final = Bvh(
    read_only(np.full((1, BOX_ROWS, WIDTH), UNUSED)),
    read_only(np.full((1, WIDTH), EMPTY, np.int32)),
    read_only(np.zeros(3)),
    1.0,
)
NO_BODIES: Final = {d: BodyTree(np.empty((0, d)), np.empty((0, d)), _NO_TREE, 1.0, _NOBODY, _NOBODY) for d in (2, 3)}


def candidates(where: Where, items: FloatArray, budget: Budget, workers: int | None) -> tuple[IntArray, IntArray]:
    """Return pairs of a segment (n, 2, dimension) and a body that it may meet, by item; bodies of one in no order."""
    n, items, chunks = len(items), read_only(items), dict[int, tuple[IntArray, IntArray]]()
    if n <= _FEW:
        return _of_some(where, items, budget, 0)

    def task(first: int, last: int) -> None:
        chunks[first] = _of_some(where, items[first:last], budget, first)

    run_chunks(task, n, budget=budget, workers=workers)
    owners, bodies = zip(*(chunks[first] for first in sorted(chunks)))
    return np.concatenate(owners), np.concatenate(bodies)


def _of_some(where: Where, items: FloatArray, budget: Budget, first: int) -> tuple[IntArray, IntArray]:
    n, start, room = len(items), 0, 4 * len(items) + 64
    parts: list[IntArray] = []
    while start < n:  # bound: the room doubles until the bodies of an item find it
        pairs = np.empty((2, room), np.int64)
        stop, m = entry_of(list_near)(items, start, where, pairs, budget.flag)
        budget.check()
        budget.take(2 * pairs.itemsize * m)
        parts.append(pairs[:, :m])
        room *= 2
        start = stop
    owners, bodies = parts[0] if len(parts) == 1 else np.concatenate([np.empty((2, 0), np.int64), *parts], axis=1)
    return (owners + first if first else owners), bodies
