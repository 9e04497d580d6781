r"""The intersection of two convex polygons: one walk along x for the crossings, one around the result.

    upper  ,-----.        Edges can intersect only at a common x: the edges of a lower and an upper chain of each
          /       \        polygon, walked from left to right two by two, are n + m pairs for each of four pairs of
    lower '-------'       chains. Each edge enters the other polygon at most once, and leaves it at most once.

A filter: only what floating point proves is decided here (strictly convex rings, proper crossings of edges whose
vertices have different x). Else the pair is GENERAL, with the same result. The rounded ring is valid if it is still
strictly convex, which is checked.

A ring is stored counter-clockwise from its lexicographically smallest vertex (x, then y), which is repeated at its end,
so that both chains are ranges: the lower one up from the first vertex, the upper one down from the last.

Source: M. I. Shamos and D. Hoey, Geometric intersection problems, 1976, section 3.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

import numpy as np

from engine.compiling.jit import called, inline, merged
from engine.polygon_overlay.compiled.clearance import distance_of, round_crossing
from engine.polygon_overlay.compiled.crossing_signs import Edges
from engine.polygon_overlay.compiled.edge_contacts import same_sign, smaller_turn, turns
from engine.polygon_overlay.compiled.edge_tree import POLL
from engine.polygon_overlay.compiled.loading import Given
from engine.predicates.expansion import is_safe
from engine.predicates.orientation import BOUND_2D, GUARD_2D
from engine.types import FlagArray, FloatArray, Int32Array

GENERAL: Final = -1
"""Result value: the filter decides nothing, and the pair takes the general path."""
_NONE: Final = -1

Passages = namedtuple("Passages", "enters leaves")
"""By edge: the edge of the other polygon through which it enters that polygon, and the one through which it leaves, or
_NONE."""

Points = namedtuple("Points", "x y firsts seconds")
"""Points of the result. x, y: doubles; firsts, seconds: v and -1 for input vertex v, two edges for their crossing, that
along which the result continues first."""


@merged
def _is_left(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> bool:
    """Return whether floating point proves that the turn a, b, c is to the left."""
    left, right = (bx - ax) * (cy - ay), (by - ay) * (cx - ax)
    return bool(left - right > BOUND_2D * (abs(left) + abs(right)) + GUARD_2D)


@merged
def _is_after(ax: float, ay: float, bx: float, by: float) -> bool:
    """Return whether point b is lexicographically larger than point a (x, then y)."""
    return bool((bx > ax) | ((bx == ax) & (by > ay)))


@inline
def _count_rising(x: FloatArray, y: FloatArray, size: int) -> int:
    """Return how many edges of a ring of ``size`` vertices rise (their end is lexicographically larger, x, then y), or
    GENERAL unless the ring is proven strictly convex.

    It is if all turns are to the left and it winds once: its edges rise once and fall once. x, y: its vertices,
    counter-clockwise, and the first one again. Branch-free, so that the compiler vectorises the loop.
    """
    n_left = n_rising = n_changes = 0
    for i in range(size - 1):
        ax, ay, bx, by, cx, cy = x[i], y[i], x[i + 1], y[i + 1], x[i + 2], y[i + 2]
        rises = _is_after(ax, ay, bx, by)
        n_left += _is_left(ax, ay, bx, by, cx, cy)
        n_rising += rises
        n_changes += rises != _is_after(bx, by, cx, cy)
    ax, ay, bx, by, cx, cy = x[size - 1], y[size - 1], x[0], y[0], x[1], y[1]
    rises = _is_after(ax, ay, bx, by)
    n_left += _is_left(ax, ay, bx, by, cx, cy)
    n_rising += rises
    n_changes += rises != _is_after(bx, by, cx, cy)
    return n_rising if n_left == size and n_changes == 2 else GENERAL


@inline
def _lowest_vertex(vertices: FloatArray) -> int:
    """Return the index of the lexicographically smallest vertex (x, then y)."""
    low = 0
    px, py = vertices[0, 0], vertices[0, 1]
    for k in range(1, vertices.shape[0]):
        qx = vertices[k, 0]
        if qx <= px and (qx < px or vertices[k, 1] < py):
            low, px, py = k, qx, vertices[k, 1]
    return low


@inline
def load_convex(
    vertices: FloatArray, base: int, edges: Edges, origins: Int32Array, start: int, stop: FlagArray
) -> tuple[int, int]:  # fmt: skip
    """Write a ring to ``edges`` from index ``start`` on: counter-clockwise, from its smallest vertex (x, then y), which
    is repeated at the end. Returns the index in ``edges`` of its largest vertex, or GENERAL unless the ring is proven
    strictly convex; and the step, 1, or -1 if it was given clockwise. origins: filled with ``base`` + the number of
    each vertex."""
    size = vertices.shape[0]
    low = _lowest_vertex(vertices)
    after, before = (low + 1 if low + 1 < size else 0), (low if low > 0 else size) - 1
    ux, uy = vertices[after, 0] - vertices[low, 0], vertices[after, 1] - vertices[low, 1]
    wx, wy = vertices[before, 0] - vertices[low, 0], vertices[before, 1] - vertices[low, 1]
    step = 1 if ux * wy - uy * wx > 0.0 else -1  # a guess: the turns below must all be to the left
    if size < 3 or stop[0]:
        return GENERAL, step
    end, k, is_range_safe = start + size + 1, low, True
    for i in range(start, end):
        px, py = vertices[k, 0], vertices[k, 1]
        edges.x[i], edges.y[i], edges.after[i], origins[i] = px, py, i + 1, base + k
        is_range_safe &= is_safe(px) & is_safe(py)
        k += step
        k = 0 if k == size else size - 1 if k < 0 else k
    if not is_range_safe or stop[0]:
        return GENERAL, step
    n_rising = _count_rising(edges.x[start:end], edges.y[start:end], size)
    return start + n_rising if n_rising > 0 else GENERAL, step


@inline
def _record_crossing(edges: Edges, e: int, f: int, passages: Passages) -> int:
    """Write the crossing of edges e and f, one of each polygon, to ``passages``; return 1 if they are proven to cross,
    0 if proven not to, GENERAL if undecided or one of them crosses twice in the same way."""
    x, y = edges.x, edges.y
    to_f = turns(x, y, e, e + 1, f, f + 1)
    nearest_f = smaller_turn(to_f)
    if nearest_f > to_f.bound and same_sign(to_f):
        return 0
    to_e = turns(x, y, f, f + 1, e, e + 1)
    nearest_e = smaller_turn(to_e)
    if nearest_e > to_e.bound and same_sign(to_e):
        return 0
    if nearest_f <= to_f.bound or nearest_e <= to_e.bound:
        return GENERAL
    # into the other polygon, to its edge's left, and there the other edge leaves this one
    first, second = (passages.enters, passages.leaves) if to_e.second > 0.0 else (passages.leaves, passages.enters)
    if first[e] != _NONE or second[f] != _NONE:
        return GENERAL
    first[e], second[f] = f, e
    return 1


@inline
def _find_passages(
    edges: Edges, i: int, i_end: int, i_step: int, j: int, j_end: int, j_step: int, passages: Passages, stop: FlagArray
) -> int:  # fmt: skip
    """Write the crossings of two x-monotone chains, one of each polygon, to ``passages``; return their number, or
    GENERAL. i, j: leftmost vertex of each chain; i_end, j_end: its rightmost; i_step, j_step: 1 for a lower chain, -1
    for an upper one."""
    x, y = edges.x, edges.y
    while i != i_end and x[i + i_step] < x[j]:
        i += i_step
    while j != j_end and x[j + j_step] < x[i]:
        j += j_step
    if i == i_end or j == j_end:
        return 0
    n_crossings = 0
    for k in range((i_end - i) * i_step + (j_end - j) * j_step):  # each turn ends an edge of one chain
        if k & POLL == POLL and stop[0]:
            return GENERAL
        p, q = np.uint64(i), np.uint64(j)  # unsigned: no check for negative indices
        b, d = np.uint64(i + i_step), np.uint64(j + j_step)
        if (min(y[p], y[b]) <= max(y[q], y[d])) & (min(y[q], y[d]) <= max(y[p], y[b])):
            n_new = _record_crossing(edges, min(i, i + i_step), min(j, j + j_step), passages)
            if n_new == GENERAL:
                return GENERAL
            n_crossings += n_new
        if x[b] == x[d]:
            return GENERAL  # case: what touches there might be passed over
        is_first = x[b] < x[d]  # no branch: which of both ends first nobody can foresee
        i += i_step * is_first
        j += j_step * (not is_first)
        if i == i_end or j == j_end:
            break
    return n_crossings


@inline
def _locate_vertex(edges: Edges, first: int, last: int, v: int) -> int:
    """Return 1, -1 or 0: vertex v is proven inside the convex ring of edges first .. last - 1, proven outside, or
    undecided."""
    x, y = edges.x, edges.y
    side = 1
    for i in range(first, last):
        if _is_left(x[i + 1], y[i + 1], x[i], y[i], x[v], y[v]):
            return -1
        if not _is_left(x[i], y[i], x[i + 1], y[i + 1], x[v], y[v]):
            side = 0
    return side


@inline
def _add_vertices(edges: Edges, origins: Int32Array, first: int, last: int, points: Points, n: int) -> int:
    """Append the vertices first .. last - 1 of ``edges``, with the numbers ``origins``, to the result of n points;
    return the number of points then."""
    size = max(last - first, 0)
    x, y, names = edges.x[first : first + size], edges.y[first : first + size], origins[first : first + size]
    u, v, firsts, seconds = points.x[n:], points.y[n:], points.firsts[n:], points.seconds[n:]
    for k in range(size):
        u[k], v[k], firsts[k], seconds[k] = x[k], y[k], names[k], _NONE
    return n + size


@inline
def _add_stretch(
    edges: Edges, origins: Int32Array, e: int, f: int, first: int, last: int, points: Points, n: int
) -> int:  # fmt: skip
    """Append the vertices of a ring between edge e and edge f, counter-clockwise, to the result of n points; return the
    number of points then. The ring has the edges first .. last - 1."""
    if f >= e:
        return _add_vertices(edges, origins, e + 1, f + 1, points, n)
    n = _add_vertices(edges, origins, e + 1, last, points, n)
    return _add_vertices(edges, origins, first, f + 1, points, n)


@inline
def _add_crossing(edges: Edges, e: int, f: int, e_name: int, f_name: int, points: Points, n: int) -> float:
    """Write the rounded crossing of edges e and f as point n of the result; return a bound of its displacement,
    infinity if the nearest double is not determined. e_name, f_name: the input's numbers of the edges, that along which
    the result continues first."""
    x, y, ex, ey = round_crossing(edges, e, f)
    points.x[n], points.y[n], points.firsts[n], points.seconds[n] = x, y, e_name, f_name
    if ex < 0.0 or ey < 0.0:
        return np.inf
    return distance_of(ex, ey)


@inline
def _walk(
    edges: Edges, origins: Int32Array, n: int, second: int, end: int, is_reversed: int, is_second_reversed: int,
    passages: Passages, points: Points, stop: FlagArray,
) -> tuple[int, float]:  # fmt: skip
    """Trace the boundary of the intersection into ``points``; return its number of points, or GENERAL, and their
    largest displacement by rounding.

    The walk follows the first polygon (edges 0 .. n - 1) inside the second, and the second (edges second .. end - 1)
    from where the first leaves it to where it enters again. Caller guarantees a crossing. is_reversed,
    is_second_reversed: 1 if the ring was given clockwise, so that an edge has the input number of its end.
    """
    enters, leaves = passages.enters, passages.leaves
    start = 0
    while start < n and enters[start] == _NONE:  # bound: n
        start += 1
    if start == n:
        return GENERAL, 0.0
    n_points, farthest = 0, 0.0
    e, entered, left_at = start, _NONE, _NONE
    for k in range(n + 1):  # the last turn closes the ring
        f = enters[e]
        if f != _NONE:
            if k > 0:
                if left_at == _NONE:
                    return GENERAL, 0.0
                n_points = _add_stretch(edges, origins, left_at, f, second, end, points, n_points)
            if k == n:
                return n_points, farthest
            moved = _add_crossing(
                edges, e, f, origins[e + is_reversed], origins[f + is_second_reversed], points, n_points
            )
            n_points, farthest = n_points + 1, max(farthest, moved)
            entered, left_at = e, _NONE
        f = leaves[e]
        if f != _NONE:
            if left_at != _NONE:
                return GENERAL, 0.0
            n_points = _add_stretch(edges, origins, entered, e, 0, n, points, n_points)
            moved = _add_crossing(
                edges, e, f, origins[f + is_second_reversed], origins[e + is_reversed], points, n_points
            )
            n_points, farthest = n_points + 1, max(farthest, moved)
            left_at = f
        if n_points > 2 * end or (k & POLL == POLL and stop[0]):
            return GENERAL, 0.0
        e = e + 1 if e + 1 < n else 0
    return GENERAL, 0.0


@called
def intersect_convex(
    subject: FloatArray, clip: FloatArray, given: Given, passages: Passages, points: Points, stop: FlagArray
) -> tuple[int, int, float]:  # fmt: skip
    """Intersect two convex rings, (n, 2) and (m, 2) float64; return the number of points or GENERAL, the index of the
    smallest one (x, then y), and the largest displacement by rounding. points: filled counter-clockwise; vertices of
    ``clip`` are numbered after those of ``subject``. given and passages have room for n + m + 2 vertices, points for
    four times n + m."""
    edges, origins, x, y = given.edges, given.origins, points.x, points.y
    n = subject.shape[0]
    top, step = load_convex(subject, 0, edges, origins, 0, stop)
    if top == GENERAL:
        return GENERAL, 0, 0.0
    other = n + 1  # after the first vertex of the first ring once more
    end = other + clip.shape[0]
    top_second, step_second = load_convex(clip, n, edges, origins, other, stop)
    if top_second == GENERAL:
        return GENERAL, 0, 0.0
    passages.enters[:end] = _NONE
    passages.leaves[:end] = _NONE
    n_crossings = 0
    for is_upper in range(2):
        for is_other_upper in range(2):
            i, i_step = (n, -1) if is_upper else (0, 1)
            j, j_step = (end, -1) if is_other_upper else (other, 1)
            n_added = _find_passages(edges, i, top, i_step, j, top_second, j_step, passages, stop)
            if n_added == GENERAL:
                return GENERAL, 0, 0.0
            n_crossings += n_added
    if n_crossings == 0:
        in_second, in_first = _locate_vertex(edges, other, end, 0), _locate_vertex(edges, 0, n, other)
        if in_second > 0:
            return _add_vertices(edges, origins, 0, n, points, 0), 0, 0.0
        if in_first > 0 and in_second < 0:
            return _add_vertices(edges, origins, other, end, points, 0), 0, 0.0
        return (0 if in_first < 0 and in_second < 0 else GENERAL), 0, 0.0
    m, farthest = _walk(edges, origins, n, other, end, int(step < 0), int(step_second < 0), passages, points, stop)
    if m < 3 or farthest == np.inf:
        return GENERAL, 0, 0.0
    x[m], y[m] = x[0], y[0]
    if _count_rising(x[: m + 1], y[: m + 1], m) == GENERAL:
        return GENERAL, 0, 0.0
    low = 0
    for k in range(1, m):
        if x[k] <= x[low] and (x[k] < x[low] or y[k] < y[low]):
            low = k
    return m, low, farthest
