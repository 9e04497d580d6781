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

import math
from typing import Final, NamedTuple

import numpy as np

from engine.collision.convex_body import ASIDE, CENTER, REACH, ConvexArrays, point_of
from engine.collision.convex_pair import PlacedBody, interior_point, placed_body, support_value, support_vertex
from engine.collision.meshes.near_triangles import FACE
from engine.collision.meshes.placement import PoseArrays, placed, rotate_back
from engine.collision.meshes.triangle_triangle import Facet
from engine.compiling.jit import called, inline, kernel, merged
from engine.distance.closed_forms import Wide, Wide3, dot3, gap_of_forms, less, less3, root
from engine.distance.refined import CERTAIN, ROUNDING, corner_of, ends_of, height_above, scaled
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
def _support_corner(a: PlacedBody, b: PlacedBody, v: Point3) -> tuple[Corner, float]:
    """Support mapping of the Minkowski difference {a - b}: return its corner that minimises dot(v, corner), a
    difference of two vertices, and that minimum, rounded."""
    i, j = support_vertex(a, rotate_back(a.place, negative(v))), support_vertex(b, rotate_back(b.place, v))
    at = minus(placed(point_of(a.points, i), a.place), placed(point_of(b.points, j), b.place))
    return Corner(at, i, j), dot(v, at)


@merged
def _slab(a: PlacedBody, b: PlacedBody, v: Point3, error: float) -> float:
    """Return a lower bound on the distance of two placed bodies without their radii: the width of the slab between them
    across the direction v, which points from b to a. error: bound on a placed coordinate, both bodies together."""
    d = negative(v)
    gap = -(support_value(a, d) + support_value(b, v)) - 2.25 * error * (abs(d.x) + abs(d.y) + abs(d.z))
    return gap / (length(d) * (1.0 + 2.0**-50))


FARTHER, NEARER, STUCK, FOUND = range(4)
"""Outcomes of a walk: proven to be at least the gap apart; proven nearer; nothing; a simplex that is probably the
nearest."""


@inline
def walk(a: PlacedBody, b: PlacedBody, start: Point3, gap: float, is_measured: bool) -> tuple[int, Simplex]:
    """GJK: return the outcome of the walk from `start`, about a difference of points of two placed bodies, and its last
    simplex. is_measured: if False, NEARER may be returned for any distance below `gap`."""
    error, v = a.place.error + b.place.error, start
    corner, along = _support_corner(a, b, v)
    simplex = Simplex(corner, corner, corner, 1)
    if along > (gap + a.round + b.round) * length(v) and _slab(a, b, v, error) > gap:
        return FARTHER, simplex
    v, reach = corner.at, largest_of(corner.at)
    if not (error < _LARGEST and reach < _LARGEST):
        return STUCK, simplex
    for _ in range(_TURNS):
        square = dot(v, v)
        if not square > _SMALLEST:
            return STUCK, simplex
        most = np.sqrt(square) - a.round - b.round + error + 2.0**-46 * (reach + a.round + b.round)
        if not is_measured and most < gap:
            return NEARER, simplex
        corner, along = _support_corner(a, b, v)
        reach = max(reach, largest_of(corner.at))
        if along > (gap + a.round + b.round) * np.sqrt(square) and _slab(a, b, v, error) > gap:
            return FARTHER, simplex
        if square - along <= 2.0**-44 * square:
            break
        grown, nearest = _add_corner(simplex, corner)
        if not dot(nearest, nearest) < square:
            break
        simplex, v = grown, nearest
    return FOUND, simplex


@merged
def difference_of_centers(
    first: ConvexArrays, i: int, a: PlacedBody, second: ConvexArrays, j: int, b: PlacedBody
) -> Point3:
    """Return where a walk starts: the difference of interior points of bodies i and j of two pools, placed by a, b."""
    return minus(interior_point(first.numbers, i, a, CENTER), interior_point(second.numbers, j, b, ASIDE))


@merged
def gap_of_convex(a: PlacedBody, b: PlacedBody, start: Point3, reach: float, gap: float, is_measured: bool) -> float:
    """Return the distance of two placed convex bodies, correctly rounded; infinity if it is provably at least `gap`,
    NaN if unproven. start: of the walk; reach: of both, added; is_measured: if False, 0.0 stands for any distance below
    `gap`."""
    how, s = walk(a, b, start, gap, is_measured)
    if how != FOUND:
        return np.inf if how == FARTHER else (0.0 if how == NEARER else np.nan)
    i, j = spans_of(s)
    distance = measure(a, b, i, j, unit_of(a, b, reach)).distance
    if distance > gap:
        return np.inf
    return np.nan if not distance < gap else (distance if is_measured else 0.0)


@merged
def unit_of(a: PlacedBody, b: PlacedBody, reach: float) -> float:
    """Return a power of two by which the coordinates of two placed bodies, relative to the first one's translation, are
    below 1. reach: of both, added."""
    size = 4.0 * reach + 2.0 * max(largest_of(a.place.shift), largest_of(b.place.shift))
    return math.ldexp(1.0, -min(max(math.frexp(size)[1], -1000), 1000))


class Span(NamedTuple):
    """Vertices of a body that span a feature, distinct ones first, and its kind by code: 0 a vertex, 3 an edge, or FACE
    (`near_triangles.py`)."""

    i: int
    j: int
    k: int
    code: int


