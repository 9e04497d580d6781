"""What even-odd leaves of a face, and how far it is from a point."""

from __future__ import annotations

from fractions import Fraction

import pytest

from engine import Polyhedron
from engine.budget import Budget
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.simple.boundary import live_parts, simplex_distance
from engine.predicates.rational import cross, minus
from tests.unit.collision.meshes.bodies import brick

TWO = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def glued(top: float) -> Polyhedron:
    """Two tetrahedra with one face in common, or with a smaller one within it."""
    base = [[0, 0, 0], [6, 0, 0], [0, 6, 0]]
    small = [[x * top / 6, y * top / 6, z] for x, y, z in base]
    faces = TWO + [[i + 4 for i in face] for face in TWO]
    return Polyhedron([*base, [1, 1, 5], *small, [1, 1, -5]], faces)


@pytest.mark.parametrize(("top", "n_left", "square"), [(6.0, 6, 25), (3.0, 7, Fraction(1, 2))])
def test_a_common_wall_is_not_live(top: float, n_left: int, square: Fraction) -> None:
    body = mesh_body_of(glued(top))
    with Budget(None, None) as budget:
        parts = [list(live_parts(body, face, budget)) for face in range(8)]
        assert sum(map(bool, parts)) == n_left
        cut = [found for found in parts if len(found) > 1]
        assert len(cut) == n_left - 6
        for found in cut:  # of the base what the smaller one leaves: beyond x + y = 3
            center = Fraction(1), Fraction(1), Fraction(0)
            assert min(simplex_distance(center, corners) for corners in found) == square
            doubled = (cross(minus(q, p), minus(r, p)) for p, q, r in found)
            assert sum(abs(normal[2]) for normal in doubled) == 36 - 9


def test_all_of_a_box_is_live() -> None:
    body = mesh_body_of(brick(1))
    with Budget(None, None) as budget:
        for face in range(12):
            (corners,) = live_parts(body, face, budget)
            assert len(corners) == 3
