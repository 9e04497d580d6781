"""Doubles as integers over one denominator, and quotients and roots of integers as the nearest doubles."""

from __future__ import annotations

from collections.abc import Sequence
from math import isqrt


def nearest(numerator: int, denominator: int) -> float:
    """Return the double nearest to a quotient of integers, zero as +0.0."""
    return numerator / denominator + 0.0


def common_integers(numbers: Sequence[float]) -> tuple[list[int], int]:
    """Return integers and their common positive denominator for finite doubles."""
    ratios = [number.as_integer_ratio() for number in numbers]
    denominator = max((bottom for _, bottom in ratios), default=1)
    return [top * (denominator // bottom) for top, bottom in ratios], denominator


def nearest_with_root(u: int, v: int, w: int, z: int) -> float:
    """Return the double nearest to (u + v sqrt(w)) / z for integers w >= 0 and z > 0.

    Bound: if w is no square and v is not zero the number is irrational, so it is no double and no midpoint of two, and
    the enclosing quotients round alike once they are close enough; each turn doubles the digits.
    """
    root = isqrt(w)
    if v == 0 or root * root == w:
        return nearest(u + v * root, z)
    bits = 64
    while True:
        root = isqrt(w << 2 * bits)
        ends = [nearest((u << bits) + v * (root + step), z << bits) for step in (0, 1)]
        if ends[0] == ends[1]:
            return ends[0]
        bits *= 2
