"""How far points are from a ball or from planes: by formulas in double-doubles, in rational arithmetic where these
leave a point open (`point_formulas.py`)."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations
from typing import NamedTuple

import numpy as np

from engine.collision.exact_images import image_half_space, image_point
from engine.compiling.jit import entry_of
from engine.distance.point_formulas import fill_from_ball, fill_from_planes
from engine.distance.point_measures import Answers
from engine.distance.point_mesh import OTHER, Features
from engine.errors import EmptyGeometryError, NotRepresentableError
from engine.predicates.expansion import LARGEST, SMALLEST
from engine.predicates.rational import dot, nearest_pair, nearest_with_root
from engine.running.budget import Budget, poll
from engine.solids.checks import check_finite
from engine.solids.pose import Pose
from engine.solids.primitives import Convex, HalfSpace, Sphere
from engine.types import FloatArray, IntArray, read_only


class Rooted(NamedTuple):
    """The number a + b sqrt(s), exact; s >= 0."""

    a: Fraction
    b: Fraction
    s: Fraction

    def rounded(self) -> float:
        """Return the nearest double. Raises: NotRepresentableError beyond the largest."""
        (p, q), w = self.a.as_integer_ratio(), self.s.numerator * self.s.denominator  # sqrt(s) = sqrt(w) / denominator
        b = self.b / self.s.denominator
        try:
            return nearest_with_root(p * b.denominator, b.numerator * q, w, q * b.denominator) + 0.0
        except OverflowError:
            raise NotRepresentableError(
                "a distance is beyond the largest double, 1.8e308; scale the scene down by a power of two", ("points",)
            ) from None

    def is_at_most(self, most: Fraction) -> bool:
        """Return whether the number is at most `most`."""
        rest, square = most - self.a, self.b * self.b * self.s
        if self.b < 0:
            return rest >= 0 or square >= rest * rest
        return rest >= 0 and square <= rest * rest


Vector = Sequence[Fraction]


class _ByFormula:
    """Base of the measures of balls and planes: each point in rational arithmetic."""

    def order(self, _: FloatArray) -> None:
        """Return None: the order of points does not matter here."""

    def filter(self, points: FloatArray, span: tuple[int, int], answers: Answers, most: float, budget: Budget) -> None:
        """Fill those distances, and nearest points, that a kernel decides. most: a distance to compare with."""

    def measured(self, point: Vector) -> tuple[Rooted, list[Rooted], int]:
        """Return the distance of a point from the boundary or, outside, from the solid, its nearest point there, and
        the number of a plane, -1 for none."""
        raise NotImplementedError

    def fill(
        self, points: FloatArray, start: int, stop: int, answers: Answers, limit: float | None, budget: Budget
    ) -> int:
        """Fill the answers as `Measure.fill` says: by kernels where doubles prove the distance, the rest in rational
        arithmetic."""
        self.filter(points, (start, stop), answers, np.inf if limit is None else limit, budget)
        budget.check()
        left = (start + np.flatnonzero(np.isnan(answers.distance[start:stop]))).tolist()
        if left:
            check_finite(points, ("points",))
        for item in left:
            budget.check()
            value, foot, plane = self.measured([Fraction(x) for x in points[item].tolist()])
            if limit is not None:
                answers.distance[item] = 0.0 if value.is_at_most(Fraction(limit)) else np.inf
                continue
            answers.distance[item] = value.rounded() or (0.0 if value.is_at_most(_ZERO) else 5e-324)
            if answers.is_named:
                answers.feet[item], answers.codes[item] = [x.rounded() for x in foot], (plane, 0)
        return len(left)

    def name(self, codes: IntArray, features: Features) -> None:
        """Fill ``features.face`` with the number of the plane, the first column of `codes`."""
        is_near = codes[:, 1] >= 0
        features.face[is_near], features.kind[is_near] = codes[is_near, 0], OTHER


_ZERO, _ONE = Fraction(0), Fraction(1)


class BallMeasure(_ByFormula):
    """Distances from the surface of a ball, whose radius a pose keeps; of its centre the nearest point is that in the
    direction of the first axis."""

    def __init__(self, solid: Sphere, pose: Pose | None) -> None:
        self.centre, self.radius = image_point(solid.center.tolist(), pose), Fraction(float(solid.radius))
        self.numbers = _ball_numbers(self.centre, float(solid.radius), pose is None)
        """As `nearest_on_ball` takes it; None for numbers that kernels do not take."""

    def filter(self, points: FloatArray, span: tuple[int, int], answers: Answers, most: float, budget: Budget) -> None:
        """As `_ByFormula.filter`."""
        if self.numbers is None:
            return
        distance, part = answers.distance, slice(*span)
        were_open, feet = np.isnan(distance[part]), answers.feet if answers.is_named else np.empty((1, points.shape[1]))
        address = int(self.numbers.ctypes.data)
        entry_of(fill_from_ball)(points, span, address, most, distance, feet, answers.is_named, budget.flag)
        if answers.is_named:
            answers.codes[part][were_open & ~np.isnan(distance[part])] = -1, 0

    def measured(self, point: Vector) -> tuple[Rooted, list[Rooted], int]:
        """As `_ByFormula.measured`: |sqrt(s) - r|, and c + (q - c) r / sqrt(s)."""
        way = [x - c for x, c in zip(point, self.centre)]
        s, r = sum((x * x for x in way), _ZERO), self.radius
        if s == 0:
            foot = [Rooted(c + (r if axis == 0 else 0), _ZERO, _ONE) for axis, c in enumerate(self.centre)]
            return Rooted(r, _ZERO, _ONE), foot, -1
        sign = 1 if s >= r * r else -1
        return Rooted(-sign * r, _ONE * sign, s), [Rooted(c, x * r / s, s) for c, x in zip(self.centre, way)], -1


def _ball_numbers(centre: Vector, radius: float, is_exact: bool) -> FloatArray | None:
    """Return (8,): a centre in double-doubles, radius and whether the centre is exact, or None."""
    numbers, d = np.zeros(8), len(centre)
    try:
        numbers[: 2 * d] = np.ravel([nearest_pair(*Fraction(x).as_integer_ratio()) for x in centre])
    except OverflowError:
        return None
    numbers[6:] = radius, is_exact
    sizes = [abs(x) for x in (*numbers[: 2 * d : 2].tolist(), radius) if x != 0.0]
    return numbers if all(SMALLEST <= size <= LARGEST for size in sizes) else None


class PlanesMeasure(_ByFormula):
    """Distances from a half-space, or from an intersection of half-spaces.

    Within it the nearest plane is that with the least |h| / |n|: the largest ball about the point that lies in all
    half-spaces lies in the solid. Outside the nearest point p is the only one of the solid with q - p a sum of outward
    normals of planes through p with weights that are not negative (Karush, Kuhn, Tucker): all sets of at most d planes
    are tried, in floats first.
    """

    def __init__(self, solid: HalfSpace | Convex, pose: Pose | None) -> None:
        rows = [solid] if isinstance(solid, HalfSpace) else [HalfSpace(r[:-1], r[-1]) for r in solid.planes.tolist()]
        self.rows = [image_half_space(row, pose) for row in rows]
        self.d = solid.dimension
        self.own = None if pose is not None else solid.row[None] if isinstance(solid, HalfSpace) else solid.planes

    def filter(self, points: FloatArray, span: tuple[int, int], answers: Answers, most: float, budget: Budget) -> None:
        """As `_ByFormula.filter`: distances alone, of solids without a pose."""
        if self.own is not None and not answers.is_named:
            entry_of(fill_from_planes)(points, span, read_only(self.own), most, answers.distance, budget.flag)

    def measured(self, point: Vector) -> tuple[Rooted, list[Rooted], int]:
        """Return what `_ByFormula.measured` says, by the nearest plane inside, and by sets of planes outside (see the
        class)."""
        heights = [(dot(n, point) + offset, dot(n, n)) for n, offset in self.rows]
        if all(h >= 0 for h, _ in heights):
            squares = [h * h / size for h, size in heights]
            plane = min(range(len(squares)), key=squares.__getitem__)
            h, size = heights[plane]
            foot = [x - h / size * y for x, y in zip(point, self.rows[plane][0])]
            return Rooted(_ZERO, _ONE, squares[plane]), [Rooted(x, _ZERO, _ONE) for x in foot], plane
        below = [k for k, (h, _) in enumerate(heights) if h < 0]
        for n_planes in range(1, self.d + 1):
            for some in combinations(range(len(self.rows)), n_planes):
                poll()
                if not any(k in below for k in some):
                    continue
                foot_ = self._foot(point, some, heights)
                if foot_ is not None:
                    s = sum(((x - y) ** 2 for x, y in zip(point, foot_)), _ZERO)
                    return Rooted(_ZERO, _ONE, s), [Rooted(x, _ZERO, _ONE) for x in foot_], some[0]
        raise EmptyGeometryError("solid has no point to be near: its half-spaces have none in common", ("solid",))

    def _foot(
        self, point: Vector, some: Sequence[int], heights: Sequence[tuple[Fraction, Fraction]]
    ) -> list[Fraction] | None:
        """Return the foot of a point on the planes `some`, if it is the nearest point of the solid."""
        normals = [self.rows[k][0] for k in some]
        weights = _solved([[dot(a, b) for b in normals] for a in normals], [-heights[k][0] for k in some])
        if weights is None or min(weights) < 0:
            return None
        foot = [x + sum((w * n[axis] for w, n in zip(weights, normals)), _ZERO) for axis, x in enumerate(point)]
        return foot if all(dot(n, foot) + offset >= 0 for n, offset in self.rows) else None


def _solved(matrix: list[list[Fraction]], right: list[Fraction]) -> list[Fraction] | None:
    """Return the solution of a symmetric system of one to three equations, None if it is singular."""
    rows = [[*row, value] for row, value in zip(matrix, right)]
    for k in range(len(rows)):
        pivot = next((i for i in range(k, len(rows)) if rows[i][k] != 0), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(len(rows)):
            if i != k:
                rows[i] = [x - rows[i][k] * y for x, y in zip(rows[i], rows[k])]
    return [row[-1] for row in rows]
