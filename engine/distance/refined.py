"""Second stage: re-evaluates the candidate pairs in double-doubles; usually enough to round the distance correctly, and
to certify the nearest points if one pair of features without a tie is left.

For each pair of triangles the nearest points of its two features are convex combinations of corners, so they lie on the
triangles up to rounding: their distance bounds that of the pair from above, the slab between from below.

**Bound.** Coordinates are exact products of two doubles and seven sums, each sum off by 4 u^2 of all terms; a point
takes six operations more, a slab eight, each on numbers below twice `size`, which bounds all coordinates. In total
`error <= 2^-98 size`; 2^-94 size is allowed.

**Proof of the points** (`certify`). All remaining candidates name the same two features, vertex, edge or triangle. The
nearest points of their lines or planes have weights that are quotients of differences of products of two scalar
products. Vectors are off by e = 2^-97 in each coordinate (none is above 2). With L the longest coordinate of edges, M
that of the vector between their starts:

| quantity | error |
|---|---|
| scalar product | 3 e (L + L) or 3 e (L + M) |
| difference of products | 72 e L^2 (L + M) < 2^-90 L^2 (L + M) |
| scalar product on one edge | 2^-90 (L + M) |

`ends_of` counts in these units: the margin of all weights times their denominators above 0, so that the exact points
lie within both features, and the amplification of weight errors to the point, times the lengths of the edges over the
denominator (`steepness`): `error`, with room for the errors of denominators and for sums of three. If all other corners
of all candidates lie strictly beyond the planes across the exact connection, no other points of these triangles are as
near. A direction off by 2 `error` changes a height, of lengths below 4, by less than 16 `error`.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Final, NamedTuple

import numpy as np

from engine.collision.meshes.mesh_arrays import triangle_of
from engine.collision.meshes.near_triangles import FACE
from engine.collision.meshes.placement import Placement
from engine.collision.meshes.triangle_triangle import Facet, corner
from engine.compiling.jit import called, inline, merged
from engine.distance.closed_forms import Wide, Wide3, along3, dot3, less, less3, over, plus, product, root, times
from engine.lanes.boxes import FRAME_ROWS
from engine.lanes.faces import FIXED_ROWS, GAP_ROWS
from engine.lanes.tracing import LANES
from engine.predicates.error_free import fast_two_sum, is_correctly_rounded, two_diff, workspace
from engine.predicates.expansion import compress, grow, grow_product, is_safe
from engine.predicates.vectors import as_point3
from engine.types import FloatArray, Point3

ROOT: Final = -1
"""Stands for the box of a whole tree, where a child is given as 8 node + lane."""


class View(NamedTuple):
    """A body in a search: its mesh (`MeshArrays` or `PointMesh`), its placement, and `unit`, the power of two by which
    its coordinates are multiplied."""

    mesh: Any
    place: Placement
    unit: float


Heap = namedtuple("Heap", "bounds lanes")
"""Priority queue of pairs of boxes, least bound first: bounds (room,), and lanes (room, 2) int64, 8 node + lane or
ROOT."""

Candidates = namedtuple("Candidates", "pairs bounds")
"""Candidate pairs of triangles: pairs (room, 4) int64, two triangles and a feature code of each; bounds (room,)
float64, lower bounds on their distances."""

Room = namedtuple("Room", "heap candidates limits points frames work fixed")
"""Work space of searches, one at a time. limits (2,): of a search (traversal.py). points (2, 3): the nearest. frames,
work, fixed: of `lanes/faces.py`."""


def new_room(room: int) -> Room:
    """Allocate work space for `room` pairs of boxes, and as many of triangles."""
    heap, pairs = Heap(np.empty(room), np.empty((room, 2), np.int64)), np.empty((room, 4), np.int64)
    return Room(
        heap, Candidates(pairs, np.empty(room)), np.empty(2),
        np.empty((2, 3)), np.empty((2, FRAME_ROWS, LANES), np.float32), np.empty((GAP_ROWS, LANES), np.float32),
        np.empty((FIXED_ROWS, LANES), np.float32),
    )  # fmt: skip


class Search(NamedTuple):
    """One query: both bodies, `error`, a bound on the rounding of points of both together, and work space."""

    a: View
    b: View
    error: float
    room: Room


@merged
def scaled(p: Point3, unit: float) -> Point3:
    """Return a point times the unit, applied before any product, which would lose denormal coordinates."""
    return Point3(p.x * unit, p.y * unit, p.z * unit)


@inline
def retain_below(candidates: Candidates, n: int, most: float) -> int:
    """Remove the first n candidates' rows whose lower bound is above `most`; return the number of the others, moved to
    the front."""
    n_left = 0
    for item in range(n):
        if candidates.bounds[item] <= most:
            candidates.bounds[n_left] = candidates.bounds[item]
            for column in range(4):
                candidates.pairs[n_left, column] = candidates.pairs[item, column]
            n_left += 1
    return n_left


ROUNDING: Final = 2.0**-94


@inline
def _clamped_quotient(top: Wide, bottom: Wide) -> Wide:
    """Return top / bottom in double-double, clamped to [0, 1]."""
    if not (bottom.h > 0.0 and top.h > 0.0):
        return Wide(0.0, 0.0)
    share = over(top, bottom)
    return share if share.h < 1.0 else Wide(1.0, 0.0)


@inline
def _row(a: Point3, p: Point3, shift: Wide) -> Wide:
    """Return dot(a, p) + shift in double-double; a, p: doubles."""
    return plus(plus(plus(shift, product(a.x, p.x)), product(a.y, p.y)), product(a.z, p.z))


@called
def corner_of(place: Placement, p: Point3, shift: Wide3) -> Wide3:
    """Return R p + `shift` in double-doubles, R the rotation of a placement."""
    return Wide3(_row(place.x, p, shift.x), _row(place.y, p, shift.y), _row(place.z, p, shift.z))


@inline
def corners_of(view: View, triangle: int, shift: Wide3) -> Facet:
    """Return the corners of a triangle of a body, rotated by its placement and scaled by its unit, in double-doubles,
    with `shift` as the translation."""
    t = triangle_of(view.mesh, triangle)
    p, q = corner_of(view.place, scaled(t.p, view.unit), shift), corner_of(view.place, scaled(t.q, view.unit), shift)
    return Facet(p, q, corner_of(view.place, scaled(t.r, view.unit), shift))


@inline
def _edge(t: Facet, k: int) -> tuple[Wide3, Wide3]:
    """Return the start of edge k (0, 1, 2) of a triangle, and the vector to its end."""
    a = corner(t, k)
    return a, less3(corner(t, k + 1), a)


@inline
def _reach(u: Wide3) -> float:
    """Return the largest magnitude of a component."""
    return max(abs(u.x.h), abs(u.y.h), abs(u.z.h))


@called
def _closest_on_feature(point: Wide3, t: Facet, feature: int) -> tuple[Wide3, float, float]:
    """Return (closest point, margin, amplification) for a point and a feature of t, given by its code (vertex, edge,
    FACE). If the foot lies outside the feature, the point is some other point of it. Margin: the smallest weight times
    the denominator of the weights, negative outside, infinite for a vertex. Amplification of errors (condition number):
    the lengths of the edges over the denominator. Both in the units of the module's table."""
    if feature < 3:
        return corner(t, feature), np.inf, 0.0
    a, u = _edge(t, feature % 3)
    w, uu = less3(point, a), dot3(u, u)
    uw = dot3(u, w)
    if feature < FACE:
        scale = _reach(u) + _reach(w)
        return along3(a, _clamped_quotient(uw, uu), u), min(uw.h, uu.h - uw.h) / scale, np.sqrt(uu.h) / uu.h * scale
    v = less3(t.r, a)
    length = max(_reach(u), _reach(v))
    scale = length * length * (length + _reach(w))
    uv, vv, vw = dot3(u, v), dot3(v, v), dot3(v, w)
    size = less(times(uu, vv), times(uv, uv))
    top, their_top = less(times(vv, uw), times(uv, vw)), less(times(uu, vw), times(uv, uw))
    x, y = _clamped_quotient(top, size), _clamped_quotient(their_top, size)
    rest = less(Wide(1.0, 0.0), x)
    foot = along3(along3(a, x, u), y if less(y, rest).h <= 0.0 else rest, v)
    inside = min(top.h, their_top.h, size.h - top.h - their_top.h) / scale
    return foot, inside, (np.sqrt(uu.h) + np.sqrt(vv.h)) / abs(size.h) * scale


