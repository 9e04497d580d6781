"""Whether a ring of the plane is simple, and its ears in the order of `ear_cutting.py`: every sign exact, n^2 at most.

A ring is simple if it turns back at no corner and no two sides meet that share no corner: all pairs are compared, most
of them by their boxes.

Always the ear of the lowest number is cut. A corner is blunt (no left turn: it may become one, never the other way
round), or blocked (a blunt corner lies in its closed triangle), or the tip of an ear. Blunt corners are enough: of the
corners in a triangle the one nearest the tip has an inner angle of 180 degrees or more. While the triangle of a corner
stays the same, what does not block it never will, so that the search for a blocker goes on where it stopped; a cut
changes two triangles.

Signs that the compiled predicate leaves open (UNDECIDED: coordinates of one axis more than 2^985 apart) are asked for:
the three corners are left in `Ring.wanted`, the caller settles them and begins again.

Source: G. H. Meisters, Polygons have ears, 1975.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from engine.arrays import FlagArray, IntArray
from engine.jit import inline, kernel
from engine.predicates.orientation import orient2d
from engine.types import UNDECIDED, Point2

SIMPLE, TURNS_BACK, MEETS, ENDED_EARLY = 0, 1, 2, 3


class Ring(NamedTuple):
    """Corners x, y (n,); signs of turns that were settled before, rows corner, corner, corner, sign of (k, 4); and room
    for the three corners of a turn that is to be settled, after a 1 where there is one."""

    x: Any
    y: Any
    settled: Any
    wanted: Any


class Corners(NamedTuple):
    """Rows (n,) that `cut_ears` works in: the corners before and after one that is not cut, whether it is blunt, which
    blunt corner blocks it, -1 for none, and how many of `blunt`, those that were blunt at first, it was compared with.
    """

    before: Any
    after: Any
    is_blunt: Any
    blocker: Any
    n_passed: Any
    blunt: Any


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


@inline
def _is_before(ring: Ring, i: int, j: int) -> bool:
    """Tell whether corner i is before corner j by x, then y, then number."""
    x, y = ring.x, ring.y
    return x[i] < x[j] or (x[i] == x[j] and (y[i] < y[j] or (y[i] == y[j] and i < j)))


@inline
def _are_apart(a: float, b: float, c: float, d: float) -> bool:
    """Tell whether the intervals between a and b, and between c and d, have nothing in common."""
    return max(a, b) < min(c, d) or max(c, d) < min(a, b)


@kernel
def find_meeting(ring: Ring, found: IntArray, flag: FlagArray) -> int:
    """Return whether the ring is SIMPLE, or what was found: TURNS_BACK at corner found[0], or side found[0] MEETS side
    found[1]; ENDED_EARLY where the flag is set or a turn is wanted. Side i goes from corner i to the next one."""
    x, y, n = ring.x, ring.y, ring.x.shape[0]
    for i in range(n):
        before, after = (i - 1) % n, (i + 1) % n
        is_back = _is_before(ring, i, after) == _is_before(ring, i, before) and turn(ring, before, i, after) == 0
        if is_back or (x[i] == x[after] and y[i] == y[after]):
            found[0] = i
            return ENDED_EARLY if ring.wanted[0] != 0 else TURNS_BACK
    for i in range(n - 2):
        if flag[0] != 0:
            return ENDED_EARLY
        for k in range(i + 2, n - 1 if i == 0 else n):
            j, m = i + 1, (k + 1) % n
            if _are_apart(x[i], x[j], x[k], x[m]) or _are_apart(y[i], y[j], y[k], y[m]):
                continue
            # of sides on one line all turns are 0: they meet, as their boxes do
            if turn(ring, i, j, k) * turn(ring, i, j, m) <= 0 and turn(ring, k, m, i) * turn(ring, k, m, j) <= 0:
                found[0], found[1] = i, k
                return ENDED_EARLY if ring.wanted[0] != 0 else MEETS
    return SIMPLE


@kernel
def cut_ears(ring: Ring, corners: Corners, ears: IntArray, flag: FlagArray) -> int:
    """Fill ears (n - 2, 3): corner before, tip, corner after; return how many were cut, fewer than n - 2 where the flag
    is set or a turn is wanted. ring: simple, counter-clockwise."""
    before, after, is_blunt, n, n_blunt = corners.before, corners.after, corners.is_blunt, ring.x.shape[0], 0
    for i in range(n):
        before[i], after[i] = (i - 1) % n, (i + 1) % n
        corners.n_passed[i], corners.blocker[i] = 0, -1
        is_blunt[i] = turn(ring, before[i], i, after[i]) <= 0
        if is_blunt[i] != 0:
            corners.blunt[n_blunt] = i
            n_blunt += 1
    for n_ears in range(n - 2):
        tip = 0
        while tip < n and (before[tip] < 0 or is_blunt[tip] != 0 or _is_blocked(ring, corners, tip, n_blunt)):
            tip += 1
            if flag[0] != 0:
                return n_ears
        if tip == n or ring.wanted[0] != 0 or flag[0] != 0:
            return n_ears
        left, right = before[tip], after[tip]
        ears[n_ears, 0], ears[n_ears, 1], ears[n_ears, 2] = left, tip, right
        after[left], before[right], before[tip] = right, left, -1
        for corner in (left, right):
            corners.n_passed[corner], corners.blocker[corner] = 0, -1
            is_blunt[corner] = is_blunt[corner] != 0 and turn(ring, before[corner], corner, after[corner]) <= 0
    return n - 2


@inline
def _is_blocked(ring: Ring, corners: Corners, tip: int, n_blunt: int) -> bool:
    """Tell whether a blunt corner lies in the closed triangle of a left turn: go on where the last search ended.

    No blunt corner is ever cut, so that none of them is gone.
    """
    left, right, x, y = corners.before[tip], corners.after[tip], ring.x, ring.y
    if corners.blocker[tip] >= 0 and corners.is_blunt[corners.blocker[tip]] != 0:
        return True
    x_low, x_high = min(x[left], x[tip], x[right]), max(x[left], x[tip], x[right])
    y_low, y_high = min(y[left], y[tip], y[right]), max(y[left], y[tip], y[right])
    for place in range(corners.n_passed[tip], n_blunt):
        p = corners.blunt[place]
        if corners.is_blunt[p] == 0 or x[p] < x_low or x[p] > x_high or y[p] < y_low or y[p] > y_high:
            continue
        if p != left and p != right and turn(ring, left, tip, p) >= 0 and turn(ring, tip, right, p) >= 0:
            if turn(ring, right, left, p) >= 0:
                corners.n_passed[tip], corners.blocker[tip] = place + 1, p
                return True
    corners.n_passed[tip] = n_blunt
    return False
