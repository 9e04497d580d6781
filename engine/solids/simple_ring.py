"""Is a ring of the plane simple? One sweep over its vertices, every sign exact.

The sides that cross the line through the vertex looked at stand in order from below to above. Where a vertex is passed
the sides that end there leave and those that start there come in; two sides are compared when they become neighbours:

        |    /         Of all common points of two sides that share no corner take the first along the sweep, and there
      --+---*--        two sides that no other parts: they were neighbours before, or one of them begins there, on the
        |    \\         other. So a ring that is not simple is found, whichever pair is named, and no other is.

Vertices are passed by x, then y, which makes a vertical side one that goes up. The order is kept in blocks of at most
`WIDTH` sides, so that a side comes in or leaves for the move of some of them.

Signs that the compiled predicate leaves open (UNDECIDED: coordinates of one axis more than 2^985 apart) are asked for:
the three corners are left in `Ring.wanted`, the caller settles them and begins anew.

Source: M. I. Shamos, D. Hoey, Geometric intersection problems, 1976. Changed: exact signs, every degenerate case.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import IntArray
from engine.jit import inline, kernel
from engine.predicates.orientation import orient2d
from engine.types import UNDECIDED, Point2

WIDTH: Final = 64
SIMPLE, TURNS_BACK, MEETS, ENDED_EARLY = 0, 1, 2, 3


class Ring(NamedTuple):
    """Corners x, y (n,); signs of turns that were settled before, rows corner, corner, corner, sign of (k, 4); and room
    for the three corners of a turn that is to be settled, after a 1 where there is one."""

    x: Any
    y: Any
    settled: Any
    wanted: Any


class Blocks(NamedTuple):
    """Sides from below to above: those of block ``order[b]`` are ``sides[order[b], : counts[order[b]]]``.

    used: how many blocks stand in `order`, and how many were ever begun.
    """

    sides: Any
    counts: Any
    order: Any
    used: Any


@inline
def turn(ring: Ring, i: int, j: int, k: int) -> int:
    """Return the sign of the turn at corner j on the way i, j, k; 0, and the turn in `wanted`, if it is not known."""
    x, y = ring.x, ring.y
    side = orient2d(Point2(x[i], y[i]), Point2(x[j], y[j]), Point2(x[k], y[k]))
    if side != UNDECIDED:
        return side
    for row in range(ring.settled.shape[0]):
        if ring.settled[row, 0] == i and ring.settled[row, 1] == j and ring.settled[row, 2] == k:
            return int(ring.settled[row, 3])
    ring.wanted[0], ring.wanted[1], ring.wanted[2], ring.wanted[3] = 1, i, j, k
    return 0


def room_for(n: int) -> tuple[IntArray, Blocks]:
    """Return what `find_meeting` works in for n corners: a block is begun for every WIDTH / 2 sides that come in."""
    n_blocks = 2 * n // WIDTH + 2
    sides, order = np.empty((n_blocks, WIDTH), np.int64), np.zeros(n_blocks, np.int64)
    return np.empty((2, n), np.int64), Blocks(sides, np.zeros_like(order), order, np.zeros(2, np.int64))


@kernel
def find_meeting(ring: Ring, sorted_corners: Any, rank: Any, ends: Any, blocks: Blocks, found: Any, flag: Any) -> int:
    """Return whether the ring is SIMPLE, or what was found: TURNS_BACK at corner found[0], or side found[0] MEETS side
    found[1]; ENDED_EARLY where the flag is set or a turn is wanted.

    sorted_corners (n,): by x, then y; rank (n,): the place of each among them. ends (2, n), blocks: `room_for`. Side i
    goes from corner i to the next one.
    """
    x, y, n = ring.x, ring.y, ring.x.shape[0]
    for i in range(n):
        before, after = (i - 1) % n, (i + 1) % n
        is_up = rank[i] < rank[after]
        ends[0, i], ends[1, i] = (i, after) if is_up else (after, i)
        stands = x[i] == x[after] and y[i] == y[after]
        if stands or (is_up == (rank[i] < rank[before]) and turn(ring, before, i, after) == 0):
            found[0] = i
            return ENDED_EARLY if ring.wanted[0] != 0 else TURNS_BACK
    for place in range(n):
        corner = sorted_corners[place]
        if flag[0] != 0 or ring.wanted[0] != 0:
            return ENDED_EARLY
        if place > 0:
            last = sorted_corners[place - 1]
            if x[last] == x[corner] and y[last] == y[corner]:
                found[0], found[1] = min(last, corner), max(last, corner)
                return MEETS
        if _pass_corner(ring, blocks, corner, rank, ends, found):
            return ENDED_EARLY if ring.wanted[0] != 0 else MEETS
    return SIMPLE


@inline
def _pass_corner(ring: Ring, blocks: Blocks, corner: int, rank: Any, ends: Any, found: Any) -> bool:
    """Take out the sides that end at a corner and put in those that start there; tell whether two sides meet."""
    n = ring.x.shape[0]
    first, second = (corner - 1) % n, corner
    n_ended = int(ends[1, first] == corner) + int(ends[1, second] == corner)
    b, i = _find(ring, blocks, corner, ends)
    for _ in range(n_ended):
        side = _side_at(blocks, b, i)
        if side != first and side != second:  # case: another side through the corner
            found[0], found[1] = first if ends[1, first] == corner else second, side
            return True
        b, i = _remove(blocks, b, i)
    above, below = _side_at(blocks, b, i), _side_before(blocks, b, i)
    if n_ended == 2:
        return _meet(ring, below, above, rank, ends, found)
    if n_ended == 1:
        if ends[1, first] != corner:
            first, second = second, first  # `second` starts here
        _insert(blocks, b, i, second)
        first = second
    else:
        if above >= 0 and turn(ring, ends[0, above], ends[1, above], corner) == 0:
            found[0], found[1] = second, above
            return True
        if turn(ring, corner, ends[1, first], ends[1, second]) < 0:
            first, second = second, first
        b, i = _insert(blocks, b, i, first)
        _insert(blocks, b, i + 1, second)
    return _meet(ring, below, first, rank, ends, found) or _meet(ring, second, above, rank, ends, found)


@inline
def _meet(ring: Ring, e: int, f: int, rank: Any, ends: Any, found: Any) -> bool:
    """Tell whether two sides have a common point; those that share a corner count as apart: they were looked at."""
    n = ring.x.shape[0]
    if e < 0 or f < 0 or (e + 1) % n == f or (f + 1) % n == e:
        return False
    found[0], found[1] = min(e, f), max(e, f)
    a, b, c, d = ends[0, e], ends[1, e], ends[0, f], ends[1, f]
    abc, abd = turn(ring, a, b, c), turn(ring, a, b, d)
    cda, cdb = turn(ring, c, d, a), turn(ring, c, d, b)
    if abc == 0 and abd == 0:  # on one line
        return rank[a] <= rank[d] and rank[c] <= rank[b]
    return abc * abd <= 0 and cda * cdb <= 0


@inline
def _find(ring: Ring, blocks: Blocks, corner: int, ends: Any) -> tuple[int, int]:
    """Return the place, block and number in it, of the first side that the corner is not above."""
    low, high = -1, blocks.used[0]  # invariant: the corner is above the first side of block `low`
    while high - low > 1:
        middle = (low + high) // 2
        side = blocks.sides[blocks.order[middle], 0]
        if turn(ring, ends[0, side], ends[1, side], corner) > 0:
            low = middle
        else:
            high = middle
    if low < 0:
        return 0, 0
    block = blocks.order[low]
    start, end = 0, blocks.counts[block]
    while end - start > 1:
        middle = (start + end) // 2
        side = blocks.sides[block, middle]
        if turn(ring, ends[0, side], ends[1, side], corner) > 0:
            start = middle
        else:
            end = middle
    return (low, end) if end < blocks.counts[block] else (low + 1, 0)


@inline
def _side_at(blocks: Blocks, b: int, i: int) -> int:
    """Return the side at a place, -1 above the last one."""
    return blocks.sides[blocks.order[b], i] if b < blocks.used[0] else -1


@inline
def _side_before(blocks: Blocks, b: int, i: int) -> int:
    """Return the side below a place, -1 below the first one."""
    if i > 0:
        return blocks.sides[blocks.order[b], i - 1]
    return blocks.sides[blocks.order[b - 1], blocks.counts[blocks.order[b - 1]] - 1] if b > 0 else -1


@inline
def _insert(blocks: Blocks, b: int, i: int, side: int) -> tuple[int, int]:
    """Put a side before the one at a place; return where it stands."""
    sides, counts, order, used = blocks.sides, blocks.counts, blocks.order, blocks.used
    n_blocks = used[0]
    if b == n_blocks:
        if n_blocks == 0:
            order[0] = used[1]
            counts[order[0]], used[0], used[1] = 0, 1, used[1] + 1
            b, i = 0, 0
        else:
            b = n_blocks - 1
            i = counts[order[b]]
    block = order[b]
    if counts[block] == WIDTH:
        half, new = WIDTH // 2, used[1]
        for k in range(n_blocks, b + 1, -1):
            order[k] = order[k - 1]
        order[b + 1] = new
        used[0], used[1] = n_blocks + 1, new + 1
        for k in range(half):
            sides[new, k] = sides[block, half + k]
        counts[block], counts[new] = half, WIDTH - half
        if i > half:
            b, i, block = b + 1, i - half, new
    for k in range(counts[block], i, -1):
        sides[block, k] = sides[block, k - 1]
    sides[block, i] = side
    counts[block] += 1
    return b, i


@inline
def _remove(blocks: Blocks, b: int, i: int) -> tuple[int, int]:
    """Take out the side at a place; return the place of the one above it."""
    sides, counts, order, used = blocks.sides, blocks.counts, blocks.order, blocks.used
    block, n_blocks = order[b], used[0]
    counts[block] -= 1
    for k in range(i, counts[block]):
        sides[block, k] = sides[block, k + 1]
    if counts[block] == 0:
        for k in range(b, n_blocks - 1):
            order[k] = order[k + 1]
        used[0] = n_blocks - 1
    elif i == counts[block]:
        return b + 1, 0
    return b, i
