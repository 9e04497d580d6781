"""Exact placed vertices as integers, and the faces near a box."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine import Pose
from engine.collision.exact_images import image_point
from engine.collision.meshes.exact_body import exact_pair, on_lattice, plane_through, rounded_outward
from tests.unit.collision.meshes.bodies import TURN, mesh


@pytest.mark.parametrize("pose", [None, TURN, Pose(np.eye(3), [2.0**-1074, 1e300, 0.1])])
def test_vertices_are_exact_images(pose: Pose | None) -> None:
    body, _ = exact_pair(mesh(2, (0.1, 0, 2.0**-60)), mesh(1), (pose, TURN))
    for vertex, p in enumerate(body.mesh.arrays.vertices.tolist()):
        assert tuple(Fraction(x, 1 << body.shift) for x in body.vertex(vertex)) == image_point(p, pose)
    a, b, c, d = body.plane(0)
    assert all(a * x + b * y + c * z + d == 0 for x, y, z in body.corners(0))


@pytest.mark.parametrize("pose", [None, TURN])
def test_no_face_that_meets_a_box_is_missed(pose: Pose | None) -> None:
    body, _ = exact_pair(mesh(3), mesh(1), (pose, None))
    low, high = [0.5, 0.5, -1.0], [1.5, 1.25, float("inf")]
    found = body.faces_in(low, high)
    assert found == sorted(found)
    scale = 1 << body.shift
    for face in set(range(len(body.mesh.faces))) - set(found):
        assert not all(low[k] * scale <= x <= high[k] * scale for p in body.corners(face) for k, x in enumerate(p))
    assert body.faces_in([9.0] * 3, [10.0] * 3) == []


def test_helpers() -> None:
    assert on_lattice(0.75, 2) == 3
    assert plane_through(((0, 0, 0), (1, 0, 0), (0, 1, 0))) == (0, 0, 1, 0)
    low, high = rounded_outward(1, 3)
    assert Fraction(low) < Fraction(1, 3) < Fraction(high)
    assert rounded_outward(10**400, 1)[1] == float("inf")