@called
def ends_of(s: Facet, t: Facet, first: int, second: int) -> tuple[Wide3, Wide3, float, float]:
    """Return (p, q, margin, amplification): the closest points of a feature of s and one of t, given by codes, the
    smaller margin of their weights and the sum of their error amplifications (`_closest_on_feature`)."""
    if second < 3:
        q = corner(t, second)
        p, inside, steepness = _closest_on_feature(q, s, first)
        return p, q, inside, steepness
    p, inside, steepness = corner(s, first % 3), np.inf, 0.0
    if 3 <= first < FACE and second < FACE:
        (a, u), (b, v) = _edge(s, first - 3), _edge(t, second - 3)
        w = less3(a, b)
        uu, uv, vv, uw, vw = dot3(u, u), dot3(u, v), dot3(v, v), dot3(u, w), dot3(v, w)
        size, top = less(times(uu, vv), times(uv, uv)), less(times(uv, vw), times(vv, uw))
        length = max(_reach(u), _reach(v))
        scale = length * length * (length + _reach(w))
        p, inside = along3(a, _clamped_quotient(top, size), u), min(top.h, size.h - top.h) / scale
        steepness = np.sqrt(uu.h) / abs(size.h) * scale  # of parallel edges the size may round to less than 0
    q, their_inside, their_steepness = _closest_on_feature(p, t, second)
    return p, q, min(inside, their_inside), steepness + their_steepness


