"""Which bodies of a scene may a segment, or another body, meet: a tree over the boxes of all bodies with bounds.

Boxes are rounded outward (posed_boxes.py), so no body is missed; those without bounds stand apart and are always named.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.bounding.bvh import UNUSED, WIDTH, Bvh, build_bvh
from engine.bounding.posed_boxes import place_boxes
from engine.containment.scene.bodies import body_box
from engine.direct import entry_of
from engine.lanes.boxes import BOX_ROWS, EMPTY
from engine.parallel import Budget, run_chunks
from engine.scenes.near_boxes import list_near
from engine.solids.base import Solid
from engine.solids.bounds import own_box
from engine.solids.csg import Csg
from engine.solids.pose import Pose
from engine.solids.triangle import Triangle

_CHECK_EVERY = 256


class BodyTree(NamedTuple):
    """The boxes of bodies, and a tree over those that are bounded."""

    boxes: FloatArray
    """(n, 2, dimension) low and high of every body, infinite where it may have no bounds."""
    tree: Bvh
    inverse: float
    """1 / its scale."""
    bounded: IntArray
    """The bodies of the tree by their place there."""
    unbounded: IntArray


def body_tree(solids: Sequence[Solid], poses: Sequence[Pose | None], dimension: int, budget: Budget) -> BodyTree:
    """Return the tree over bodies; a solid that stands for many is looked at once."""
    places: dict[int, int] = {}
    kinds = np.array([places.setdefault(id(solid), len(places)) for solid in solids], np.int64)
    distinct = list({id(solid): solid for solid in solids}.values())
    n = len(solids)
    boxes, reaches = np.empty((len(distinct), 2, dimension)), np.empty(len(distinct))
    for kind, solid in enumerate(distinct):
        if kind % _CHECK_EVERY == 0:
            budget.check()
        if isinstance(solid, Triangle) and dimension == 3:  # a prism
            boxes[kind, 0], boxes[kind, 1], reaches[kind] = -np.inf, np.inf, np.inf
        else:
            boxes[kind, 0], boxes[kind, 1], reaches[kind] = own_box(solid, budget.check)
    moved = [body for body, pose in enumerate(poses) if pose is not None]
    rows = np.full(n, -1, np.int64)
    rows[moved] = np.arange(len(moved))
    numbers = np.frombuffer(b"".join([pose.numbers for pose in poses if pose is not None]))
    numbers = numbers.reshape(len(moved), dimension**2 + dimension)
    turns = np.ascontiguousarray(numbers[:, : dimension**2]).reshape(-1, dimension, dimension)
    radii = np.array([getattr(solid, "radius", 0.0) for solid in distinct])
    low, high = np.empty((n, dimension)), np.empty((n, dimension))
    with np.errstate(all="ignore"):  # uncompiled runs only
        moves = np.ascontiguousarray(numbers[:, dimension**2 :])
        place_boxes(boxes, reaches, radii, kinds, rows, turns, moves, low, high)
    for body, solid in enumerate(solids):
        if isinstance(solid, Csg):
            low[body], high[body] = body_box(solid, poses[body], budget.check)
    is_bounded = np.isfinite(low).all(axis=1) & np.isfinite(high).all(axis=1)
    bounded, unbounded = np.flatnonzero(is_bounded), np.flatnonzero(~is_bounded & (low <= high).all(axis=1))
    together = np.stack([low, high], axis=1)
    flat = np.zeros((len(bounded), 6))  # in the plane z is 0
    flat[:, :dimension], flat[:, 3 : 3 + dimension] = low[bounded], high[bounded]
    tree = build_bvh(flat) if len(bounded) else _NO_TREE
    return BodyTree(together, tree, 1.0 / tree.scale, bounded, unbounded)


_NO_TREE: Final = Bvh(
    read_only(np.full((1, BOX_ROWS, WIDTH), UNUSED)),
    read_only(np.full((1, WIDTH), EMPTY, np.int32)),
    read_only(np.zeros(3)),
    1.0,
)


def candidates(
    tree: BodyTree, items: FloatArray, are_boxes: bool, budget: Budget, workers: int | None
) -> tuple[IntArray, IntArray]:
    """Return pairs of an item and a body that it may meet, by item; bodies of an item in no order.

    items: (n, 2, dimension), segments, or where `are_boxes` boxes, which may be infinite.
    """
    n, items, chunks = len(items), read_only(items), dict[int, tuple[IntArray, IntArray]]()

    def task(first: int, last: int) -> None:
        chunks[first] = _of_some(tree, items[first:last], are_boxes, budget, first)

    run_chunks(task, n, budget=budget, workers=workers)
    parts = [chunks[first] for first in sorted(chunks)]
    if len(parts) == 1:
        return parts[0]
    none = np.empty(0, np.int64)
    return np.concatenate([none, *(part[0] for part in parts)]), np.concatenate([none, *(part[1] for part in parts)])


def _of_some(
    tree: BodyTree, items: FloatArray, are_boxes: bool, budget: Budget, first: int
) -> tuple[IntArray, IntArray]:
    n, start, room = len(items), 0, 4 * len(items) + 64
    owners, found = [np.repeat(np.arange(n), len(tree.unbounded))], [np.tile(tree.unbounded, n)]
    while start < n:  # bound: the room doubles until the bodies of an item find it
        pairs = np.empty((2, room), np.int64)
        stop, m = entry_of(list_near)(items, start, are_boxes, tree, pairs, budget.flag)
        budget.check()
        budget.take(2 * pairs.itemsize * int(m))
        owners.append(pairs[0, :m])
        found.append(pairs[1, :m])
        room *= 2
        start = int(stop)
    owner, body = np.concatenate(owners) + first, np.concatenate(found)
    if not len(tree.unbounded):
        return owner, body
    order = np.argsort(owner, kind="stable")
    return owner[order], body[order]
