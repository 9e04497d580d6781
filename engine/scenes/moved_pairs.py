"""Pairs of a scene of which a body is named, by their boxes, and where the two of each stand; compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.bounding.bvh import STACK
from engine.jit import inline, kernel
from engine.scenes.near_boxes import bodies_in


class Placed(NamedTuple):
    """What `SceneBodies` says of where bodies stand: kinds (n,), rotations (n + 1, d, d), translations (n + 1, d)."""

    kinds: IntArray
    rotations: FloatArray
    translations: FloatArray


class PairRows(NamedTuple):
    """Pairs by the keys first * n + second, and their bodies: those of pair i are rows 2 i + 1 and 2 i + 2, row 0 is
    the identity."""

    keys: IntArray
    """(room,)."""
    kinds: IntArray
    """(2 room + 1,)."""
    rotations: FloatArray
    translations: FloatArray


@inline
def _place_in(names: Any, body: int) -> int:
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
def _put_row(rows: Any, row: int, still: Placed, moved: Placed, names: Any, body: int) -> None:
    """Fill a row with a body where it stands."""
    place = _place_in(names, body)
    rows.kinds[row] = still.kinds[body]
    for i in range(rows.translations.shape[1]):
        translations = still.translations[body + 1, i] if place < 0 else moved.translations[place + 1, i]
        rows.translations[row, i] = translations
        for j in range(rows.translations.shape[1]):
            turn = still.rotations[body + 1, i, j] if place < 0 else moved.rotations[place + 1, i, j]
            rows.rotations[row, i, j] = turn


@kernel
def list_pairs(
    named: Any,
    reach: float,
    tree: Any,
    is_away: Any,
    few: Any,
    names: Any,
    still: Any,
    moved: Any,
    rows: Any,
    flag: Any,
) -> int:
    """Fill `rows` with the pairs of a named body and another whose boxes, grown by `reach`, meet, each once, in no
    order; return how many there are, more than there is room for where that is less.

    named, names: ascending. tree: the `BodyTree` of all, of whom some are away (is_away (n,), or (0,) for none); few:
    that of those, called `names`. still, moved: `Placed` of both.
    """
    n, dimension, n_pairs = tree.boxes.shape[0], tree.boxes.shape[2], 0
    stack, found, box = np.empty(STACK, np.int32), np.empty(n + 1, np.int64), np.empty((1, 2, dimension))
    rows.kinds[0] = 0
    for i in range(dimension):
        rows.translations[0, i] = 0.0
        for j in range(dimension):
            rows.rotations[0, i, j] = still.rotations[0, i, j]
    for body in named:
        place = _place_in(names, body)
        for i in range(dimension):
            for side in range(2):
                value = tree.boxes[body, side, i] if place < 0 else few.boxes[place, side, i]
                box[0, side, i] = value if reach == 0.0 else _outward(value, reach, side)
        n_still = bodies_in(box, 0, tree, stack, found)
        n_found = n_still
        if names.size > 0:
            n_found += bodies_in(box, 0, few, stack, found[n_still:])
        for i in range(n_found):
            other = found[i] if i < n_still else names[found[i]]
            is_gone = i < n_still and is_away.size > 0 and is_away[other]
            if is_gone or other == body or (other < body and _place_in(named, other) >= 0):
                continue
            if n_pairs < rows.keys.size:
                first, second = min(body, other), max(body, other)
                rows.keys[n_pairs] = first * n + second
                _put_row(rows, 2 * n_pairs + 1, still, moved, names, first)
                _put_row(rows, 2 * n_pairs + 2, still, moved, names, second)
            n_pairs += 1
        if flag[0]:
            break
    return n_pairs


@inline
def _outward(value: float, reach: float, side: int) -> float:
    """Return a side of a box moved by more than a pose may stretch `reach` (posed_boxes.py)."""
    far = 1.001 * reach
    return np.nextafter(value - far, -np.inf) if side == 0 else np.nextafter(value + far, np.inf)
