"""Rings as blocks of edges, so that those that meet nothing need not be looked at one by one.

    ring  o--o--o--o--o--o--o--o--o--o      a block is so many consecutive edges, with their box, and which way
          |  block  |  block  |  block      all of them head: right, left, up or down by more than the margin

Edges of blocks that head one way together, one after another, have only their common vertices in common. A block that
lies beyond one side of a box outside of which nothing counts becomes a chord, one straight edge, and so do such blocks
one after another: that moves the boundary beyond that side only.

Every step is one that the compiler does four at a time, over vertices that are in the nearest cache.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final

import numpy as np

from engine.jit import inline
from engine.polygon_overlay.compiled.loading import Box, RingArrays, box_of
from engine.predicates.orientation import BOUND_2D, GUARD_2D

NOT_RIGHT: Final = 2
NOT_LEFT: Final = 4
NOT_UP: Final = 8
NOT_DOWN: Final = 16
EVERYWHERE: Final = NOT_RIGHT | NOT_LEFT | NOT_UP | NOT_DOWN
"""Marks of a block some edge of which does not head that way, and of one whose edges head no way together."""
CHORD: Final = 32
"""Mark of a block that stands for one edge, from its first vertex to its last."""
_AT_ONCE: Final = 512
"""Edges whose directions are computed at once: they stay in the nearest cache."""
_TURN_BOUND: Final = 4.0 * BOUND_2D
"""Bound of a turn by the larger half of its two products: |r| <= |l| + |l - r|, so BOUND_2D (|l| + |r|) is less."""

Blocks = namedtuple("Blocks", "first last following boxes marks is_active firsts")
"""By block: its first vertex, the number after its last edge's first vertex, the block that follows in the ring; boxes:
x_min, x_max, y_min, y_max; marks: uint8, which way it does not head; is_active: uint8, whether its edges have to be
looked at one by one; firsts: the first block of each ring, and the end of the last one's."""


@inline
def load_blocks(rings: RingArrays, size: int, blocks: Blocks, n: int, ring: int, stop: Any) -> int:
    """Append the blocks of rings, of up to ``size`` edges, from number n and ``ring`` on; return their end."""
    vertices, offsets, n_rings = rings.vertices, rings.offsets, rings.offsets.shape[0] - 1
    first, last, boxes = blocks.first, blocks.last, blocks.boxes
    for i_ring in range(n_rings):
        start, end = offsets[i_ring], offsets[i_ring + 1]
        blocks.firsts[ring + i_ring] = n
        for a in range(start, end, size):
            if stop[0]:
                return n
            b = min(a + size, end)
            part = vertices[a:b]
            closing = b if b < end else start
            x_min, x_max, y_min, y_max = box_of(part, 0, b - a)
            boxes[n, 0], boxes[n, 1] = min(x_min, vertices[closing, 0]), max(x_max, vertices[closing, 0])
            boxes[n, 2], boxes[n, 3] = min(y_min, vertices[closing, 1]), max(y_max, vertices[closing, 1])
            first[n], last[n], blocks.marks[n] = a, b, 0
            n += 1
    blocks.firsts[ring + n_rings] = n
    return n


@inline
def box_of_blocks(boxes: Any, first: int, last: int) -> Box:
    """Return x_min, x_max, y_min, y_max of some blocks; inverted where there is none."""
    x_min = y_min = np.inf
    x_max = y_max = -np.inf
    for i in range(first, last):
        x_min, x_max = min(x_min, boxes[i, 0]), max(x_max, boxes[i, 1])
        y_min, y_max = min(y_min, boxes[i, 2]), max(y_max, boxes[i, 3])
    return x_min, x_max, y_min, y_max


