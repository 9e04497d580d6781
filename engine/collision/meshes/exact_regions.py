"""Exact fallback where contacts alone prove nothing: the status of both bodies on either side of each region of a face.

The faces of both bodies cut a face T into regions. Within a region, each body is inside or outside just above T, and
just below. One point q per region, with rational coordinates (x, y, z, w), and the line through q along the axis k of
T's largest normal component decide both. A face with plane F(q) = a x + b y + c z + d w, F_k its coefficient on axis k,
that the line passes through:

    F(q) F_k < 0     the face is above q: above := not above
    F(q) = 0         q is on the face: below differs from above by one more flip
    F(q) F_k > 0     the face is below q: nothing

Regions are sampled by slabs: the traces of other faces on T are segments; an edge P Q of another face, with values f, g
at the plane of T, ends its trace in (f Q - g P) / (f - g). Between neighbouring abscissas of ends and crossings of
traces no two traces cross, so one point between neighbours on the middle of every slab reaches every region with an
interior. The line is moved by (eps, eps^2) across itself (orientation.py), so that it meets no edge.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

from engine.collision.meshes.exact_body import Corners, ExactBody, Plane, Vector, drop_axis, rounded_outward, value_at
from engine.predicates.orientation import tie_sign_exact
from engine.predicates.rational import cross, dot, minus, sign_of
from engine.running.budget import Budget

Rational = int | Fraction  # integers where they suffice: they are ten times faster
Rational2 = tuple[Rational, Rational]
Trace = tuple[Rational2, Rational2]
Homogeneous = tuple[int, ...]
"""x, y, z, w: the point (x / w, y / w, z / w), w > 0."""

Only = tuple[int, list[int]]

WITHIN = ((1, 1, 1), (1, 1, 2), (2, 1, 1), (3, 5, 4), (7, 11, 5))
"""Barycentric weights, not normalised, of sample points inside a face."""


class Sides(NamedTuple):
    """Where a body is, along an axis through a point: whether it is inside just above the point, inside just below it,
    and inside at it (then the point lies on no face)."""

    above: bool
    below: bool
    at: bool


def sides_at(body: ExactBody, q: Homogeneous, axis: int) -> Sides:
    """Return whether `body` is inside just above q along `axis`, just below and at q. Caller guarantees that no face
    through q is parallel to the axis."""
    sides = sides_over(body, q, axis, None)
    assert sides is not None
    return sides


def sides_over(body: ExactBody, q: Homogeneous, axis: int, plane: Plane | None) -> Sides | None:
    """Return whether `body` is inside just above, just below and at a point q of `plane`, along `axis`; None if a face
    through q is not parallel to the plane, so that the two sides of the plane at q are not uniform. plane None: this is
    not tested."""
    if not body.mesh.has_inside:
        return Sides(False, False, False)
    above = changes = is_on_face = False
    j, k = (axis + 1) % 3, (axis + 2) % 3
    x, y, w = q[j], q[k], q[3]
    low, high = _around(body, [q])
    high[axis] = float("inf")
    for face in body.faces_in(low, high):
        other = body.plane(face)
        slope = other[axis]
        if slope == 0:  # case: a face along the line, or without area
            continue
        corners = body.corners(face)
        if not _perturbed_line_hits(corners, j, k, x, y, w):
            continue
        height = other[0] * q[0] + other[1] * q[1] + other[2] * q[2] + other[3] * w
        if height == 0:
            if plane is not None and any(cross(plane[:3], other[:3])):
                return None
            is_on_face, changes = True, not changes
        elif (height < 0) == (slope > 0):  # the face lies above q
            above = not above
    return Sides(above, above != changes, above and not is_on_face)


def side_of_clean(body: ExactBody, face: int) -> int:
    """Return the side of a face of STATE_CLEAN (not crossed or covered by others) on which its body lies: 1 the side to
    which its normal points, -1 the other; 0 if no sample point decides. Cached in the mesh."""
    cached, axis, plane = body.mesh.arrays.inner, body.axis(face), body.plane(face)
    if cached[face] not in (1, -1):
        for q in points_within(body.corners(face)):
            sides = sides_over(body, q, axis, plane)
            if sides is not None:
                cached[face] = 1 if sides.above == (plane[axis] > 0) else -1
                return int(cached[face])
        return 0
    return int(cached[face])


def points_within(corners: Corners) -> Iterator[Homogeneous]:
    """Yield a few points in the relative interior of a face, as homogeneous integers (x, y, z, w)."""
    for weights in WITHIN:
        x, y, z = (sum(w * p[side] for w, p in zip(weights, corners)) for side in range(3))
        yield x, y, z, sum(weights)


def _around(body: ExactBody, points: Sequence[Homogeneous]) -> tuple[list[float], list[float]]:
    """Return the low and the high corner of a box of doubles that contains the points. points: homogeneous, on the
    lattice of `body`, all with the same w."""
    scale, sides = points[0][3] << body.shift, list(zip(*points))[:3]
    return [rounded_outward(min(x), scale)[0] for x in sides], [rounded_outward(max(x), scale)[1] for x in sides]


def _perturbed_line_hits(corners: Corners, j: int, k: int, x: int, y: int, w: int) -> bool:
    """Return whether a line along an axis, moved by (eps, eps^2), passes through a triangle. j, k: the other two axes,
    on which the line has the coordinates x / w and y / w. Caller guarantees that the triangle is not parallel to the
    line."""
    before = 0
    for index in range(3):
        a, b = corners[index], corners[(index + 1) % 3]
        dx, dy = b[j] - a[j], b[k] - a[k]
        value = dx * (y - a[k] * w) - dy * (x - a[j] * w)
        turn = (value > 0) - (value < 0)
        if turn == 0:
            turn = tie_sign_exact(a[j], a[k], b[j], b[k])
        if before * turn < 0:
            return False
        before = turn
    return True


def regions_of(
    body: ExactBody, face: int, cutters: list[ExactBody], budget: Budget, only: Only | None = None
) -> Iterator[Homogeneous]:
    """Yield a homogeneous point in each region into which the faces of `cutters` cut a face of `body` with area; no
    point lies on a trace, the segment in which another face meets the plane. only: (side, faces) restricts the cutters
    to those of these faces that reach strictly to that side (1: of the normal, -1) of the face's plane; None: all."""
    traces = _traces(body, face, cutters, budget, only)
    if not traces:
        yield next(points_within(body.corners(face)))
    for (x, y), _ in _sample_regions(body, face, traces, budget) if traces else ():
        yield _lift_to_plane(x, y, body.plane(face), body.axis(face))


