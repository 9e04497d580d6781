"""The predicates in Python's unlimited integers, the exact fallback of the kernels; vectors of exact numbers as tuples.

Kernels return UNDECIDED where an exponent leaves their range; public functions decide such an item here, for any finite
floats, integers and Fractions. The sign of a determinant does not change when the numbers of one axis are multiplied by
a common positive factor, so each axis is first brought to integers: no greatest common divisors are needed.

Also scales a whole scene by one power of two into the range in which kernels are exact. Points are multiplied by 2^-e,
offsets of planes too, and each plane row by a power of two of its own: signs, orders and parameters do not change,
coordinates of the result are multiplied by 2^e. A scaling that would round any number is not done; the kernels then
leave items outside their range open. Results that scaling back rounds to a subnormal number, or up to the smallest
normal one, would be rounded twice, so rational arithmetic computes them again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from math import frexp
from typing import Final, TypeVar

import numpy as np

from engine.errors import NotRepresentableError
from engine.predicates.expansion import LARGEST, SMALLEST
from engine.types import BoolArray, FloatArray, IntArray, read_only

Exact = TypeVar("Exact", int, Fraction)


def minus(u: Sequence[Exact], v: Sequence[Exact]) -> tuple[Exact, ...]:
    """Return u - v of two vectors of 2 or 3 numbers."""
    if len(u) == 2:
        return u[0] - v[0], u[1] - v[1]
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


def dot(u: Sequence[Exact], v: Sequence[Exact]) -> Exact:
    """Return u . v of two vectors of 2 or 3 numbers."""
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
    """Return the first axis on which a vector has its largest magnitude, -1 for the zero vector."""
    sizes = [abs(value) for value in u]
    largest = max(sizes)
    return sizes.index(largest) if largest else -1


def determinant(matrix: Sequence[Sequence[Exact]]) -> Exact | int:
    """Return the determinant of a matrix of 0 to 3 rows; 1 for none."""
    if len(matrix) == 3:
        return dot(matrix[0], cross(matrix[1], matrix[2]))
    if len(matrix) == 2:
        return matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0]
    return matrix[0][0] if matrix else 1


Number = float | int | Fraction
"""Any finite number; numpy scalars of float64 are floats."""


def sign_of(value: Number) -> int:
    """Return the sign of a number: -1, 0 or 1."""
    return (value > 0) - (value < 0)


def common_integers(values: Sequence[Number]) -> tuple[list[int], int]:
    """Return integers n and a positive integer w with values[i] = n[i] / w (w not always the least)."""
    ratios = [value.as_integer_ratio() for value in values]
    common = math.lcm(*(bottom for _, bottom in ratios))
    return [top * (common // bottom) for top, bottom in ratios], common


def reduced(numbers: Sequence[int]) -> tuple[int, ...]:
    """Return integers divided by their greatest common divisor."""
    divisor = math.gcd(*numbers)
    return tuple(x // divisor for x in numbers) if divisor > 1 else tuple(numbers)


def scaled_integers(values: Sequence[Number]) -> list[int]:
    """Return the values times a common positive factor that makes them integers."""
    return common_integers(values)[0]


def orient2d_rational(a: Sequence[Number], b: Sequence[Number], c: Sequence[Number]) -> int:
    """Return the sign of (b - a) x (c - a): 1 for a left turn, -1 for a right turn, 0 if collinear."""
    ax, bx, cx = scaled_integers((a[0], b[0], c[0]))
    ay, by, cy = scaled_integers((a[1], b[1], c[1]))
    return sign_of((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))


def orient3d_rational(a: Sequence[Number], b: Sequence[Number], c: Sequence[Number], d: Sequence[Number]) -> int:
    """Return 1 if d lies on the side to which the normal (b - a) x (c - a) points, -1 opposite, 0 on the plane."""
    p, q, r, s = zip(*(scaled_integers(axis) for axis in zip(a, b, c, d)))
    return sign_of(dot(cross(minus(q, p), minus(r, p)), minus(s, p)))


def side_rational(row: Sequence[Number], point: Sequence[Number]) -> int:
    """Return the sign of dot(row, (point, 1)), row being normal and offset of a plane, in any dimension."""
    *normal, offset = scaled_integers(row)
    *scaled_point, one = scaled_integers((*point, 1))
    return sign_of(sum(n * p for n, p in zip(normal, scaled_point)) + offset * one)


def polynomial_sign_rational(
    powers: Sequence[Sequence[int]], coefficients: Sequence[Number], point: Sequence[Number]
) -> int:
    """Return the sign of the sum of coefficient * prod(point[k] ** powers[k]) over the terms. The point is written as P
    / w with integers P and w; every term is multiplied by w^degree, so that only integer powers remain."""
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
    """Return the double nearest to `value`, ties to even; zero as +0.0. Raises: `NotRepresentableError` if the nearest
    double would be infinite."""
    top, bottom = value.as_integer_ratio()
    try:
        return top / bottom + 0.0  # Python rounds a quotient of integers correctly, subnormals included
    except OverflowError:
        raise NotRepresentableError(
            f"an exact value, {Decimal(top) / Decimal(bottom):.17g}, is beyond the largest float64, "
            "1.7976931348623157e+308; scale the input down"
        ) from None


def nearest(numerator: int, denominator: int) -> float:
    """Return the double nearest to a quotient of integers, zero as +0.0."""
    return numerator / denominator + 0.0


def nearest_pair(numerator: int, denominator: int) -> tuple[float, float]:
    """Return numerator / denominator as a double-double: the nearest double, and that nearest to the remainder."""
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
        rounded = nearest(low + v * root, size)
        if root * root == square or nearest(low + v * (root + 1), size) == rounded:
            return rounded
        bits *= 2


COMFORTABLE: Final = 64
"""Scenes whose largest coordinate lies within 2^-64 .. 2^64 are not scaled; kernels are exact to 2^-120 .. 2^120."""
SMALLEST_NORMAL: Final = 2.0**-1022


def largest_of(*arrays: FloatArray) -> float:
    """Return the largest magnitude in some arrays; not finite if a number is not."""
    return max((max(array.max().item(), -array.min().item()) for array in arrays if array.size), default=0.0)


def are_all_safe(numbers: FloatArray) -> bool:
    """Return whether every number is zero or in the range of `is_safe`."""
    sizes = np.abs(numbers)
    return bool(((sizes == 0.0) | ((sizes >= SMALLEST) & (sizes <= LARGEST))).all())


def exponent_of(*arrays: FloatArray) -> int:
    """Return e such that all coordinates in some arrays are below 2^e; 0 if they need no scaling, the largest being
    within 2^-64 .. 2^64."""
    return exponent_above(largest_of(*arrays))


def exponent_above(largest: float) -> int:
    """Return e such that a coordinate of magnitude `largest` is below 2^e; 0 if it needs no scaling, being within 2^-64
    .. 2^64 or 0."""
    exponent = frexp(largest)[1]
    return 0 if largest == 0.0 or abs(exponent) <= COMFORTABLE else exponent


def shifted(array: FloatArray, exponent: int | IntArray) -> FloatArray | None:
    """Return array 2^exponent, read-only, if that is exact for every number, else None. exponent: one, or one for each
    number."""
    if isinstance(exponent, int) and exponent == 0:
        return read_only(array)
    with np.errstate(all="ignore"):
        result: FloatArray = np.ldexp(array, exponent)
        result.setflags(write=False)
        return result if bool((np.ldexp(result, -exponent) == array).all()) else None


def balanced_rows(rows: FloatArray, exponent: int) -> FloatArray | None:
    """Return plane rows (n, d + 1), normal and offset, for points multiplied by 2^-exponent, each row also multiplied
    by a power of two that brings its normal near 1 where needed; None if an offset cannot be scaled exactly."""
    offsets = shifted(rows[:, -1], -exponent)
    if offsets is None:
        return None
    result = rows.copy()
    result[:, -1] = offsets
    own = np.frexp(np.abs(rows[:, :-1]).max(axis=1))[1].astype(np.int64)
    own[np.abs(own) <= COMFORTABLE] = 0
    if not own.any():
        return result
    for i_row in np.flatnonzero(own):
        better = shifted(result[i_row], -int(own[i_row]))
        if better is not None:  # else: the row stays outside of the kernels' range
            result[i_row] = better
    return result


def scaled_back(points: FloatArray, exponent: int) -> tuple[FloatArray, BoolArray]:
    """Return points (n, d) times 2^exponent, and (n,) which of them may have been rounded twice: those that scaling
    rounds, up to and including the smallest normal number. If nothing is rounded here, the nearest double of unlimited
    exponent is the nearest double."""
    with np.errstate(all="ignore"):
        result: FloatArray = np.ldexp(points, exponent)
        doubtful = (np.abs(result) <= SMALLEST_NORMAL) & (np.ldexp(result, -exponent) != points)
    return result, doubtful.any(axis=1)
