"""The table of pairs: every two types that `collide` takes have one function, whichever stands first."""

from __future__ import annotations

import random

import pytest

import engine
from engine.collision.collide import PAIRS, TAKEN, pair_function
from engine.collision.result import meets_as
from tests.unit.collision import lattices

MAKERS = {
    2: ("polygon", "triangle", "aabb", "sphere", "half_space"),
    3: ("polyhedron", "surface", "aabb", "sphere", "half_space"),
}


@pytest.mark.parametrize("d", [2, 3])
def test_every_pair_has_one_function(d: int) -> None:
    rng = random.Random(d)
    bodies = {name: lattices.solid(getattr(lattices, name)(rng, d)) for name in MAKERS[d]}
    assert ", ".join(bodies) == TAKEN[d]
    assert {*bodies} == {row.name for row in engine.solid_types.values() if d in row.meets}
    for first in bodies.values():
        for second in bodies.values():
            function, is_swapped = pair_function(first, second)
            kinds = (second, first) if is_swapped else (first, second)
            assert PAIRS[d, *map(meets_as, kinds)] is function
            assert is_swapped or pair_function(second, first)[0] is function or first.type == second.type
