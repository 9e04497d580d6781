"""Half-spaces against bodies given by vertices."""

from __future__ import annotations

import pytest

from tests.unit.collision.lattices import (
    COUNTS,
    Maker,
    aabb,
    check_pairs,
    half_space,
    polygon,
    polyhedron,
    surface,
    triangle,
)


@pytest.mark.parametrize(
    ("d", "first", "second"),
    [
        (2, half_space, aabb),
        (2, half_space, triangle),
        (2, half_space, polygon),
        (3, half_space, aabb),
        (3, half_space, polyhedron),
        (3, half_space, surface),
    ],
)
@COUNTS
def test_agrees_with_the_reference(d: int, first: Maker, second: Maker, n: int) -> None:
    check_pairs(d, first, second, n)
