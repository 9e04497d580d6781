"""Sutherland-Hodgman in double-double: settles the polygons whose every decision and coordinate it can prove.

A vertex is a point of double-doubles with a bound for each coordinate; an original vertex has the bound zero. Each
plane takes the sign of every vertex (doubles with a bound, then an expansion for original vertices, then
double-double), keeps those on its inner side and cuts the edges that change sides:

    s_p > 0 > s_q        p ------ x -- q            x = (p |s_q| + q |s_p|) / (|s_p| + |s_q|)

A later plane decides about x from its double-doubles: their bound contains every rounding since the original input,
so a sign beyond it is the exact one. A sign within it, a coordinate that may round either way, two vertices in a plane
that may coincide: the polygon is left open, and exact integers settle it (exact_contours.py).

A plane that has all original vertices inside is left out, for what other planes leave lies between them; one that has
all of them outside leaves nothing.

Bound of a cut coordinate: the larger bound of both ends (x lies between them), the roundings of cut_point.py, and
r |q - p| for weights known to a relative r: the parameter moves by at most 2 r t (1 - t) <= r / 2.

Source: I. E. Sutherland, G. W. Hodgman, Reentrant polygon clipping, 1974; the textbook's section on clipping polygons.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.clipping.cut_point import CUT_BOUND, POINT_BOUND, is_safe, side_of
from engine.clipping.cyrus_beck import exact_sign, expand_value
from engine.jit import inline, kernel
from engine.predicates.double_double import U2, dd_add, dd_div, dd_mul, dd_sub, surely_rounded
from engine.predicates.error_free import two_diff, two_prod, two_sum, workspace
from engine.types import UNDECIDED

CLIPPED: Final = 0
OPEN: Final = 1
INSIDE: Final = 1
OUTSIDE: Final = -1
CUTS: Final = 0
VALUE_BOUND: Final = 16.0 * 2.0**-53
"""Signs in doubles: a term loses the low parts of row and vertex, a product, three sums; its size as much again."""
ACROSS_BOUND: Final = 4.0 * 2.0**-53
"""A difference of a coordinate and a plane's, rounded twice."""
DD_VALUE_BOUND: Final = 32.0 * U2
"""Signs in double-double: rows known to 2 u^2, products 5 u^2, three sums of 4 u^2."""


@inline
def rough_sign(row: Any, points: Any, i: int) -> int:
    """Return the sign of a row at vertex i from doubles, UNDECIDED where they do not prove it."""
    d = row.size - 1
    value, size, moved = row[d], abs(row[d]), 0.0
    for k in range(d):
        term = row[k] * points[i, k, 0]
        value += term
        size += abs(term)
        moved += abs(row[k]) * points[i, k, 2]
    bound = VALUE_BOUND * size + 1.01 * moved
    return 1 if value > bound else (-1 if -value > bound else UNDECIDED)


@inline
def value_of(high: Any, low: Any, points: Any, i: int) -> tuple[float, float, float]:
    """Return the value of a row of double-doubles at vertex i, and its bound."""
    d = high.size - 1
    h, rest, size, moved = high[d], low[d], abs(high[d]), 0.0
    for k in range(d):
        ph, pl = dd_mul(high[k], low[k], points[i, k, 0], points[i, k, 1])
        h, rest = dd_add(h, rest, ph, pl)
        size += abs(ph)
        moved += abs(high[k]) * points[i, k, 2]
    return h, rest, DD_VALUE_BOUND * size + 1.01 * moved


@inline
def sign_across(sense: float, axis: int, at: float, points: Any, i: int) -> int:
    """Return the exact sign at vertex i of the plane where a coordinate is `at`, or UNDECIDED; sense: of its normal."""
    h, low, bound = points[i, axis, 0], points[i, axis, 1], points[i, axis, 2]
    gap = (h - at) + low  # h and at close: the difference is exact; else far beyond any bound
    if low == 0.0 and bound == 0.0:
        gap, slack = (1.0 if h > at else (-1.0 if h < at else 0.0)), 0.0
        if gap == 0.0:
            return 0
    else:
        slack = bound + 4.0 * 2.0**-53 * abs(low) + ACROSS_BOUND * abs(gap)
    if abs(gap) > slack:
        return 1 if gap * sense > 0.0 else -1
    return UNDECIDED


