"""Vectors of exact numbers, integers or Fractions, in the plane and in space, as tuples."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import TypeVar

Exact = TypeVar("Exact", int, Fraction)


def minus(u: Sequence[Exact], v: Sequence[Exact]) -> tuple[Exact, ...]:
    """Return u - v."""
    if len(u) == 2:
        return u[0] - v[0], u[1] - v[1]
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


def dot(u: Sequence[Exact], v: Sequence[Exact]) -> Exact:
    """Return u . v."""
    if len(u) == 2:
        return u[0] * v[0] + u[1] * v[1]
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def squared_length(u: Sequence[Exact]) -> Exact:
    """Return u . u."""
    return dot(u, u)


def cross(u: Sequence[Exact], v: Sequence[Exact]) -> tuple[Exact, Exact, Exact]:
    """Return u x v of two vectors of space."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


def largest_axis(u: Sequence[Exact]) -> int:
    """Return the first axis of the largest magnitude, -1 for the zero vector."""
    sizes = [abs(value) for value in u]
    largest = max(sizes)
    return sizes.index(largest) if largest else -1


def determinant(matrix: Sequence[Sequence[Exact]]) -> Exact | int:
    """Return the determinant of a matrix of at most 3 rows; 1 for none."""
    if len(matrix) == 3:
        return dot(matrix[0], cross(matrix[1], matrix[2]))
    if len(matrix) == 2:
        return matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0]
    return matrix[0][0] if matrix else 1
