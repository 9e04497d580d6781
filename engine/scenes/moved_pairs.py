"""Pairs of a scene of which a body is named, by their boxes, and where the two of each stand; compiled."""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np

from engine.jit import inline, kernel
from engine.scenes.near_boxes import bodies_in, place_in
from engine.scenes.scratch import scratch_at

Placed = namedtuple("Placed", "kinds rotations translations")
"""What `SceneBodies` says of where bodies stand: kinds (n,), rotations (n + 1, d, d), translations (n + 1, d)."""
PairRows = namedtuple("PairRows", "keys kinds rotations translations")
"""Pairs by the keys first * n + second (room,), and their bodies (2 room + 1, ...): those of pair i are rows 2 i + 1
and 2 i + 2, row 0 is the identity."""


@inline
def _put_row(rows: Any, row: int, still: Placed, moved: Placed, body: int, name: int) -> None:
    """Fill a row with a body where it stands."""
    n = still.kinds.size
    rows.kinds[row] = still.kinds[name]
    for i in range(rows.translations.shape[1]):
        step = still.translations[body + 1, i] if body < n else moved.translations[body - n, i]
        rows.translations[row, i] = step
        for j in range(rows.translations.shape[1]):
            turn = still.rotations[body + 1, i, j] if body < n else moved.rotations[body - n, i, j]
            rows.rotations[row, i, j] = turn


@kernel
def list_pairs(
    named: Any, reach: float, where: Any, still: Any, moved: Any, rows: Any, room: Any, box: Any, flag: Any
) -> int:
    """Fill `rows` with the pairs of a named body and another whose boxes, grown by `reach`, meet, each once, in no
    order; return how many there are, more than there is room for where that is less.

    named: ascending. where: a `Where` of n bodies and m that moved; still, moved: `Placed` of both, moved without its
    row 0. Room to work in: that of `scratch_for`, box (2, dim).
    """
    n, n_pairs, scratch = still.kinds.size, 0, scratch_at(room)
    rows.kinds[0] = 0
    for i in range(box.shape[1]):
        rows.translations[0, i] = 0.0
        for j in range(box.shape[1]):
            rows.rotations[0, i, j] = still.rotations[0, i, j]
    for name in named:
        place = place_in(where.names, name)
        body = name if place < 0 else n + place
        for i in range(box.shape[1]):
            box[0, i] = where.together.low[name, i] if place < 0 else where.moved.low[place, i]
            box[1, i] = where.together.high[name, i] if place < 0 else where.moved.high[place, i]
            if reach != 0.0:
                box[0, i], box[1, i] = _outward(box[0, i], reach, 0), _outward(box[1, i], reach, 1)
        for i in range(bodies_in(box[0], box[1], where, scratch.stack, scratch.near)):
            near = scratch.near[i]
            other = near if near < n else where.names[near - n]
            if other == name or (other < name and place_in(named, other) >= 0):
                continue
            if n_pairs < rows.keys.size:
                rows.keys[n_pairs] = min(name, other) * n + max(name, other)
                row = 2 * n_pairs + 1
                _put_row(rows, row + (other < name), still, moved, body, name)
                _put_row(rows, row + (name < other), still, moved, near, other)
            n_pairs += 1
        if flag[0]:
            break
    return n_pairs


@inline
def _outward(value: float, reach: float, side: int) -> float:
    """Return a side of a box moved by more than a pose may stretch `reach` (bounding/aabb.py)."""
    far = 1.001 * reach
    return np.nextafter(value - far, -np.inf) if side == 0 else np.nextafter(value + far, np.inf)
