"""Which bodies of a scene may a segment, or another body, meet: a tree over the boxes of all bodies with bounds.

Boxes are rounded outward (posed_boxes.py), so no body is missed; those without bounds stand apart and are always named.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.bounding.bvh import UNUSED, WIDTH, Bvh, build_bvh
from engine.collision.scenes.bodies import SceneBodies
from engine.containment.scene.bodies import body_box
from engine.direct import entry_of
from engine.lanes.boxes import BOX_ROWS, EMPTY
from engine.parallel import Budget, run_chunks
from engine.scenes.near_boxes import list_near
from engine.solids.csg import Csg
from engine.solids.triangle import Triangle

_FEW: Final = 64
"""Items that are asked about in one piece of work."""
_LISTED: Final = 4
"""Bodies that have no tree: their boxes are looked at sooner than one is built."""


class BodyTree(NamedTuple):
    """The boxes of bodies, and a tree over those that are bounded, where they are not few."""

    boxes: FloatArray
    """(n, 2, dimension) low and high of every body, infinite where it may have no bounds."""
    tree: Bvh
    inverse: float
    """1 / its scale."""
    bounded: IntArray
    """The bodies of the tree by their place there."""
    listed: IntArray
    """The others, whose boxes are looked at one by one."""


def body_tree(bodies: SceneBodies, budget: Budget) -> BodyTree:
    """Return the tree over bodies."""
    n, dimension = len(bodies.solids), bodies.dimension
    together = np.empty((n, 2, dimension))
    together[:, 0], together[:, 1] = bodies.low, bodies.high
    for body, solid in enumerate(bodies.solids):
        if isinstance(solid, Csg):
            together[body] = body_box(solid, bodies.poses[body], budget.check)
        elif isinstance(solid, Triangle) and dimension == 3:  # a prism
            together[body] = _EVERYWHERE
    if n <= _LISTED:
        return BodyTree(together, _NO_TREE, 1.0, _NOBODY, np.arange(n))
    is_bounded = np.isfinite(together).all(axis=(1, 2))
    low, high = together[:, 0], together[:, 1]
    bounded, listed = np.flatnonzero(is_bounded), np.flatnonzero(~is_bounded & (low <= high).all(axis=1))
    flat = np.zeros((len(bounded), 6))  # in the plane z is 0
    flat[:, :dimension], flat[:, 3 : 3 + dimension] = low[bounded], high[bounded]
    tree = build_bvh(flat) if len(bounded) else _NO_TREE
    return BodyTree(together, tree, 1.0 / tree.scale, bounded, listed)


_EVERYWHERE: Final = np.array([[-np.inf], [np.inf]])
_NOBODY: Final = np.empty(0, np.int64)
_NO_TREE: Final = Bvh(
    read_only(np.full((1, BOX_ROWS, WIDTH), UNUSED)),
    read_only(np.full((1, WIDTH), EMPTY, np.int32)),
    read_only(np.zeros(3)),
    1.0,
)


def candidates(tree: BodyTree, items: FloatArray, budget: Budget, workers: int | None) -> tuple[IntArray, IntArray]:
    """Return pairs of a segment (n, 2, dimension) and a body that it may meet, by item; bodies of one in no order."""
    n, items, chunks = len(items), read_only(items), dict[int, tuple[IntArray, IntArray]]()
    if n <= _FEW:
        return _of_some(tree, items, budget, 0)

    def task(first: int, last: int) -> None:
        chunks[first] = _of_some(tree, items[first:last], budget, first)

    run_chunks(task, n, budget=budget, workers=workers)
    owners, bodies = zip(*(chunks[first] for first in sorted(chunks)))
    return np.concatenate(owners), np.concatenate(bodies)


def _of_some(tree: BodyTree, items: FloatArray, budget: Budget, first: int) -> tuple[IntArray, IntArray]:
    n, start, room = len(items), 0, 4 * len(items) + 64
    parts: list[IntArray] = []
    while start < n:  # bound: the room doubles until the bodies of an item find it
        pairs = np.empty((2, room), np.int64)
        stop, m = entry_of(list_near)(items, start, tree, pairs, budget.flag)
        budget.check()
        budget.take(2 * pairs.itemsize * int(m))
        parts.append(pairs[:, :m])
        room *= 2
        start = int(stop)
    owners, bodies = parts[0] if len(parts) == 1 else np.concatenate([np.empty((2, 0), np.int64), *parts], axis=1)
    return owners + first, bodies
