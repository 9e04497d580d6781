"""The intersection of two convex polygons: one walk along x for the crossings, one around the result.

    upper  ,-----.        An edge can meet another only where both have the same x: the edges of a lower and an upper
          /       \\       chain of each polygon, walked from left to right two by two, are n + m pairs for each of four
    lower '-------'       pairs of chains. Each edge enters the other polygon once at most, and leaves it once.

Only what floating point decides for sure is settled here: strictly convex rings, proper crossings of edges whose
vertices have different x. Everything else goes the general way, with the same result. Rounded, the ring is valid if it
is strictly convex still, which is looked at.

Source: M. I. Shamos and D. Hoey, Geometric intersection problems, 1976, section 3.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrangement.crossing_signs import Edges
from engine.arrangement.edge_contacts import POLL
from engine.arrangement.edge_crossings import turns
from engine.arrangement.rounded_crossings import round_crossing
from engine.clipping.cut_point import is_safe
from engine.jit import inline, merged
from engine.predicates.orientation import BOUND_2D, GUARD_2D

UNSETTLED: Final = -1
"""Goes the general way."""
_NONE: Final = -1


class Passages(NamedTuple):
    """By edge: the edge of the other polygon at which it enters that, and leaves it, or none."""

    enters: Any
    leaves: Any


@merged
def _surely_left(x: Any, y: Any, a: int, b: int, c: int) -> int:
    """Return the sign of the turn a, b, c where floating point is sure of it, else 0."""
    left, right = (x[b] - x[a]) * (y[c] - y[a]), (y[b] - y[a]) * (x[c] - x[a])
    turn, bound = left - right, BOUND_2D * (abs(left) + abs(right)) + GUARD_2D
    return 1 if turn > bound else -1 if turn < -bound else 0


@inline
def load_convex(
    vertices: Any, first: int, last: int, base: int, edges: Edges, origins: Any, n: int, stop: Any
) -> tuple[int, int, int]:
    """Append a strictly convex ring, counter-clockwise from its first vertex in the order of x, then y.

    Returns the number of vertices then, or UNSETTLED, the last vertex in that order, and 1 or -1, along or against the
    ring as given.
    """
    size = last - first
    low = first
    for k in range(first + 1, last):
        if vertices[k, 0] < vertices[low, 0] or (
            vertices[k, 0] == vertices[low, 0] and vertices[k, 1] < vertices[low, 1]
        ):
            low = k
    after, before = (low + 1 if low + 1 < last else first), (low - 1 if low > first else last - 1)
    ux, uy = vertices[after, 0] - vertices[low, 0], vertices[after, 1] - vertices[low, 1]
    wx, wy = vertices[before, 0] - vertices[low, 0], vertices[before, 1] - vertices[low, 1]
    step = 1 if ux * wy - uy * wx > 0.0 else -1  # a guess: the turns below must all be to the left
    x, y = edges.x, edges.y
    k, top, falls = low, n, False
    for i in range(n, n + size):
        px, py = vertices[k, 0], vertices[k, 1]
        if not (is_safe(px) and is_safe(py)) or (i & POLL == 0 and stop[0]):
            return UNSETTLED, top, step
        x[i], y[i], origins[i], edges.after[i] = px, py, base + k, i + 1
        if i > n + 1 and _surely_left(x, y, i - 2, i - 1, i) <= 0:
            return UNSETTLED, top, step
        if i > n:
            rises = px > x[i - 1] or (px == x[i - 1] and py > y[i - 1])
            if rises:
                if falls:
                    return UNSETTLED, top, step  # a ring that turns more than once
                top = i
            else:
                falls = True
        k += step
        if k == last:
            k = first
        elif k < first:
            k = last - 1
    end = n + size
    edges.after[end - 1] = n
    if size < 3 or _surely_left(x, y, end - 2, end - 1, n) <= 0 or _surely_left(x, y, end - 1, n, n + 1) <= 0:
        return UNSETTLED, top, step
    return end, top, step


@inline
def _find_passages(
    edges: Edges,
    i: int,
    i_end: int,
    i_step: int,
    j: int,
    j_end: int,
    j_step: int,
    passages: Passages,
    stop: Any,
) -> int:
    """Enter the crossings of two chains, walked from left to right; return how many, or UNSETTLED.

    i, j: the leftmost edge of each; a lower chain goes up by steps of 1, an upper one down by -1.
    """
    x, y, after = edges.x, edges.y, edges.after
    n_found = 0
    while i != i_end and j != j_end:  # bound: each turn ends an edge of one chain
        if (i + j) & POLL == 0 and stop[0]:
            return UNSETTLED
        b, d = after[i], after[j]
        x_low, x_high = (x[i], x[b]) if i_step > 0 else (x[b], x[i])
        u_low, u_high = (x[j], x[d]) if j_step > 0 else (x[d], x[j])
        if (
            x_low <= u_high
            and u_low <= x_high
            and min(y[i], y[b]) <= max(y[j], y[d])
            and min(y[j], y[d]) <= max(y[i], y[b])
        ):
            turn_c, turn_d, bound, _ = turns(x, y, i, b, j, d)
            nearest = min(abs(turn_c), abs(turn_d))
            if nearest <= bound or (turn_c > 0.0) != (turn_d > 0.0):
                turn_a, turn_b, bound_ab, _ = turns(x, y, j, d, i, b)
                nearest_ab = min(abs(turn_a), abs(turn_b))
                if nearest_ab <= bound_ab or (turn_a > 0.0) != (turn_b > 0.0):
                    if nearest <= bound or nearest_ab <= bound_ab:
                        return UNSETTLED
                    # into the other polygon, to its edge's left, and there the other edge leaves this one
                    first, second = (
                        (passages.enters, passages.leaves) if turn_b > 0.0 else (passages.leaves, passages.enters)
                    )
                    if first[i] != _NONE or second[j] != _NONE:
                        return UNSETTLED
                    first[i], second[j] = j, i
                    n_found += 1
        if x_high == u_high:
            return UNSETTLED  # case: what touches there might be passed over
        if x_high < u_high:
            i += i_step
        else:
            j += j_step
    return n_found


@inline
def _holds(edges: Edges, first: int, last: int, v: int) -> int:
    """Return 1 if vertex v is inside the convex ring of the vertices first .. last - 1, -1 if outside, 0 if unsure."""
    side = 1
    for i in range(first, last):
        turn = _surely_left(edges.x, edges.y, i, edges.after[i], v)
        if turn < 0:
            return -1
        side = min(side, turn)
    return side


@inline
def _walk(edges: Edges, n: int, end: int, passages: Passages, firsts: Any, seconds: Any) -> int:
    """Write the points of the result: vertices and -1, or two edges that cross; return how many, or UNSETTLED.

    The first polygon is followed where it is inside the other, and the other from where the first leaves to where it
    enters again. Vertices 0 .. n - 1 and n .. end - 1; at least one crossing.
    """
    start = 0
    while start < n and passages.enters[start] == _NONE:  # bound: n
        start += 1
    if start == n:
        return UNSETTLED
    n_found, most = 0, 2 * end
    is_inside, left_at = True, _NONE
    e = start
    for k in range(n + 1):  # the last turn closes the ring
        f = passages.enters[e]
        if f != _NONE:
            if k > 0:
                if is_inside:
                    return UNSETTLED
                v = left_at
                while v != f:  # bound: around the other polygon
                    v = edges.after[v]
                    firsts[n_found], seconds[n_found] = v, _NONE
                    n_found += 1
                if n_found > most:
                    return UNSETTLED
            if k == n:
                return n_found
            firsts[n_found], seconds[n_found] = e, f
            n_found += 1
            is_inside = True
        f = passages.leaves[e]
        if f != _NONE:
            if not is_inside:
                return UNSETTLED
            firsts[n_found], seconds[n_found] = e, f
            n_found += 1
            is_inside, left_at = False, f
        e = edges.after[e]
        if is_inside:
            firsts[n_found], seconds[n_found] = e, _NONE
            n_found += 1
    return UNSETTLED


@inline
def _all_vertices(first: int, last: int, firsts: Any, seconds: Any) -> int:
    for v in range(first, last):
        firsts[v - first], seconds[v - first] = v, _NONE
    return last - first


@inline
def _round_ring(edges: Edges, m: int, firsts: Any, seconds: Any, x: Any, y: Any) -> tuple[int, float]:
    """Round the points of a ring; return its first point and how far one moved, UNSETTLED if it is not strictly convex.

    The first point is the leftmost, then lowest.
    """
    farthest, low = 0.0, 0
    for k in range(m):
        e, f = firsts[k], seconds[k]
        if f == _NONE:
            x[k], y[k] = edges.x[e] + 0.0, edges.y[e] + 0.0
        else:
            x[k], y[k], ex, ey = round_crossing(edges, e, f)
            if ex < 0.0 or ey < 0.0:
                return UNSETTLED, 0.0
            farthest = max(farthest, np.sqrt(ex * ex + ey * ey) * (1.0 + 2.0**-50))  # two squares, their sum, a root
        if x[k] < x[low] or (x[k] == x[low] and y[k] < y[low]):
            low = k
    i, j, n_changes = m - 2, m - 1, 0
    rises = x[j] > x[i] or (x[j] == x[i] and y[j] > y[i])
    for k in range(m):
        if _surely_left(x, y, i, j, k) <= 0:
            return UNSETTLED, 0.0
        rose, rises = rises, x[k] > x[j] or (x[k] == x[j] and y[k] > y[j])
        n_changes += rises != rose
        i, j = j, k
    return low if n_changes == 2 else UNSETTLED, farthest


@inline
def intersect_convex(
    subjects: Any, first: int, first_end: int, clips: Any, second: int, second_end: int, base: int, edges: Edges,
    origins: Any, passages: Passages, firsts: Any, seconds: Any, x: Any, y: Any,
    stop: Any,
) -> tuple[int, int, float]:  # fmt: skip
    """Intersect two rings: return the number of points, which of them is first, and how far one moved; or UNSETTLED.

    firsts, seconds: filled with the points as `_walk` names them, but by numbers of the input, those of clips counted
    from ``base``; x, y: with their doubles, counter-clockwise.
    """
    n, top, step = load_convex(subjects, first, first_end, 0, edges, origins, 0, stop)
    if n == UNSETTLED:
        return UNSETTLED, 0, 0.0
    end, top_second, step_second = load_convex(clips, second, second_end, base, edges, origins, n, stop)
    if end == UNSETTLED:
        return UNSETTLED, 0, 0.0
    passages.enters[:end] = _NONE
    passages.leaves[:end] = _NONE
    n_crossings = 0
    for is_upper in range(2):
        for is_other_upper in range(2):
            i, i_end, i_step = (n - 1, top - 1, -1) if is_upper else (0, top, 1)
            j, j_end, j_step = (end - 1, top_second - 1, -1) if is_other_upper else (n, top_second, 1)
            found = _find_passages(edges, i, i_end, i_step, j, j_end, j_step, passages, stop)
            if found == UNSETTLED:
                return UNSETTLED, 0, 0.0
            n_crossings += found
    if n_crossings > 0:
        m = _walk(edges, n, end, passages, firsts, seconds)
    else:
        in_second, in_first = _holds(edges, n, end, 0), _holds(edges, 0, n, n)
        if in_second > 0:
            m = _all_vertices(0, n, firsts, seconds)
        elif in_first > 0 and in_second < 0:
            m = _all_vertices(n, end, firsts, seconds)
        else:
            m = 0 if in_first < 0 and in_second < 0 else UNSETTLED
    if m <= 0:
        return m, 0, 0.0
    if m < 3:
        return UNSETTLED, 0, 0.0
    low, farthest = _round_ring(edges, m, firsts, seconds, x, y)
    if low == UNSETTLED:
        return UNSETTLED, 0, 0.0
    for k in range(m):
        e, f = firsts[k], seconds[k]
        if f != _NONE:
            firsts[k] = origins[e if step > 0 else edges.after[e]]
            seconds[k] = origins[f if step_second > 0 else edges.after[f]]
        else:
            firsts[k] = origins[e]
    return m, low, farthest