def cells_of(body: ExactBody, face: int, budget: Budget) -> Iterator[tuple[Homogeneous, list[Homogeneous]]]:
    """Yield an interior point and the four corners, homogeneous, of each trapezoid into which the traces of the body's
    other faces, and vertical lines at their ends and crossings, cut a face."""
    plane, axis = body.plane(face), body.axis(face)
    for (x, y), (x0, x1, low, high) in _sample_regions(body, face, _traces(body, face, [body], budget, None), budget):
        corners = (x0, _height(low, x0)), (x1, _height(low, x1)), (x1, _height(high, x1)), (x0, _height(high, x0))
        yield _lift_to_plane(x, y, plane, axis), [_lift_to_plane(*corner, plane, axis) for corner in corners]


def _lift_to_plane(x: Rational, y: Rational, plane: Plane, axis: int) -> Homogeneous:
    """Return the homogeneous point of a plane that projects to (x, y) along ``axis``, to which the plane is not
    parallel; x, y: the coordinates after the axis, in cyclic order."""
    j, k, n = (axis + 1) % 3, (axis + 2) % 3, abs(plane[axis])
    w, sign = x.denominator * y.denominator, sign_of(plane[axis])
    xw, yw = x.numerator * y.denominator, y.numerator * x.denominator
    point = [0, 0, 0, w * n]
    point[axis] = -sign * (plane[j] * xw + plane[k] * yw + plane[3] * w)
    point[j], point[k] = xw * n, yw * n
    return tuple(point)


def _segment(p: Rational2, q: Rational2) -> Trace:
    return (p, q) if p <= q else (q, p)


def _traces(body: ExactBody, face: int, cutters: list[ExactBody], budget: Budget, only: Only | None) -> list[Trace]:
    """Return the segments in which faces of `cutters` meet the plane of a face of `body`, near the face, projected
    along its axis. only: as in `regions_of`, the faces that count and the side to which they reach."""
    low, high = _around(body, [(*p, 1) for p in body.corners(face)])
    segments = set()
    for cutter in cutters:
        for other in cutter.faces_in(low, high) if only is None else only[1]:
            budget.check()
            if (cutter is body and other == face) or not any(cutter.plane(other)[:3]):
                continue
            points = cutter.corners(other)
            values = [value_at(body.plane(face), p) for p in points]
            if only is None or max(only[0] * value for value in values) > 0:
                segments |= {_segment(p, q) for p, q in _trace(points, values, body.axis(face)) if p != q}
    return sorted(segments)


def _trace(points: Corners, values: list[int], axis: int) -> list[Trace]:
    """Return the segments in which a triangle meets a plane, projected along ``axis``: none, one, or its three edges if
    it lies in the plane. values: its corners' in the plane's equation."""
    if not any(values):
        return [(drop_axis(points[i], axis), drop_axis(points[i - 2], axis)) for i in range(3)]
    flat = [drop_axis(p, axis) for p in points]
    ends: list[Rational2] = [p for p, value in zip(flat, values) if value == 0]
    for i in range(3):
        (f, (x, y)), (g, (z, w)) = (values[i], flat[i]), (values[i - 2], flat[i - 2])
        if f * g < 0:
            ends.append((Fraction(f * z - g * x, f - g), Fraction(f * w - g * y, f - g)))
    return [(ends[0], ends[1])] if len(ends) == 2 else []