@inline
def is_exact(points: Any, i: int) -> bool:
    """Tell whether every coordinate of vertex i is a known double."""
    exact = True
    for k in range(points.shape[1]):
        exact = exact and points[i, k, 2] == 0.0 and points[i, k, 1] == 0.0
    return exact


@inline
def is_double_row(low: Any) -> bool:
    """Tell whether a row of double-doubles is one of doubles."""
    exact = True
    for k in range(low.size):
        exact = exact and low[k] == 0.0
    return exact


@inline
def sign_at(high: Any, low: Any, points: Any, i: int) -> int:
    """Return the exact sign of a row at vertex i, or UNDECIDED."""
    sign = rough_sign(high, points, i)
    if sign != UNDECIDED:
        return sign
    if is_double_row(low) and is_exact(points, i):
        return exact_sign(high, points[i, :, 0])
    h, _, bound = value_of(high, low, points, i)
    return 1 if h > bound else (-1 if -h > bound else UNDECIDED)


@inline
def compare_vertices(points: Any, i: int, j: int) -> int:
    """Return 0 if two vertices are the same point, 1 if they surely differ, else UNDECIDED."""
    for k in range(points.shape[1]):
        h, _ = dd_sub(points[i, k, 0], points[i, k, 1], points[j, k, 0], points[j, k, 1])
        slack = 8.0 * U2 * (abs(points[i, k, 0]) + abs(points[j, k, 0]))
        if abs(h) > points[i, k, 2] + points[j, k, 2] + slack:
            return 1
    if not (is_exact(points, i) and is_exact(points, j)):
        return UNDECIDED
    for k in range(points.shape[1]):
        if points[i, k, 0] != points[j, k, 0]:
            return 1
    return 0


@inline
def copy_vertex(source: Any, i: int, target: Any, j: int) -> None:
    for k in range(source.shape[1]):
        target[j, k, 0], target[j, k, 1], target[j, k, 2] = source[i, k, 0], source[i, k, 1], source[i, k, 2]


@inline
def is_at(high: Any, source: Any, p: int, q: int, k: int, x: float) -> bool:
    """Tell whether coordinate k is exactly x where the edge p q crosses the plane of a row; all three known doubles."""
    wp, wq, e = workspace(8), workspace(8), workspace(96)
    n_wp, n_wq = expand_value(high, source[p, :, 0], wp), expand_value(high, source[q, :, 0], wq)
    # the values have two signs: turned over, one of them is a weight, and the sign asked for is not that of zero
    for i in range(n_wq):
        wq[i] = -wq[i]
    return side_of(source[p, k, 0], source[q, k, 0], wp, n_wp, wq, n_wq, x, 0.0, e) == 0


