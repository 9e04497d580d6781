"""Sutherland-Hodgman on rings whose every decision and coordinate doubles and double-doubles prove.

That is nearly every ring, so the work is that of careless code: vertices stay where they are and a ring is a list of
their numbers; only cuts are made in double-double. A cut is kept only where its doubles are surely the nearest ones.
Rounding keeps order: where such a double lies beside a wall of a box so does the vertex, and vertices whose doubles
differ are two. Original vertices are doubles, so on a wall they are decided too. At the first doubt the polygon is
given up, and in_digits.py begins anew.

One long function, and arrays of one dimension: compiled code counts references to each array that it hands to another
function, and that was two fifths of the time. The functions that it calls take numbers.

pool: (room * dim,) float64, the doubles of vertices, those of the ring first. rests: (room * dim * 2,) float64, for
each coordinate of a cut what its double leaves over, and the bound of its error. edges: (room,) int32, the original
edge that goes on from a vertex, -1 for one along a plane.

Neighbours on the same side of every plane stay and go together: a long ring is first taken as runs of them, each
standing as its first vertex, up to ``ends`` of it.

Slack of planes across no axis: every vertex lies in the box of its polygon, so a value in doubles is wrong by less than
2^-49 of the plane's row on that box.
"""

from __future__ import annotations

from typing import Any, Final

from engine.jit import merged
from engine.lanes.memory import move
from engine.polygon_clipping.cut_vertices import (
    TINY,
    VALUE_BOUND,
    WIDEST,
    between,
    distance_across,
    is_at,
    on_edge,
    plus_term,
    share_of_edge,
    value_bound,
)
from engine.predicates.double_double import dd_add, dd_div, surely_rounded

DONE: Final = 0
GIVEN_UP: Final = -1
NO_ROOM: Final = -2
CLIPPED: Final = 0
OPEN: Final = 1
EXACT: Final = 2
"""States of a polygon: settled by doubles, by nothing yet, by whole numbers."""
_SLACK: Final = 2.0**-45
LONG: Final = 8
"""Vertices from which on a ring is taken as runs: of fewer, nearly every one is a run of its own."""
MOST_BITS: Final = 30
ALONE: Final = 1 << MOST_BITS
"""Mark of a vertex on a plane (or near it): a run of its own."""