@inline
def spans_of(s: Simplex) -> tuple[Span, Span]:
    """Return the feature that the corners of a simplex span on each body: two that `ends_of` measures."""
    first, second = _span(s.a.i, s.b.i, s.c.i), _span(s.a.j, s.b.j, s.c.j)
    if first.code > 0 and second.code > 0 and first.code + second.code > 6:
        return Span(s.a.i, s.a.i, s.a.i, 0), second
    return first, second


@inline
def _span(i: int, j: int, k: int) -> Span:
    """Return the feature that three vertices of a body span, some of them maybe equal."""
    if i == j:
        j, k = k, j
    if i == j:
        return Span(i, i, i, 0)
    return Span(i, j, j, 3) if k in (i, j) else Span(i, j, k, FACE)


class Measured(NamedTuple):
    """The nearest points p and q of a feature of each of two placed bodies, in the frame of the search (`measure`).

    | field | meaning |
    |---|---|
    | distance | of the bodies: the nearest double, NaN if unproven |
    | error | bound on the coordinates of p and q; infinite unless the exact ones lie within the features |
    | alone, other_alone | whether all other vertices of each body are proven to lie beyond the plane across p q |
    | beyond, other_beyond | whether some vertex of each body is |
    """

    p: Wide3
    q: Wide3
    distance: float
    error: float
    alone: bool
    other_alone: bool
    beyond: bool
    other_beyond: bool


@merged
def _dual(f: PlacedBody, vertex: int, unit: float, shift: Wide3) -> Wide3:
    """Return a vertex of a body times the unit, rotated by its placement in double-doubles, with `shift` in place of
    the translation."""
    return corner_of(f.place, scaled(point_of(f.points, vertex), unit), shift)


@merged
def _facet(f: PlacedBody, s: Span, unit: float, shift: Wide3) -> Facet:
    """Return the vertices of a feature as `_dual` does."""
    return Facet(_dual(f, s.i, unit, shift), _dual(f, s.j, unit, shift), _dual(f, s.k, unit, shift))


@called
def measure(a: PlacedBody, b: PlacedBody, first: Span, second: Span, unit: float) -> Measured:
    """Measure between a feature of each of two placed bodies. Frame: coordinates relative to the first one's
    translation, times the unit (`unit_of`); bounds: `refined.py`."""
    origin, p, q = Wide(0.0, 0.0), scaled(a.place.shift, unit), scaled(b.place.shift, unit)
    here = Wide3(origin, origin, origin)
    there = Wide3(Wide(*two_diff(q.x, p.x)), Wide(*two_diff(q.y, p.y)), Wide(*two_diff(q.z, p.z)))
    t, u = _facet(a, first, unit, here), _facet(b, second, unit, there)
    p_end, q_end, inside, steepness = ends_of(t, u, first.code, second.code)
    n = less3(q_end, p_end)
    square = dot3(n, n)
    if not square.h > 2.0**-200:
        return Measured(p_end, q_end, np.nan, np.inf, False, False, False, False)
    error = CERTAIN * steepness + 2.0**-92
    slack = CERTAIN + 16.0 * error
    excess, alone, beyond = _heights(a, n, p_end, first, here, unit, slack)
    other_excess, other_alone, other_beyond = _heights(b, less3(here, n), q_end, second, there, unit, slack)
    size, radii = root(square), Wide(*two_sum(a.round * unit, b.round * unit))
    distance, bound = less(size, radii), 2.0 * max(excess, other_excess) / size.h + ROUNDING
    is_proven = distance.h > bound and is_correctly_rounded(distance.h, distance.low, bound)
    value = distance.h / unit
    return Measured(
        p_end, q_end, value if is_proven and 2.0**-1000 < value < 2.0**1000 else np.nan,
        error if inside > CERTAIN else np.inf, alone, other_alone, beyond, other_beyond,
    )  # fmt: skip


@merged
def _heights(
    f: PlacedBody, n: Wide3, base: Wide3, known: Span, shift: Wide3, unit: float, slack: float
) -> tuple[float, bool, bool]:
    """Return (excess, alone, beyond): max(0, dot(n, x - base)) over the vertices x of body f, moved by `shift`; whether
    it is below -slack for all vertices but those of the feature `known`; and whether for any. Floats prove most of
    them: in their own coordinates, which are below 1 / unit, they are off by less than 2^-44 |n| / unit."""
    d, most, alone, beyond = Point3(n.x.h, n.y.h, n.z.h), 0.0, True, False
    local = rotate_back(f.place, d)
    level = (d.x * (base.x.h - shift.x.h) + d.y * (base.y.h - shift.y.h) + d.z * (base.z.h - shift.z.h)) / unit
    margin = (2.0**-44 * (abs(d.x) + abs(d.y) + abs(d.z)) + slack) / unit
    for vertex in range(f.first, f.stop):
        if dot(local, point_of(f.points, vertex)) - level < -margin:
            beyond = True
            continue
        height = height_above(n, _dual(f, vertex, unit, shift), base).h
        most, is_behind = max(most, height), height < -slack
        alone = alone and (is_behind or vertex in (known.i, known.j, known.k))
        beyond = beyond or is_behind
    return most, alone, beyond


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
            start = difference_of_centers(pool, bodies[first], a, pool, bodies[second], b)
            reach = pool.numbers[bodies[first], REACH] + pool.numbers[bodies[second], REACH]
            distances[item] = gap_of_convex(a, b, start, reach, gap, is_measured)
