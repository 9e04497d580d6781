"""Sutherland-Hodgman on rings without a special case: no vertex on a plane, no sign near zero, no cuts that coincide.

That is nearly every ring, so the work is that of careless code: vertices stay where they are and a ring is a list of
their numbers; signs come from doubles, with one slack for a plane and polygon; only cuts are made in double-double. At
the first doubt the ring is given up, and the careful passes of sutherland_hodgman.py begin anew.

pool: (room, dim, 3) float64, vertices as in cut_vertices.py, those of the ring first. edges: (room,) int32, the original
edge that goes on from a vertex, -1 for one along a plane.

Slack: every vertex lies within `reach` of zero, so a value in doubles is wrong by less than 2^-49 of the plane's row at
`reach`; cuts that are known to less than 2^-48 of `reach` are given up.
"""

from __future__ import annotations

from typing import Any, Final

from engine.clipping.cut_point import CUT_BOUND, POINT_BOUND
from engine.clipping.cut_vertices import compare_vertices, sign_across, sign_at, value_of
from engine.jit import inline
from engine.predicates.double_double import U2, dd_add, dd_div, dd_mul, surely_rounded
from engine.predicates.error_free import two_diff, two_prod, two_sum
from engine.types import UNDECIDED

GIVEN_UP: Final = -1
NO_ROOM: Final = -2
SLACK: Final = 2.0**-45
_KNOWN: Final = 2.0**-48
_APART: Final = 2.0**-40


@inline
def are_apart(points: Any, i: int, j: int) -> bool:
    """Tell whether two vertices surely differ."""
    for k in range(points.shape[1]):
        h, other = points[i, k, 0], points[j, k, 0]
        if abs(h - other) > _APART * (abs(h) + abs(other)) + points[i, k, 2] + points[j, k, 2]:
            return True
    return compare_vertices(points, i, j) == 1


@inline
def cut_plainly(
    high: Any, low: Any, plane: int, axis: int, at: float, reach: Any, points: Any, p: int, q: int, j: int
) -> bool:
    """Set vertex j to where the edge p q crosses a plane as `cut_edge` does; False at any doubt."""
    is_known = axis >= 0  # case: along a plane across another axis, to a corner of a box
    for k in range(points.shape[1]):
        if k != axis:
            is_known = is_known and points[p, k, 0] == points[q, k, 0]
            is_known = is_known and points[p, k, 1] == 0.0 and points[p, k, 2] == 0.0
            is_known = is_known and points[q, k, 1] == 0.0 and points[q, k, 2] == 0.0
    if is_known:
        for k in range(points.shape[1]):
            points[j, k, 0], points[j, k, 1], points[j, k, 2] = at if k == axis else points[p, k, 0], 0.0, 0.0
        return True
    if axis < 0:
        ph, pl, p_bound = value_of(high[plane], low[plane], points, p)
        qh, ql, q_bound = value_of(high[plane], low[plane], points, q)
    elif points[p, axis, 1] == 0.0 and points[q, axis, 1] == 0.0:
        ph, pl = two_diff(points[p, axis, 0], at)
        qh, ql = two_diff(points[q, axis, 0], at)
        p_bound, q_bound = points[p, axis, 2], points[q, axis, 2]
    else:
        ph, pl = dd_add(points[p, axis, 0], points[p, axis, 1], -at, 0.0)
        qh, ql = dd_add(points[q, axis, 0], points[q, axis, 1], -at, 0.0)
        p_bound, q_bound = points[p, axis, 2] + 4.0 * U2 * abs(ph), points[q, axis, 2] + 4.0 * U2 * abs(qh)
    if ph < 0.0:
        ph, pl = -ph, -pl
    if qh < 0.0:
        qh, ql = -qh, -ql
    if not (p_bound < 0.001 * ph and q_bound < 0.001 * qh):
        return False
    r = 0.0
    if p_bound > 0.0 or q_bound > 0.0:
        r = 1.01 * max(p_bound / ph, q_bound / qh)
    sum_h, sum_l = dd_add(ph, pl, qh, ql)
    th, tl = dd_div(ph, pl, sum_h, sum_l)
    for k in range(points.shape[1]):
        xh, xl, x_bound = points[p, k, 0], points[p, k, 1], points[p, k, 2]
        yh, yl, y_bound = points[q, k, 0], points[q, k, 1], points[q, k, 2]
        if k == axis:
            h, rest, bound = at, 0.0, 0.0
        elif xl == 0.0 and yl == 0.0 and x_bound == 0.0 and y_bound == 0.0:
            h, rest, bound = xh, 0.0, 0.0
            if xh != yh:
                dh, dl = two_diff(yh, xh)
                mh, ml = two_prod(th, dh)
                sh, sl = two_sum(xh, mh)
                h, rest = two_sum(sh, (sl + ml) + (tl * dh + th * dl))
                bound = 1.01 * (POINT_BOUND * (abs(xh) + abs(mh)) + r * abs(dh))
                if abs(rest) <= bound:
                    return False
        else:
            ah, al = dd_mul(xh, xl, qh, ql)
            bh, bl = dd_mul(yh, yl, ph, pl)
            nh, nl = dd_add(ah, al, bh, bl)
            h, rest = dd_div(nh, nl, sum_h, sum_l)
            bound = 1.01 * (max(x_bound, y_bound) + CUT_BOUND * max(abs(xh), abs(yh)) + r * abs(yh - xh))
        points[j, k, 0], points[j, k, 1], points[j, k, 2] = h, rest, bound
        if bound > _KNOWN * reach[k]:
            return False
    return True


