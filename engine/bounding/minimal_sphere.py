"""Minimal enclosing ball (smallest enclosing sphere), exact: float64 proposes the farthest point, integers decide.

The walk: take the smallest ball of a few points (`smallest_ball`, exact). Take the point farthest from its centre. If
it is outside, take the smallest ball of the support and that point, which is strictly larger, and repeat; there are
finitely many supports, so the walk ends, in practice after 5 to 20 iterations. Only points within rounding of the
sphere are tested in integers, many of them first in double-doubles (a finely tessellated sphere has all of its vertices
there).

A support set lies on the sphere and has the centre in its convex hull: of a handful of points every set is tried, in
whole numbers. With q_i = p_i - p_0 the centre p_0 + sum lambda_i q_i is equally far from all of them when ``2 G lambda
= diag G``, G the matrix of ``q_i . q_j``; it lies in the hull when no lambda_i is negative and they add up to at most
1.

Centre: each coordinate the double nearest to the exact one. Radius: the smallest double whose closed ball about that
rounded centre contains every point.

Source: the active-set walk of B. Gaertner, "Fast and robust smallest enclosing balls", 1999 (farthest-point pivot);
support sets as in E. Welzl, "Smallest enclosing disks (balls and ellipsoids)", 1991. Changed: the ball of the support
is exact, float distances only choose the candidates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Final

import numpy as np

from engine.errors import NotRepresentableError
from engine.predicates.error_free import two_sum
from engine.predicates.rational import determinant, nearest_float
from engine.running.budget import Budget
from engine.types import FloatArray

Rational = tuple[Fraction, ...]
IntPoint = tuple[int, ...]

_UNIT: Final = 2.0**-53
_TINY: Final = 2.0**-900  # above all that scaling to the unit ball can lose to underflow
_two_sum: Final = getattr(two_sum, "py_func", two_sum)  # of arrays
_BYTES: Final = 88  # of a coordinate, in differences, squares and the double-double pass (measured)
_FEW: Final = 64  # candidates that are not worth a double-double pass


@dataclass(frozen=True, slots=True)
class MinimalSphere:
    """Minimal enclosing ball (smallest enclosing sphere), its support and the work it took."""

    center: FloatArray  # (dimension,): each coordinate the double nearest to the exact one
    radius: float  # the smallest double whose closed ball about `center` contains every point
    exact_center: Rational  # before rounding
    exact_square: Fraction  # the squared radius of the exact ball
    support: tuple[int, ...]  # points on the exact sphere that have the exact centre in their convex hull
    n_candidates: int  # largest number of points in one turn that float64 left open
    n_rational: int  # largest number of those that integers had to settle


def minimal_sphere(points: FloatArray, budget: Budget | None = None) -> MinimalSphere:
    """Return the smallest sphere around points ``(n, dimension)`` of finite float64, n at least 1.

    Degenerate: one point, or all at one place, give radius 0. Accuracy: exact as stated in the module. Cost: a few
    passes over the points, O(n) memory. Raises: NotRepresentableError if the radius is beyond float64,
    DeadlineExceededError, CancelledError.

    >>> ball = minimal_sphere(np.array([[0.0, 0.0], [4.0, 0.0], [1.0, 1.0]]))
    >>> ball.center.tolist(), ball.radius, ball.support
    ([2.0, 0.0], 2.0, (0, 1))
    """
    return _Walk(points, lambda index: tuple(map(Fraction, points[index].tolist())), 0.0, budget or Budget()).sphere()


def minimal_sphere_of_rationals(points: list[Rational], budget: Budget | None = None) -> MinimalSphere:
    """Return the smallest sphere that encloses points with rational coordinates, at least one."""
    rounded = np.array([[nearest_float(x) for x in point] for point in points])
    slack = math.sqrt(rounded.shape[1]) * float(np.spacing(np.abs(rounded)).max())
    return _Walk(rounded, points.__getitem__, slack, budget or Budget()).sphere()


class _Walk:
    """State of one search: points (n, d) in float64, their exact coordinates by index, and `slack`, a bound on the
    distance between the two."""

    def __init__(self, points: FloatArray, exact: Callable[[int], Rational], slack: float, budget: Budget) -> None:
        self.points = points
        self.exact = exact
        self.slack = slack  # bound on the distance of a float64 point from its exact place
        self.budget = budget
        self.n_candidates = self.n_rational = 0

    def sphere(self) -> MinimalSphere:
        self.budget.take(_BYTES * self.points.size)
        first = int(self._distances(self.points[0])[0].argmax())
        support: tuple[int, ...] = (first,)
        center, square = self.exact(first), Fraction(0)
        while True:  # bound: `square` grows strictly, and a support determines it
            self.budget.check()
            outside = self._farthest_outside(center, square)
            if outside is None:
                break
            support, center, square = self._ball_of((outside, *support))
        near = np.array([nearest_float(x) for x in center])
        radius = self._radius_about(near)
        return MinimalSphere(near, radius, center, square, tuple(sorted(support)), self.n_candidates, self.n_rational)

    def _ball_of(self, indices: tuple[int, ...]) -> tuple[tuple[int, ...], Rational, Fraction]:
        """Return support, centre and squared radius of the smallest ball of some points; points[indices[0]] is on its
        surface."""
        places = [self.exact(index) for index in indices]
        common = math.lcm(*(x.denominator for place in places for x in place))
        integers = [tuple(x.numerator * (common // x.denominator) for x in place) for place in places]
        ball = smallest_ball(integers, 0)
        scale = ball.scale * common
        center = tuple(Fraction(x, scale) for x in ball.center)
        return tuple(indices[i] for i in ball.support), center, Fraction(ball.square, scale * scale)

    def _distances(self, center: FloatArray) -> tuple[FloatArray, Fraction]:
        """Return the squared distances of the points from `center` in units of unit^2, and unit, a power of two. error:
        a difference, a square and a sum of at most three terms: each result is within ``8 _UNIT result + _TINY`` of the
        exact one; the largest component of a vector is between 1/2 and 1 unit.
        """
        with np.errstate(over="ignore", under="ignore"):
            vectors, unit = self.points - center, Fraction(1)
            largest = float(np.abs(vectors).max())
            if not math.isfinite(largest):
                vectors, unit = self.points * 0.25 - center * 0.25, Fraction(4)
                largest = float(np.abs(vectors).max())
            exponent = math.frexp(largest)[1]
            vectors = np.ldexp(vectors, -exponent)
            return (vectors * vectors).sum(axis=1), unit * Fraction(2) ** exponent

    def _farthest_outside(self, center: Rational, square: Fraction) -> int | None:
        """Return the index of a point outside the exact ball (square: squared radius), about the farthest one; None if
        the ball contains all points."""
        rounded = np.array([nearest_float(x) for x in center])
        sizes, unit = self._distances(rounded)
        shift = [(x - Fraction(y)) / unit for x, y in zip(center, rounded.tolist())]
        radius = math.sqrt(square / unit**2)
        gap = _round_up(
            sum(map(abs, shift), Fraction(self.slack) / unit)
        )  # what may lie between |vector| and the distance
        farthest = int(sizes.argmax())
        if sizes[farthest] > (radius * (1.0 + 4.0 * _UNIT) + gap) ** 2 * (1.0 + 16.0 * _UNIT) + _TINY:
            return farthest
        inner = radius * (1.0 - 4.0 * _UNIT) - gap
        candidates = np.flatnonzero(sizes > (inner * inner * (1.0 - 16.0 * _UNIT) - _TINY if inner > 0.0 else -1.0))
        self.n_candidates = max(self.n_candidates, len(candidates))
        if len(candidates) > _FEW and self.slack == 0.0:
            excess, bound = excess_double_double(self.points[candidates], rounded, shift, square / unit**2, unit)
            if excess.max() > bound:
                return int(candidates[excess.argmax()])
            candidates = candidates[excess >= -bound]
        self.n_rational = max(self.n_rational, len(candidates))
        return self._exactly_farthest(candidates.tolist(), center, square)

    def _exactly_farthest(self, candidates: list[int], center: Rational, square: Fraction) -> int | None:
        """Return the candidate that is farthest outside the ball by integer arithmetic; None if the ball contains all
        candidates."""
        common = math.lcm(*(x.denominator for x in center))
        tops = [x.numerator * (common // x.denominator) for x in center]
        farthest, largest = None, square
        for turn, index in enumerate(candidates):
            if turn % 256 == 0:
                self.budget.check()
            place = self.exact(index)
            own = math.lcm(*(x.denominator for x in place))
            scaled = (x.numerator * (own // x.denominator) * common - own * top for x, top in zip(place, tops))
            distance, scale = sum(x * x for x in scaled), own * common
            if distance * largest.denominator > largest.numerator * scale * scale:
                farthest, largest = index, Fraction(distance, scale * scale)
        return farthest

    def _radius_about(self, center: FloatArray) -> float:
        """Return the smallest double whose closed ball about `center` contains every point. bound: each iteration takes
        the distance of a point outside the last radius, so radii grow strictly."""
        place = tuple(map(Fraction, center.tolist()))
        outside: int | None = int(self._distances(center)[0].argmax())
        radius = 0.0
        while outside is not None:
            self.budget.check()
            steps = [x - y for x, y in zip(self.exact(outside), place)]
            radius = root_up(sum((step * step for step in steps), Fraction(0)))
            outside = self._farthest_outside(place, Fraction(radius) ** 2)
        return radius


def _round_up(value: Fraction) -> float:
    """Return a double >= value, at most about 1e100."""
    return float(min(value, Fraction(10) ** 100)) * (1.0 + 4.0 * _UNIT) + _TINY


def excess_double_double(
    points: FloatArray, center: FloatArray, shift: list[Fraction], square: Fraction, unit: Fraction
) -> tuple[FloatArray, float]:
    """Return |p - c|^2 - `square` for each point p (n,) and the exact centre c, and a bound on the error; both in units
    of unit^2.

    center, shift: c = center + unit * shift, with |shift| below an ulp of the centre. unit: a power of two in which no
    component of p - c is above 1. bound: p - c is a double-double from the exact difference; its square and the sum
    lose less than 2^-98 each (components at most 1, three terms); what the rounded shift loses enters twice per axis.
    """
    factor = 0.25 if unit >= 2**1020 else 1.0  # differences must not overflow; what underflow takes is below 2^-2000
    exponent = math.frexp(unit * Fraction(factor))[1] - 1
    high, low = np.zeros((2, len(points)))
    lost = Fraction(0)
    for axis, step in enumerate(shift):
        rounded_step = float(step)
        lost += abs(step - Fraction(rounded_step))
        a, b = points[:, axis] * factor, center[axis] * factor
        difference, tail = _two_sum(a, -b)
        d, e = np.ldexp(difference, -exponent), np.ldexp(tail, -exponent)
        d, e_more = _two_sum(d, -rounded_step)
        d, e = _two_sum(d, e + e_more)
        product, rest = _two_square(d)
        high, carry = _two_sum(high, product)
        low += carry + (rest + 2.0 * d * e)
    target = float(square)
    target_low = float(square - Fraction(target))
    excess = (high - target) + (low - target_low)
    return excess, 2.0**-90 + 8.0 * _round_up(lost)


def _two_square(a: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rounded squares of a and their exact errors (Dekker's splitting; |a| at most 1)."""
    product, wide = a * a, a * 134217729.0  # 2^27 + 1
    top = wide - (wide - a)
    rest = a - top
    return product, ((top * top - product) + 2.0 * top * rest) + rest * rest


