"""The candidates of a search again, in double-doubles: mostly that tells the double nearest to the distance.

Of each pair of triangles the nearest points of its two features are found as convex combinations of corners, so they
lie on the triangles but for rounding: their distance bounds that of the pair from above, and the slab across the line
between them from below, whatever the points are.

**Bound.** Coordinates are products of two doubles, exact, and sums of seven such, each sum off by 4 u^2 of all terms; a
point takes six operations more, a slab eight, each on numbers below twice `size`, which bounds all coordinates. All
together is below 2^-98 size; 2^-94 size is allowed.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from engine.collision.clearance.blocks import keep_below
from engine.collision.clearance.boxes import Search, View
from engine.collision.clearance.near_triangles import FACE
from engine.jit import called, inline
from engine.predicates.double_double import dd_add, dd_div, dd_mul, dd_sub, surely_rounded
from engine.predicates.error_free import fast_two_sum, two_diff, two_prod
from engine.types import Point3

_ROUNDING: Final = 2.0**-94


class Wide(NamedTuple):
    """A double-double."""

    h: float
    low: float


class Wide3(NamedTuple):
    """A point."""

    x: Wide
    y: Wide
    z: Wide


class Triangle(NamedTuple):
    """Three corners."""

    p: Wide3
    q: Wide3
    r: Wide3


@inline
def _times(a: Wide, b: Wide) -> Wide:
    h, low = dd_mul(a.h, a.low, b.h, b.low)
    return Wide(h, low)


@inline
def _less(a: Wide, b: Wide) -> Wide:
    h, low = dd_sub(a.h, a.low, b.h, b.low)
    return Wide(h, low)


@inline
def _minus(a: Wide3, b: Wide3) -> Wide3:
    return Wide3(_less(a.x, b.x), _less(a.y, b.y), _less(a.z, b.z))


@called
def _dot(a: Wide3, b: Wide3) -> Wide:
    x, y, z = _times(a.x, b.x), _times(a.y, b.y), _times(a.z, b.z)
    s, t = dd_add(x.h, x.low, y.h, y.low)
    h, low = dd_add(s, t, z.h, z.low)
    return Wide(h, low)


@inline
def _moved(a: Wide, t: Wide, u: Wide) -> Wide:
    x = _times(t, u)
    h, low = dd_add(a.h, a.low, x.h, x.low)
    return Wide(h, low)


@inline
def _along(a: Wide3, t: Wide, u: Wide3) -> Wide3:
    """Return a + t u."""
    return Wide3(_moved(a.x, t, u.x), _moved(a.y, t, u.y), _moved(a.z, t, u.z))


@inline
def _share(top: Wide, bottom: Wide) -> Wide:
    """Return top / bottom, but from 0 to 1."""
    if not (bottom.h > 0.0 and top.h > 0.0):
        return Wide(0.0, 0.0)
    h, low = dd_div(top.h, top.low, bottom.h, bottom.low)
    return Wide(h, low) if h < 1.0 else Wide(1.0, 0.0)


@inline
def _root(a: Wide) -> Wide:
    """Return the root of a positive number."""
    h = np.sqrt(a.h)
    p, e = two_prod(h, h)
    r, low = fast_two_sum(h, ((a.h - p) - e + a.low) / (2.0 * h))
    return Wide(r, low)


@inline
def _row(a: Point3, p: Point3, shift: Wide) -> Wide:
    """Return a . p + shift."""
    h, low = shift
    for x, y in ((a.x, p.x), (a.y, p.y), (a.z, p.z)):
        product = two_prod(x, y)
        h, low = dd_add(h, low, product[0], product[1])
    return Wide(h, low)


@called
def _corner(view: View, vertex: int, shift: Wide3) -> Wide3:
    """Return a placed vertex, times the unit."""
    p, m = view.mesh.vertices, view.place
    v = Point3(p[vertex, 0] * view.unit, p[vertex, 1] * view.unit, p[vertex, 2] * view.unit)
    x = _row(Point3(m.xx, m.xy, m.xz), v, shift.x)
    y = _row(Point3(m.yx, m.yy, m.yz), v, shift.y)
    return Wide3(x, y, _row(Point3(m.zx, m.zy, m.zz), v, shift.z))


@inline
def _corners(view: View, triangle: int, shift: Wide3) -> Triangle:
    t = view.mesh.triangles
    p, q = _corner(view, t[triangle, 0], shift), _corner(view, t[triangle, 1], shift)
    return Triangle(p, q, _corner(view, t[triangle, 2], shift))


@inline
def _vertex(t: Triangle, k: int) -> Wide3:
    return t.p if k == 0 else (t.q if k == 1 else t.r)


@inline
def _edge(t: Triangle, k: int) -> tuple[Wide3, Wide3]:
    """Return the start of an edge, and the vector to its end."""
    a = _vertex(t, k)
    return a, _minus(_vertex(t, (k + 1) % 3), a)


@called
def _foot(point: Wide3, t: Triangle, feature: int) -> Wide3:
    """Return the point of a vertex, edge or triangle that is nearest to a point, or some other of it."""
    if feature < 3:
        return _vertex(t, feature)
    a, u = _edge(t, feature % 3)
    w, uu = _minus(point, a), _dot(u, u)
    if feature < FACE:
        return _along(a, _share(_dot(w, u), uu), u)
    v = _minus(t.r, a)
    uv, vv, uw, vw = _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    size = _less(_times(uu, vv), _times(uv, uv))
    x = _share(_less(_times(vv, uw), _times(uv, vw)), size)
    y = _share(_less(_times(uu, vw), _times(uv, uw)), size)
    rest = _less(Wide(1.0, 0.0), x)
    return _along(_along(a, x, u), y if _less(y, rest).h <= 0.0 else rest, v)


@called
def _ends(s: Triangle, t: Triangle, first: int, second: int) -> tuple[Wide3, Wide3]:
    """Return the nearest points of two features, or some others of them."""
    if second < 3:
        q = _vertex(t, second)
        return _foot(q, s, first), q
    if 3 <= first < FACE and second < FACE:
        (a, u), (b, v) = _edge(s, first - 3), _edge(t, second - 3)
        w = _minus(a, b)
        uu, uv, vv, uw, vw = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
        size = _less(_times(uu, vv), _times(uv, uv))
        p = _along(a, _share(_less(_times(uv, vw), _times(vv, uw)), size), u)
    else:
        p = _vertex(s, first % 3)
    return p, _foot(p, t, second)


@inline
def _height(n: Wide3, p: Wide3, base: Wide3) -> Wide:
    """Return n . (p - base)."""
    return _dot(n, _minus(p, base))


@called
def _bounds(s: Triangle, t: Triangle, first: int, second: int) -> tuple[Wide, float]:
    """Return the distance of two points of the triangles, and by how much the triangles may be nearer at most but for
    rounding."""
    p, q = _ends(s, t, first, second)
    n = _minus(q, p)
    square = _dot(n, n)
    if not square.h > 2.0**-300:
        return Wide(0.0, 0.0), 0.0
    beyond = 0.0
    for k in range(3):
        beyond = max(beyond, _height(n, _vertex(s, k), p).h, -_height(n, _vertex(t, k), q).h)
    size = _root(square)
    return size, 2.0 * beyond / size.h


@called
def refine(s: Search, start: Any, other: Any, radii: Any, n: int) -> tuple[float, int]:
    """Bound n candidates again and leave out those that are none; return the double nearest to the distance, -1.0 where
    that is not sure, and how many are left.

    start, other: the translations of both bodies (3,). radii: about either, times the unit.
    """
    found, unit = s.room.found, s.a.unit
    least, lowest, origin = Wide(np.inf, 0.0), Wide(np.inf, 0.0), Wide(0.0, 0.0)
    x = two_diff(other[0] * unit, start[0] * unit)
    y = two_diff(other[1] * unit, start[1] * unit)
    z = two_diff(other[2] * unit, start[2] * unit)
    shift = Wide3(Wide(x[0], x[1]), Wide(y[0], y[1]), Wide(z[0], z[1]))
    for k in range(n):
        t = _corners(s.a, found.pairs[k, 0], Wide3(origin, origin, origin))
        size, beyond = _bounds(t, _corners(s.b, found.pairs[k, 1], shift), found.pairs[k, 2], found.pairs[k, 3])
        low = _less(size, Wide(beyond, 0.0))
        found.bounds[k] = low.h * (1.0 - 2.0**-50) - _ROUNDING
        least = size if _less(size, least).h < 0.0 or k == 0 else least
        lowest = low if _less(low, lowest).h < 0.0 or k == 0 else lowest
    n = keep_below(found, n, least.h * (1.0 + 2.0**-50) + _ROUNDING)
    distance = _less(_less(least, Wide(radii[0], 0.0)), Wide(radii[1], 0.0))
    value = distance.h / unit
    is_sure = 2.0**-1000 < value < 2.0**1000
    is_sure = is_sure and surely_rounded(distance.h, distance.low, _less(least, lowest).h + _ROUNDING)
    return value if is_sure else -1.0, n
