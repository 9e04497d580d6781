"""Cuts the ears of a simple ring in the order of `ear_cutting.py`, compiled: n log n for the rings that occur.

Always the ear of the lowest number is cut. A corner is waiting for a look, or blunt (no left turn: it may become one,
never the other way round), or blocked: a blunt corner lies in its closed triangle. It waits again when its triangle
changes, or when its blocker is blunt no more. No other corner is an ear, and the first that waits and is not blocked
is the first ear.

Which of the corners in a triangle is named as its blocker does not change what is cut, only how often is looked: each
has a random number, and the one with the highest blocks. While a triangle stays the same its corners leave in an order
that knows nothing of these numbers, so that the highest changes some log n times, and all looks are n log n on average.

The blunt corners stand in a tree of boxes over the order of Morton of their ranks in x and y, with the highest number
below each node. The boxes stand along the ring's longest direction: a triangle along a row of corners, as the back of
a comb is, would else reach into all of their boxes.

**margin.** Along that direction a corner is off by 2^-51 of its coordinates' sum at most; `margin` is twice the
largest, boxes are grown by it. With its ends off by a margin each, the product of a side d and the step e from its
start to a corner of a box is off by less than 4 margin (|d| + |e|); twice that, and what the product itself loses, is
asked for.

Source: G. H. Meisters, Polygons have ears, 1975; C. Aragon, R. Seidel, Randomized search trees, 1989 (numbers drawn
once); G. M. Morton, A computer oriented geodetic data base, 1966.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.jit import inline, kernel
from engine.solids.simple_ring import Ring, turn
from engine.types import Point2

_DEPTH = 64  # of the stack: two for each level of a tree with fewer than 2^31 leaves


class Tree(NamedTuple):
    """Nodes 1 .. 2 half - 1, the children of k are 2 k and 2 k + 1, leaves from half on.

    frame (3,): cosine and sine of the direction of the boxes, margin. boxes (2 half, 4): xmin, ymin, xmax, ymax. best
    (2 half,): the highest number of a blunt corner below, -1 for none. corners (half,): of each leaf. leaves (n,): of
    each corner. waiting (2 half,): whether a corner below waits, by the number of the corner. stack: for a walk.
    """

    frame: Any
    boxes: Any
    best: Any
    corners: Any
    leaves: Any
    waiting: Any
    stack: Any


class Links(NamedTuple):
    """The blocked corners of each blocker: first, and of each the next and the one before; -1 where there is none."""

    first: Any
    after: Any
    before: Any
    blocker: Any


def room_for(points: FloatArray, curve: IntArray) -> tuple[Tree, Links]:
    """Return what `cut_ears` works in; points (n, 2); curve (n,): the corners along a curve that fills the plane."""
    n = len(curve)
    half = 1 << (n - 1).bit_length()
    boxes, corners, leaves = np.empty((2 * half, 4)), np.zeros(half, np.int64), np.empty(n, np.int64)
    boxes[:, :2], boxes[:, 2:] = np.inf, -np.inf
    corners[:n] = curve
    leaves[curve] = half + np.arange(n)
    with np.errstate(all="ignore"):  # what overflows leaves no box out
        middle = points - points.mean(axis=0)
        x, y = (middle / np.abs(middle).max()).T
        angle = 0.5 * np.arctan2(2.0 * (x * y).sum(), (x * x - y * y).sum())
        margin = 2.0**-50 * np.abs(points).sum(axis=1).max() + 2.0**-1070
    frame = np.array([np.cos(angle), np.sin(angle), margin])
    best, waiting, stack = np.full(2 * half, -1), np.zeros(2 * half, np.bool_), np.empty(_DEPTH, np.int64)
    tree = Tree(frame, boxes, best, corners, leaves, waiting, stack)
    return tree, Links(*np.full((4, n), -1))


@kernel
def cut_ears(ring: Ring, tree: Tree, links: Links, numbers: Any, neighbours: Any, ears: Any, flag: Any) -> int:
    """Fill ears (n - 2, 3): corner before, tip, corner after; return how many were cut, fewer than n - 2 where the flag
    is set or a turn is wanted.

    ring: simple, counter-clockwise. tree, links: `room_for`. numbers (n,): a random permutation. neighbours (3, n):
    room for the corner before, the corner after, and whether it is blunt.
    """
    n = ring.x.shape[0]
    before, after, is_blunt = neighbours[0], neighbours[1], neighbours[2]
    for i in range(n):
        before[i], after[i] = (i - 1) % n, (i + 1) % n
        is_blunt[i] = turn(ring, before[i], i, after[i]) <= 0
    _plant(ring, tree, numbers, is_blunt)
    n_ears, first = 0, 0
    while n_ears < n - 3:  # bound: see above; each turn takes a corner off the waiting ones
        if flag[0] != 0 or ring.wanted[0] != 0 or not tree.waiting[1]:
            return n_ears
        tip = _first_waiting(tree)
        _set_waiting(tree, tip, False)
        _unlink(links, tip)
        left, right = before[tip], after[tip]
        blocker = _blocker(ring, tree, left, tip, right)
        if blocker >= 0:
            _link(links, tip, blocker)
            continue
        ears[n_ears, 0], ears[n_ears, 1], ears[n_ears, 2] = left, tip, right
        n_ears += 1
        after[left], before[right] = right, left
        before[tip] = -1
        for corner in (left, right):
            if is_blunt[corner] != 0 and turn(ring, before[corner], corner, after[corner]) > 0:
                is_blunt[corner] = 0
                _forget(tree, corner)
                while links.first[corner] >= 0:  # bound: each turn unlinks one
                    blocked = links.first[corner]
                    _unlink(links, blocked)
                    _set_waiting(tree, blocked, True)
            if is_blunt[corner] == 0:
                _set_waiting(tree, corner, True)
    while before[first] < 0:
        first += 1
    ears[n_ears, 0], ears[n_ears, 1], ears[n_ears, 2] = before[first], first, after[first]
    return n_ears + 1


@inline
def _plant(ring: Ring, tree: Tree, numbers: Any, is_blunt: Any) -> None:
    """Put the blunt corners into the tree, and have the others wait."""
    boxes, best, waiting, half = tree.boxes, tree.best, tree.waiting, tree.corners.shape[0]
    for corner in range(ring.x.shape[0]):
        leaf = tree.leaves[corner]
        waiting[half + corner] = is_blunt[corner] == 0
        if is_blunt[corner] != 0:
            best[leaf] = numbers[corner]
            p, margin = _turned(ring, tree, corner), tree.frame[2]
            boxes[leaf, 0], boxes[leaf, 2] = p.x - margin, p.x + margin
            boxes[leaf, 1], boxes[leaf, 3] = p.y - margin, p.y + margin
    for node in range(half - 1, 0, -1):
        a, b = 2 * node, 2 * node + 1
        best[node] = max(best[a], best[b])
        waiting[node] = waiting[a] or waiting[b]
        for k in range(2):
            boxes[node, k], boxes[node, 2 + k] = min(boxes[a, k], boxes[b, k]), max(boxes[a, 2 + k], boxes[b, 2 + k])


@inline
def _first_waiting(tree: Tree) -> int:
    """Return the lowest corner that waits; caller guarantees that there is one."""
    node, half = 1, tree.corners.shape[0]
    while node < half:
        node = 2 * node if tree.waiting[2 * node] else 2 * node + 1
    return node - half


@inline
def _set_waiting(tree: Tree, corner: int, is_waiting: bool) -> None:
    node = tree.corners.shape[0] + corner
    tree.waiting[node] = is_waiting
    while node > 1:
        node //= 2
        tree.waiting[node] = tree.waiting[2 * node] or tree.waiting[2 * node + 1]


@inline
def _forget(tree: Tree, corner: int) -> None:
    """Take a corner that is blunt no more out of the tree."""
    node = tree.leaves[corner]
    tree.best[node] = -1
    while node > 1:
        node //= 2
        tree.best[node] = max(tree.best[2 * node], tree.best[2 * node + 1])


@inline
def _blocker(ring: Ring, tree: Tree, left: int, tip: int, right: int) -> int:
    """Return the blunt corner with the highest number in the closed triangle of a left turn, -1 if there is none.

    Blunt corners are enough: of the corners in the triangle the one nearest the tip has an inner angle of 180 degrees
    or more. No blunt corner is ever cut, so that none of them is gone.
    """
    best, half = tree.best, tree.corners.shape[0]
    a, b, c = _turned(ring, tree, left), _turned(ring, tree, tip), _turned(ring, tree, right)
    stack = tree.stack
    stack[0] = 1
    n_stack, found, highest = 1, -1, -1
    while n_stack > 0:  # bound: each turn takes a node off, and each node enters once
        n_stack -= 1
        node = stack[n_stack]
        if best[node] <= highest or _is_beside(tree, node, a, b, c):
            continue
        if node >= half:
            p = tree.corners[node - half]
            if p != left and p != right:
                if turn(ring, left, tip, p) >= 0 and turn(ring, tip, right, p) >= 0 and turn(ring, right, left, p) >= 0:
                    found, highest = p, best[node]
            continue
        near = 2 * node + (1 if best[2 * node + 1] > best[2 * node] else 0)
        stack[n_stack], stack[n_stack + 1] = near ^ 1, near
        n_stack += 2
    return found


@inline
def _turned(ring: Ring, tree: Tree, corner: int) -> Point2:
    """Return a corner along the direction of the boxes, rounded."""
    cosine, sine, x, y = tree.frame[0], tree.frame[1], ring.x[corner], ring.y[corner]
    return Point2(cosine * x + sine * y, cosine * y - sine * x)


@inline
def _is_beside(tree: Tree, node: int, a: Point2, b: Point2, c: Point2) -> bool:
    """Tell whether a box surely has no point in common with a triangle of positive area."""
    margin, box = tree.frame[2], tree.boxes[node]
    if box[0] > max(a.x, b.x, c.x) + margin or box[2] < min(a.x, b.x, c.x) - margin:
        return True
    if box[1] > max(a.y, b.y, c.y) + margin or box[3] < min(a.y, b.y, c.y) - margin:
        return True
    for start, end in ((a, b), (b, c), (c, a)):
        dx, dy = end.x - start.x, end.y - start.y
        ex, ey = (box[2] if dy < 0.0 else box[0]) - start.x, (box[3] if dx > 0.0 else box[1]) - start.y
        left, right = dx * ey, dy * ex
        loss = 8.0 * margin * (abs(dx) + abs(dy) + abs(ex) + abs(ey)) + 2.0**-50 * (abs(left) + abs(right))
        if right - left > loss + 2.0**-1000:
            return True
    return False


@inline
def _link(links: Links, tip: int, blocker: int) -> None:
    links.blocker[tip], links.before[tip], links.after[tip] = blocker, -1, links.first[blocker]
    if links.first[blocker] >= 0:
        links.before[links.first[blocker]] = tip
    links.first[blocker] = tip


@inline
def _unlink(links: Links, tip: int) -> None:
    """Take a corner out of the list of its blocker, if it has one."""
    if links.blocker[tip] < 0:
        return
    if links.before[tip] >= 0:
        links.after[links.before[tip]] = links.after[tip]
    else:
        links.first[links.blocker[tip]] = links.after[tip]
    if links.after[tip] >= 0:
        links.before[links.after[tip]] = links.before[tip]
    links.blocker[tip] = -1
