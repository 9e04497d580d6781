"""Which bodies of a tree of boxes does a segment, or a box, come near; compiled. In the plane z is 0."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.bounding.bvh import STACK
from engine.jit import inline, kernel
from engine.lanes.boxes import EMPTY, inside_box, near_segment
from engine.lanes.lanes import lowest_bit
from engine.segment_clipping.mesh_contacts import local_segment
from engine.segment_clipping.pieces import point_of
from engine.types import Point3

_SLACK: Final = 2.0**-20
"""By how much a box in the tree's coordinates, at most 2 where it matters, is widened for its rounding to float32."""


@inline
def near_bodies(segments: Any, item: int, bodies: Any, stack: Any, found: Any) -> int:
    """Fill `found` with the bodies of a `BodyTree` that a segment may meet; return how many. stack: (STACK,)."""
    tree = bodies.tree
    is_flat = segments.shape[2] == 2
    px, py, pz = point_of(segments, item, 0, is_flat)
    qx, qy, qz = point_of(segments, item, 1, is_flat)
    middle, half, slack, tiny, is_near = local_segment(
        Point3(px, py, pz), Point3(qx, qy, qz), tree.origin, bodies.inverse
    )
    n_found, depth, stack[0] = 0, int(is_near), 0
    while depth > 0:  # bound: each node enters the stack once
        depth -= 1
        node = stack[depth]
        bits = near_segment(tree.boxes, node, middle, half, np.float32(slack), np.float32(tiny))
        while bits != 0:
            below = tree.child[node, lowest_bit(bits)]
            bits &= bits - 1
            if below >= 0:
                stack[depth] = below
                depth += 1
            elif below != EMPTY:
                found[n_found] = bodies.bounded[-1 - below]
                n_found += 1
    for place in range(bodies.listed.size):
        found[n_found] = body = bodies.listed[place]
        meet = True
        for k in range(segments.shape[2]):
            p, q = segments[item, 0, k], segments[item, 1, k]
            meet &= (min(p, q) <= bodies.boxes[body, 1, k]) & (max(p, q) >= bodies.boxes[body, 0, k])
        n_found += meet
    return n_found


@inline
def _is_met(items: Any, item: int, bodies: Any, body: int) -> bool:
    """Tell whether a box meets that of a body."""
    meet = True
    for k in range(items.shape[2]):
        meet &= (items[item, 0, k] <= bodies.boxes[body, 1, k]) & (items[item, 1, k] >= bodies.boxes[body, 0, k])
    return meet


@inline
def bodies_in(items: Any, item: int, bodies: Any, stack: Any, found: Any) -> int:
    """Fill `found` with the bodies of a `BodyTree` whose boxes a box meets, which may be infinite; return how many."""
    tree, inverse = bodies.tree, bodies.inverse
    is_flat, n_found, depth, stack[0] = items.shape[2] == 2, 0, 1, 0
    low, high = point_of(items, item, 0, is_flat), point_of(items, item, 1, is_flat)
    x, y, z = tree.origin[0], tree.origin[1], tree.origin[2]
    least = (
        np.float32((low[0] - x) * inverse - _SLACK),
        np.float32((low[1] - y) * inverse - _SLACK),
        np.float32((low[2] - z) * inverse - _SLACK),
    )
    most = (
        np.float32((high[0] - x) * inverse + _SLACK),
        np.float32((high[1] - y) * inverse + _SLACK),
        np.float32((high[2] - z) * inverse + _SLACK),
    )
    while depth > 0:  # bound: each node enters the stack once
        depth -= 1
        node = stack[depth]
        bits = inside_box(tree.boxes, node, least, most)
        while bits != 0:
            below = tree.child[node, lowest_bit(bits)]
            bits &= bits - 1
            if below >= 0:
                stack[depth] = below
                depth += 1
            elif below != EMPTY:
                found[n_found] = bodies.bounded[-1 - below]
                n_found += _is_met(items, item, bodies, found[n_found])
    for place in range(bodies.listed.size):
        found[n_found] = bodies.listed[place]
        n_found += _is_met(items, item, bodies, found[n_found])
    return n_found


@kernel
def list_near(items: Any, start: int, bodies: Any, pairs: Any, flag: Any) -> tuple[int, int]:
    """List in pairs (2, room) the segments (n, 2, dim) from `start` on and the bodies that they may meet; return the
    item reached, and how many pairs there are. An item whose bodies find no room is not begun."""
    n_bodies = bodies.bounded.size + bodies.listed.size
    stack, found, n_pairs = np.empty(STACK, np.int32), np.empty(n_bodies + 1, np.int64), 0
    for item in range(start, items.shape[0]):
        if flag[0]:
            return item, n_pairs
        n_found = near_bodies(items, item, bodies, stack, found)
        if n_pairs + n_found > pairs.shape[1]:
            return item, n_pairs
        for place in range(n_found):
            pairs[0, n_pairs + place], pairs[1, n_pairs + place] = item, found[place]
        n_pairs += n_found
    return items.shape[0], n_pairs