@inline
def height_above(n: Wide3, p: Wide3, base: Wide3) -> Wide:
    """Return n . (p - base) in double-double."""
    return dot3(n, less3(p, base))


@called
def bounds_of_features(s: Facet, t: Facet, first: int, second: int) -> tuple[Wide, float]:
    """Return the distance of the closest points of two features, and a bound on how much nearer points of the triangles
    may be; 0, 0 where the distance is too small."""
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
    """Return the vertices of a feature, given by its code, of a triangle, -1 in place of missing ones; of an edge the
    smaller vertex first."""
    t, k = view.mesh.triangles, feature % 3
    i, j = t[triangle, k], t[triangle, (k + 1) % 3]
    if feature < 3:
        return i, -1, -1
    return (min(i, j), max(i, j), -1) if feature < FACE else (i, j, t[triangle, 2])


@inline
def shift_of(s: Search, start: FloatArray, other: FloatArray) -> Wide3:
    """Return the translation `other` of the second body less `start` of the first, times the unit, in
    double-doubles."""
    unit = s.a.unit
    x, y = Wide(*two_diff(other[0] * unit, start[0] * unit)), Wide(*two_diff(other[1] * unit, start[1] * unit))
    return Wide3(x, y, Wide(*two_diff(other[2] * unit, start[2] * unit)))


@called
def refine(s: Search, start: FloatArray, other: FloatArray, radii: tuple[float, ...], n: int) -> tuple[float, int]:
    """Bound the first n candidates in double-doubles and remove those that cannot be nearest; return the distance, the
    nearest double or -1.0 if unproven, and the new n. start, other: the translations of both bodies (3,). radii: of the
    balls about their triangles, times the unit."""
    candidates, unit = s.room.candidates, s.a.unit
    least, lowest, origin = Wide(np.inf, 0.0), Wide(np.inf, 0.0), Wide(0.0, 0.0)
    first_size = origin  # order: bounds are less this, so that a double has what parts near ties
    shift = shift_of(s, start, other)
    for k in range(n):
        i, j, first, second = candidates.pairs[k]
        t, u = corners_of(s.a, i, Wide3(origin, origin, origin)), corners_of(s.b, j, shift)
        size, beyond = bounds_of_features(t, u, first, second)
        low, first_size = less(size, Wide(beyond, 0.0)), size if k == 0 else first_size
        more = less(low, first_size).h
        candidates.bounds[k] = more - 2.0**-50 * abs(more) - ROUNDING
        least = size if less(size, least).h < 0.0 or k == 0 else least
        lowest = low if less(low, lowest).h < 0.0 or k == 0 else lowest
    most = less(least, first_size).h
    n = retain_below(candidates, n, most + 2.0**-50 * abs(most) + ROUNDING)
    distance = less(less(least, Wide(radii[0], 0.0)), Wide(radii[1], 0.0))
    value = distance.h / unit
    is_proven = 2.0**-1000 < value < 2.0**1000
    is_proven = is_proven and is_correctly_rounded(distance.h, distance.low, less(least, lowest).h + ROUNDING)
    return value if is_proven else -1.0, n


CERTAIN: Final = 2.0**-86


@inline
def are_strictly_beyond(
    view: View, triangle: int, known: tuple[int, int, int], t: Facet, n: Wide3, base: Wide3, slack: float
) -> bool:
    """Return whether all corners of a triangle, placed as t, but the vertices `known` lie strictly behind the plane at
    base across n, by more than slack."""
    for k in range(3):
        if view.mesh.triangles[triangle, k] in known:
            continue
        if not height_above(n, corner(t, k), base).h < -slack:
            return False
    return True


@called
def _placed_coordinate(row: Point3, v: Point3, shift: float) -> tuple[float, bool]:
    """Return the double nearest to row . v + shift, and whether that is proven: also of a number halfway between two
    doubles, as those of corners of lattices are under poses now and then."""
    if not (is_safe(shift) and is_safe(row.x * v.x) and is_safe(row.y * v.y) and is_safe(row.z * v.z)):
        return 0.0, False
    e = workspace(8)
    n = grow_product(e, grow_product(e, grow_product(e, 0, row.x, v.x), row.y, v.y), row.z, v.z)
    n = compress(e, grow(e, n, shift))
    if n == 0:
        return 0.0, True
    h, low = fast_two_sum(e[n - 1], e[n - 2] if n > 1 else 0.0)
    return h, is_correctly_rounded(h, low, 2.0**-51 * abs(e[n - 2]) if n > 2 else 0.0)


