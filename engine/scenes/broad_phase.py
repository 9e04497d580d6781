"""Which bodies of a scene may a segment, or another body, meet: a tree over the boxes of all bodies with bounds.

Boxes are rounded outward (posed_boxes.py), so no body is missed; those without bounds stand apart and are always named.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.bounding.bvh import Bvh, build_bvh
from engine.bounding.posed_boxes import place_boxes
from engine.containment.scene.bodies import body_box
from engine.direct import entry_of
from engine.parallel import Budget, run_chunks
from engine.scenes.near_boxes import list_candidates, list_near_segments
from engine.segment_clipping.box_tree import build_box_tree
from engine.solids.base import Solid
from engine.solids.bounds import own_box
from engine.solids.csg import Csg
from engine.solids.pose import Pose
from engine.solids.triangle import Triangle

_CHECK_EVERY = 256
_FEW = 32
"""Bodies up to which one tree does."""


class BodyTree(NamedTuple):
    """The boxes of bodies, and a tree over those that are bounded."""

    boxes: FloatArray
    """(n, 2, dimension) low and high of every body, infinite where it may have no bounds."""
    bodies: IntArray
    """Those of the tree, by leaf."""
    nodes: FloatArray
    """See `build_box_tree`; no rows where no body is bounded."""
    lanes: Bvh | None
    """In space, and where they are many, the same as a tree that segments go down faster."""
    bounded: IntArray
    """The bodies of `lanes` by their place there."""
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
    if not len(bounded):
        return BodyTree(together, bounded, np.empty((0, 2, dimension)), None, bounded, unbounded)
    order, nodes = build_box_tree(low[bounded], high[bounded])
    lanes = None
    if dimension == 3 and len(bounded) > _FEW:
        lanes = build_bvh(np.concatenate([low[bounded], high[bounded]], axis=1))
    return BodyTree(together, bounded[order], nodes, lanes, bounded, unbounded)


def candidates(
    tree: BodyTree, items: FloatArray, are_boxes: bool, budget: Budget, workers: int | None
) -> tuple[IntArray, IntArray]:
    """Return pairs of an item and a body that it may meet, by item; bodies of an item in no order.

    items: (n, 2, dimension), segments, or where `are_boxes` boxes, which may be infinite.
    """
    n, chunks = len(items), dict[int, tuple[IntArray, IntArray]]()

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
    lanes = None if are_boxes else tree.lanes
    while start < n and len(tree.nodes):  # bound: the room doubles until the bodies of an item find it
        pairs = np.empty((2, room), np.int64)
        if lanes is not None:
            stop, m = entry_of(list_near_segments)(items, start, lanes, 1.0 / lanes.scale, pairs, budget.flag)
            bodies = tree.bounded[pairs[1, :m]]
        else:
            stop, m = entry_of(list_candidates)(
                items, start, are_boxes, tree.nodes, tree.bodies, tree.boxes, pairs, budget.flag
            )
            bodies = pairs[1, :m]
        budget.check()
        budget.take(2 * pairs.itemsize * int(m))
        owners.append(pairs[0, :m])
        found.append(bodies)
        room *= 2
        start = int(stop)
    owner, body = np.concatenate(owners) + first, np.concatenate(found)
    if not len(tree.unbounded):
        return owner, body
    order = np.argsort(owner, kind="stable")
    return owner[order], body[order]
