"""Squared distances from a point to segments and triangles: exact in rationals, and float64 bounds for many boxes.

The bounds come first, from boxes alone; the faces whose boxes leave a contact open are measured exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from engine.arrays import FloatArray
from engine.collision.exact_images import Vector
from engine.predicates.exact_vectors import cross, dot, minus, squared_length


def segment_distance(point: Vector, a: Vector, b: Vector) -> Fraction:
    """Return the squared distance from `point` to the closed segment a b, which may be a point."""
    along, to_point = minus(b, a), minus(point, a)
    length = squared_length(along)
    if length == 0:
        return squared_length(to_point)
    t = dot(to_point, along)
    if t <= 0:
        return squared_length(to_point)
    if t >= length:
        return squared_length(minus(point, b))
    return squared_length(to_point) - t * t / length


def simplex_distance(point: Vector, corners: Sequence[Vector]) -> Fraction:
    """Return the squared distance from `point` to the closed segment or triangle of these corners."""
    return segment_distance(point, *corners) if len(corners) == 2 else triangle_distance(point, *corners)


def triangle_distance(point: Vector, a: Vector, b: Vector, c: Vector) -> Fraction:
    """Return the squared distance from `point` of space to the closed triangle a b c, which may be degenerate.

    Over the open triangle it is the distance to the plane, elsewhere that to the nearest edge.
    """
    normal = cross(minus(b, a), minus(c, a))
    size = squared_length(normal)
    if size != 0:
        corners = (a, b, c)
        inner = (
            dot(cross(minus(corners[(k + 1) % 3], corners[k]), minus(point, corners[k])), normal) >= 0 for k in range(3)
        )
        if all(inner):
            return dot(normal, minus(point, a)) ** 2 / size
    return min(segment_distance(point, a, b), segment_distance(point, b, c), segment_distance(point, c, a))


def box_distance_bounds(point: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds of the squared distance from `point` to anything that fills the boxes ``(n, d)``.

    The lower bound is the distance to the box, the upper one that to its farthest corner, both widened by 2^-48 of
    themselves and 2^-1000: at most d + 3 roundings of relative size u enter each, and d underflows of 2^-1074.
    Overflow makes them infinite or NaN; NaN lower bounds become 0, NaN upper bounds infinity.
    """
    with np.errstate(all="ignore"):
        gap = np.maximum(np.maximum(low - point, point - high), 0.0)
        reach = np.maximum(np.abs(low - point), np.abs(high - point))
        lower = (gap * gap).sum(axis=1) * (1.0 - 2.0**-48) - 2.0**-1000
        upper = (reach * reach).sum(axis=1) * (1.0 + 2.0**-48) + 2.0**-1000
    lower[np.isnan(lower) | np.isinf(lower)] = 0.0
    upper[np.isnan(upper)] = np.inf
    return lower, upper
