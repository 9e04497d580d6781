"""Boxes against boxes: the reference, and a witness that says whether a flat one pierces."""

from __future__ import annotations

import pytest

from engine import Aabb, collide
from tests.unit.collision.lattices import COUNTS, Maker, aabb, check_pairs


@pytest.mark.parametrize(("d", "first", "second"), [(2, aabb, aabb), (3, aabb, aabb)])
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)


@pytest.mark.parametrize(("z", "piercing"), [(0.5, True), (1.0, False)])
def test_a_flat_box_touches_and_may_pierce(z: float, piercing: bool) -> None:
    found = collide(Aabb([0, 0, 0], [1, 1, 1]), Aabb([0, 0, z], [1, 1, z]))
    assert found.relation.label == "touching"
    assert found.witness is not None
    assert found.witness.piercing == piercing
