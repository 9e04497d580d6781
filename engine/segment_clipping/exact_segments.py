"""One segment on a convex region or a sphere in exact integer arithmetic: settles what the kernels leave open.

All coordinates of an item are written as integers over one common denominator (a power of two), so that plane values
are integers, parameters are pairs of integers, and a coordinate is one quotient of integers, which Python rounds
correctly (half to even, subnormals included). No item is too large or too small.

Results are `Piece` tuples; None where nothing remains.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from engine.predicates.rational import common_integers, nearest, nearest_with_root


class Piece(NamedTuple):
    """What remains of one segment: parameters and points correctly rounded, the faces crossed (-1: own end)."""

    t: tuple[float, float]
    start: list[float]
    end: list[float]
    faces: tuple[int, int]


def clip_by_planes(p: Sequence[float], q: Sequence[float], rows: Sequence[Sequence[float]]) -> Piece | None:
    """Return what remains of the segment p q where every row (a, b, ..., d) has dot(row, (x, 1)) >= 0.

    Of planes crossed at the same point the first row is named. A point (p = q) is kept as t = (0, 1).
    """
    dimension = len(p)
    numbers, scale = common_integers([*p, *q])
    start, end = numbers[:dimension], numbers[dimension:]
    entry, entered, leave, left = (0, 1), -1, (1, 1), -1
    for plane, row in enumerate(rows):
        (*normal, offset), _ = common_integers(row)
        s_p = sum(a * x for a, x in zip(normal, start)) + offset * scale
        s_q = sum(a * x for a, x in zip(normal, end)) + offset * scale
        if (s_p < 0 and s_q < 0) or (s_p < 0 and s_p == s_q):
            return None
        if s_p < 0:  # t = s_p / (s_p - s_q) with a positive denominator
            t = (-s_p, s_q - s_p)
            if entered < 0 or t[0] * entry[1] > entry[0] * t[1]:
                entry, entered = t, plane
        elif s_q < 0:
            t = (s_p, s_p - s_q)
            if left < 0 or t[0] * leave[1] < leave[0] * t[1]:
                leave, left = t, plane
    if entry[0] * leave[1] > leave[0] * entry[1]:
        return None

    def at(t: tuple[int, int]) -> list[float]:
        return [nearest(x * (t[1] - t[0]) + y * t[0], t[1] * scale) for x, y in zip(start, end)]

    return Piece((nearest(*entry), nearest(*leave)), at(entry), at(leave), (entered, left))


def clip_by_sphere(p: Sequence[float], q: Sequence[float], center: Sequence[float], radius: float) -> Piece | None:
    """Return what remains of the segment p q in the closed ball; the ball's surface is face 0."""
    n = len(p)
    numbers, scale = common_integers([*p, *q, *center, radius])
    start, end, middle, r = numbers[:n], numbers[n : 2 * n], numbers[2 * n : 3 * n], numbers[-1]
    d = [y - x for x, y in zip(start, end)]
    f = [x - c for x, c in zip(start, middle)]
    a = sum(x * x for x in d)  # the ball is a t^2 + 2 b t + c <= 0
    b = sum(x * y for x, y in zip(d, f))
    c = sum(x * x for x in f) - r * r
    c_end = a + 2 * b + c
    discriminant = b * b - a * c
    is_in, ends_in = c <= 0, c_end <= 0
    if not is_in and not ends_in and (discriminant < 0 or b >= 0 or a + b <= 0):
        return None

    def at(sign: int) -> tuple[float, list[float]]:
        t = nearest_with_root(-b, sign, discriminant, a)
        point = [nearest_with_root(x * a - b * y, sign * y, discriminant, a * scale) for x, y in zip(start, d)]
        return t, point

    t0, first = (0.0, [x + 0.0 for x in p]) if is_in else at(-1)
    t1, last = (1.0, [x + 0.0 for x in q]) if ends_in else at(1)
    return Piece((t0, t1), first, last, (-1 if is_in else 0, -1 if ends_in else 0))
