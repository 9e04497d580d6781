"""The point where a segment crosses an edge of the plane or a triangle of space, where double-doubles leave it open.

Exact values s(p) and s(q) of the line or plane at both ends are expansions (crossing_values.py says what s is); of them
`nearest` finds t and each coordinate, ties and zeros too. Coordinates are zero or of sizes within 2^-120 .. 2^120, so
differences are multiples of 2^-172 and values of 2^-516, below 2^366.
"""

from __future__ import annotations

from typing import Any

from engine.jit import called, inline
from engine.predicates.cut_point import nearest, parameter_and_point
from engine.predicates.error_free import two_diff, workspace
from engine.predicates.expansion import Components, add_scaled, compress, grow, sign
from engine.predicates.parameters import minor


@inline
def _magnitude(e: Components, n: int) -> int:
    """Rewrite an expansion as its magnitude, compressed; return its length."""
    n = compress(e, n)
    if sign(e, n) < 0:
        for i in range(n):
            e[i] = -e[i]
    return n


@called
def edge_value(elements: Any, element: int, x: float, y: float, e: Components) -> int:
    """Set e, 16 places, to |(b - a) x ((x, y) - a)| of an edge a b; return its length."""
    ax, ay = elements[element, 0, 0], elements[element, 0, 1]
    u, u_tail = two_diff(elements[element, 1, 0], ax)
    v, v_tail = two_diff(elements[element, 1, 1], ay)
    x, x_tail = two_diff(x, ax)
    y, y_tail = two_diff(y, ay)
    return _magnitude(e, minor(e, u, u_tail, v, v_tail, x, x_tail, y, y_tail))


@called
def triangle_value(elements: Any, element: int, segments: Any, item: int, end: int, e: Components) -> int:
    """Set e, 192 places, to |((b - a) x (c - a)) . (x - a)| of a triangle a b c, x an end of a segment; return its
    length."""
    m, n = workspace(16), 0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        u, u_tail = two_diff(elements[element, 1, i], elements[element, 0, i])
        v, v_tail = two_diff(elements[element, 1, j], elements[element, 0, j])
        x, x_tail = two_diff(elements[element, 2, i], elements[element, 0, i])
        y, y_tail = two_diff(elements[element, 2, j], elements[element, 0, j])
        length = minor(m, u, u_tail, v, v_tail, x, x_tail, y, y_tail)
        for part in two_diff(segments[item, end, k], elements[element, 0, k])[::-1]:
            if part != 0.0:
                n = add_scaled(e, n, m, length, part)
    return _magnitude(e, n)


@called
def cross_exactly(segments: Any, item: int, elements: Any, element: int, point: Any) -> tuple[float, bool]:
    """Set `point` to where a segment crosses an element; return t and whether all is sure.

    The ends lie on different sides, or one of them on the element's line or plane.
    """
    if segments.shape[2] == 2:
        wp, wq, e = workspace(16), workspace(16), workspace(192)
        n_wp = edge_value(elements, element, segments[item, 0, 0], segments[item, 0, 1], wp)
        n_wq = edge_value(elements, element, segments[item, 1, 0], segments[item, 1, 1], wq)
        return parameter_and_point(segments[item], wp, n_wp, wq, n_wq, -1, 0.0, point, e)
    wp_3, wq_3, e_3 = workspace(192), workspace(192), workspace(2304)
    n_wp = triangle_value(elements, element, segments, item, 0, wp_3)
    n_wq = triangle_value(elements, element, segments, item, 1, wq_3)
    return parameter_and_point(segments[item], wp_3, n_wp, wq_3, n_wq, -1, 0.0, point, e_3)


@called
def parameter_exactly(p: float, q: float, x: float) -> tuple[float, bool]:
    """Return (x - p) / (q - p), x between p and q, and whether it is surely the nearest double."""
    wp, wq, e = workspace(2), workspace(2), workspace(24)
    n_wp, n_wq = _difference(x, p, wp), _difference(q, x, wq)
    h, low = two_diff(q, p)
    way = 1.0 if h > 0.0 else -1.0
    return nearest(0.0, 1.0, wp, n_wp, wq, n_wq, way * h, way * low, e)


@inline
def _difference(x: float, y: float, e: Components) -> int:
    """Set e, two places, to |x - y|; return its length."""
    h, low = two_diff(x, y)
    return _magnitude(e, grow(e, grow(e, 0, low), h))
