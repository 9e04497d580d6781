"""Batches of poses against the rational reference: bodies and moves on a small lattice, so that most pairs touch."""

from __future__ import annotations

import math
import random
from typing import Any

import pytest

from engine import Relation, collide_poses
from tests.reference.collision import relation
from tests.reference.shapes import box
from tests.unit.collision.lattices import QUARTERS, TURNS, aabb, points, polyhedron, solid, surface

STILL = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
FLIP = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]


def block(rng: random.Random, d: int) -> dict[str, Any]:
    """Return a box of whole numbers as a polyhedron."""
    low = points(rng, 1, d, 2)[0]
    return box(tuple(low), tuple(x + rng.randint(1, 3) for x in low))


def one_ulp_off(rng: random.Random, move: list[float]) -> list[float]:
    """Return a move, one coordinate of it now and then moved to the next double."""
    if rng.random() < 0.3:
        axis = rng.randrange(3)
        move[axis] = math.nextafter(move[axis], rng.choice([-math.inf, math.inf]))
    return move


@pytest.mark.parametrize("first", [polyhedron, block, aabb, surface])
@pytest.mark.parametrize("second", [polyhedron, block, surface])
@pytest.mark.parametrize("n", [2, pytest.param(150, marks=pytest.mark.full)])
def test_agrees_with_the_reference(first: Any, second: Any, n: int) -> None:
    rng = random.Random(f"{first.__name__}{second.__name__}")
    for _ in range(n):
        a, b = first(rng, 3), second(rng, 3)
        turns = [rng.choice([STILL, TURNS[3], QUARTERS[3], FLIP]) for _ in range(12)]
        moves = [one_ulp_off(rng, move) for move in points(rng, 12, 3)]
        expected = [
            relation(a, b, None, {"rotation": turn, "translation": move})
            for turn, move in zip(turns, moves, strict=True)
        ]
        one, other = solid(a), solid(b)
        found, witnesses = collide_poses(one, other, turns, moves, witnesses=True)
        assert found.tolist() == expected, (a, b, turns, moves)
        assert [w is None for w in witnesses] == [r == Relation.DISJOINT for r in expected]
        assert collide_poses(one, other, turns, moves, workers=1).tolist() == expected
        is_apart = collide_poses(one, other, turns, moves, boolean=True) == Relation.DISJOINT
        assert is_apart.tolist() == [r == Relation.DISJOINT for r in expected]
