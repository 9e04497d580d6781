"""Ear clipping of a polygon with holes, whose rings may touch each other: on floats, compiled, or on fractions.

Holes are joined to the shell by bridges, from the leftmost on. An ear is a left turn whose closed triangle holds no
other blunt corner, but such as lie at the same place as one of its corners; at the place of the tip no side may enter.

On floats nothing is decided for good. Turns within `slack` count as straight, so that corners along what was one edge
are joined to others across it, not to each other, and points within it of an ear as in it. Triangles that have the
rings as their boundary, all counter-clockwise or flat for the exact points, cover each point as often as the rings wind
around it: once inside, never outside. So the caller checks each triangle exactly, and calls again with fractions around
one that is turned, or for all where the ears run out.

Source: D. Eberly, Triangulation by ear clipping, 2002; Mapbox, earcut, 2015 (the bridge of a hole).
"""

from __future__ import annotations

from typing import Any

from engine.compiling.jit import kernel
from engine.types import BoolArray, FlagArray, IntArray

Numbers = Any
"""Coordinates: float64 (n,), or a list of fractions."""


@kernel
def bridge_of(x: Numbers, y: Numbers, before: IntArray, after: IntArray, start: int, hole: int) -> int:
    """Return a corner of the ring through `start` that is seen from `hole`, the leftmost corner of a hole in it; -1 if
    there is none. before, after: neighbours by corner."""
    hx, hy = x[hole], y[hole]
    best, qx = -1, hx
    p = start
    for _ in range(len(before)):  # bound: corners of the ring
        q = after[p]
        if x[p] == hx and y[p] == hy:
            best, qx = p, hx
            break
        if hy <= y[p] and hy >= y[q] and y[p] != y[q]:
            at = x[p] + (hy - y[p]) * (x[q] - x[p]) / (y[q] - y[p])
            if at <= hx and (best < 0 or at > qx):
                qx, best = at, p if x[p] < x[q] else q
        p = q
        if p == start:
            break
    if best < 0:
        return -1
    mx, my = x[best], y[best]
    low, high = (hx, qx) if hy < my else (qx, hx)
    rise, run, has_tangent = hy - hy, hx - hx, False
    p = stop = best
    for _ in range(len(before)):
        px, py = x[p], y[p]
        is_at_hole = px == hx and py == hy
        is_within = is_at_hole or (
            hx > px and px >= mx
            and (high - px) * (hy - py) >= (low - px) * (hy - py)
            and (low - px) * (my - py) >= (mx - px) * (hy - py)
            and (mx - px) * (hy - py) >= (high - px) * (my - py)
        )  # fmt: skip
        if is_within:
            a, c = before[p], after[p]
            turn = (px - x[a]) * (y[c] - py) - (py - y[a]) * (x[c] - px)
            to_next = (hx - px) * (y[c] - hy) - (hy - py) * (x[c] - hx)
            to_last = (x[a] - px) * (hy - y[a]) - (y[a] - py) * (hx - x[a])
            if turn > 0:
                is_seen = to_next <= 0 and to_last <= 0
            else:
                is_seen = (hx - px) * (y[a] - hy) - (hy - py) * (x[a] - hx) > 0 or (
                    (x[c] - px) * (hy - y[c]) - (y[c] - py) * (hx - x[c]) > 0
                )
            if is_at_hole:  # case: other holes touch there, and were joined
                while a != p and x[a] == px and y[a] == py:  # bound: corners of the ring
                    a = before[a]
                while c != p and x[c] == px and y[c] == py:  # bound: corners of the ring
                    c = after[c]
                ux, uy, wx, wy = x[c] - px, y[c] - py, x[a] - px, y[a] - py
                is_seen, is_convex = False, ux * wy - uy * wx > 0
                for q in (after[hole], before[hole]):  # is one strictly between, counter-clockwise from u to w?
                    is_left = ux * (y[q] - py) - uy * (x[q] - px) > 0
                    is_right = (x[q] - px) * wy - (y[q] - py) * wx > 0
                    is_seen = is_seen or (is_left and is_right) or (not is_convex and (is_left or is_right))
            climb, length = abs(hy - py), hx - px
            gain = rise * length - climb * run
            if is_seen and (not has_tangent or gain > 0 or (gain == 0 and px > x[best])):
                best, rise, run, has_tangent = p, climb, length, True
        p = after[p]
        if p == stop:
            break
    return best


