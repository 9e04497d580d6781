"""What floats say of a ball and a mesh is what rationals say, the face too; and they say it of most."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polyhedron, Pose, Sphere, Surface
from engine.collision.result import Work
from engine.collision.simple.against_ball import _by_distances, _by_floats, centers_in_frame

FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


@pytest.mark.parametrize("scale", [1.0, 2.0**-500, 2.0**400])
@pytest.mark.parametrize("is_solid", [True, False])
def test_agrees_with_rationals(is_solid: bool, scale: float) -> None:
    draw = np.random.default_rng(int(is_solid))
    n_told = 0
    for _ in range(60):
        corners = draw.integers(-8, 9, (4, 3)) * scale
        if np.linalg.det((corners[1:] - corners[0]) / scale) <= 0:
            continue
        body = (Polyhedron if is_solid else Surface)(corners, FACES)
        for _ in range(8):
            ball = Sphere(draw.integers(-24, 25, 3) / 2 * scale, draw.integers(0, 20) / 2 * scale)
            found = _by_floats(body, [*ball.center.tolist(), 0.0], ball.radius, Work())
            if found is not None:
                n_told += 1
                assert found == _by_distances(body, ball, (None, None), Work())
    assert n_told > 100 or scale != 1.0


def test_a_rounded_centre_is_told_where_it_does_not_matter() -> None:
    body = Polyhedron([[0, 0, 0], [8, 0, 0], [0, 8, 0], [0, 0, 8]], FACES)
    turn = Pose([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]], [1e-3, 0, 0])
    moves = turn.rotation[None], turn.translation[None]
    for x in range(-3, 9):
        ball = Sphere([x, 0.5, 0.5], 1)
        found = _by_floats(body, centers_in_frame(ball, None, moves)[0].tolist(), 1.0, Work())
        assert found == _by_distances(body, ball, (None, turn), Work())
