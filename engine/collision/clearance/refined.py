"""The candidates of a search again, in double-doubles: mostly that tells the double nearest to the distance.

Of each pair of triangles the nearest points of its two features are found as convex combinations of corners, so they
lie on the triangles but for rounding: their distance bounds that of the pair from above, and the slab across the line
between them from below, whatever the points are.

**Bound.** Coordinates are products of two doubles, exact, and sums of seven such, each sum off by 4 u^2 of all terms; a
point takes six operations more, a slab eight, each on numbers below twice `size`, which bounds all coordinates. All
together is below 2^-98 size; 2^-94 size is allowed.

Most candidates name the two features of the first, of which all that they add are corners: floats tell those apart.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from engine.collision.clearance.blocks import keep_below
from engine.collision.clearance.boxes import Search, View, scaled
from engine.collision.clearance.near_triangles import FACE
from engine.collision.clearance.wide import Wide, Wide3, along3, dot3, less, less3, over, plus, product, root, times
from engine.collision.meshes.mesh_arrays import triangle_of
from engine.collision.meshes.placement import Placement, turned
from engine.collision.meshes.triangle_triangle import Facet, corner
from engine.jit import called, inline
from engine.predicates.double_double import surely_rounded
from engine.predicates.error_free import two_diff
from engine.predicates.vectors import as_point3, dot, minus
from engine.types import Point3

ROUNDING: Final = 2.0**-94
_ROUGHLY: Final = 2.0**-40
"""More than a scalar product of differences of rounded points, none above 2, may be off."""


@inline
def _share(top: Wide, bottom: Wide) -> Wide:
    """Return top / bottom, but from 0 to 1."""
    if not (bottom.h > 0.0 and top.h > 0.0):
        return Wide(0.0, 0.0)
    share = over(top, bottom)
    return share if share.h < 1.0 else Wide(1.0, 0.0)


@inline
def _row(a: Point3, p: Point3, shift: Wide) -> Wide:
    """Return a . p + shift."""
    return plus(plus(plus(shift, product(a.x, p.x)), product(a.y, p.y)), product(a.z, p.z))


@called
def corner_of(place: Placement, p: Point3, shift: Wide3) -> Wide3:
    """Return a placed point, with `shift` in place of the translation."""
    return Wide3(_row(place.x, p, shift.x), _row(place.y, p, shift.y), _row(place.z, p, shift.z))


@inline
def corners_of(view: View, triangle: int, shift: Wide3) -> Facet:
    t = triangle_of(view.mesh, triangle)
    p, q = corner_of(view.place, scaled(t.p, view.unit), shift), corner_of(view.place, scaled(t.q, view.unit), shift)
    return Facet(p, q, corner_of(view.place, scaled(t.r, view.unit), shift))


@inline
def _edge(t: Facet, k: int) -> tuple[Wide3, Wide3]:
    """Return the start of an edge, and the vector to its end."""
    a = corner(t, k)
    return a, less3(corner(t, k + 1), a)


@inline
def _reach(u: Wide3) -> float:
    return max(abs(u.x.h), abs(u.y.h), abs(u.z.h))


@called
def _foot(point: Wide3, t: Facet, feature: int) -> tuple[Wide3, float, float]:
    """Return the point of a vertex, edge or triangle that is nearest to a point, or some other of it; by how much its
    weights times their denominator are above 0, and the lengths of the edges over the denominator: the former over,
    the latter times what errors of the weights are to be counted in (`certified.py`)."""
    if feature < 3:
        return corner(t, feature), np.inf, 0.0
    a, u = _edge(t, feature % 3)
    w, uu = less3(point, a), dot3(u, u)
    uw = dot3(u, w)
    if feature < FACE:
        scale = _reach(u) + _reach(w)
        return along3(a, _share(uw, uu), u), min(uw.h, uu.h - uw.h) / scale, np.sqrt(uu.h) / uu.h * scale
    v = less3(t.r, a)
    length = max(_reach(u), _reach(v))
    scale = length * length * (length + _reach(w))
    uv, vv, vw = dot3(u, v), dot3(v, v), dot3(v, w)
    size = less(times(uu, vv), times(uv, uv))
    top, their_top = less(times(vv, uw), times(uv, vw)), less(times(uu, vw), times(uv, uw))
    x, y = _share(top, size), _share(their_top, size)
    rest = less(Wide(1.0, 0.0), x)
    foot = along3(along3(a, x, u), y if less(y, rest).h <= 0.0 else rest, v)
    inside = min(top.h, their_top.h, size.h - top.h - their_top.h) / scale
    return foot, inside, (np.sqrt(uu.h) + np.sqrt(vv.h)) / size.h * scale


@called
def ends_of(s: Facet, t: Facet, first: int, second: int) -> tuple[Wide3, Wide3, float, float]:
    """Return the nearest points of two features, or some others of them, and of both together what `_foot` tells."""
    if second < 3:
        q = corner(t, second)
        p, inside, steepness = _foot(q, s, first)
        return p, q, inside, steepness
    p, inside, steepness = corner(s, first % 3), np.inf, 0.0
    if 3 <= first < FACE and second < FACE:
        (a, u), (b, v) = _edge(s, first - 3), _edge(t, second - 3)
        w = less3(a, b)
        uu, uv, vv, uw, vw = dot3(u, u), dot3(u, v), dot3(v, v), dot3(u, w), dot3(v, w)
        size, top = less(times(uu, vv), times(uv, uv)), less(times(uv, vw), times(vv, uw))
        length = max(_reach(u), _reach(v))
        scale = length * length * (length + _reach(w))
        p, inside = along3(a, _share(top, size), u), min(top.h, size.h - top.h) / scale
        steepness = np.sqrt(uu.h) / size.h * scale
    q, their_inside, their_steepness = _foot(p, t, second)
    return p, q, min(inside, their_inside), steepness + their_steepness


@inline
def height_above(n: Wide3, p: Wide3, base: Wide3) -> Wide:
    """Return n . (p - base)."""
    return dot3(n, less3(p, base))


@called
def _bounds(s: Facet, t: Facet, first: int, second: int) -> tuple[Wide, float, Point3, Point3]:
    """Return the distance of two points of the triangles, by how much the triangles may be nearer at most but for
    rounding, and the points, rounded."""
    p, q, _, _ = ends_of(s, t, first, second)
    n, ends = less3(q, p), (Point3(p.x.h, p.y.h, p.z.h), Point3(q.x.h, q.y.h, q.z.h))
    square = dot3(n, n)
    if not square.h > 2.0**-300:
        return Wide(0.0, 0.0), 0.0, *ends
    beyond = 0.0
    for k in range(3):
        beyond = max(beyond, height_above(n, corner(s, k), p).h, -height_above(n, corner(t, k), q).h)
    size = root(square)
    return size, 2.0 * beyond / size.h, *ends


@inline
def named(view: View, triangle: int, feature: int) -> tuple[int, int, int]:
    """Return the vertices of a feature, of an edge the smaller first, -1 for none."""
    t, k = view.mesh.triangles, feature % 3
    i, j = t[triangle, k], t[triangle, (k + 1) % 3]
    if feature < 3:
        return i, -1, -1
    return (min(i, j), max(i, j), -1) if feature < FACE else (i, j, t[triangle, 2])


@inline
def _is_beyond(view: View, item: int, known: tuple[int, int, int], shift: Point3, way: Point3, base: Point3) -> bool:
    """Tell whether the corners of a triangle that are none of a feature surely lie beyond the plane across a way."""
    for k in range(3):
        vertex = view.mesh.triangles[item, k]
        if vertex not in known:
            v = turned(view.place, scaled(as_point3(view.mesh.vertices, vertex), view.unit))
            if not dot(way, minus(Point3(v.x + shift.x, v.y + shift.y, v.z + shift.z), base)) < -_ROUGHLY:
                return False
    return True


@inline
def shift_of(s: Search, start: Any, other: Any) -> Wide3:
    """Return the translation of the second body less that of the first, times the unit."""
    unit = s.a.unit
    x, y = Wide(*two_diff(other[0] * unit, start[0] * unit)), Wide(*two_diff(other[1] * unit, start[1] * unit))
    return Wide3(x, y, Wide(*two_diff(other[2] * unit, start[2] * unit)))


@called
def refine(s: Search, start: Any, other: Any, radii: Any, n: int) -> tuple[float, int]:
    """Bound n candidates again and leave out those that are none; return the double nearest to the distance, -1.0 where
    that is not sure, and how many are left.

    start, other: the translations of both bodies (3,). radii: about either, times the unit.
    """
    found, unit = s.room.found, s.a.unit
    least, lowest, origin = Wide(np.inf, 0.0), Wide(np.inf, 0.0), Wide(0.0, 0.0)
    shift = shift_of(s, start, other)
    here, there = named(s.a, found.pairs[0, 0], found.pairs[0, 2]), named(s.b, found.pairs[0, 1], found.pairs[0, 3])
    none, rough = Point3(0.0, 0.0, 0.0), Point3(shift.x.h, shift.y.h, shift.z.h)
    p = q = none
    for k in range(n):
        i, j, first, second = found.pairs[k]
        if (
            k > 0
            and named(s.a, i, first) == here
            and named(s.b, j, second) == there
            and _is_beyond(s.a, i, here, none, minus(q, p), p)
            and _is_beyond(s.b, j, there, rough, minus(p, q), q)
        ):
            found.bounds[k] = found.bounds[0]  # the same two points, and no corner more that may be nearer
            continue
        t, u = corners_of(s.a, i, Wide3(origin, origin, origin)), corners_of(s.b, j, shift)
        size, beyond, here_p, there_q = _bounds(t, u, first, second)
        if k == 0:
            p, q = here_p, there_q
        low = less(size, Wide(beyond, 0.0))
        found.bounds[k] = low.h * (1.0 - 2.0**-50) - ROUNDING
        least = size if less(size, least).h < 0.0 or k == 0 else least
        lowest = low if less(low, lowest).h < 0.0 or k == 0 else lowest
    n = keep_below(found, n, least.h * (1.0 + 2.0**-50) + ROUNDING)
    distance = less(less(least, Wide(radii[0], 0.0)), Wide(radii[1], 0.0))
    value = distance.h / unit
    is_sure = 2.0**-1000 < value < 2.0**1000
    is_sure = is_sure and surely_rounded(distance.h, distance.low, less(least, lowest).h + ROUNDING)
    return value if is_sure else -1.0, n
