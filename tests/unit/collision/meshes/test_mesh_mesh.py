"""Polyhedra, surfaces and boxes of space against each other."""

from __future__ import annotations

import pytest

from tests.unit.collision.lattices import COUNTS, Maker, aabb, check_pairs, polyhedron, surface


@pytest.mark.parametrize(
    ("d", "first", "second"),
    [
        (3, aabb, polyhedron),
        (3, aabb, surface),
        (3, polyhedron, polyhedron),
        (3, polyhedron, surface),
        (3, surface, surface),
    ],
)
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)
