"""Exact decisions on crossings of edges, each the sign of an expansion.

The crossing of an edge ab with the line through c and d divides ab by the two weights

    w_a = orient(c, d, a),   w_b = orient(c, d, b)   (of opposite signs),   x = (a |w_b| + b |w_a|) / (|w_a| + |w_b|).

All decisions are polynomials of degree four at most in the coordinates of the input, never of computed points.
Preconditions: every coordinate is zero or within 2^-120 .. 2^120, so that expansions are exact (multiples of 2^-172, of
2^-688 after a product of four) and double-doubles keep their bounds; or it is infinitesimal, below 2^-1061 (a
neighbour of zero). Infinitesimals count as 0 in expansions: that changes differences by 2^-1060, weights by 2^-937,
products of two weights by 2^-692 in all. A sign that is not 0 then is the sign for the input; where it is 0 and one of
the edges has an infinitesimal coordinate, it is not decided, which ``Edges.doubts`` records.

A weight as a double-double carries 32 u^2 (|p| + |q|) for its two products p and q: differences are exact, products
14 u^2, their sum 4 u^2.

Source: J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates, 1997.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final

from engine.compiling.jit import called, inline, merged
from engine.predicates.error_free import U2, dd_mul, dd_sub, two_diff, workspace
from engine.predicates.expansion import SMALLEST, Components, add_product, grow, sign
from engine.predicates.orientation import BOUND_2D, GUARD_2D, orient2d_exact
from engine.predicates.parameters import minor
from engine.types import UNDECIDED, Point2

INFINITESIMAL: Final = 2.0**-1061
WEIGHT_BOUND: Final = 32.0 * U2
WEIGHT_GUARD: Final = 2.0**-1060
"""Error bound of a weight, relative (WEIGHT_BOUND) and for products that underflow."""
WEIGHT_ROOM: Final = 16
"""Most components of a weight: two products of two differences, each of two components."""

Edges = namedtuple("Edges", "x y after before ring doubts")
"""Closed rings as vertices; edge i runs from vertex i to vertex ``after[i]``. x, y: float64; after, before, ring:
int64; one entry a vertex. doubts: int64, its first entry is set to 1 where a sign is not decided."""

Ends = tuple[float, float, float, float]
"""x and y of the first end of an edge, then of the second."""


@merged
def orient(edges: Edges, a: int, b: int, c: int) -> int:
    """Return the exact sign of orient2d(a, b, c) of three vertices: 1 for a left turn."""
    x, y = edges.x, edges.y
    left = (x[a] - x[c]) * (y[b] - y[c])
    right = (y[a] - y[c]) * (x[b] - x[c])
    det = left - right
    threshold = BOUND_2D * (abs(left) + abs(right)) + GUARD_2D
    if det > threshold:
        return 1
    if -det > threshold:
        return -1
    return _exact_orient(edges, a, b, c)


@called
def _exact_orient(edges: Edges, a: int, b: int, c: int) -> int:
    """Return the sign of orient2d(a, b, c), computed with an expansion; 0 also if it is not decided."""
    x, y = edges.x, edges.y
    if ((x[a] == x[c]) & (y[a] == y[c])) | ((x[b] == x[c]) & (y[b] == y[c])):  # case: borders that polygons share
        return 0
    side = orient2d_exact(Point2(x[a], y[a]), Point2(x[b], y[b]), Point2(x[c], y[c]))
    if side == UNDECIDED:
        edges.doubts[0] = 1
        return 0
    return side


@inline
def flushed(z: float) -> float:
    """Return 0.0 for an infinitesimal, else z."""
    return 0.0 if abs(z) < INFINITESIMAL else z


@inline
def _is_infinitesimal(z: float) -> bool:
    """Return whether z is not 0, but counts as 0 in expansions."""
    return (z != 0.0) & (abs(z) < INFINITESIMAL)


@inline
def _ends_at_infinitesimal(edges: Edges, e: int) -> bool:
    """Return whether edge e has an end with an infinitesimal coordinate."""
    ax, ay, bx, by = edges.x[e], edges.y[e], edges.x[edges.after[e]], edges.y[edges.after[e]]
    return _is_infinitesimal(ax) or _is_infinitesimal(ay) or _is_infinitesimal(bx) or _is_infinitesimal(by)


@called
def doubt_zero(edges: Edges, side: int, e: int, f: int, g: int) -> int:
    """Return ``side``, the sign of an expansion for edges e, f and g; if it is 0 and one of their coordinates is
    infinitesimal, record the doubt."""
    if side == 0 and (
        _ends_at_infinitesimal(edges, e) or _ends_at_infinitesimal(edges, f) or _ends_at_infinitesimal(edges, g)
    ):
        edges.doubts[0] = 1
    return side


@merged
def turn_of_edges(edges: Edges, e: int, f: int) -> int:
    """Return the exact sign of the cross product of the directions of edges e and f: 1 if f points to the left of e."""
    x, y = edges.x, edges.y
    b, d = edges.after[e], edges.after[f]
    left = (x[b] - x[e]) * (y[d] - y[f])
    right = (y[b] - y[e]) * (x[d] - x[f])
    det = left - right
    threshold = BOUND_2D * (abs(left) + abs(right)) + GUARD_2D  # each factor, product and the sum is off by u
    if det > threshold:
        return 1
    if -det > threshold:
        return -1
    if e == f:
        return 0
    return _exact_turn(edges, e, b, f, d)


@called
def _exact_turn(edges: Edges, a: int, b: int, c: int, d: int) -> int:
    """Return the sign of the cross product ``(b - a) x (d - c)`` of four vertices, computed with an expansion."""
    x, y = edges.x, edges.y
    if (x[a] == x[d]) & (y[a] == y[d]) & (x[b] == x[c]) & (y[b] == y[c]):  # case: as above
        return 0
    e = workspace(16)
    side = sign(e, exact_cross((x[a], y[a], x[b], y[b]), (x[c], y[c], x[d], y[d]), e))
    return doubt_zero(edges, side, a, c, c)


@merged
def exact_cross(first: Ends, second: Ends, e: Components) -> int:
    """Set expansion e to the cross product of the directions of two edges, infinitesimals as 0; return its number of
    components, at most WEIGHT_ROOM."""
    ux, ux_tail = two_diff(flushed(first[2]), flushed(first[0]))
    uy, uy_tail = two_diff(flushed(first[3]), flushed(first[1]))
    vx, vx_tail = two_diff(flushed(second[2]), flushed(second[0]))
    vy, vy_tail = two_diff(flushed(second[3]), flushed(second[1]))
    return minor(e, ux, ux_tail, uy, uy_tail, vx, vx_tail, vy, vy_tail)


@inline
def weight_of(cx: float, cy: float, dx: float, dy: float, px: float, py: float) -> tuple[float, float, float]:
    """Return (h, low, bound): orient2d(c, d, p) as a double-double, and a bound of its absolute error."""
    ux, ux_tail = two_diff(dx, cx)
    uy, uy_tail = two_diff(dy, cy)
    wx, wx_tail = two_diff(px, cx)
    wy, wy_tail = two_diff(py, cy)
    ph, pl = dd_mul(ux, ux_tail, wy, wy_tail)
    qh, ql = dd_mul(uy, uy_tail, wx, wx_tail)
    h, low = dd_sub(ph, pl, qh, ql)
    return h, low, WEIGHT_BOUND * (abs(ph) + abs(qh)) + WEIGHT_GUARD


@called
def exact_weight(edges: Edges, c: int, d: int, p: int, e: Components) -> int:
    """Set expansion e to orient2d(c, d, p) of three vertices; return its number of components, at most WEIGHT_ROOM."""
    x, y = edges.x, edges.y
    return exact_cross((x[c], y[c], x[d], y[d]), (x[c], y[c], x[p], y[p]), e)


@called
def order_of_crossings(edges: Edges, e: int, f: int, g: int) -> int:
    """Return -1, 0 or 1: along edge e, its crossing with edge f comes before, with or after that with edge g. Exact.
    Caller guarantees that f and g each cross e in a point inside both."""
    a, b, fb, gb = e, edges.after[e], edges.after[f], edges.after[g]
    wfa, wfb, wga, wgb = workspace(16), workspace(16), workspace(16), workspace(16)
    nfa, nfb = exact_weight(edges, f, fb, a, wfa), exact_weight(edges, f, fb, b, wfb)
    nga, ngb = exact_weight(edges, g, gb, a, wga), exact_weight(edges, g, gb, b, wgb)
    # With t_f = w_a / (w_a - w_b) the difference t_f - t_g has the sign of w_a(g) w_b(f) - w_a(f) w_b(g), times the
    # signs of w_a(f) and w_a(g).
    total = workspace(1024)  # 2 * 16 * 16 components for each of two products
    n = add_product(total, 0, wga, nga, wfb, nfb)
    for k in range(nfa):
        wfa[k] = -wfa[k]
    n = add_product(total, n, wfa, nfa, wgb, ngb)
    return doubt_zero(edges, -sign(total, n) * sign(wfa, nfa) * sign(wga, nga), e, f, g)


@called
def crossing_against(edges: Edges, e: int, f: int, axis: int, value: float, tail: float) -> int:
    """Return the exact sign of ``coordinate - (value + tail)`` for the crossing of edges e and f; axis 0: x, 1: y.
    Caller guarantees that e and f cross in a point inside both, and that ``value + tail`` rounds to ``value``."""
    z = edges.x if axis == 0 else edges.y
    a, b, fb = e, edges.after[e], edges.after[f]
    wa, wb, p, q = workspace(16), workspace(16), workspace(4), workspace(4)
    na, nb = exact_weight(edges, f, fb, a, wa), exact_weight(edges, f, fb, b, wb)
    # x - v = ((a - v) |w_b| + (b - v) |w_a|) / (|w_a| + |w_b|)
    np_, nq = _set_difference(z[a], value, tail, p), _set_difference(z[b], value, tail, q)
    total = workspace(256)  # 2 * 16 * 3 components for each of two products
    if sign(wa, na) < 0 or sign(wb, nb) > 0:  # of opposite signs, but 0 where only an infinitesimal makes it another
        for k in range(na):
            wa[k] = -wa[k]
    else:
        for k in range(nb):
            wb[k] = -wb[k]
    n = add_product(total, 0, wb, nb, p, np_)
    n = add_product(total, n, wa, na, q, nq)
    side = sign(total, n)
    if side == 0 and _is_infinitesimal(value):
        edges.doubts[0] = 1
    has_low_bits = INFINITESIMAL <= abs(value) < SMALLEST  # of a crossing near an axis: below those of coordinates
    doubt_zero(edges, 0 if has_low_bits else side, e, f, f)
    return side


@inline
def _set_difference(z: float, value: float, tail: float, e: Components) -> int:
    """Set expansion e to ``z - value - tail``, infinitesimals as 0; return its number of components, at most 3."""
    n = 0
    high, low = two_diff(flushed(z), flushed(value))
    if low != 0.0:
        e[0] = low
        n = 1
    if high != 0.0:
        e[n] = high
        n += 1
    if tail == 0.0:
        return n
    return grow(e, n, -tail)
