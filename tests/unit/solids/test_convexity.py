"""The certificate accepts convex solids, however cut and turned, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polyhedron
from engine.solids.convexity import convexity

CUBE = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], float)


def prism(ring: np.ndarray) -> Polyhedron:
    n = len(ring)
    vertices = np.concatenate([np.column_stack([ring, np.full(n, z)]) for z in (0.0, 1.0)])
    sides = [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    return Polyhedron(vertices, [list(range(n))[::-1], list(range(n, 2 * n)), *sides])


@pytest.mark.parametrize("scale", [1.0, 1e-150, 1e100])
def test_a_cube_is_convex_either_way_round(scale: float) -> None:
    outward = convexity(Polyhedron(CORNERS * scale, CUBE))
    inward = convexity(Polyhedron(CORNERS * scale, [face[::-1] for face in CUBE]))
    assert outward is not None
    assert outward.is_outward
    assert inward is not None
    assert not inward.is_outward


def test_faces_cut_into_coplanar_triangles_are_convex() -> None:
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    regular = np.round(np.column_stack([np.cos(turn), np.sin(turn)]) * 2.0**20)
    assert convexity(prism(regular)) is not None


def test_a_dent_as_small_as_2_to_the_minus_60_is_seen() -> None:
    square = [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    assert convexity(prism(np.array(square))) is not None
    square[1][1] = 2.0**-60
    assert convexity(prism(np.array(square))) is None
    square[1][1] = -(2.0**-60)
    assert convexity(prism(np.array(square))) is not None


def test_bodies_that_look_convex_at_every_edge_are_not_taken() -> None:
    faces = [[v + 8 * k for v in face] for k in range(2) for face in CUBE]
    two = Polyhedron(np.concatenate([CORNERS, CORNERS + 3.0]), faces)
    nested = Polyhedron(np.concatenate([CORNERS, CORNERS * 0.5 + 0.25]), faces)
    same = Polyhedron(CORNERS, CUBE + CUBE)
    assert convexity(two) is convexity(nested) is convexity(same) is None


def test_a_star_that_winds_twice_around_its_axis_is_not_taken() -> None:
    turn = np.arange(5) * 4 * np.pi / 5
    vertices = np.array([*np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]), [0, 0, 1], [0, 0, -1]])
    faces = [f for k in range(5) for f in ([k, (k + 1) % 5, 5], [(k + 1) % 5, k, 6])]
    assert convexity(Polyhedron(vertices, faces)) is None
