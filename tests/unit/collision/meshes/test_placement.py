"""Rounded places of two bodies, within the error they state; exact where poses turn a lattice into itself."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine import Pose
from engine.collision.exact_images import image_point
from engine.collision.meshes.placement import place_pair, placed
from engine.jit import kernel
from engine.predicates.vectors import as_point3
from tests.unit.collision.meshes.bodies import TURN, mesh

QUARTER = Pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [3, 0, -2])


@kernel
def place(first: Any, first_pose: Any, second: Any, second_pose: Any, out: Any, errors: Any) -> None:
    a, b = place_pair(first.extent, first_pose, 0, second.extent, second_pose, 0)
    for item in range(first.vertices.shape[0]):
        out[0, item, 0], out[0, item, 1], out[0, item, 2] = placed(as_point3(first.vertices, item), a)
        out[1, item, 0], out[1, item, 1], out[1, item, 2] = placed(as_point3(second.vertices, item), b)
    errors[0], errors[1] = a.error, b.error


@pytest.mark.parametrize("first_pose", [None, TURN, QUARTER])
@pytest.mark.parametrize("second_pose", [None, TURN, QUARTER])
@pytest.mark.parametrize("at", [(0, 0, 0), (0.1, 1e9, -1e-9)])
def test_differences_are_right_within_the_errors(
    first_pose: Pose | None, second_pose: Pose | None, at: tuple[float, float, float]
) -> None:
    a, b, out, errors = mesh(1, at), mesh(1), np.empty((2, 8, 3)), np.empty(2)
    place(a.arrays, a.posed(first_pose), b.arrays, b.posed(second_pose), out, errors)
    for item in range(8):
        p = image_point(a.arrays.vertices[item].tolist(), first_pose)
        q = image_point(b.arrays.vertices[item].tolist(), second_pose)
        for axis in range(3):
            difference = Fraction(out[1, item, axis]) - Fraction(out[0, item, axis])
            assert abs(difference - (q[axis] - p[axis])) <= Fraction(errors[0]) + Fraction(errors[1])
    if at == (0, 0, 0) and TURN not in (first_pose, second_pose):
        assert errors.tolist() == [0.0, 0.0]
