"""Boxes against balls: the reference, and one unit in the last place beside a contact."""

from __future__ import annotations

import math

import pytest

from engine import Aabb, Sphere, collide
from tests.unit.collision.lattices import COUNTS, Maker, aabb, check_pairs, sphere


@pytest.mark.parametrize(("d", "first", "second"), [(2, sphere, aabb), (3, sphere, aabb)])
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


@pytest.mark.parametrize(("radius", "label"), [(1.0, "touching"), (math.nextafter(1.0, 2), "overlapping")])
def test_one_ulp_decides(radius: float, label: str) -> None:
    assert collide(Aabb([0, 0], [1, 1]), Sphere([2, 0.5], radius)).relation.label == label
    assert collide(Aabb([0, 0], [1, 1]), Sphere([2, 0.5], math.nextafter(1.0, 0))).relation.label == "disjoint"