@merged
def load_ring(
    vertices: Any, begin: int, end: int, d: int, pool: Any
) -> tuple[int, float, float, float, float, float, float]:
    """Load a ring into `pool` without vertices equal to the one before; return how many, and the bounds of each axis.

    Zeros become +0.0. The first vertex may still be repeated at the end.
    """
    x, y, z = vertices[begin * d], vertices[begin * d + 1], 0.0 if d == 2 else vertices[begin * d + 2]
    pool[0], pool[1] = x + 0.0, y + 0.0
    if d == 3:
        pool[2] = z + 0.0
    n, x_low, x_high, y_low, y_high, z_low, z_high = 1, x, x, y, y, z, z
    for i in range(begin + 1, end):
        u, v, w = vertices[i * d], vertices[i * d + 1], 0.0 if d == 2 else vertices[i * d + 2]
        pool[n * d], pool[n * d + 1] = u + 0.0, v + 0.0
        if d == 3:
            pool[n * d + 2] = w + 0.0
        n += (u != x) | (v != y) | (w != z)
        x, y, z = u, v, w
        x_low, x_high = x if x < x_low else x_low, x if x > x_high else x_high
        y_low, y_high = y if y < y_low else y_low, y if y > y_high else y_high
        z_low, z_high = z if z < z_low else z_low, z if z > z_high else z_high
    return n, x_low, x_high, y_low, y_high, z_low, z_high


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
    names: Any,
    pool: Any,
    rests: Any,
    edges: Any,
    ends: Any,
    codes: Any,
    rings: Any,
    signs: Any,
    contacts: Any,
    dropped: Any,
    cutting: Any,
    slack: Any,
    lows: Any,
    highs: Any,
) -> tuple[int, int, int, int]:
    """Clip polygons from `first` on as `clip_rings` does, up to one that needs care.

    vertices, out: as one row of numbers. names: a tuple of as many numbers as there are axes, so that their count is
    known when this is compiled. pool .. highs: scratch. Returns the polygon reached, the vertices written, NO_ROOM (or
    stopped), GIVEN_UP or DONE, and how many planes of `cutting` may cut the polygon reached.
    """
    d, n_planes = len(names), high.shape[0]
    for polygon in range(first, last):
        if stop[0]:
            return polygon, written, NO_ROOM, 0
        first_ring, last_ring = polygon_offsets[polygon], polygon_offsets[polygon + 1]
        state[polygon], may_have_bridges[polygon] = CLIPPED, False
        n_loaded, x_low, x_high, y_low, y_high, z_low, z_high = load_ring(
            vertices, ring_offsets[first_ring], ring_offsets[first_ring + 1], d, pool
        )
        for ring in range(first_ring + 1, last_ring):
            n_loaded, x, x_most, y, y_most, z, z_most = load_ring(
                vertices, ring_offsets[ring], ring_offsets[ring + 1], d, pool
            )
            x_low, x_high = min(x, x_low), max(x_most, x_high)
            y_low, y_high = min(y, y_low), max(y_most, y_high)
            z_low, z_high = min(z, z_low), max(z_most, z_high)
        lows[0], lows[1], lows[2], highs[0], highs[1], highs[2] = x_low, y_low, z_low, x_high, y_high, z_high
        # a plane that has all vertices inside cuts nothing: what later planes see are points between the vertices
        n_cutting, is_outside = 0, False
        for plane in range(n_planes):
            axis = axes[plane]
            if axis >= 0:
                place, is_up = at[plane], high[plane, axis] > 0.0
                low_k, high_k, size = lows[axis], highs[axis], 0.0
                is_cut = (low_k < place) if is_up else (high_k > place)
                is_outside = (high_k < place) if is_up else (low_k > place)
            else:
                least = most = high[plane, d]
                size = abs(least)
                for k in range(d):
                    x, y = high[plane, k] * lows[k], high[plane, k] * highs[k]
                    least, most, size = least + min(x, y), most + max(x, y), size + max(abs(x), abs(y))
                is_cut, is_outside = not least > VALUE_BOUND * size, -most > VALUE_BOUND * size + TINY
            cutting[n_cutting], slack[n_cutting] = plane, _SLACK * size + TINY
            contacts[n_cutting], dropped[n_cutting] = 0, False
            n_cutting += is_cut
            if is_outside:
                break
        if is_outside:
            for ring in range(first_ring, last_ring):
                sizes[ring] = 0
            continue
        begun, most = written, edges.size  # two rings of at most as many vertices as there is room for
        for ring in range(first_ring, last_ring):
            here, there = 0, most
            if last_ring > first_ring + 1:
                n_loaded, _, _, _, _, _, _ = load_ring(vertices, ring_offsets[ring], ring_offsets[ring + 1], d, pool)
            n = n_loaded
            while n > 1:
                is_same = True
                for k in range(d):
                    is_same = is_same & (pool[(n - 1) * d + k] == pool[k])
                if not is_same:
                    break
                n -= 1
            size_pool, n_ring = n, n
            if n_cutting == 0:
                rings[0], ends[0], n = 0, n - 1, 1
            elif n >= LONG and n_cutting <= MOST_BITS:
                for i in range(n):
                    codes[i] = 0
                for i_plane in range(n_cutting):
                    plane, near, bit = cutting[i_plane], slack[i_plane], 1 << i_plane
                    axis, place = axes[plane], at[plane]
                    if axis >= 0:
                        for i in range(n):
                            x = pool[i * d + axis]
                            codes[i] |= bit if x < place else (ALONE if x == place else 0)
                    else:
                        for i in range(n):
                            value = high[plane, d]
                            for k in range(d):
                                value += high[plane, k] * pool[i * d + k]
                            codes[i] |= bit if value < -near else (ALONE if value <= near else 0)
                n, before = 0, -1
                for i in range(n_ring):
                    code = codes[i]
                    rings[n] = i
                    n += (code != before) | (code >= ALONE)
                    before = code
                rings[n] = n_ring
                for i in range(n):
                    edges[rings[i]] = ends[rings[i]] = rings[i + 1] - 1
            else:
                for i in range(n):
                    rings[i] = edges[i] = ends[i] = i
            for i_plane in range(n_cutting):
                plane, near = cutting[i_plane], slack[i_plane]
                axis, place = axes[plane], at[plane]
                n_in, n_on = 0, 0
                if axis >= 0:
                    sense = 1 if high[plane, axis] > 0.0 else -1
                    for i in range(n):
                        v = rings[here + i]
                        x = pool[v * d + axis]
                        sign = sense * (int(x > place) - int(x < place))
                        if sign == 0 and v >= n_ring:
                            rest, bound = rests[2 * (v * d + axis)], rests[2 * (v * d + axis) + 1]
                            if abs(rest) > bound:
                                sign = sense if rest > 0.0 else -sense
                            elif bound > 0.0:
                                return polygon, begun, GIVEN_UP, n_cutting
                        signs[i] = sign
                        n_in += sign >= 0
                        n_on += sign == 0
                else:
                    for i in range(n):
                        v = rings[here + i]
                        value = high[plane, d]
                        for k in range(d):
                            value += high[plane, k] * pool[v * d + k]
                        if abs(value) <= near:
                            return polygon, begun, GIVEN_UP, n_cutting
                        signs[i] = 1 if value > 0.0 else -1
                        n_in += value > 0.0
                contacts[i_plane] += n_on
                if n_in == n:
                    continue
                dropped[i_plane] = True
                if size_pool + n > most:
                    return polygon, begun, GIVEN_UP, n_cutting
                kept, size_before, was_on, first_on = 0, size_pool, False, False
                signs[n] = signs[0]
                for i in range(n):
                    v, sign, sign_after = rings[here + i], signs[i], signs[i + 1]
                    if sign >= 0:
                        if sign == 0 and was_on:
                            is_same, b = True, rings[there + kept - 1]
                            for k in range(d):
                                is_same = is_same & (pool[v * d + k] == pool[b * d + k])
                            if is_same:
                                return polygon, begun, GIVEN_UP, n_cutting
                        was_on = sign == 0
                        first_on = was_on if kept == 0 else first_on
                        if was_on and sign_after < 0:
                            edges[v] = -1
                        rings[there + kept] = v
                        kept += 1
                    if sign * sign_after >= 0:
                        continue
                    w = rings[here + i + 1] if i + 1 < n else rings[here]
                    edge, j, is_sure = edges[v], size_pool, True
                    if axis >= 0 and edge >= 0:
                        p, q = edge, edge + 1 if edge + 1 < n_ring else 0
                        a, b = pool[p * d + axis], pool[q * d + axis]
                        th, tl, is_sure = share_of_edge(a, b, place)
                        for k in range(d):
                            if k == axis:
                                h, rest, bound = place, 0.0, 0.0
                            else:
                                x, y = pool[p * d + k], pool[q * d + k]
                                h, rest, bound = on_edge(x, y, th, tl)
                                if abs(rest) <= bound:
                                    near_double = h if abs(h) > bound else 0.0
                                    if is_at(x, y, a, b, place, near_double):
                                        h, rest, bound = near_double, 0.0, 0.0
                                is_sure = is_sure & surely_rounded(h, rest, bound)
                            pool[j * d + k] = h
                            rests[2 * (j * d + k)], rests[2 * (j * d + k) + 1] = rest, bound
                    else:
                        p, q = v, w
                        if edge >= 0:
                            p, q = edge, edge + 1 if edge + 1 < n_ring else 0
                        is_known = axis >= 0  # case: along a plane across another axis, to a corner of a box
                        for k in range(d):
                            is_double = (p < n_ring or rests[2 * (p * d + k) + 1] == 0.0) and (
                                q < n_ring or rests[2 * (q * d + k) + 1] == 0.0
                            )
                            is_same = is_double and pool[p * d + k] == pool[q * d + k]
                            is_known = is_known and (k == axis or is_same)
                        if is_known:
                            for k in range(d):
                                pool[j * d + k] = place if k == axis else pool[p * d + k]
                                rests[2 * (j * d + k)], rests[2 * (j * d + k) + 1] = 0.0, 0.0
                        else:
                            if axis >= 0:
                                x, y = p * d + axis, q * d + axis
                                rest, bound = (rests[2 * x], rests[2 * x + 1]) if p >= n_ring else (0.0, 0.0)
                                ph, pl, p_bound = distance_across(pool[x], rest, bound, place)
                                rest, bound = (rests[2 * y], rests[2 * y + 1]) if q >= n_ring else (0.0, 0.0)
                                qh, ql, q_bound = distance_across(pool[y], rest, bound, place)
                            else:
                                ph, pl, p_size, p_moved = high[plane, d], low[plane, d], abs(high[plane, d]), 0.0
                                qh, ql, q_size, q_moved = ph, pl, p_size, 0.0
                                for k in range(d):
                                    a, a_low, x, y = high[plane, k], low[plane, k], p * d + k, q * d + k
                                    rest, bound = (rests[2 * x], rests[2 * x + 1]) if p >= n_ring else (0.0, 0.0)
                                    ph, pl, p_size, p_moved = plus_term(
                                        ph, pl, p_size, p_moved, a, a_low, pool[x], rest, bound
                                    )
                                    rest, bound = (rests[2 * y], rests[2 * y + 1]) if q >= n_ring else (0.0, 0.0)
                                    qh, ql, q_size, q_moved = plus_term(
                                        qh, ql, q_size, q_moved, a, a_low, pool[y], rest, bound
                                    )
                                p_bound, q_bound = value_bound(p_size, p_moved), value_bound(q_size, q_moved)
                            if ph < 0.0:
                                ph, pl = -ph, -pl
                            if qh < 0.0:
                                qh, ql = -qh, -ql
                            least = min(ph, qh)
                            if not (p_bound < 0.001 * ph and q_bound < 0.001 * qh and least > WIDEST):
                                return polygon, begun, GIVEN_UP, n_cutting
                            r = 0.0
                            if p_bound > 0.0 or q_bound > 0.0:
                                r = 1.01 * max(p_bound / ph, q_bound / qh)
                            sum_h, sum_l = dd_add(ph, pl, qh, ql)
                            th, tl = dd_div(ph, pl, sum_h, sum_l)
                            for k in range(d):
                                h, rest, bound = place, 0.0, 0.0
                                if k != axis:
                                    x, y = p * d + k, q * d + k
                                    x_low, x_bound = (rests[2 * x], rests[2 * x + 1]) if p >= n_ring else (0.0, 0.0)
                                    y_low, y_bound = (rests[2 * y], rests[2 * y + 1]) if q >= n_ring else (0.0, 0.0)
                                    h, rest, bound = between(
                                        pool[x],
                                        x_low,
                                        x_bound,
                                        pool[y],
                                        y_low,
                                        y_bound,
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
                                is_sure = is_sure & surely_rounded(h, rest, bound)
                                pool[j * d + k] = h
                                rests[2 * (j * d + k)], rests[2 * (j * d + k) + 1] = rest, bound
                    if not is_sure:
                        return polygon, begun, GIVEN_UP, n_cutting
                    if was_on:
                        is_same, b = True, rings[there + kept - 1]
                        for k in range(d):
                            is_same = is_same & (pool[j * d + k] == pool[b * d + k])
                        if is_same:
                            return polygon, begun, GIVEN_UP, n_cutting
                    was_on = True
                    first_on = True if kept == 0 else first_on
                    edges[j] = -1 if sign > 0 else edge
                    rings[there + kept] = j
                    kept += 1
                    size_pool += 1
                contacts[i_plane] += size_pool - size_before
                if kept > 1 and was_on and first_on:
                    is_same, a, b = True, rings[there + kept - 1], rings[there]
                    for k in range(d):
                        is_same = is_same & (pool[a * d + k] == pool[b * d + k])
                    if is_same:
                        return polygon, begun, GIVEN_UP, n_cutting
                n, here, there = kept, there, here
                if n == 0:
                    break
            if (written + n_ring + n) * d > out.size:
                return polygon, begun, NO_ROOM, n_cutting
            place_out = written * d
            for i in range(n):
                j = rings[here + i]
                last_of_run = ends[j] if j < n_ring else j
                n_numbers = (last_of_run + 1 - j) * d
                move(out, place_out, pool, j * d, n_numbers)
                place_out += n_numbers
            sizes[ring] = place_out // d - written
            written = place_out // d
        for i in range(n_cutting):
            if written > begun and dropped[i] and contacts[i] > 2:
                may_have_bridges[polygon] = True
    return last, written, DONE, 0
