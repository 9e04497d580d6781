"""Filters of blurred points: what they tell holds at every corner of the blur; boxes and polynomials, exact."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine import Aabb, Convex, HalfSpace, Implicit, Polygon, Polyhedron, Solid, locate
from engine.containment import posed_locators as posed
from engine.containment.methods.rational_locate import rational_location
from engine.running.budget import Budget
from engine.types import read_only
from tests.unit.containment.scenes import box_mesh, made

FILTERS: dict[type[Solid], Callable[..., Any]] = {
    Aabb: posed.box_sides, HalfSpace: posed.rows, Convex: posed.rows, Polygon: posed.rings, Polyhedron: posed.faces,
    Implicit: posed.terms,
}  # fmt: skip
SOLIDS: list[Callable[[], Solid]] = [
    lambda: Aabb([0, 0, 0], [2, 1, 3]),
    lambda: Aabb([0, 0], [2, 1]),
    lambda: HalfSpace([1, -2], 0.5),
    lambda: Convex([[1, 0, 0, 0], [0, 1, 0.5, 0], [-1, -1, -1, 3]]),
    lambda: Implicit([{"powers": [2, 0], "coefficient": -1.0}, {"powers": [0, 1], "coefficient": 1.0}]),
    lambda: Polygon([[[0, 0], [2, 0], [2, 2], [1, 0.5], [0, 2]]]),
    lambda: made(box_mesh([0, 0, 0], [2, 1, 2])),
]


@pytest.mark.parametrize("make", SOLIDS)
def test_an_answer_holds_all_over_the_blur(make: Callable[[], Any]) -> None:
    solid = make()
    points = np.random.default_rng(0).integers(-2, 12, (150, solid.dimension)) / 4.0
    blurs = np.where(np.arange(len(points)) % 2, 0.25, 2.0**-40)
    found = np.empty(len(points), np.int8)
    with np.errstate(all="ignore"), Budget() as budget:
        kernel, *prepared = FILTERS[type(solid)](solid, budget.check)
        kernel(read_only(points), blurs, *prepared, found, budget.flag)
    assert (np.abs(found) == 1).mean() > 0.2
    corners = np.stack(np.meshgrid(*[[-0.5, 0.0, 0.5]] * solid.dimension), axis=-1).reshape(-1, solid.dimension)
    for point, blur, location in zip(points, blurs, found.tolist()):
        if abs(location) == 1:
            assert {rational_location(each, solid) for each in (point + blur * corners).tolist()} == {location}


def test_flat_box_has_only_boundary() -> None:
    assert locate([[0.5, 0.5, 1.0], [0.5, 0.5, 1.1]], Aabb([0, 0, 1], [1, 1, 1])).tolist() == [0, -1]


@pytest.mark.parametrize("dimension", [2, 3])
def test_comparisons_are_the_definition(dimension: int) -> None:
    low, high = np.arange(dimension) - 2.0, np.arange(dimension) + 0.0
    points = np.random.default_rng(0).integers(-4, 5, (2000, dimension)) / 2.0
    distance = np.minimum(points - low, high - points).min(axis=1)  # exact: halves of small integers
    assert locate(points, Aabb(low, high)).tolist() == np.sign(distance).astype(int).tolist()


def test_signs_are_those_of_rationals() -> None:
    terms = [([0, 0], 25.0), ([2, 0], -1.0), ([0, 2], -1.0), ([3, 1], 0.5)]
    solid = Implicit([{"powers": powers, "coefficient": coefficient} for powers, coefficient in terms])
    points = np.random.default_rng(0).integers(-6, 7, (500, 2)).astype(float)
    points = np.concatenate([points, np.nextafter(points, 9.0), [[3.0, 4.0], [0.0, 5.0]]])
    values = [sum(Fraction(c) * Fraction(x) ** i * Fraction(y) ** j for (i, j), c in terms) for x, y in points.tolist()]
    assert locate(points, solid).tolist() == [(value > 0) - (value < 0) for value in values]
