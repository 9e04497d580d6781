"""Sutherland-Hodgman on rings without a special case: no vertex on a plane, no sign near zero, no cuts that coincide.

That is nearly every ring, so the work is that of careless code: vertices stay where they are and a ring is a list of
their numbers; signs come from doubles, with one slack for a plane and polygon; only cuts are made in double-double. At
the first doubt the polygon is given up, and the careful passes of sutherland_hodgman.py begin anew.

One long function for that reason: compiled code counts references to each array that it hands to another function, and
that was two fifths of the time. The functions that it calls take numbers; those that take arrays are rarely reached.

pool: (room, dim, 3) float64, vertices as in cut_vertices.py, those of the ring first. edges: (room,) int32, the
original edge that goes on from a vertex, -1 for one along a plane.

Slack: every vertex lies within `reach` of zero, so a value in doubles is wrong by less than 2^-49 of the plane's row at
`reach`; cuts that are known to less than 2^-48 of `reach` are given up.
"""

from __future__ import annotations

from typing import Any, Final

from engine.clipping.cut_point import CUT_BOUND, POINT_BOUND, is_safe
from engine.clipping.cut_vertices import DD_VALUE_BOUND, VALUE_BOUND, compare_vertices, sign_across, sign_at
from engine.jit import inline, merged
from engine.predicates.double_double import U2, dd_add, dd_div, dd_mul, surely_rounded
from engine.predicates.error_free import two_diff, two_prod, two_sum
from engine.types import UNDECIDED

DONE: Final = 0
GIVEN_UP: Final = -1
NO_ROOM: Final = -2
CLIPPED: Final = 0
OPEN: Final = 1
_SLACK: Final = 2.0**-45
_KNOWN: Final = 2.0**-48
_APART: Final = 2.0**-40


@inline
def distance_across(x: float, low: float, bound: float, at: float) -> tuple[float, float, float]:
    """Return x - at as a double-double, and its bound."""
    if low == 0.0:
        h, rest = two_diff(x, at)
        return h, rest, bound
    h, rest = dd_add(x, low, -at, 0.0)
    return h, rest, bound + 4.0 * U2 * abs(h)


@inline
def plus_term(
    h: float, rest: float, size: float, moved: float, a: float, a_low: float, x: float, x_low: float, bound: float
) -> tuple[float, float, float, float]:
    """Return the sum h + rest with a x added to it, and its sums of sizes and of bounds; see `value_of`."""
    ph, pl = dd_mul(a, a_low, x, x_low)
    h, rest = dd_add(h, rest, ph, pl)
    return h, rest, size + abs(ph), moved + abs(a) * bound


@inline
def between(
    x: float,
    x_low: float,
    x_bound: float,
    y: float,
    y_low: float,
    y_bound: float,
    ph: float,
    pl: float,
    qh: float,
    ql: float,
    sum_h: float,
    sum_l: float,
    th: float,
    tl: float,
    r: float,
) -> tuple[float, float, float, bool]:
    """Return the coordinate x + t (y - x) and its bound, as `cut_edge` does; False where it may be a double."""
    if x_low != 0.0 or y_low != 0.0 or x_bound != 0.0 or y_bound != 0.0:
        ah, al = dd_mul(x, x_low, qh, ql)
        bh, bl = dd_mul(y, y_low, ph, pl)
        nh, nl = dd_add(ah, al, bh, bl)
        h, rest = dd_div(nh, nl, sum_h, sum_l)
        return h, rest, 1.01 * (max(x_bound, y_bound) + CUT_BOUND * max(abs(x), abs(y)) + r * abs(y - x)), True
    if x == y:
        return x, 0.0, 0.0, True
    dh, dl = two_diff(y, x)
    mh, ml = two_prod(th, dh)
    sh, sl = two_sum(x, mh)
    h, rest = two_sum(sh, (sl + ml) + (tl * dh + th * dl))
    bound = 1.01 * (POINT_BOUND * (abs(x) + abs(mh)) + r * abs(dh))
    return h, rest, bound, abs(rest) > bound