@inline
def cut_edge(high: Any, low: Any, axis: int, at: float, source: Any, p: int, q: int, target: Any, j: int) -> bool:
    """Set vertex j of `target` to where the edge p q crosses a plane; False where a value is known too roughly.

    A coordinate that may be a double is compared with it exactly, where both ends and the row are doubles: cuts that
    hit a lattice or another plane stay exact.
    """
    if axis >= 0:
        ph, pl = dd_add(source[p, axis, 0], source[p, axis, 1], -at, 0.0)
        qh, ql = dd_add(source[q, axis, 0], source[q, axis, 1], -at, 0.0)
        p_bound = source[p, axis, 2] + 4.0 * U2 * abs(ph)
        q_bound = source[q, axis, 2] + 4.0 * U2 * abs(qh)
    else:
        ph, pl, p_bound = value_of(high, low, source, p)
        qh, ql, q_bound = value_of(high, low, source, q)
    if ph < 0.0:
        ph, pl = -ph, -pl
    if qh < 0.0:
        qh, ql = -qh, -ql
    if not (p_bound < 0.001 * ph and q_bound < 0.001 * qh):
        return False
    r = 1.01 * max(p_bound / ph, q_bound / qh)
    sum_h, sum_l = dd_add(ph, pl, qh, ql)
    th, tl = dd_div(ph, pl, sum_h, sum_l)
    for k in range(source.shape[1]):
        xh, xl, x_bound = source[p, k, 0], source[p, k, 1], source[p, k, 2]
        yh, yl, y_bound = source[q, k, 0], source[q, k, 1], source[q, k, 2]
        if k == axis:
            target[j, k, 0], target[j, k, 1], target[j, k, 2] = at, 0.0, 0.0
        elif xh == yh and xl == yl and x_bound == 0.0 and y_bound == 0.0:
            target[j, k, 0], target[j, k, 1], target[j, k, 2] = xh, xl, 0.0
        elif xl == 0.0 and yl == 0.0 and x_bound == 0.0 and y_bound == 0.0:
            dh, dl = two_diff(yh, xh)
            mh, ml = two_prod(th, dh)
            sh, sl = two_sum(xh, mh)
            h, rest = two_sum(sh, (sl + ml) + (tl * dh + th * dl))
            bound = 1.01 * (POINT_BOUND * (abs(xh) + abs(mh)) + r * abs(dh))
            if abs(rest) <= bound:
                double = h if abs(h) > bound else 0.0
                if is_double_row(low) and is_exact(source, p) and is_exact(source, q):
                    if is_at(high, source, p, q, k, double):
                        h, rest, bound = double, 0.0, 0.0
            target[j, k, 0], target[j, k, 1], target[j, k, 2] = h, rest, bound
        else:
            ah, al = dd_mul(xh, xl, qh, ql)
            bh, bl = dd_mul(yh, yl, ph, pl)
            nh, nl = dd_add(ah, al, bh, bl)
            target[j, k, 0], target[j, k, 1] = dd_div(nh, nl, sum_h, sum_l)
            roundings = CUT_BOUND * max(abs(xh), abs(yh)) + r * abs(yh - xh)
            target[j, k, 2] = 1.01 * (max(x_bound, y_bound) + roundings)
    return True


@inline
def clip_ring(
    high: Any,
    low: Any,
    axis: int,
    at: float,
    source: Any,
    n: int,
    edges: Any,
    ring: Any,
    n_ring: int,
    signs: Any,
    target: Any,
    target_edges: Any,
    on_plane: Any,
) -> tuple[int, int, bool]:
    """Cut a ring of n vertices by one plane into `target`; `signs`, `on_plane`: scratch of the same room.

    ring: the original n_ring vertices. edges: for each vertex of `source`, and so in `target_edges`, the original edge
    that goes on from it, by its first vertex, -1 for one along a plane: cuts are made on original edges where possible.

    Returns the number of vertices left (-1: open; the ring itself where nothing is dropped), in how many points the
    plane was met, and whether a vertex was dropped.
    """
    n_contacts, has_dropped = 0, False
    sense = 1.0
    if axis >= 0 and high[axis] < 0.0:
        sense = -1.0
    for i in range(n):
        if axis >= 0:
            signs[i] = sign_across(sense, axis, at, source, i)
        else:
            signs[i] = sign_at(high, low, source, i)
        if signs[i] == UNDECIDED:
            return -1, 0, False
        if signs[i] == 0:
            n_contacts += 1
        has_dropped = has_dropped or signs[i] < 0
    if not has_dropped:
        return n, n_contacts, False
    kept = 0
    for i in range(n):
        following = i + 1 if i + 1 < n else 0
        for step in range(2):
            if step == 0:
                if signs[i] < 0:
                    continue
                copy_vertex(source, i, target, kept)
                on_plane[kept] = signs[i] == 0
                target_edges[kept] = -1 if signs[i] == 0 and signs[following] < 0 else edges[i]
            else:
                if signs[i] * signs[following] >= 0:
                    continue
                n_contacts += 1
                if kept + 1 >= target.shape[0]:
                    return -1, 0, False
                edge = edges[i]
                if edge < 0:
                    is_cut = cut_edge(high, low, axis, at, source, i, following, target, kept)
                else:
                    after = edge + 1 if edge + 1 < n_ring else 0
                    is_cut = cut_edge(high, low, axis, at, ring, edge, after, target, kept)
                if not is_cut:
                    return -1, 0, False
                on_plane[kept] = True
                target_edges[kept] = edge if signs[i] < 0 else -1
            if kept > 0 and on_plane[kept] and on_plane[kept - 1]:
                relation = compare_vertices(target, kept, kept - 1)
                if relation == UNDECIDED:
                    return -1, 0, False
                if relation == 0:
                    target_edges[kept - 1] = target_edges[kept]
                    continue
            kept += 1
            if kept >= target.shape[0]:
                return -1, 0, False
    while kept > 1 and on_plane[kept - 1] and on_plane[0]:
        relation = compare_vertices(target, kept - 1, 0)
        if relation == UNDECIDED:
            return -1, 0, False
        if relation == 1:
            break
        kept -= 1
    return kept, n_contacts, True