@inline
def surely_inside(
    high: Any, low: Any, plane: int, axis: int, at: float, slack: float, pool: Any, ring: Any, n: int, inside: Any
) -> int:
    """Set inside[i] where vertex i of a ring lies inside a plane; return how many do, GIVEN_UP at a sign not sure."""
    n_in, n_sure = 0, 0
    if axis >= 0:
        sense = 1.0 if high[plane, axis] > 0.0 else -1.0
        for i in range(n):
            value = sense * (pool[ring[i], axis, 0] - at)
            inside[i] = value > 0.0
            n_in += value > 0.0
            n_sure += abs(value) > slack
    else:
        d = pool.shape[1]
        for i in range(n):
            value = high[plane, d]
            for k in range(d):
                value += high[plane, k] * pool[ring[i], k, 0]
            inside[i] = value > 0.0
            n_in += value > 0.0
            n_sure += abs(value) > slack
    if n_sure == n:
        return n_in
    n_in = 0
    for i in range(n):
        if axis >= 0:
            sign = sign_across(1.0 if high[plane, axis] > 0.0 else -1.0, axis, at, pool, ring[i])
        else:
            sign = sign_at(high[plane], low[plane], pool, ring[i])
        if sign == 0 or sign == UNDECIDED:
            return GIVEN_UP
        inside[i] = sign > 0
        n_in += sign > 0
    return n_in


@inline
def clip_plainly(
    vertices: Any,
    begin: int,
    end: int,
    high: Any,
    low: Any,
    axes: Any,
    at: Any,
    slack: Any,
    reach: Any,
    cutting: Any,
    n_cutting: int,
    pool: Any,
    edges: Any,
    rings: Any,
    inside: Any,
    contacts: Any,
    dropped: Any,
    out: Any,
    written: int,
) -> int:
    """Clip the ring of vertices begin .. end - 1 by the planes of `cutting` into ``out[written:]``.

    slack: for each of `cutting`. rings: (2, room) int32, scratch as pool, edges and inside are. Adds to contacts,
    dropped. Returns the vertices left, GIVEN_UP or NO_ROOM.
    """
    dimension, n = vertices.shape[1], 0
    for i in range(begin, end):
        is_same = i > begin
        for k in range(dimension):
            x = vertices[i, k]
            is_same = is_same and vertices[i - 1, k] == x
            pool[n, k, 0], pool[n, k, 1], pool[n, k, 2] = x, 0.0, 0.0
        rings[0, n], edges[n] = n, n
        n += not is_same
    while n > 1:
        is_same = True
        for k in range(dimension):
            is_same = is_same and pool[n - 1, k, 0] == pool[0, k, 0]
        if not is_same:
            break
        n -= 1
    size, n_ring, now = n, n, 0
    for i_plane in range(n_cutting):
        plane = cutting[i_plane]
        axis, place = axes[plane], at[plane]
        ring, left = rings[now], rings[1 - now]
        n_in = surely_inside(high, low, plane, axis, place, slack[i_plane], pool, ring, n, inside)
        if n_in == GIVEN_UP or size + n > pool.shape[0] or 2 * n > left.size:
            return GIVEN_UP
        if n_in == n:
            continue
        dropped[plane] = True
        kept, before = 0, size
        for i in range(n):
            if inside[i]:
                left[kept] = ring[i]
                kept += 1
            following = i + 1 if i + 1 < n else 0
            if inside[i] == inside[following]:
                continue
            p, q, edge = ring[i], ring[following], edges[ring[i]]
            if edge >= 0:
                p, q = edge, edge + 1 if edge + 1 < n_ring else 0
            if not cut_plainly(high, low, plane, axis, place, reach, pool, p, q, size):
                return GIVEN_UP
            if kept > 0 and left[kept - 1] >= before and not are_apart(pool, size, left[kept - 1]):
                return GIVEN_UP
            edges[size] = -1 if inside[i] else edge
            left[kept] = size
            kept += 1
            size += 1
        contacts[plane] += size - before
        if kept > 1 and left[kept - 1] >= before and left[0] >= before and not are_apart(pool, left[kept - 1], left[0]):
            return GIVEN_UP
        n, now = kept, 1 - now
        if n == 0:
            return 0
    if written + n > out.shape[0]:
        return NO_ROOM
    for i in range(n):
        j = rings[now, i]
        for k in range(dimension):
            h, rest, bound = pool[j, k, 0], pool[j, k, 1], pool[j, k, 2]
            if bound > 0.0 and not surely_rounded(h, rest, bound + 2.0 * U2 * abs(h)):
                return GIVEN_UP
            out[written + i, k] = h + rest
    return n
