"""Signed distances and where they say that elements are crossed: within their bounds of the exact ones."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine.segment_clipping.on_boundary.crossing_values import cut_at, is_item_safe, line_values, plane_values


def exact_value(element: Any, w: Any) -> Fraction:
    a = [Fraction(x) for x in element[0]]
    u, v = ([Fraction(x) - y for x, y in zip(corner, a)] for corner in (element[1], element[-1]))
    if len(a) == 2:
        return u[0] * w[1] - u[1] * w[0]
    normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    return sum((x * y for x, y in zip(normal, w)), Fraction(0))


@pytest.mark.parametrize("dimension", [2, 3])
def test_values_and_crossings_are_those_of_rationals(dimension: int) -> None:
    rng = np.random.default_rng(dimension)
    values = line_values if dimension == 2 else plane_values
    elements = rng.uniform(-1, 1, (40, dimension, dimension)) * 2.0 ** rng.integers(-30, 30, (40, 1, 1))
    segments = elements.mean(axis=1)[:, None] + rng.uniform(-1, 1, (40, 2, dimension))
    points = np.empty((1, dimension))
    for i, (element, segment) in enumerate(zip(elements.tolist(), segments.tolist())):
        p, q = ([Fraction(x) for x in end] for end in segment)
        at_p = exact_value(element, [x - Fraction(y) for x, y in zip(p, element[0])])
        along = exact_value(element, [x - y for x, y in zip(p, q)])
        found = values(elements, i, segments, i)
        for exact, (h, low, bound) in zip((at_p, along), found):
            assert abs(Fraction(h) + Fraction(low) - exact) <= Fraction(bound)
        t, is_sure = cut_at(segments, i, elements, i, points, 0)
        if is_sure and 0 <= at_p / along <= 1:
            exact_t = at_p / along
            assert t == float(exact_t)
            assert points[0].tolist() == [float(x + exact_t * (y - x)) for x, y in zip(p, q)]


def test_items_out_of_range_are_not_safe() -> None:
    items = np.ones((3, 2, 2))
    items[1, 1, 0], items[2, 0, 1] = 1e-300, 0.0
    assert [is_item_safe(items, i) for i in range(3)] == [True, False, True]
