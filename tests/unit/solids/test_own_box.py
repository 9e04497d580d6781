"""Boxes of solids before their poses, and how far their points are from the middle."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine import Aabb, HalfSpace, Polygon, Solid, Sphere, Triangle
from engine.solids.registry import own_box


def test_boxes_and_balls_and_bodies_without_bounds() -> None:
    low, high, reach = own_box(Aabb([0, 1], [2, 3]))
    assert (low.tolist(), high.tolist(), reach) == ([0, 1], [2, 3], np.inf)
    low, high, reach = own_box(Sphere([1, 2, 3], 9))
    assert low.tolist() == high.tolist() == [1, 2, 3]
    assert reach == 0.0
    low, high, reach = own_box(HalfSpace([1, 0, 0], 0))
    assert (low == -np.inf).all()
    assert (high == np.inf).all()
    assert reach == np.inf


@pytest.mark.parametrize("scale", [1e-160, 1.0, 1e160])
def test_every_vertex_is_within_reach_of_the_middle(scale: float) -> None:
    rng = np.random.default_rng(3)
    bodies: list[Solid] = [Polygon([scale * rng.normal(size=(7, 2))]), Triangle(scale * rng.normal(size=(3, 2)))]
    for body in bodies:
        low, high, reach = own_box(body)
        vertices = body.vertices  # type: ignore[attr-defined]
        assert (low == vertices.min(axis=0)).all()
        assert (high == vertices.max(axis=0)).all()
        middle = [Fraction(float(x)) for x in 0.5 * low + 0.5 * high]
        squares = [sum((Fraction(float(x)) - m) ** 2 for x, m in zip(p, middle)) for p in vertices]
        assert max(squares) <= Fraction(reach) ** 2 if np.isfinite(reach) else scale > 1
        assert own_box(body) is own_box(body)