@merged
def clip_plainly(
    vertices: Any,
    ring_offsets: Any,
    polygon_offsets: Any,
    high: Any,
    low: Any,
    axes: Any,
    at: Any,
    first: int,
    last: int,
    stop: Any,
    out: Any,
    written: int,
    sizes: Any,
    state: Any,
    may_have_bridges: Any,
    pool: Any,
    edges: Any,
    rings: Any,
    inside: Any,
    contacts: Any,
    dropped: Any,
    cutting: Any,
    slack: Any,
    reach: Any,
    lows: Any,
    highs: Any,
) -> tuple[int, int, int, int]:
    """Clip polygons from `first` on as `clip_rings` does, up to one that needs care.

    pool .. highs: scratch. Returns the polygon reached, the vertices written, NO_ROOM (or stopped), GIVEN_UP or DONE,
    and how many planes of `cutting` may cut the polygon reached.
    """
    d, n_planes = vertices.shape[1], high.shape[0]
    for polygon in range(first, last):
        if stop[0]:
            return polygon, written, NO_ROOM, 0
        first_ring, last_ring = polygon_offsets[polygon], polygon_offsets[polygon + 1]
        begin, end = ring_offsets[first_ring], ring_offsets[last_ring]
        is_safe_polygon = True
        for k in range(d):
            low_k = high_k = vertices[begin, k]
            for i in range(begin, end):
                x = vertices[i, k]
                low_k, high_k = min(low_k, x), max(high_k, x)
                is_safe_polygon = is_safe_polygon and is_safe(x)
            lows[k], highs[k], reach[k] = low_k, high_k, max(abs(low_k), abs(high_k))
        state[polygon], may_have_bridges[polygon] = CLIPPED if is_safe_polygon else OPEN, False
        # a plane that has all vertices inside cuts nothing: what later planes see are points between the vertices
        n_cutting, is_outside = 0, not is_safe_polygon
        for plane in range(n_planes):
            if is_outside:
                break
            axis = axes[plane]
            if axis >= 0:
                place, is_up = at[plane], high[plane, axis] > 0.0
                if (lows[axis] >= place) if is_up else (highs[axis] <= place):
                    continue
                is_outside = (highs[axis] < place) if is_up else (lows[axis] > place)
                size = abs(place) + reach[axis]
            else:
                size = abs(high[plane, d])
                for k in range(d):
                    size += abs(high[plane, k]) * reach[k]
                n_in, n_out = 0, 0
                for i in range(begin, end):
                    value = high[plane, d]
                    for k in range(d):
                        value += high[plane, k] * vertices[i, k]
                    n_in += value > VALUE_BOUND * size
                    n_out += -value > VALUE_BOUND * size
                if n_in == end - begin:
                    continue
                is_outside = n_out == end - begin
            cutting[n_cutting], slack[n_cutting] = plane, _SLACK * size
            contacts[plane], dropped[plane] = 0, False
            n_cutting += 1
        if is_outside:
            for ring in range(first_ring, last_ring):
                sizes[ring] = 0
            continue
        begun = written
        for ring in range(first_ring, last_ring):
            n = 0
            for i in range(ring_offsets[ring], ring_offsets[ring + 1]):
                is_same = i > ring_offsets[ring]
                for k in range(d):
                    x = vertices[i, k]
                    is_same = is_same and vertices[i - 1, k] == x
                    pool[n, k, 0], pool[n, k, 1], pool[n, k, 2] = x, 0.0, 0.0
                rings[0, n], edges[n] = n, n
                n += not is_same
            while n > 1:
                is_same = True
                for k in range(d):
                    is_same = is_same and pool[n - 1, k, 0] == pool[0, k, 0]
                if not is_same:
                    break
                n -= 1
            size_pool, n_ring, now = n, n, 0
            for i_plane in range(n_cutting):
                plane, near = cutting[i_plane], slack[i_plane]
                axis, place = axes[plane], at[plane]
                sense = 1.0
                if axis >= 0 and high[plane, axis] < 0.0:
                    sense = -1.0
                n_in = 0
                for i in range(n):
                    v = rings[now, i]
                    if axis >= 0:
                        value = sense * (pool[v, axis, 0] - place)
                    else:
                        value = high[plane, d]
                        for k in range(d):
                            value += high[plane, k] * pool[v, k, 0]
                    if abs(value) <= near:
                        if axis >= 0:
                            sign = sign_across(sense, axis, place, pool, v)
                        else:
                            sign = sign_at(high[plane], low[plane], pool, v)
                        if sign == 0 or sign == UNDECIDED:
                            return polygon, begun, GIVEN_UP, n_cutting
                        value = float(sign)
                    inside[i] = value > 0.0
                    n_in += value > 0.0
                if n_in == n:
                    continue
                if size_pool + n > pool.shape[0] or 2 * n > rings.shape[1]:
                    return polygon, begun, GIVEN_UP, n_cutting
                dropped[plane] = True
                kept, before, other = 0, size_pool, 1 - now
                for i in range(n):
                    v, following = rings[now, i], i + 1 if i + 1 < n else 0
                    if inside[i]:
                        rings[other, kept] = v
                        kept += 1
                    if inside[i] == inside[following]:
                        continue
                    edge, p, q, j = edges[v], v, rings[now, following], size_pool
                    if edge >= 0:
                        p, q = edge, edge + 1 if edge + 1 < n_ring else 0
                    is_known = axis >= 0  # case: along a plane across another axis, to a corner of a box
                    for k in range(d):
                        is_double = pool[p, k, 1] == 0.0 and pool[p, k, 2] == 0.0
                        is_double = is_double and pool[q, k, 1] == 0.0 and pool[q, k, 2] == 0.0
                        is_known = is_known and (k == axis or (is_double and pool[p, k, 0] == pool[q, k, 0]))
                    if is_known:
                        for k in range(d):
                            pool[j, k, 0], pool[j, k, 1], pool[j, k, 2] = pool[p, k, 0], 0.0, 0.0
                        pool[j, axis, 0] = place
                    else:
                        if axis >= 0:
                            ph, pl, p_bound = distance_across(
                                pool[p, axis, 0], pool[p, axis, 1], pool[p, axis, 2], place
                            )
                            qh, ql, q_bound = distance_across(
                                pool[q, axis, 0], pool[q, axis, 1], pool[q, axis, 2], place
                            )
                        else:
                            ph, pl, p_size, p_moved = high[plane, d], low[plane, d], abs(high[plane, d]), 0.0
                            qh, ql, q_size, q_moved = ph, pl, p_size, 0.0
                            for k in range(d):
                                a, a_low = high[plane, k], low[plane, k]
                                ph, pl, p_size, p_moved = plus_term(
                                    ph, pl, p_size, p_moved, a, a_low, pool[p, k, 0], pool[p, k, 1], pool[p, k, 2]
                                )
                                qh, ql, q_size, q_moved = plus_term(
                                    qh, ql, q_size, q_moved, a, a_low, pool[q, k, 0], pool[q, k, 1], pool[q, k, 2]
                                )
                            p_bound = DD_VALUE_BOUND * p_size + 1.01 * p_moved
                            q_bound = DD_VALUE_BOUND * q_size + 1.01 * q_moved
                        if ph < 0.0:
                            ph, pl = -ph, -pl
                        if qh < 0.0:
                            qh, ql = -qh, -ql
                        if not (p_bound < 0.001 * ph and q_bound < 0.001 * qh):
                            return polygon, begun, GIVEN_UP, n_cutting
                        r = 0.0
                        if p_bound > 0.0 or q_bound > 0.0:
                            r = 1.01 * max(p_bound / ph, q_bound / qh)
                        sum_h, sum_l = dd_add(ph, pl, qh, ql)
                        th, tl = dd_div(ph, pl, sum_h, sum_l)
                        for k in range(d):
                            h, rest, bound, is_sure = place, 0.0, 0.0, True
                            if k != axis:
                                h, rest, bound, is_sure = between(
                                    pool[p, k, 0],
                                    pool[p, k, 1],
                                    pool[p, k, 2],
                                    pool[q, k, 0],
                                    pool[q, k, 1],
                                    pool[q, k, 2],
                                    ph,
                                    pl,
                                    qh,
                                    ql,
                                    sum_h,
                                    sum_l,
                                    th,
                                    tl,
                                    r,
                                )
                            pool[j, k, 0], pool[j, k, 1], pool[j, k, 2] = h, rest, bound
                            if not is_sure or bound > _KNOWN * reach[k]:
                                return polygon, begun, GIVEN_UP, n_cutting
                    if kept > 0 and rings[other, kept - 1] >= before:
                        is_apart, c = False, rings[other, kept - 1]
                        for k in range(d):
                            x, y, bound = pool[j, k, 0], pool[c, k, 0], pool[j, k, 2] + pool[c, k, 2]
                            is_apart = is_apart or abs(x - y) > _APART * (abs(x) + abs(y)) + bound
                        if not is_apart and compare_vertices(pool, j, c) != 1:
                            return polygon, begun, GIVEN_UP, n_cutting
                    edges[j] = -1 if inside[i] else edge
                    rings[other, kept] = j
                    kept += 1
                    size_pool += 1
                contacts[plane] += size_pool - before
                if kept > 1 and rings[other, kept - 1] >= before and rings[other, 0] >= before:
                    if compare_vertices(pool, rings[other, kept - 1], rings[other, 0]) != 1:
                        return polygon, begun, GIVEN_UP, n_cutting
                n, now = kept, other
                if n == 0:
                    break
            if written + n > out.shape[0]:
                return polygon, begun, NO_ROOM, n_cutting
            for i in range(n):
                j = rings[now, i]
                for k in range(d):
                    h, rest, bound = pool[j, k, 0], pool[j, k, 1], pool[j, k, 2]
                    if bound > 0.0 and not surely_rounded(h, rest, bound + 2.0 * U2 * abs(h)):
                        return polygon, begun, GIVEN_UP, n_cutting
                    out[written + i, k] = h + rest
            sizes[ring] = n
            written += n
        for i in range(n_cutting):
            if written > begun and dropped[cutting[i]] and contacts[cutting[i]] > 2:
                may_have_bridges[polygon] = True
    return last, written, DONE, 0
