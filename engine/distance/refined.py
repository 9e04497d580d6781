"""The candidates of a search again, in double-doubles: mostly that tells the double nearest to the distance, and where
one pair of features without a tie is left, the nearest points.

Of each pair of triangles the nearest points of its two features are found as convex combinations of corners, so they
lie on the triangles but for rounding: their distance bounds that of the pair from above, the slab between from below.

**Bound.** Coordinates are products of two doubles, exact, and sums of seven such, each sum off by 4 u^2 of all terms; a
point takes six operations more, a slab eight, each on numbers below twice `size`, which bounds all coordinates. All
together is below 2^-98 size; 2^-94 size is allowed.

**Proof of the points** (`certify`). All candidates that are left name the same two features, vertex, edge or triangle.
The nearest points of their lines or planes have weights, quotients of differences of products of two scalar products.
Vectors are off by e = 2^-97 in each coordinate (none is above 2); with L the longest coordinate of edges, M that of the
vector between their starts, a scalar product is off by 3 e (L + L) or 3 e (L + M), and a difference of products by 72 e
L^2 (L + M), below 2^-90 L^2 (L + M); on one edge a scalar product itself by 2^-90 (L + M). `ends_of` counts in these:
it tells by how much all weights times their denominators are above 0, so that the exact points lie within both
features, and what an error of the weights brings to a point, times the lengths of the edges over the denominator
(`steepness`): `error`, with room for the errors of denominators and for sums of three. Where all other corners of both
triangles lie strictly beyond the planes across the exact connection, no other points of the triangles are as near. A
direction off by 2 `error` brings a height, of lengths below 4, off by less than 16 of it.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Final, NamedTuple

import numpy as np

from engine.collision.meshes.mesh_arrays import MeshArrays, triangle_of
from engine.collision.meshes.near_triangles import FACE
from engine.collision.meshes.placement import Placement
from engine.collision.meshes.triangle_triangle import Facet, corner
from engine.compiling.jit import called, inline, merged
from engine.distance.closed_forms import Wide, Wide3, along3, dot3, less, less3, over, plus, product, root, times
from engine.lanes.boxes import FRAME_ROWS
from engine.lanes.faces import FIXED_ROWS, GAP_ROWS
from engine.lanes.tracing import LANES
from engine.predicates.error_free import is_correctly_rounded, two_diff
from engine.types import FloatArray, Point3

ROOT: Final = -1
"""In place of a lane: the whole tree."""


class View(NamedTuple):
    """A body as the search sees it: its mesh, where it is, and the power of two that its numbers are taken times."""

    mesh: MeshArrays
    place: Placement
    unit: float


Heap = namedtuple("Heap", "bounds lanes")
"""Pairs of boxes that wait, the least bound first: bounds (room,), lanes (room, 2) int64, eight a node, or ROOT."""

Candidates = namedtuple("Candidates", "pairs bounds")
"""Pairs of triangles: pairs (room, 4) int64, two triangles and two features; bounds (room,) float64 from below."""

Room = namedtuple("Room", "heap found limits points frames work fixed")
"""Work space of searches, one at a time.

limits (2,): of a search (traversal.py). points (2, 3): the nearest. frames, work, fixed: of `lanes/faces.py`.
"""


def new_room(room: int) -> Room:
    """Return work space for so many pairs."""
    heap, found = Heap(np.empty(room), np.empty((room, 2), np.int64)), np.empty((room, 4), np.int64)
    return Room(
        heap, Candidates(found, np.empty(room)), np.empty(2),
        np.empty((2, 3)), np.empty((2, FRAME_ROWS, LANES), np.float32), np.empty((GAP_ROWS, LANES), np.float32),
        np.empty((FIXED_ROWS, LANES), np.float32),
    )  # fmt: skip


class Search(NamedTuple):
    """One question: both bodies, a bound on the rounding of points of both together, and work space."""

    a: View
    b: View
    error: float
    room: Room


@merged
def scaled(p: Point3, unit: float) -> Point3:
    """Return a point times the unit; order: before any product, which would be lost where coordinates are denormal."""
    return Point3(p.x * unit, p.y * unit, p.z * unit)


@inline
def keep_below(found: Candidates, n: int, most: float) -> int:
    """Leave out the candidates above the bound; return how many there are."""
    n_kept = 0
    for item in range(n):
        if found.bounds[item] <= most:
            found.bounds[n_kept] = found.bounds[item]
            for column in range(4):
                found.pairs[n_kept, column] = found.pairs[item, column]
            n_kept += 1
    return n_kept


ROUNDING: Final = 2.0**-94


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
    the latter times what errors of the weights are to be counted in (see above)."""
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
def _bounds(s: Facet, t: Facet, first: int, second: int) -> tuple[Wide, float]:
    """Return the distance of two nearly nearest points, and by how much the triangles may be nearer."""
    p, q, _, _ = ends_of(s, t, first, second)
    n = less3(q, p)
    square = dot3(n, n)
    if not square.h > 2.0**-300:
        return Wide(0.0, 0.0), 0.0
    beyond = 0.0
    for k in range(3):
        beyond = max(beyond, height_above(n, corner(s, k), p).h, -height_above(n, corner(t, k), q).h)
    size = root(square)
    return size, 2.0 * beyond / size.h


@inline
def named(view: View, triangle: int, feature: int) -> tuple[int, int, int]:
    """Return the vertices of a feature, of an edge the smaller first, -1 for none."""
    t, k = view.mesh.triangles, feature % 3
    i, j = t[triangle, k], t[triangle, (k + 1) % 3]
    if feature < 3:
        return i, -1, -1
    return (min(i, j), max(i, j), -1) if feature < FACE else (i, j, t[triangle, 2])