@inline
def cut_beyond(rings: RingArrays, box: Box, blocks: Blocks, ring: int, begin: int, at: int) -> int:
    """Put chords in the place of blocks beyond one side of a box, of rings from ``ring`` and blocks from ``begin`` on.

    Moves all down to ``at`` and on; returns their end.
    """
    vertices, offsets, n_rings = rings.vertices, rings.offsets, rings.offsets.shape[0] - 1
    x_min, x_max, y_min, y_max = box
    first, last, boxes, marks = blocks.first, blocks.last, blocks.boxes, blocks.marks
    i = begin
    for i_ring in range(n_rings):
        start, end = offsets[i_ring], offsets[i_ring + 1]
        after = blocks.firsts[ring + i_ring + 1]
        blocks.firsts[ring + i_ring] = at
        sides = 0  # which sides of the box the chord before is beyond
        while i < after:  # bound: each turn passes one block
            beyond = 1 * (boxes[i, 1] < x_min) + 2 * (boxes[i, 0] > x_max)
            beyond += 4 * (boxes[i, 3] < y_min) + 8 * (boxes[i, 2] > y_max)
            if beyond & sides:
                sides &= beyond
                last[at - 1] = last[i]
            else:
                sides = beyond
                first[at], last[at], marks[at] = first[i], last[i], CHORD if beyond else 0
                for k in range(4):
                    boxes[at, k] = boxes[i, k]
                at += 1
            if sides:
                a, b = first[at - 1], last[at - 1] if last[at - 1] < end else start
                for k in range(2):
                    p, q = vertices[a, k], vertices[b, k]
                    boxes[at - 1, 2 * k], boxes[at - 1, 2 * k + 1] = min(p, q), max(p, q)
            i += 1
    blocks.firsts[ring + n_rings] = at
    return at


@inline
def mark_blocks(rings: RingArrays, margin: float, blocks: Blocks, ring: int, dx: Any, dy: Any, stop: Any) -> None:
    """Fill the marks of all blocks of rings, the block that follows each, and make those active that must be.

    Active are chords, blocks that head no way, and those that may have a vertex where their ring does not turn, or one
    that the vertex before repeats. dx, dy: float64, scratch for `_AT_ONCE` edges and one.
    """
    vertices, offsets, n_rings = rings.vertices, rings.offsets, rings.offsets.shape[0] - 1
    first, last, marks = blocks.first, blocks.last, blocks.marks
    ex, ey = dx[1:], dy[1:]
    for i_ring in range(n_rings):
        start, end = offsets[i_ring], offsets[i_ring + 1]
        i, after = blocks.firsts[ring + i_ring], blocks.firsts[ring + i_ring + 1]
        begin = i
        while i < after:  # bound: each turn passes one block at least
            if stop[0]:
                return
            a, j = first[i], i + 1
            is_chord = marks[i] == CHORD
            while not is_chord and j < after and marks[j] != CHORD and last[j] - a <= _AT_ONCE:  # bound: as above
                j += 1
            b = last[j - 1]
            before, closing = a - 1 if a > start else end - 1, b if b < end else start
            if is_chord:
                ux, uy = vertices[closing, 0] - vertices[a, 0], vertices[closing, 1] - vertices[a, 1]
                marks[i] = CHORD | _way(ux > margin, ux < -margin, uy > margin, uy < -margin)
                blocks.is_active[i], blocks.following[i] = 1, i + 1
                i = j
                continue
            # direction 0 is that of the edge before, direction k + 1 that of edge a + k
            dx[0], dy[0] = vertices[a, 0] - vertices[before, 0], vertices[a, 1] - vertices[before, 1]
            part, ahead = vertices[a : b - 1], vertices[a + 1 : b]
            for k in range(b - 1 - a):
                ex[k], ey[k] = ahead[k, 0] - part[k, 0], ahead[k, 1] - part[k, 1]
            dx[b - a], dy[b - a] = vertices[closing, 0] - vertices[b - 1, 0], vertices[closing, 1] - vertices[b - 1, 1]
            for block in range(i, j):
                low, size = first[block] - a, last[block] - first[block]
                vx, vy, ux, uy = dx[low : low + size], dy[low : low + size], ex[low : low + size], ey[low : low + size]
                n_right = n_left = n_up = n_down = n_bent = 0
                for k in range(size):
                    n_right += ux[k] > margin
                    n_left += ux[k] < -margin
                    n_up += uy[k] > margin
                    n_down += uy[k] < -margin
                    left, right = vx[k] * uy[k], vy[k] * ux[k]
                    n_bent += abs(left - right) > _TURN_BOUND * abs(left) + GUARD_2D
                marks[block] = _way(n_right == size, n_left == size, n_up == size, n_down == size)
                blocks.is_active[block] = marks[block] == EVERYWHERE or n_bent < size
                blocks.following[block] = block + 1
            i = j
        if after > begin:
            blocks.following[after - 1] = begin


@inline
def _way(is_right: bool, is_left: bool, is_up: bool, is_down: bool) -> int:
    mark = 0 if is_right else NOT_RIGHT
    mark |= 0 if is_left else NOT_LEFT
    mark |= 0 if is_up else NOT_UP
    return mark | (0 if is_down else NOT_DOWN)
