"""Exact distance of two triangles in integers, their nearest points, and the nearest doubles to those.

Corners are integers on the lattice of the pair (exact_body.py). Floats suggest two features; the nearest points of
their lines or planes are integers over a denominator. They are the nearest of the triangles exactly if they lie on them
and both triangles lie beyond the planes across their connection (both are convex); else all pairs of features are
tried.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Final, NamedTuple

import numpy as np

from engine.collision.meshes.near_triangles import FACE
from engine.collision.result import Clearance, Feature
from engine.errors import NotRepresentableError
from engine.predicates.rational import cross, dot, minus, nearest, nearest_with_root, squared_length

Vector = tuple[int, ...]
Corners = tuple[Vector, Vector, Vector]
Wall = tuple[Vector, int, int]
_SMALLEST: Final = 5e-324


class Rational(NamedTuple):
    """A rational point: numerators over one positive denominator."""

    numerators: Vector
    denominator: int


class Gap(NamedTuple):
    """Points p, q of two bodies; first, second: the codes of the features that they lie on (`near_triangles.py`); top /
    bottom: their squared distance."""

    p: Rational
    q: Rational
    first: int
    second: int
    top: int
    bottom: int

    def is_less(self, other: Gap) -> bool:
        """Return whether this gap is shorter than the other."""
        return self.top * other.bottom < other.top * self.bottom


class ScaledGap(NamedTuple):
    """A gap between disjoint bodies, and the radii of balls about its ends, in integers: lengths times `scale`."""

    gap: Gap
    radii: tuple[int, int]
    scale: int

    def clearance(self, features: tuple[Feature, Feature], dimension: int) -> Clearance:
        """Return distance, nearest points with `dimension` coordinates, and the given features."""
        distance, points = self.distance(), np.array(self.ends())[:, :dimension]
        points.setflags(write=False)
        return Clearance(distance, points, features)

    def ends(self) -> tuple[list[float], list[float]]:
        """Return the nearest points, each coordinate the nearest double. Raises: NotRepresentableError."""
        p, q = self.gap.p, self.gap.q
        try:
            return self._toward(p, q, self.radii[0]), self._toward(q, p, self.radii[1])
        except OverflowError:
            raise NotRepresentableError(
                "a nearest point is beyond the largest double, 1.8e308; scale both bodies down by a power of two", ()
            ) from None

    def distance(self) -> float:
        """Return the double nearest to the distance; the smallest denormal instead of 0. Times scale the distance is
        sqrt(top / bottom) - radii = (sqrt(top bottom) - radii bottom) / bottom. Raises: NotRepresentableError beyond
        the largest double."""
        top, bottom = self.gap.top, self.gap.bottom
        try:
            return nearest_with_root(-sum(self.radii) * bottom, 1, top * bottom, bottom * self.scale) or _SMALLEST
        except OverflowError:
            raise NotRepresentableError(
                "the distance is beyond the largest double, 1.8e308; scale both bodies down by a power of two", ()
            ) from None

    def is_at_least(self, least: Fraction) -> bool:
        """Return whether the distance is at least `least`: top / bottom >= (radii + least scale)^2."""
        reach = sum(self.radii) * least.denominator + least.numerator * self.scale
        return self.gap.top * least.denominator**2 >= reach * reach * self.gap.bottom

    def is_at_most(self, most: Fraction) -> bool:
        """Return whether the distance is at most `most`."""
        reach = sum(self.radii) * most.denominator + most.numerator * self.scale
        return self.gap.top * most.denominator**2 <= reach * reach * self.gap.bottom

    def _toward(self, p: Rational, q: Rational, radius: int) -> list[float]:
        """Return the doubles nearest to the point at distance `radius` from p toward q: p + radius (q - p) / |q - p|.
        With n, q - p times both denominators, that is p + radius n / sqrt(top)."""
        if not radius:
            return [nearest(x, p.denominator * self.scale) for x in p.numerators]
        n = (y * p.denominator - x * q.denominator for x, y in zip(p.numerators, q.numerators))
        top, size = self.gap.top, p.denominator * self.gap.top * self.scale
        return [nearest_with_root(x * top, radius * y * p.denominator, top, size) for x, y in zip(p.numerators, n)]


def nearest_of_triangles(s: Corners, t: Corners, first: int, second: int) -> Gap:
    """Return the gap between two disjoint triangles. first, second: codes of the features that are probably nearest,
    tried before all others."""
    suggested = _gap(s, t, first, second)
    if suggested is not None:
        wall, other = walls(suggested)
        if all(is_beyond(wall, corner) for corner in s) and all(is_beyond(other, corner) for corner in t):
            return suggested
    best = None
    for i, j in _OF_EDGES if s[1] == s[2] and t[1] == t[2] else _PAIRS:
        candidate = _gap(s, t, i, j)
        if candidate is not None and (best is None or candidate.is_less(best)):
            best = candidate
    assert best is not None
    return best


_ALL: Final = [(i, j) for i in range(7) for j in range(7) if (i < 6 and j < 6) or i < 3 or j < 3]
_PAIRS: Final = sorted(_ALL, key=lambda pair: max(pair[0] // 3, pair[1] // 3))
"""Pairs of feature codes that can be nearest, pairs of vertices first."""
_OF_EDGES: Final = [pair for pair in _PAIRS if {*pair} <= {0, 1, 3}]
"""The same for two edges, which are triangles whose last two corners are equal."""


def walls(gap: Gap) -> tuple[Wall, Wall]:
    """Return the planes across a gap at its ends, p first, each as (n, at, size): x lies on the plane or beyond it,
    seen from the gap, if n . x size <= at."""
    (p, p_size), (q, q_size) = gap.p, gap.q
    n = tuple(y * p_size - x * q_size for x, y in zip(p, q))
    return (n, dot(n, p), p_size), (tuple(-x for x in n), -dot(n, q), q_size)


def is_beyond(wall: Wall, point: Vector) -> bool:
    """Return whether a point lies on a plane of `walls` or beyond it, seen from the gap."""
    n, at, size = wall
    return dot(n, point) * size <= at


def _gap(s: Corners, t: Corners, first: int, second: int) -> Gap | None:
    """Return the gap of two features, given by codes, of triangles s and t; None if the nearest points of their lines
    or planes lie outside them."""
    if first < 3:
        foot = _project(s[first], t, second)
        return None if foot is None else _between(Rational(s[first], 1), foot[0], first, foot[1])
    if second < 3:
        foot = _project(t[second], s, first)
        return None if foot is None else _between(foot[0], Rational(t[second], 1), foot[1], second)
    return None if FACE in (first, second) else _edges(s, first - 3, t, second - 3)


def _between(p: Rational, q: Rational, first: int, second: int) -> Gap:
    """Return the gap with ends p and q on features of the given codes."""
    n = tuple(y * p.denominator - x * q.denominator for x, y in zip(p.numerators, q.numerators))
    return Gap(p, q, first, second, squared_length(n), (p.denominator * q.denominator) ** 2)


def _project(point: Vector, t: Corners, feature: int) -> tuple[Rational, int] | None:
    """Return the foot of a point on a feature of triangle t, and the code of the vertex, edge or face that it lies on;
    None if it lies outside the feature."""
    if feature < 3:
        return Rational(t[feature], 1), feature
    if feature < FACE:
        k = feature - 3
        a, u = t[k], minus(t[(k + 1) % 3], t[k])
        size = squared_length(u)
        return _on_edge(t, k, dot(minus(point, a), u), size) if size else (Rational(a, 1), k)
    n = cross(minus(t[1], t[0]), minus(t[2], t[0]))
    size = squared_length(n)
    if not size:
        return None
    for k in range(3):
        side = dot(cross(minus(t[(k + 1) % 3], t[k]), minus(point, t[k])), n)
        if side < 0:
            return None
        if side == 0:
            return _project(point, t, 3 + k)
    height = dot(n, minus(point, t[0]))
    return Rational(tuple(x * size - height * y for x, y in zip(point, n)), size), FACE


def _on_edge(t: Corners, k: int, part: int, whole: int) -> tuple[Rational, int] | None:
    """Return the point at parameter part / whole of edge k of t, and the code of the feature it lies on, the edge or an
    end; None if it lies beyond an end."""
    a, b = t[k], t[(k + 1) % 3]
    if part == 0 or part == whole:
        return Rational(b if part else a, 1), ((k + 1) % 3 if part else k)
    if not 0 < part < whole:
        return None
    return Rational(tuple(x * (whole - part) + y * part for x, y in zip(a, b)), whole), 3 + k


def _edges(s: Corners, i: int, t: Corners, j: int) -> Gap | None:
    """Return the gap across edge i of s and edge j of t (0, 1, 2), None if its ends lie outside them. None also for
    parallel edges: then the gap at an end of one is as small."""
    u, v, w = minus(s[(i + 1) % 3], s[i]), minus(t[(j + 1) % 3], t[j]), minus(s[i], t[j])
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    size = uu * vv - uv * uv
    if not size:
        return None
    p, q = _on_edge(s, i, uv * vw - vv * uw, size), _on_edge(t, j, uu * vw - uv * uw, size)
    return None if p is None or q is None else _between(p[0], q[0], p[1], q[1])