@inline
def shift_of(s: Search, start: FloatArray, other: FloatArray) -> Wide3:
    """Return the translation of the second body less that of the first, times the unit."""
    unit = s.a.unit
    x, y = Wide(*two_diff(other[0] * unit, start[0] * unit)), Wide(*two_diff(other[1] * unit, start[1] * unit))
    return Wide3(x, y, Wide(*two_diff(other[2] * unit, start[2] * unit)))


@called
def refine(s: Search, start: FloatArray, other: FloatArray, radii: tuple[float, ...], n: int) -> tuple[float, int]:
    """Bound n candidates again and leave out those that are none; return the rounded distance, -1.0 if unsure, and n.

    start, other: the translations of both bodies (3,). radii: about either, times the unit.
    """
    found, unit = s.room.found, s.a.unit
    least, lowest, origin = Wide(np.inf, 0.0), Wide(np.inf, 0.0), Wide(0.0, 0.0)
    shift = shift_of(s, start, other)
    for k in range(n):
        i, j, first, second = found.pairs[k]
        t, u = corners_of(s.a, i, Wide3(origin, origin, origin)), corners_of(s.b, j, shift)
        size, beyond = _bounds(t, u, first, second)
        low = less(size, Wide(beyond, 0.0))
        found.bounds[k] = low.h * (1.0 - 2.0**-50) - ROUNDING
        least = size if less(size, least).h < 0.0 or k == 0 else least
        lowest = low if less(low, lowest).h < 0.0 or k == 0 else lowest
    n = keep_below(found, n, least.h * (1.0 + 2.0**-50) + ROUNDING)
    distance = less(less(least, Wide(radii[0], 0.0)), Wide(radii[1], 0.0))
    value = distance.h / unit
    is_sure = 2.0**-1000 < value < 2.0**1000
    is_sure = is_sure and is_correctly_rounded(distance.h, distance.low, less(least, lowest).h + ROUNDING)
    return value if is_sure else -1.0, n


_SLACK: Final = 2.0**-86


@inline
def _are_strictly_beyond(view: View, triangle: int, known: tuple[int, int, int], t: Facet, n: Wide3, base: Wide3,
               slack: float) -> bool:  # fmt: skip
    """Tell whether the corners of a triangle that are none of a feature lie strictly beyond the plane across n."""
    for k in range(3):
        if view.mesh.triangles[triangle, k] in known:
            continue
        if not height_above(n, corner(t, k), base).h < -slack:
            return False
    return True


@inline
def _write(view: View, known: tuple[int, int, int], p: Wide3, n: Wide3, radius: float, start: FloatArray, error: float,
           point: FloatArray) -> bool:  # fmt: skip
    """Write the point (d,) at a radius from p along n, from the origin of space; tell whether it is sure."""
    size, is_sure, v = root(dot3(n, n)), True, view.mesh.vertices
    bound = error + 4.0 * radius * (error / size.h + 2.0**-98)
    is_given = radius == 0.0 and not view.place.is_posed
    for k, at, way in ((0, p.x, n.x), (1, p.y, n.y), (2, p.z, n.z)):
        if k >= point.shape[0]:
            continue
        x, y, z = v[known[0], k], v[max(known[1], 0), k], v[max(known[2], 0), k]
        if is_given and (known[1] < 0 or x == y) and (known[2] < 0 or x == z):
            point[k] = x  # of the whole feature
            continue
        end = plus(plus(at, times(over(way, size), Wide(radius, 0.0))), Wide(start[k] * view.unit, 0.0))
        point[k] = end.h / view.unit
        is_sure = is_sure and is_correctly_rounded(end.h, end.low, bound) and 2.0**-1000 < abs(point[k]) < 2.0**1000
    return is_sure


@called
def certify(
    s: Search, start: FloatArray, other: FloatArray, radii: tuple[float, ...], n: int, points: FloatArray
) -> bool:
    """Fill points (2, d) with the nearest points of two bodies and put the candidate they are on first, of equal ones
    that of the smallest faces; False where n candidates leave them open. Other arguments as for `refine`.
    """
    pairs, best = s.room.found.pairs, 0
    faces, their_faces = s.a.mesh.faces, s.b.mesh.faces
    here, there = named(s.a, pairs[0, 0], pairs[0, 2]), named(s.b, pairs[0, 1], pairs[0, 3])
    for k in range(n):
        if named(s.a, pairs[k, 0], pairs[k, 2]) != here or named(s.b, pairs[k, 1], pairs[k, 3]) != there:
            return False
        own, least = faces[pairs[k, 0]], faces[pairs[best, 0]]
        if own < least or (own == least and their_faces[pairs[k, 1]] < their_faces[pairs[best, 1]]):
            best = k
    for column in range(4):
        pairs[0, column] = pairs[best, column]
    none = Wide(0.0, 0.0)
    t = corners_of(s.a, pairs[0, 0], Wide3(none, none, none))
    u = corners_of(s.b, pairs[0, 1], shift_of(s, start, other))
    p, q, inside, steepness = ends_of(t, u, pairs[0, 2], pairs[0, 3])
    error = _SLACK * steepness + 2.0**-92
    slack, way, back = _SLACK + 16.0 * error, less3(q, p), less3(p, q)
    if not (inside > _SLACK and way.x.h * way.x.h + way.y.h * way.y.h + way.z.h * way.z.h > 2.0**-300):
        return False
    if not _are_strictly_beyond(s.a, pairs[0, 0], here, t, way, p, slack):
        return False
    if not _are_strictly_beyond(s.b, pairs[0, 1], there, u, back, q, slack):
        return False
    is_sure = _write(s.a, here, p, way, radii[0], start, error, points[0])
    return _write(s.b, there, q, back, radii[1], start, error, points[1]) and is_sure
