"""Vectors of integers and Fractions: the identities that define them."""

from __future__ import annotations

import random
from fractions import Fraction

from engine.predicates.exact_vectors import cross, dot, largest_axis, minus, squared_length


def test_identities_in_integers_and_fractions() -> None:
    rng = random.Random(1)
    for _ in range(50):
        u, v = (tuple(rng.randint(-9, 9) for _ in range(3)) for _ in range(2))
        assert dot(cross(u, v), u) == dot(cross(u, v), v) == 0
        assert squared_length(cross(u, v)) == squared_length(u) * squared_length(v) - dot(u, v) ** 2
        for n in (2, 3):
            p, q = (tuple(Fraction(x, 7) for x in w[:n]) for w in (u, v))
            assert squared_length(minus(p, q)) == squared_length(p) - 2 * dot(p, q) + squared_length(q)


def test_largest_axis_is_the_first_of_equals() -> None:
    assert [largest_axis(u) for u in ((0, 0, 0), (1, -1, 0), (0, -3, 2), (0, 0, 5))] == [-1, 0, 1, 2]