@inline
def effect_of(high: Any, axis: int, at: float, vertices: Any, first: int, last: int, lows: Any, highs: Any) -> int:
    """Tell what a plane does to vertices first .. last - 1: INSIDE all, OUTSIDE of it all, or CUTS, where unsure.

    lows, highs: their smallest and largest coordinates. Exact: what later planes see are points between the vertices.
    """
    if axis >= 0:
        if high[axis] > 0.0:
            return INSIDE if lows[axis] >= at else (OUTSIDE if highs[axis] < at else CUTS)
        return INSIDE if highs[axis] <= at else (OUTSIDE if lows[axis] > at else CUTS)
    d = high.size - 1
    size = abs(high[d])
    for k in range(d):
        size += abs(high[k]) * max(abs(lows[k]), abs(highs[k]))
    bound = VALUE_BOUND * size
    n_in = n_out = 0
    for i in range(first, last):
        value = high[d]
        for k in range(d):
            value += high[k] * vertices[i, k]
        n_in += value > bound
        n_out += -value > bound
    return INSIDE if n_in == last - first else (OUTSIDE if n_out == last - first else CUTS)


@inline
def load_ring(vertices: Any, first: int, last: int, points: Any) -> int:
    """Load a ring without vertices equal to the one before, around the ring; return how many, -1 out of range."""
    n = 0
    for i in range(first, last):
        is_same = n > 0
        for k in range(vertices.shape[1]):
            x = vertices[i, k]
            if not is_safe(x):
                return -1
            is_same = is_same and points[n - 1, k, 0] == x
            points[n, k, 0], points[n, k, 1], points[n, k, 2] = x, 0.0, 0.0
        if not is_same:
            n += 1
    while n > 1 and compare_vertices(points, n - 1, 0) == 0:
        n -= 1
    return n


@inline
def store_ring(points: Any, n: int, out: Any, first: int) -> bool:
    """Write the nearest doubles of a ring to ``out[first:]``; False where one is not sure."""
    for i in range(n):
        for k in range(points.shape[1]):
            h, low, bound = points[i, k, 0], points[i, k, 1], points[i, k, 2]
            if bound > 0.0 and not surely_rounded(h, low, bound + 2.0 * U2 * abs(h)):
                return False
            out[first + i, k] = h + low
    return True


