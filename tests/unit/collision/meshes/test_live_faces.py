"""What even-odd leaves of a face, and how far it is from a point."""

from __future__ import annotations

from fractions import Fraction

import pytest

from engine import Polyhedron
from engine.budget import Budget
from engine.collision.meshes.live_faces import live_piece
from engine.collision.meshes.mesh_arrays import mesh_body_of
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
        pieces = [live_piece(body, face, budget) for face in range(8)]
        assert sum(piece is not None for piece in pieces) == n_left
        cut = [piece for piece in pieces if piece is not None and piece.edges is not None]
        assert len(cut) == n_left - 6
        for piece in cut:  # of the base what the smaller one leaves: beyond x + y = 3
            assert piece.squared_distance((Fraction(1), Fraction(1), Fraction(0))) == square


def test_all_of_a_box_is_live() -> None:
    body = mesh_body_of(brick(1))
    with Budget(None, None) as budget:
        for face in range(12):
            piece = live_piece(body, face, budget)
            assert piece is not None
            assert piece.edges is None
            assert len(piece.vertices()) == 3
