"""GJK distance of many pairs of convex bodies: float64 iterations, proven in double-doubles.

The nearest point to the origin of the differences M = {a - b} is approached: in each step the corner of M farthest
toward the origin joins a simplex of at most three corners, reduced to those that its nearest point needs. Whatever
direction results, the slab across it separates the bodies: all vertices are tested.

**Clear** is proven as *apart* is in `convex_pair.py`, by a slab wider than the gap; **near** by two points, each off by
the error of a placed point and 2^-48 of the largest corner of M, which covers their weights. The distance itself is
that of the nearest points of the two features of the last simplex, bounded as in `refined.py`.

Source: E. Gilbert, D. Johnson, S. Keerthi, A fast procedure for computing the distance between complex objects in
three-dimensional space, 1988; C. Ericson, Real-Time Collision Detection, 2005, 5.1.5 (triangle), 9.5 (this walk).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.collision.convex_body import ASIDE, CENTER, REACH, ConvexArrays, point_of
from engine.collision.convex_pair import PlacedBody, interior_point, placed_body, support_value, support_vertex
from engine.collision.meshes.near_triangles import FACE
from engine.collision.meshes.placement import PoseArrays, placed, rotate_back
from engine.collision.meshes.triangle_triangle import Facet
from engine.compiling.jit import called, inline, kernel, merged
from engine.distance.closed_forms import Wide, Wide3, dot3, gap_of_forms, less, less3, root
from engine.distance.refined import ROUNDING, corner_of, ends_of, height_above
from engine.predicates.error_free import is_correctly_rounded, two_diff, two_sum, workspace
from engine.predicates.vectors import dot, largest_of, length, minus, negative
from engine.types import FlagArray, FloatArray, IntArray, Point3

_TURNS: Final = 40
_SMALLEST, _LARGEST = 2.0**-140, 2.0**200
"""Range of lengths, with _SMALLEST, in which the bounds are valid."""
_POLL_EVERY: Final = 64


class Corner(NamedTuple):
    """A point of the Minkowski difference M = {a - b}: `at` is vertex i of the first body minus vertex j of the
    second."""

    at: Point3
    i: int
    j: int


class Simplex(NamedTuple):
    """A simplex of the GJK walk, n <= 3 corners of the Minkowski difference; unused ones of a, b, c repeat a used
    one."""

    a: Corner
    b: Corner
    c: Corner
    n: int


@inline
def _weights(a: Point3, b: Point3, c: Point3) -> tuple[float, float, float]:
    """Return the barycentric weights, from 0 to 1, of the point of triangle a b c, maybe degenerate, nearest to the
    origin."""
    u, v = minus(b, a), minus(c, a)
    ua, va, ub, vb, uc, vc = -dot(u, a), -dot(v, a), -dot(u, b), -dot(v, b), -dot(u, c), -dot(v, c)
    if ua <= 0.0 and va <= 0.0:
        return 1.0, 0.0, 0.0
    if ub >= 0.0 and vb <= ub:
        return 0.0, 1.0, 0.0
    of_c = ua * vb - ub * va
    if of_c <= 0.0 and ua >= 0.0 and ub <= 0.0:
        share = ua / (ua - ub)
        return 1.0 - share, share, 0.0
    if vc >= 0.0 and uc <= vc:
        return 0.0, 0.0, 1.0
    of_b = uc * va - ua * vc
    if of_b <= 0.0 and va >= 0.0 and vc <= 0.0:
        share = va / (va - vc)
        return 1.0 - share, 0.0, share
    of_a = ub * vc - uc * vb
    if of_a <= 0.0 and vb - ub >= 0.0 and uc - vc >= 0.0:
        share = (vb - ub) / ((vb - ub) + (uc - vc))
        return 0.0, 1.0 - share, share
    whole = of_a + of_b + of_c
    return of_a / whole, of_b / whole, of_c / whole


@inline
def _add_corner(s: Simplex, new: Corner) -> tuple[Simplex, Point3]:
    """Return the simplex, of the corners of s and a new one, that carries the point of their hull nearest to the origin
    and no corner more, and that point."""
    best, reduced, nearest = np.inf, s, new.at
    for turn in range(3):
        p, q = (s.b if turn == 2 else s.a), (s.b if turn == 0 else s.c)
        x, y, z = _weights(new.at, p.at, q.at)
        w, a, b, c = Point3(x, y, z), new.at, p.at, q.at
        v = Point3(dot(w, Point3(a.x, b.x, c.x)), dot(w, Point3(a.y, b.y, c.y)), dot(w, Point3(a.z, b.z, c.z)))
        if dot(v, v) < best:
            best, nearest = dot(v, v), v
            first = new if x > 0.0 else (p if y > 0.0 else q)
            last = q if z > 0.0 else (p if y > 0.0 else new)
            reduced = Simplex(first, p if x > 0.0 and y > 0.0 else last, last, (x > 0.0) + (y > 0.0) + (z > 0.0))
        if s.n < 3:
            break
    return reduced, nearest


@merged
def _support_corner(pool: ConvexArrays, a: PlacedBody, b: PlacedBody, v: Point3) -> tuple[Corner, float]:
    """Support mapping of the Minkowski difference {a - b}: return its corner that minimises dot(v, corner), a
    difference of two vertices, and that minimum, rounded."""
    i = support_vertex(pool.points, a, rotate_back(a.place, negative(v)))
    j = support_vertex(pool.points, b, rotate_back(b.place, v))
    at = minus(placed(point_of(pool.points, i), a.place), placed(point_of(pool.points, j), b.place))
    return Corner(at, i, j), dot(v, at)


@merged
def _slab(pool: ConvexArrays, a: PlacedBody, b: PlacedBody, v: Point3, error: float) -> float:
    """Return a lower bound on the distance of two placed bodies without their radii: the width of the slab between them
    across the direction v, which points from b to a. error: bound on a placed coordinate, both bodies together."""
    d = negative(v)
    size = abs(d.x) + abs(d.y) + abs(d.z)
    gap = -(support_value(pool.points, a, d) + support_value(pool.points, b, v)) - 2.25 * error * size
    return gap / (length(d) * (1.0 + 2.0**-50))


@merged
def gap_of_convex(pool: ConvexArrays, first: int, second: int, a: PlacedBody, b: PlacedBody, gap: float,
                  is_measured: bool) -> float:  # fmt: skip
    """Return the distance of two convex bodies, correctly rounded; infinity if it is provably at least `gap`, NaN if
    unproven. first, second: their indices in the pool; a, b: the same, placed. is_measured: if False, 0.0 stands for
    any distance below `gap`."""
    error = a.place.error + b.place.error
    v = minus(interior_point(pool.numbers, first, a, CENTER), interior_point(pool.numbers, second, b, ASIDE))
    corner, along = _support_corner(pool, a, b, v)
    if along > (gap + a.round + b.round) * length(v) and _slab(pool, a, b, v, error) > gap:
        return np.inf
    simplex, v, reach = Simplex(corner, corner, corner, 1), corner.at, largest_of(corner.at)
    if not (error < _LARGEST and reach < _LARGEST):
        return np.nan
    for _ in range(_TURNS):
        square = dot(v, v)
        if not square > _SMALLEST:
            return np.nan
        most = np.sqrt(square) - a.round - b.round + error + 2.0**-46 * (reach + a.round + b.round)
        if not is_measured and most < gap:
            return 0.0
        corner, along = _support_corner(pool, a, b, v)
        reach = max(reach, largest_of(corner.at))
        if along > (gap + a.round + b.round) * np.sqrt(square) and _slab(pool, a, b, v, error) > gap:
            return np.inf
        if square - along <= 2.0**-44 * square:
            break
        grown, nearest = _add_corner(simplex, corner)
        if not dot(nearest, nearest) < square:
            break
        simplex, v = grown, nearest
    distance = _certified_distance(pool, simplex, a, b, pool.numbers[first, REACH] + pool.numbers[second, REACH])
    return np.inf if distance > gap else (np.nan if not distance < gap else distance)


@merged
def _dual(pool: ConvexArrays, f: PlacedBody, vertex: int, shift: Wide3) -> Wide3:
    """Return a vertex of the pool rotated by body f's placement in double-doubles, with `shift` in place of the
    translation."""
    return corner_of(f.place, point_of(pool.points, vertex), shift)


@called
def _certified_distance(pool: ConvexArrays, s: Simplex, a: PlacedBody, b: PlacedBody, reach: float) -> float:
    """Return the double nearest to the distance of two placed bodies, measured between the features that the corners of
    simplex s span; NaN if unproven. reach: bound on coordinates relative to the first body."""
    origin, p, q = Wide(0.0, 0.0), a.place.shift, b.place.shift
    here = Wide3(origin, origin, origin)
    there = Wide3(Wide(*two_diff(q.x, p.x)), Wide(*two_diff(q.y, p.y)), Wide(*two_diff(q.z, p.z)))
    i, j = _kinds(s.a.i, s.b.i, s.c.i), _kinds(s.a.j, s.b.j, s.c.j)
    t = Facet(_dual(pool, a, i[0], here), _dual(pool, a, i[1], here), _dual(pool, a, i[2], here))
    u = Facet(_dual(pool, b, j[0], there), _dual(pool, b, j[1], there), _dual(pool, b, j[2], there))
    p_end, q_end, _, _ = ends_of(t, u, i[3], j[3])
    n = less3(q_end, p_end)
    square = dot3(n, n)
    whole = reach + max(abs(there.x.h), abs(there.y.h), abs(there.z.h))
    if not (square.h > _SMALLEST and square.h > 2.0**-80 * whole * whole):
        return np.nan
    beyond = max(
        _excess_beyond(pool, a, n, p_end, here, whole), _excess_beyond(pool, b, less3(here, n), q_end, there, whole)
    )
    size, radii = root(square), Wide(*two_sum(a.round, b.round))
    distance, bound = less(size, radii), 2.0 * beyond / size.h + ROUNDING * (whole + radii.h)
    is_proven = distance.h > bound and is_correctly_rounded(distance.h, distance.low, bound)
    return distance.h if is_proven else np.nan


@inline
def _kinds(i: int, j: int, k: int) -> tuple[int, int, int, int]:
    """Return three vertices of a body, distinct ones first, and the code of the feature that they span: 0 a vertex, 3
    an edge, or FACE (`near_triangles.py`)."""
    if i == j:
        j, k = k, j
    if i == j:
        return i, i, i, 0
    return (i, j, j, 3) if k in (i, j) else (i, j, k, FACE)


@merged
def _excess_beyond(pool: ConvexArrays, f: PlacedBody, n: Wide3, base: Wide3, shift: Wide3, reach: float) -> float:
    """Return max(0, dot(n, x - base)) over the vertices x of body f, rotated and moved by `shift`, without those that
    floats prove to lie behind the plane at base across n. reach: bound on coordinates."""
    d, most = Point3(n.x.h, n.y.h, n.z.h), 0.0
    local = rotate_back(f.place, d)
    level = d.x * (base.x.h - shift.x.h) + d.y * (base.y.h - shift.y.h) + d.z * (base.z.h - shift.z.h)
    slack = 2.0**-44 * reach * (abs(d.x) + abs(d.y) + abs(d.z))
    for vertex in range(f.first, f.stop):
        if dot(local, point_of(pool.points, vertex)) - level > -slack:
            most = max(most, height_above(n, _dual(pool, f, vertex, shift), base).h)
    return most


@kernel
def gaps_of_pairs(
    forms: FloatArray, pool: ConvexArrays, bodies: IntArray, kinds: IntArray, poses: PoseArrays, places: IntArray,
    gap: float, is_measured: bool, distances: FloatArray, flag: FlagArray,
) -> None:  # fmt: skip
    """Fill distances (n,) of n disjoint pairs of placed solids: infinity if at least `gap`, NaN if unproven. Returns
    early when the flag is set.

    kinds (n, 2): the solids of each pair; forms (n_solids, 8): numbers of their boxes or balls, NaN for other solids;
    bodies (n_solids,): their index in the pool, or -1; places (n, 2): rows of the poses, 0 for none. is_measured: if
    False, 0.0 stands for any distance below `gap`."""
    w = workspace(30)
    for item in range(places.shape[0]):
        if item % _POLL_EVERY == 0 and flag[0] != 0:
            return
        (i, j), (first, second) = (places[item, 0], places[item, 1]), (kinds[item, 0], kinds[item, 1])
        turns, moves = poses.rotations, poses.translations
        distances[item] = np.nan
        if forms[first, 0] == forms[first, 0] and forms[second, 0] == forms[second, 0]:
            distance, _, _, _, _ = gap_of_forms(forms[first], turns[i], moves[i], forms[second], turns[j], moves[j], w)
            if distance > 0.0 and distance != gap:
                distances[item] = distance if distance < gap else np.inf
                continue
        if bodies[first] >= 0 and bodies[second] >= 0:
            a, b = placed_body(pool, bodies[first], poses, i), placed_body(pool, bodies[second], poses, j)
            distances[item] = gap_of_convex(pool, bodies[first], bodies[second], a, b, gap, is_measured)