def _sample_regions(
    body: ExactBody, face: int, traces: list[Trace], budget: Budget
) -> Iterator[tuple[Rational2, _Cell]]:
    """Yield a point in every region into which `traces` cut a face, and the trapezoid (`_Cell`) that contains the
    point; both projected along the face's axis."""
    corners = [drop_axis(corner, body.axis(face)) for corner in body.corners(face)]
    own = [_segment(corners[i], corners[i - 2]) for i in range(3)]
    left, right = min(p[0] for p, _ in own), max(q[0] for _, q in own)
    segments = [_on_line(s) for s in sorted({*own, *traces}) if s[0][0] <= right and s[1][0] >= left]
    stops = {end[0] for s in segments for end in s.ends if left <= end[0] <= right}
    for index, one in enumerate(segments):
        budget.check()
        for other in segments[index + 1 :]:
            if other.ends[0][0] >= one.ends[1][0]:  # invariant: sorted by their left ends
                break
            x = _crossing_abscissa(one, other)
            if x is not None and left < x < right:
                stops.add(x)
    edges = [_on_line(s) for s in own]
    for x0, x1 in pairwise(sorted(stops)):
        budget.check()
        x = Fraction(x0 + x1, 2)
        ends = [_height(s, x) for s in edges if s.ends[0][0] < x < s.ends[1][0]]
        low, high = min(ends), max(ends)
        heights = {_height(s, x): s for s in segments if s.ends[0][0] < x < s.ends[1][0]}
        for y0, y1 in pairwise(sorted(y for y in heights if low <= y <= high)):
            yield (x, (y0 + y1) / 2), (x0, x1, heights[y0], heights[y1])


class _Segment(NamedTuple):
    """A planar segment. ends: the left one first; left, right: the same as homogeneous integers (x, y, w); line: (a, b,
    c) of its line a x + b y + c = 0."""

    ends: Trace
    left: Vector
    right: Vector
    line: Vector


def _on_line(ends: Trace) -> _Segment:
    """Return the segment between two rational points, the left one first."""
    whole = [(*x.as_integer_ratio(), *y.as_integer_ratio()) for x, y in ends]
    left, right = ((x * v, y * u, u * v) for x, u, y, v in whole)
    return _Segment(ends, left, right, cross(left, right))


_Cell = tuple[Rational, Rational, _Segment, _Segment]
"""A trapezoid: left and right abscissa, lower and upper segment, which do not cross between these."""


def _height(s: _Segment, x: Rational) -> Fraction:
    """Return the ordinate of the line of s at abscissa x."""
    a, b, c = s.line
    return Fraction(-(a * x.numerator + c * x.denominator), b * x.denominator)


def _crossing_abscissa(s: _Segment, t: _Segment) -> Fraction | None:
    """Return the abscissa of the point in which two segments cross, if it is inside both, else None."""
    for one, other in ((s, t), (t, s)):
        if sign_of(dot(one.line, other.left)) * sign_of(dot(one.line, other.right)) >= 0:
            return None
    x, _, w = cross(s.line, t.line)
    return Fraction(x, w)


def pieces_of_segment(
    body: ExactBody, ends: tuple[Vector, Vector], cutter: ExactBody, budget: Budget
) -> Iterator[Homogeneous]:
    """Yield the homogeneous midpoint of each piece into which the faces of `cutter` cut the segment `ends`, given on
    the lattice of `body`; some may lie on a face."""
    p, q = ends
    low, high = _around(body, [(*p, 1), (*q, 1)])
    stops = {Fraction(0), Fraction(1)}
    for face in cutter.faces_in(low, high):
        budget.check()
        for plane in _planes_that_cut(cutter, face):
            f, g = value_at(plane, p), value_at(plane, q)
            if f != g:
                t = Fraction(f, f - g)
                if 0 < t < 1:
                    stops.add(t)
    for t0, t1 in pairwise(sorted(stops)):
        t = (t0 + t1) / 2
        n, w = t.numerator, t.denominator
        yield (p[0] * (w - n) + q[0] * n, p[1] * (w - n) + q[1] * n, p[2] * (w - n) + q[2] * n, w)


def _planes_that_cut(cutter: ExactBody, face: int) -> Iterator[Plane]:
    """Yield the plane of a face, and the planes through its edges perpendicular to it. A segment enters or leaves the
    body only where it crosses one of these."""
    plane = cutter.plane(face)
    if any(plane[:3]):
        yield plane
        corners = cutter.corners(face)
        for i in range(3):
            m = cross(plane[:3], minus(corners[i - 2], corners[i]))
            yield (*m, -dot(m, corners[i]))
