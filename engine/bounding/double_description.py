"""Vertices of an intersection of half-spaces by the double description method, in integers.

The half-spaces ``row . (p, 1) >= 0`` are constraints on a cone one dimension higher; points (p, 1) of the solid are its
generators with a positive last number, unbounded directions have a 0 there. Starting from all of space (its axes as
lines), one constraint after the other is added: a line that is not parallel to the constraint becomes a ray; otherwise
rays behind it are dropped, and each pair of adjacent rays, one on either side, adds a ray on it.

Two rays are adjacent if no other ray lies on all constraints they have in common. Numbers stay as small as the
determinants they are, since common factors are taken out.

Source: T. S. Motzkin et al., "The double description method", 1953; K. Fukuda, A. Prodon, "Double description method
revisited", 1996 (lines apart from rays, combinatorial neighbours).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from engine.errors import TooComplexError
from engine.predicates.rational import reduced, scaled_integers
from engine.running.budget import Budget

Vector = tuple[int, ...]
MAX_RAYS = 20_000
"""Bound on the number of vertices and directions at any stage."""


@dataclass(frozen=True, slots=True)
class Corners:
    """Vertices and unbounded directions of an intersection of half-spaces."""

    points: list[tuple[Fraction, ...]]  # its corners; none if it is empty or contains a line
    is_empty: bool  # no point at all
    is_bounded: bool  # no direction leads out of it for ever; True when empty


@dataclass(frozen=True, slots=True)
class _Ray:
    vector: Vector
    zeros: int  # bit i: constraint i is zero on it


def corners_of_half_spaces(rows: Sequence[Sequence[float]], budget: Budget | None = None) -> Corners:
    """Return the `Corners` of the set of points p with ``row . (p, 1) >= 0`` for all rows.

    rows: finite floats, one more than a point has coordinates; redundant and parallel rows are allowed. Cost: rows
    times corners in integer arithmetic, pairs of rays that a new row separates; milliseconds for tens of rows. Raises:
    TooComplexError beyond 20,000 corners, DeadlineExceededError, CancelledError.

        >>> triangle = corners_of_half_spaces([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-2.0, -2.0, 1.0]])
        >>> sorted((float(x), float(y)) for x, y in triangle.points), triangle.is_bounded
        ([(0.0, 0.0), (0.0, 0.5), (0.5, 0.0)], True)
    """
    budget = budget or Budget()
    size = len(rows[0])
    constraints = [(*([0] * (size - 1)), 1), *(reduced(scaled_integers(row)) for row in rows)]
    lines: list[Vector] = [tuple(int(i == axis) for i in range(size)) for axis in range(size)]
    rays: list[_Ray] = []
    for number, constraint in enumerate(constraints):
        budget.check()
        lines, rays = _add(constraint, number, lines, rays, budget)
        if len(rays) > MAX_RAYS:
            raise TooComplexError(f"an intersection of {len(rows)} half-spaces has more than {MAX_RAYS} corners")
    ends = [ray.vector for ray in rays if ray.vector[-1] > 0]
    if not ends:
        return Corners([], True, True)
    is_bounded = not lines and len(ends) == len(rays)
    points = [] if lines else [tuple(Fraction(x, end[-1]) for x in end[:-1]) for end in ends]
    return Corners(points, False, is_bounded)


def _add(
    constraint: Vector, number: int, lines: list[Vector], rays: list[_Ray], budget: Budget
) -> tuple[list[Vector], list[_Ray]]:
    """Return the lines and rays that generate the cone of `lines` and `rays` intersected with the half-space constraint
    . x >= 0. number: index of the constraint, its bit in `_Ray.zeros`."""
    bit, slopes = 1 << number, [_dot(constraint, line) for line in lines]
    i_line = next((i for i, slope in enumerate(slopes) if slope != 0), None)
    if i_line is None:
        return lines, _cut(constraint, bit, rays, len(constraint) - len(lines) - 2, budget)
    line, slope = lines[i_line], slopes[i_line]
    if slope < 0:
        line, slope = tuple(-x for x in line), -slope
    others = [_project_onto(constraint, other, line, slope) for other in lines[:i_line] + lines[i_line + 1 :]]
    moved = [_Ray(_project_onto(constraint, ray.vector, line, slope), ray.zeros | bit) for ray in rays]
    return others, [*moved, _Ray(line, bit - 1)]  # the line was zero on all constraints before this one


def _cut(constraint: Vector, bit: int, rays: list[_Ray], n_common: int, budget: Budget) -> list[_Ray]:
    """Return the rays of a cone, whose lines all lie on the constraint, intersected with the half-space constraint . x
    >= 0. bit: of this constraint in `_Ray.zeros`. n_common: least number of constraints that are zero on two adjacent
    rays, which span a face of dimension 2."""
    before: list[tuple[_Ray, int]] = []
    behind: list[tuple[_Ray, int]] = []
    survivors: list[_Ray] = []
    for ray in rays:
        value = _dot(constraint, ray.vector)
        if value > 0:
            before.append((ray, value))
            survivors.append(ray)
        elif value < 0:
            behind.append((ray, value))
        else:
            survivors.append(_Ray(ray.vector, ray.zeros | bit))
    zeros = [ray.zeros for ray in rays]
    for first, up in before:
        budget.check()
        for second, down in behind:
            common = first.zeros & second.zeros
            if common.bit_count() < n_common:
                continue
            if sum(common & other == common for other in zeros) == 2:  # only these two: neighbours
                vector = reduced([up * y - down * x for x, y in zip(first.vector, second.vector)])
                survivors.append(_Ray(vector, common | bit))
    return survivors


def _project_onto(constraint: Vector, vector: Vector, line: Vector, slope: int) -> Vector:
    """Return a positive multiple of `vector` + s line, with s such that it lies on the plane of the constraint. slope:
    constraint . line, positive."""
    value = _dot(constraint, vector)
    return reduced([slope * x - value * y for x, y in zip(vector, line)])


def _dot(a: Sequence[int], b: Sequence[int]) -> int:
    return sum(x * y for x, y in zip(a, b))