def root_up(square: Fraction) -> float:
    """Return the smallest double whose square is at least `square` >= 0. Raises: NotRepresentableError if that is
    beyond float64."""
    top, bottom = square.numerator, square.denominator
    shift = max(0, 128 - top.bit_length() + bottom.bit_length()) // 2 + 1  # 64 bits and more in the root
    root = nearest_float(Fraction(math.isqrt((top << 2 * shift) // bottom), 1 << shift))
    while Fraction(root) ** 2 < square:  # bound: the guess is within an ulp or two
        root = math.nextafter(root, math.inf)
        if root == math.inf:
            raise NotRepresentableError("a radius is beyond the largest float64; scale the input down")
    while root > 0.0 and Fraction(math.nextafter(root, 0.0)) ** 2 >= square:
        root = math.nextafter(root, 0.0)
    return root


@dataclass(frozen=True, slots=True)
class IntBall:
    """A ball with centre ``center / scale`` and squared radius ``square / scale**2``, all integers; scale > 0. support:
    the points on it that determine it."""

    center: IntPoint
    square: int
    scale: int
    support: tuple[int, ...]  # positions in the sequence it was made from

    def contains(self, point: IntPoint) -> bool:
        """Return whether the closed ball contains an integer point."""
        return sum((self.scale * p - c) ** 2 for p, c in zip(point, self.center)) <= self.square


def smallest_ball(points: Sequence[IntPoint], through: int) -> IntBall:
    """Return the smallest ball around integer points; ``points[through]`` must be on its surface. Support sets of at
    most dimension + 1 points are tried from the smallest up; the smallest ball is unique and has such a support, so the
    first ball that contains all points is that ball. For at most dimension + 2 points: 15 sets."""
    others = [index for index in range(len(points)) if index != through]
    for size in range(min(len(others), len(points[0])) + 1):
        for chosen in combinations(others, size):
            ball = _ball_through(points, (through, *chosen))
            if ball is not None and all(ball.contains(points[index]) for index in others if index not in chosen):
                return ball
    raise AssertionError("no ball goes through the point that was to lie on its surface")


def _ball_through(points: Sequence[IntPoint], support: tuple[int, ...]) -> IntBall | None:
    """Return the smallest ball through all points of `support`, or None if its centre is not in their convex hull."""
    first, *others = (points[index] for index in support)
    steps = [tuple(x - x0 for x, x0 in zip(point, first)) for point in others]
    gram = [[sum(a * b for a, b in zip(u, v)) for v in steps] for u in steps]
    squares, volume = [gram[i][i] for i in range(len(steps))], determinant(gram)
    if volume == 0:
        return None  # affinely dependent: a smaller set has the same ball
    scale = 2 * volume  # > 0: a Gram determinant
    weights = [
        determinant([[*row[:i], squares[j], *row[i + 1 :]] for j, row in enumerate(gram)]) for i in range(len(steps))
    ]
    if any(weight < 0 for weight in weights) or sum(weights) > scale:
        return None
    offset = [sum(weight * step[axis] for weight, step in zip(weights, steps)) for axis in range(len(first))]
    center = tuple(scale * x0 + x for x0, x in zip(first, offset))
    return IntBall(center, sum(x * x for x in offset), scale, support)
