"""The predicates in Python's unlimited integers: right for any finite floats, integers and Fractions, and slow; and
vectors of exact numbers, integers or Fractions, in the plane and in space, as tuples.

Kernels answer UNDECIDED where an exponent leaves their range; public functions settle such an item here. The sign of a
determinant does not change when the numbers of one axis are multiplied by a common positive factor, so each axis is
first brought to integers: no greatest common divisors are taken in the arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from typing import TypeVar

from engine.errors import NotRepresentableError

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


Number = float | int | Fraction
"""Any finite number; numpy scalars of float64 are floats."""


def sign_of(value: Number) -> int:
    """Return -1, 0 or 1."""
    return (value > 0) - (value < 0)


def common_integers(values: Sequence[Number]) -> tuple[list[int], int]:
    """Return integers and their common positive denominator (not the least one)."""
    ratios = [value.as_integer_ratio() for value in values]
    common = math.lcm(*(bottom for _, bottom in ratios))
    return [top * (common // bottom) for top, bottom in ratios], common


def reduced(numbers: Sequence[int]) -> tuple[int, ...]:
    """Return integers without their common divisor."""
    divisor = math.gcd(*numbers)
    return tuple(x // divisor for x in numbers) if divisor > 1 else tuple(numbers)


def scaled_integers(values: Sequence[Number]) -> list[int]:
    """Return the values times a common positive factor that makes all of them integers."""
    return common_integers(values)[0]


def orient2d_rational(a: Sequence[Number], b: Sequence[Number], c: Sequence[Number]) -> int:
    """Return the sign of (b - a) x (c - a): 1 for a left turn, -1 for a right turn, 0 on a line."""
    ax, bx, cx = scaled_integers((a[0], b[0], c[0]))
    ay, by, cy = scaled_integers((a[1], b[1], c[1]))
    return sign_of((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))


def orient3d_rational(a: Sequence[Number], b: Sequence[Number], c: Sequence[Number], d: Sequence[Number]) -> int:
    """Return 1 if d lies on the side the normal (b - a) x (c - a) points to, -1 opposite, 0 on the plane."""
    p, q, r, s = zip(*(scaled_integers(axis) for axis in zip(a, b, c, d)))
    return sign_of(dot(cross(minus(q, p), minus(r, p)), minus(s, p)))


def side_rational(row: Sequence[Number], point: Sequence[Number]) -> int:
    """Return the sign of dot(row, (point, 1)), for a row of one number more than the point, in any dimension."""
    *normal, offset = scaled_integers(row)
    *scaled_point, one = scaled_integers((*point, 1))
    return sign_of(sum(n * p for n, p in zip(normal, scaled_point)) + offset * one)


def polynomial_sign_rational(
    powers: Sequence[Sequence[int]], coefficients: Sequence[Number], point: Sequence[Number]
) -> int:
    """Return the sign of the sum of coefficient * prod(point[k] ** powers[k]) over the terms.

    The point is written as P / w with integers P and w; every term is multiplied by w^degree, so that only integer
    powers remain.
    """
    *tops, w = scaled_integers((*point, 1))
    exponents = [[int(power) for power in term] for term in powers]
    degree = max((sum(term) for term in exponents), default=0)
    total = 0
    for term, coefficient in zip(exponents, scaled_integers(coefficients)):
        value = coefficient * w ** (degree - sum(term))
        for top, power in zip(tops, term):
            value *= top**power
        total += value
    return sign_of(total)


def nearest_float(value: Number) -> float:
    """Return the double nearest to `value`, ties to even; what rounds to zero is +0.0.

    Raises: `NotRepresentableError` where the nearest double would be infinite.
    """
    top, bottom = value.as_integer_ratio()
    try:
        return top / bottom + 0.0  # Python rounds a quotient of integers correctly, subnormals included
    except OverflowError:
        raise NotRepresentableError(
            f"an exact coordinate, {Decimal(top) / Decimal(bottom):.17g}, is beyond the largest float64, "
            "1.7976931348623157e+308; scale the input down"
        ) from None


def nearest(numerator: int, denominator: int) -> float:
    """Return the double nearest to a quotient of integers, zero as +0.0."""
    return numerator / denominator + 0.0


def nearest_pair(numerator: int, denominator: int) -> tuple[float, float]:
    """Return a quotient as a double-double: the double nearest to it, and the double nearest to what is left."""
    head = nearest(numerator, denominator)
    n, d = head.as_integer_ratio()
    return head, nearest(numerator * d - n * denominator, denominator * d)


def nearest_with_root(u: int, v: int, w: int, z: int) -> float:
    """Return the double nearest to (u + v sqrt(w)) / z for integers w >= 0 and z > 0.

    Bound: if w is no square and v is not zero the number is irrational, so it is no double and no midpoint of two, and
    the enclosing quotients round alike once they are close enough; each turn doubles the digits.
    """
    if v == 0:
        return nearest(u, z)
    bits = 64
    while True:
        square, low = w << 2 * bits, u << bits
        root, size = math.isqrt(square), z << bits
        found = nearest(low + v * root, size)
        if root * root == square or nearest(low + v * (root + 1), size) == found:
            return found
        bits *= 2
