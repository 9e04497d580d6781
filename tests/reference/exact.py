"""Rational numbers, small vectors, and rounding to the nearest double."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from gmpy2 import is_square, isqrt, mpq

Q = mpq
Vector = tuple  # of Q


def q(number: object) -> mpq:
    """Return `number` (int, float, text of a hexadecimal float, rational) as the rational it is."""
    if isinstance(number, str):
        number = float.fromhex(number)
    if isinstance(number, float) and not math.isfinite(number):
        raise ValueError(f"not finite: {number!r}")
    return mpq(number)


def vector(numbers: Iterable[object]) -> Vector:
    return tuple(q(number) for number in numbers)


def sign(number: mpq) -> int:
    return (number > 0) - (number < 0)


def add(a: Vector, b: Vector) -> Vector:
    return tuple(x + y for x, y in zip(a, b, strict=True))


def sub(a: Vector, b: Vector) -> Vector:
    return tuple(x - y for x, y in zip(a, b, strict=True))


def times(a: Vector, factor: mpq) -> Vector:
    return tuple(x * factor for x in a)


def along(a: Vector, b: Vector, t: mpq) -> Vector:
    """Return a + t (b - a)."""
    return tuple(x + t * (y - x) for x, y in zip(a, b, strict=True))


def dot(a: Vector, b: Vector) -> mpq:
    return sum((x * y for x, y in zip(a, b, strict=True)), Q(0))


def square(a: Vector) -> mpq:
    return dot(a, a)


def cross(a: Vector, b: Vector) -> Vector:
    """Return the cross product; in the plane the one number it has there."""
    if len(a) == 2:
        return (a[0] * b[1] - a[1] * b[0],)
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def solve(rows: Sequence[Vector], right: Vector) -> Vector | None:
    """Return x with rows x = right by elimination, None where the matrix is singular."""
    n = len(rows)
    table = [[*row, value] for row, value in zip(rows, right, strict=True)]
    for column in range(n):
        pivot = next((i for i in range(column, n) if table[i][column] != 0), None)
        if pivot is None:
            return None
        table[column], table[pivot] = table[pivot], table[column]
        lead = table[column][column]
        table[column] = [value / lead for value in table[column]]
        for i in range(n):
            if i != column and table[i][column] != 0:
                factor = table[i][column]
                table[i] = [x - factor * y for x, y in zip(table[i], table[column], strict=True)]
    return tuple(row[n] for row in table)


def nearest_double(number: mpq) -> float:
    """Return the double nearest to `number` (ties to even; zero is +0.0); OverflowError beyond the largest."""
    number = Q(number)
    return int(number.numerator) / int(number.denominator) + 0.0


def sign_with_root(a: mpq, b: mpq, radicand: mpq) -> int:
    """Return the sign of a + b sqrt(radicand) by squaring, radicand >= 0."""
    sa, sb = sign(a), sign(b) if radicand != 0 else 0
    if sa == 0 or sb == 0 or sa == sb:
        return sa or sb
    return sa * sign(a * a - b * b * radicand)


def nearest_double_with_root(a: mpq, b: mpq, radicand: mpq) -> float:
    """Return the double nearest to a + b sqrt(radicand): a guess by integer square root, then proved by sign tests."""
    product = radicand.numerator * radicand.denominator
    if is_square(product):  # a rational root: a tie is possible only here
        return nearest_double(a + b * Q(isqrt(product), radicand.denominator))
    bits = 2400  # enough to see past any cancellation down to the smallest double squared
    root = Q(isqrt(product << (2 * bits)), radicand.denominator << bits)
    guess = nearest_double(a + b * root)
    for candidate in (guess, math.nextafter(guess, math.inf), math.nextafter(guess, -math.inf)):
        if math.isfinite(candidate) and _is_nearest(candidate, a, b, radicand):
            return candidate + 0.0
    raise AssertionError(f"no nearest double beside {guess!r}")


def _is_nearest(candidate: float, a: mpq, b: mpq, radicand: mpq) -> bool:
    """Tell whether a + b sqrt(radicand) lies between the midpoints on either side of `candidate`."""
    below, above = ((_neighbour(candidate, way) + q(candidate)) / 2 for way in (-1, 1))
    return sign_with_root(a - below, b, radicand) > 0 > sign_with_root(a - above, b, radicand)


def _neighbour(x: float, way: int) -> mpq:
    """Return the next double down or up; beyond the largest, the power of two that would follow."""
    beside = math.nextafter(x, way * math.inf)
    return q(beside) if math.isfinite(beside) else Q(way * 2**1024)


def smallest_double_with_square_at_least(number: mpq) -> float:
    """Return the smallest double r >= 0 with r r >= number."""
    if number <= 0:
        return 0.0
    r = nearest_double_with_root(Q(0), Q(1), Q(number))
    while q(r) ** 2 >= number and r > 0.0:
        r = math.nextafter(r, 0.0)
    while q(r) ** 2 < number:
        r = math.nextafter(r, math.inf)
    return r