@kernel
def clip_ears(
    x: Numbers, y: Numbers, before: IntArray, after: IntArray, start: int, size: int, blunt: IntArray,
    is_blunt: BoolArray, slack: Any, ears: IntArray, flag: FlagArray,
) -> int:  # fmt: skip
    """Write the triangles of the ring through `start`, of `size` corners, to ears (size - 2, 3); return how many.
    blunt, is_blunt: scratch, by corner. before, after: neighbours by corner, changed. slack: a bound on the error of
    turns, 0 for fractions."""
    n_ears, n_blunt, p = 0, 0, start
    for _ in range(size):
        a, c = before[p], after[p]
        is_blunt[p] = (x[p] - x[a]) * (y[c] - y[a]) - (y[p] - y[a]) * (x[c] - x[a]) <= slack
        if is_blunt[p]:
            blunt[n_blunt] = p
            n_blunt += 1
        p = c
    n_missed = 0
    while size - n_ears > 2 and n_missed <= 2 * (size - n_ears):  # bound: an ear, or a miss more
        if flag[0] != 0:
            return n_ears
        a, c = before[p], after[p]
        ax, ay, bx, by, cx, cy = x[a], y[a], x[p], y[p], x[c], y[c]
        turn = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        is_left, is_forced = turn > slack, n_missed > size - n_ears
        is_ear = is_left or (turn >= -slack and is_forced) or size - n_ears == 3
        low_x, high_x, low_y, high_y = min(ax, bx, cx), max(ax, bx, cx), min(ay, by, cy), max(ay, by, cy)
        place, n_left = 0, 0
        while is_left and is_ear and place < n_blunt:
            k = blunt[place]
            place += 1
            if not is_blunt[k]:
                continue
            blunt[n_left] = k
            n_left += 1
            kx, ky = x[k], y[k]
            if kx < low_x or kx > high_x or ky < low_y or ky > high_y or k in (a, c):
                continue
            if (kx == ax and ky == ay) or (kx == cx and ky == cy):
                continue
            sides = (
                (bx - ax) * (ky - ay) - (by - ay) * (kx - ax),
                (cx - bx) * (ky - by) - (cy - by) * (kx - bx),
                (ax - cx) * (ky - cy) - (ay - cy) * (kx - cx),
            )
            if min(sides) < -slack:
                continue
            is_ear, n_between = kx == bx and ky == by, 0
            for q in (before[k], after[k]):
                first = (bx - ax) * (y[q] - ay) - (by - ay) * (x[q] - ax)
                second = (cx - bx) * (y[q] - by) - (cy - by) * (x[q] - bx)
                n_between += 2 if min(first, second) > slack else 1 if min(first, second) >= -slack else 0
            is_ear = is_ear and n_between < 2  # case: a side enters there, or both lie along the ear
        while place < n_blunt and n_left < place:
            blunt[n_left] = blunt[place]
            n_left, place = n_left + 1, place + 1
        n_blunt = n_left if n_left < place else n_blunt
        if size - n_ears == 4 and is_ear:  # the other triangle is not turned either
            d = after[c]
            is_ear = (cx - ax) * (y[d] - ay) - (cy - ay) * (x[d] - ax) >= (-slack if is_forced else slack)
        n_missed += 1
        if is_ear:
            ears[n_ears, 0], ears[n_ears, 1], ears[n_ears, 2] = a, p, c
            n_ears, n_missed, is_blunt[p] = n_ears + 1, 0, False
            after[a], before[c] = c, a
            for q in (a, c):
                i, j = before[q], after[q]
                if is_blunt[q]:
                    is_blunt[q] = (x[q] - x[i]) * (y[j] - y[i]) - (y[q] - y[i]) * (x[j] - x[i]) <= slack
            c = after[c]
        p = c
    return n_ears