@inline
def write_offset_point(
    view: View, known: tuple[int, int, int], p: Wide3, n: Wide3, radius: float, start: FloatArray, move: FloatArray,
    error: float, point: FloatArray,
) -> bool:  # fmt: skip
    """Write p + start, moved by radius along n, to point (d,), divided by the unit; return whether it is correctly
    rounded. known: the vertices of the feature that p lies on, -1 for none. move: the translation of the body. error:
    bound on p."""
    size, is_proven, v = root(dot3(n, n)), True, view.mesh.vertices
    bound = error + 4.0 * radius * (error / size.h + 2.0**-98)
    for k, at, way, row in ((0, p.x, n.x, view.place.x), (1, p.y, n.y, view.place.y), (2, p.z, n.z, view.place.z)):
        if k >= point.shape[0]:
            continue
        x, y, z = v[known[0], k], v[max(known[1], 0), k], v[max(known[2], 0), k]
        is_turned = row.x != (k == 0) or row.y != (k == 1) or row.z != (k == 2)
        if radius == 0.0 and not is_turned and (known[1] < 0 or x == y) and (known[2] < 0 or x == z):
            point[k] = x + move[k]  # of the whole feature; a sum of two doubles is rounded to the nearest
            continue
        end = plus(plus(at, times(over(way, size), Wide(radius, 0.0))), Wide(start[k] * view.unit, 0.0))
        point[k] = end.h / view.unit
        is_sure = is_correctly_rounded(end.h, end.low, bound) and 2.0**-1000 < abs(point[k]) < 2.0**1000
        if not is_sure and radius == 0.0 and known[1] < 0:
            point[k], is_sure = _placed_coordinate(row, as_point3(v, known[0]), move[k])
        is_proven = is_proven and is_sure
    return is_proven


@called
def certify(
    s: Search, start: FloatArray, other: FloatArray, radii: tuple[float, ...], n: int, points: FloatArray
) -> bool:
    """Fill points (2, d) with the nearest points of two bodies, if the first n candidates prove them; else return
    False. The candidate of these points moves to row 0; ties are decided by the lowest faces. start, other:
    translations of both bodies (3,). radii: of the balls about their triangles, times the unit."""
    pairs, best = s.room.candidates.pairs, 0
    faces, their_faces = s.a.mesh.faces, s.b.mesh.faces
    here, there = named(s.a, pairs[0, 0], pairs[0, 2]), named(s.b, pairs[0, 1], pairs[0, 3])
    for k in range(n):
        if named(s.a, pairs[k, 0], pairs[k, 2]) != here or named(s.b, pairs[k, 1], pairs[k, 3]) != there:
            return False
        own, least = faces[pairs[k, 0]], faces[pairs[best, 0]]
        if own < least or (own == least and their_faces[pairs[k, 1]] < their_faces[pairs[best, 1]]):
            best = k
    none = Wide(0.0, 0.0)
    t = corners_of(s.a, pairs[0, 0], Wide3(none, none, none))
    u = corners_of(s.b, pairs[0, 1], shift_of(s, start, other))
    p, q, inside, steepness = ends_of(t, u, pairs[0, 2], pairs[0, 3])
    error = CERTAIN * steepness + 2.0**-92
    slack, way, back = CERTAIN + 16.0 * error, less3(q, p), less3(p, q)
    if not (inside > CERTAIN and way.x.h * way.x.h + way.y.h * way.y.h + way.z.h * way.z.h > 2.0**-300):
        return False
    for k in range(n):
        if k > 0 and pairs[k, 0] != pairs[k - 1, 0]:
            t = corners_of(s.a, pairs[k, 0], Wide3(none, none, none))
        if k > 0 and pairs[k, 1] != pairs[k - 1, 1]:
            u = corners_of(s.b, pairs[k, 1], shift_of(s, start, other))
        if not are_strictly_beyond(s.a, pairs[k, 0], here, t, way, p, slack):
            return False
        if not are_strictly_beyond(s.b, pairs[k, 1], there, u, back, q, slack):
            return False
    for column in range(4):
        pairs[0, column] = pairs[best, column]
    is_proven = write_offset_point(s.a, here, p, way, radii[0], start, start, error, points[0])
    return write_offset_point(s.b, there, q, back, radii[1], start, other, error, points[1]) and is_proven
