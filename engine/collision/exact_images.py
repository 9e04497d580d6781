"""Exact images of points and half-spaces under a pose, as rationals.

A pose maps p to R p + t, R and t taken as the exact numbers they are. R is not quite orthogonal, so the image of the
half-space n . p + d >= 0 is that of the affine map: with A the adjugate of R, R^-1 = A / det R and det R > 0, it is
(n A) . q + (d det R - (n A) . t) >= 0.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction

from engine.arrays import FloatArray
from engine.solids.pose import Pose

Vector = tuple[Fraction, ...]
_CHECK_EVERY = 64


def as_vector(numbers: Iterable[float]) -> Vector:
    """Return the numbers as exact fractions."""
    return tuple(Fraction(float(number)) for number in numbers)


def dot(first: Iterable[Fraction], second: Iterable[Fraction]) -> Fraction:
    """Return the scalar product."""
    return sum((a * b for a, b in zip(first, second)), Fraction(0))


def minus(first: Vector, second: Vector) -> Vector:
    """Return first - second."""
    return tuple(a - b for a, b in zip(first, second))


def squared_length(vector: Vector) -> Fraction:
    """Return the square of the Euclidean length."""
    return dot(vector, vector)


def image_point(point: Iterable[float], pose: Pose | None) -> Vector:
    """Return the exact image of a point."""
    p = as_vector(point)
    if pose is None:
        return p
    t = as_vector(pose.translation)
    return tuple(dot(as_vector(row), p) + shift for row, shift in zip(pose.rotation, t))


def image_points(points: FloatArray, pose: Pose | None, check: Callable[[], object]) -> list[Vector]:
    """Return the exact images of the rows of ``(n, d)`` points; `check` is called now and then."""
    check()
    if pose is None:
        return [as_vector(point) for point in _watched(points, check)]
    rows = [as_vector(row) for row in pose.rotation.tolist()]
    shifts = as_vector(pose.translation)
    vectors = (as_vector(point) for point in _watched(points, check))
    return [tuple(dot(row, p) + shift for row, shift in zip(rows, shifts)) for p in vectors]


def _watched(points: FloatArray, check: Callable[[], object]) -> Iterator[list[float]]:
    for index, point in enumerate(points.tolist()):
        if index % _CHECK_EVERY == 0:
            check()
        yield point


def image_half_space(normal: FloatArray, offset: float, pose: Pose | None) -> tuple[Vector, Fraction]:
    """Return normal and offset of the exact image of a half-space, up to a positive factor."""
    n, d = as_vector(normal), Fraction(offset)
    if pose is None:
        return n, d
    columns = [as_vector(column) for column in pose.rotation.T.tolist()]
    adjugate = _adjugate_rows(columns)
    determinant = dot(adjugate[0], columns[0])
    image = tuple(sum((n[k] * adjugate[k][j] for k in range(len(n))), Fraction(0)) for j in range(len(n)))
    return image, d * determinant - dot(image, as_vector(pose.translation))


def _adjugate_rows(columns: Sequence[Vector]) -> list[Vector]:
    """Return the rows of the adjugate of the matrix with these columns: row k is orthogonal to all others but k."""
    if len(columns) == 2:
        (a, c), (b, d) = columns
        return [(d, -b), (-c, a)]
    u, v, w = columns
    return [cross(v, w), cross(w, u), cross(u, v)]


def cross(u: Vector, v: Vector) -> Vector:
    """Return the cross product of two vectors of space."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
