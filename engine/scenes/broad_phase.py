"""Which bodies of a scene may a segment, or another body, meet: a tree over the boxes of all bodies with bounds.

Boxes are rounded outward (`place_boxes`), so no body is missed; those without bounds stand apart and are always named.
"""

from __future__ import annotations

from collections import namedtuple
from math import isfinite
from typing import Any, Final

import numpy as np

from engine.arrays import FloatArray, IntArray, read_only
from engine.bounding.bvh import UNUSED, WIDTH, Bvh, build_bvh
from engine.budget import Budget
from engine.direct import entry_of
from engine.lanes.boxes import BOX_ROWS, EMPTY
from engine.scenes.near_boxes import BodyTree, list_near, put_keys
from engine.scenes.scratch import scratch_for

_MANY: Final = 4096
_AS_GIVEN: Final = read_only(np.arange(_MANY))
Where = namedtuple("Where", "together moved names")
"""Where the bodies of a scene are: the `BodyTree` of n of them together, and of those that moved since, which count
from n on; what these are called in the scene, ascending."""


def body_tree(low: FloatArray, high: FloatArray, most_listed: int) -> BodyTree:
    """Return the tree over bodies by their boxes (n, dimension); up to so many have none, nor have those so near each
    other that 1 / its scale is no double."""
    n, dimension = low.shape
    every = BodyTree(low, high, _NO_TREE, 1.0, NOBODY, np.arange(n))
    if n <= most_listed:
        return every
    is_bounded = (np.isfinite(low) & np.isfinite(high)).all(axis=1)
    bounded, listed = np.flatnonzero(is_bounded), np.flatnonzero(~is_bounded & (low <= high).all(axis=1))
    flat = np.zeros((len(bounded), 6))  # in the plane z is 0
    flat[:, :dimension], flat[:, 3 : 3 + dimension] = low[bounded], high[bounded]
    tree = build_bvh(flat) if len(bounded) else _NO_TREE
    inverse = 1.0 / tree.scale
    return BodyTree(low, high, tree, inverse, bounded, listed) if isfinite(inverse) else every


NOBODY: Final = np.empty(0, np.int64)
_NO_TREE: Final = Bvh(
    read_only(np.full((1, BOX_ROWS, WIDTH), UNUSED)),
    read_only(np.full((1, WIDTH), EMPTY, np.int32)),
    read_only(np.zeros(3)),
    1.0,
)
_NO_NUMBERS: Final = read_only(np.array([1.0, 0.0, 0.0, 0.0]))
_ADDRESSES: Final[dict[int, int]] = {
    id(array): array.__array_interface__["data"][0] for array in (NOBODY, _NO_TREE.boxes, _NO_TREE.child, _NO_NUMBERS)
}
"""Of what stays, by its id: to ask an array for its own takes a microsecond."""
NO_BODIES: Final = {d: BodyTree(np.empty((0, d)), np.empty((0, d)), _NO_TREE, 1.0, NOBODY, NOBODY) for d in (2, 3)}


def words_of(bodies: BodyTree, names: IntArray, placed: IntArray) -> tuple[list[int], Any]:
    """Return the row that stands for a `BodyTree`, with a `Table`'s rows, and what it gives addresses of."""
    tree = bodies.tree
    numbers = _NO_NUMBERS if tree is _NO_TREE else np.array([bodies.inverse, *tree.origin.tolist()])
    kept = bodies.low, bodies.high, tree.boxes, tree.child, bodies.bounded, bodies.listed, numbers, names, placed
    low, high, boxes, child, bounded, listed, *more = (_ADDRESSES.get(id(array)) or _address(array) for array in kept)
    return [len(bodies.low), low, high, len(tree.child), boxes, child, bounded, len(bodies.listed), listed, *more], kept


def _address(array: Any) -> int:
    return int(array.__array_interface__["data"][0])


def order_of(segments: FloatArray, t: float, where: Any) -> IntArray:
    """Return an order of segments in which those follow each other that are near each other at t, where they are many:
    these find in the cache what others were asked about."""
    n = len(segments)
    if n < _MANY:
        return _AS_GIVEN[:n]
    entry_of(put_keys)(segments, t, where.together, keys := np.empty(n, np.uint16))
    return np.argsort(keys, kind="stable")


def candidates(where: Where, points: FloatArray, budget: Budget) -> IntArray:
    """Return pairs (m, 2) of a point (n, dimension) and a body that it may lie in, by point; bodies in no order."""
    room, scratch = 16 * len(points), scratch_for(len(where.together.low) + len(where.names))
    while True:  # bound: the second turn has room
        pairs = np.empty((room, 2), np.int64)
        n = entry_of(list_near)(points, where, scratch, pairs, budget.flag)
        budget.check()
        if n <= room:
            return pairs[:n]
        room = n