@kernel
def clip_rings(
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
    sizes: Any,
    state: Any,
    may_have_bridges: Any,
) -> tuple[int, int]:
    """Clip polygons first .. last - 1 by all planes; returns the polygon reached and the vertices written.

    vertices: (m, dim) float64 with the offsets of rings and polygons. high, low: (planes, dim + 1) float64, rows as
    double-doubles, every number zero or in the safe range. axes, at: for a plane across one axis that axis and its
    coordinate, else -1. stop: one uint8, polled. out: (room, dim) float64, rings one after another; sizes: (n_rings,)
    int64, vertices left of each. state: (n,) uint8, CLIPPED or OPEN; an open polygon has sizes 0 and writes nothing.
    Stops before a polygon that has no room in `out`.
    """
    n_planes, dimension = high.shape[0], vertices.shape[1]
    largest = 0
    for ring in range(polygon_offsets[first], polygon_offsets[last]):
        largest = max(largest, ring_offsets[ring + 1] - ring_offsets[ring])
    room = 2 * largest + 2 * n_planes + 8  # a convex ring gains one vertex a plane; one that outgrows this is left open
    here, there = np.empty((room, dimension, 3)), np.empty((room, dimension, 3))
    ring_points, edges, new_edges = np.empty((largest, dimension, 3)), np.empty(room, np.int64), np.empty(room, np.int64)
    signs, on_plane = np.empty(room, np.int64), np.empty(room, np.bool_)
    contacts, dropped = np.empty(n_planes, np.int64), np.empty(n_planes, np.bool_)
    cutting, lows, highs = np.empty(n_planes, np.int64), np.empty(dimension), np.empty(dimension)
    written = 0
    for polygon in range(first, last):
        if stop[0]:
            return polygon, written
        begun = written
        begin, until = ring_offsets[polygon_offsets[polygon]], ring_offsets[polygon_offsets[polygon + 1]]
        safe = True
        for k in range(dimension):
            low_k = high_k = vertices[begin, k]
            for i in range(begin, until):
                x = vertices[i, k]
                low_k, high_k = min(low_k, x), max(high_k, x)
                safe = safe and is_safe(x)
            lows[k], highs[k] = low_k, high_k
        n_cutting, is_outside = 0, False
        for plane in range(n_planes):
            effect = CUTS
            if safe:
                effect = effect_of(high[plane], axes[plane], at[plane], vertices, begin, until, lows, highs)
            is_outside = is_outside or effect == OUTSIDE
            if effect == CUTS:
                cutting[n_cutting] = plane
                n_cutting += 1
        state[polygon], may_have_bridges[polygon] = CLIPPED, False
        if is_outside:
            for ring in range(polygon_offsets[polygon], polygon_offsets[polygon + 1]):
                sizes[ring] = 0
            continue
        for i_plane in range(n_cutting):
            contacts[cutting[i_plane]], dropped[cutting[i_plane]] = 0, False
        is_open = False
        for ring in range(polygon_offsets[polygon], polygon_offsets[polygon + 1]):
            n = load_ring(vertices, ring_offsets[ring], ring_offsets[ring + 1], here)
            n_ring = n
            for i in range(n):
                copy_vertex(here, i, ring_points, i)
                edges[i] = i
            for i_plane in range(n_cutting):
                if n <= 0:
                    break
                plane = cutting[i_plane]
                n, met, has_dropped = clip_ring(
                    high[plane],
                    low[plane],
                    axes[plane],
                    at[plane],
                    here,
                    n,
                    edges,
                    ring_points,
                    n_ring,
                    signs,
                    there,
                    new_edges,
                    on_plane,
                )
                contacts[plane] += met
                if has_dropped:
                    dropped[plane] = True
                    here, there = there, here
                    edges, new_edges = new_edges, edges
            if n > 0 and written + n > out.shape[0]:
                return polygon, begun
            if n < 0 or not store_ring(here, n, out, written):
                is_open = True
                break
            sizes[ring] = n
            written += n
        if is_open:
            state[polygon], written = OPEN, begun
            for ring in range(polygon_offsets[polygon], polygon_offsets[polygon + 1]):
                sizes[ring] = 0
            continue
        for i_plane in range(n_cutting):
            if written > begun and dropped[cutting[i_plane]] and contacts[cutting[i_plane]] > 2:
                may_have_bridges[polygon] = True
    return last, written
