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
def place_in(names: Any, body: int) -> int:
    """Return where a body stands among names, which ascend; -1 where it does not."""
    low, high = 0, names.size
    while low < high:  # bound: halved each turn
        middle = (low + high) // 2
        if names[middle] < body:
            low = middle + 1
        else:
            high = middle
    return low if low < names.size and names[low] == body else -1


@inline
def name_of(where: Any, body: int) -> int:
    """Return what a body of a `Where` is called in the scene."""
    n = where.together.low.shape[0]
    return body if body < n else where.names[body - n]


@inline
def _join_moved(where: Any, found: Any, n_found: int, n_all: int) -> int:
    """Leave out those of n_found bodies that moved, and count those that follow up to n_all as moved; return how many
    there are."""
    n, n_left = where.together.low.shape[0], 0
    for place in range(n_all):
        if place >= n_found:
            found[n_left] = n + found[place]
        elif place_in(where.names, found[place]) < 0:
            found[n_left] = found[place]
        else:
            continue
        n_left += 1
    return n_left


@inline
def near_bodies(segments: Any, item: int, where: Any, stack: Any, found: Any) -> int:
    """Fill `found` with the bodies of a `Where` that a segment may meet; return how many. stack: (STACK,)."""
    n_found = _near_of(segments, item, where.together, stack, found, 0)
    if where.names.size > 0:
        n_found = _join_moved(where, found, n_found, _near_of(segments, item, where.moved, stack, found, n_found))
    return n_found


@inline
def _near_of(segments: Any, item: int, bodies: Any, stack: Any, found: Any, n_found: int) -> int:
    """Fill `found` from n_found on with the bodies of a `BodyTree` that a segment may meet; return where they end."""
    tree, is_flat = bodies.tree, segments.shape[2] == 2
    px, py, pz = point_of(segments, item, 0, is_flat)
    qx, qy, qz = point_of(segments, item, 1, is_flat)
    p, q = Point3(px, py, pz), Point3(qx, qy, qz)
    middle, half, slack, tiny, is_near = local_segment(p, q, tree.origin, bodies.inverse)
    depth, stack[0] = int(is_near), 0
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
            start, end = segments[item, 0, k], segments[item, 1, k]
            meet &= (min(start, end) <= bodies.high[body, k]) & (max(start, end) >= bodies.low[body, k])
        n_found += meet
    return n_found


@inline
def bodies_in(low: Any, high: Any, where: Any, stack: Any, found: Any) -> int:
    """Fill `found` with the bodies of a `Where` whose boxes a box (dim,) meets, which may be infinite; return how
    many."""
    n_found = _of_box(low, high, where.together, stack, found, 0)
    if where.names.size > 0:
        n_found = _join_moved(where, found, n_found, _of_box(low, high, where.moved, stack, found, n_found))
    return n_found


@inline
def _is_met(low: Any, high: Any, bodies: Any, body: int) -> bool:
    """Tell whether a box meets that of a body."""
    meet = True
    for k in range(low.size):
        meet &= (low[k] <= bodies.high[body, k]) & (high[k] >= bodies.low[body, k])
    return meet


@inline
def _local(value: float, inverse: float, way: float) -> Any:
    return np.float32(value * inverse + way * _SLACK)


@inline
def _of_box(low: Any, high: Any, bodies: Any, stack: Any, found: Any, n_found: int) -> int:
    """Fill `found` from n_found on with the bodies of a `BodyTree` whose boxes a box meets; return where they end."""
    tree, inverse, depth, stack[0] = bodies.tree, bodies.inverse, 1, 0
    is_flat, x, y, z = low.size == 2, tree.origin[0], tree.origin[1], tree.origin[2]
    bottom, top = (0.0 if is_flat else low[2]) - z, (0.0 if is_flat else high[2]) - z
    least = _local(low[0] - x, inverse, -1.0), _local(low[1] - y, inverse, -1.0), _local(bottom, inverse, -1.0)
    most = _local(high[0] - x, inverse, 1.0), _local(high[1] - y, inverse, 1.0), _local(top, inverse, 1.0)
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
                n_found += _is_met(low, high, bodies, found[n_found])
    for place in range(bodies.listed.size):
        found[n_found] = bodies.listed[place]
        n_found += _is_met(low, high, bodies, found[n_found])
    return n_found


@kernel
def list_near(items: Any, start: int, where: Any, pairs: Any, flag: Any) -> tuple[int, int]:
    """List in pairs (2, room) the segments (n, 2, dim) from `start` on and the bodies of a `Where` that they may meet;
    return the item reached, and how many pairs there are. An item whose bodies find no room is not begun."""
    n_bodies = where.together.low.shape[0] + where.names.size
    stack, found, n_pairs = np.empty(STACK, np.int32), np.empty(n_bodies + 1, np.int64), 0
    for item in range(start, items.shape[0]):
        if flag[0]:
            return item, n_pairs
        n_found = near_bodies(items, item, where, stack, found)
        if n_pairs + n_found > pairs.shape[1]:
            return item, n_pairs
        for place in range(n_found):
            pairs[0, n_pairs + place], pairs[1, n_pairs + place] = item, found[place]
        n_pairs += n_found
    return items.shape[0], n_pairs
