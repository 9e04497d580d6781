"""Regions of a face: one point in each, and what lies on either side."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Pose, Surface
from engine.budget import Budget
from engine.collision.meshes.exact_body import ExactBody, exact_pair
from engine.collision.meshes.exact_regions import Sides, points_within, regions_of, sides_at, sides_over
from engine.collision.meshes.mesh_arrays import mesh_body_of
from tests.unit.collision.meshes.bodies import TURN, mesh


def sheet(*triangles: tuple[tuple[int, ...], ...]) -> ExactBody:
    corners = [corner for triangle in triangles for corner in triangle]
    faces = np.arange(len(corners)).reshape(-1, 3)
    return ExactBody(mesh_body_of(Surface(corners, faces)), None, 0)


def test_a_point_in_every_region() -> None:
    face = sheet(((0, 0, 0), (12, 0, 0), (0, 12, 0)))
    cutters = sheet(((4, -9, -9), (4, 99, -9), (4, 0, 99)), ((-9, 2, -9), (99, 2, -9), (0, 2, 99)))
    with Budget(None, None) as budget:
        points = list(regions_of(face, 0, [cutters], budget))
        assert all(z == 0 for _, _, z, _ in points)
        assert {(x > 4 * w, y > 2 * w) for x, y, _, w in points} == {(a, b) for a in (0, 1) for b in (0, 1)}
        assert len(list(regions_of(face, 0, [], budget))) == 1


@pytest.mark.parametrize("pose", [None, TURN])
def test_sides_of_the_faces_of_a_box(pose: Pose | None) -> None:
    body, other = exact_pair(mesh(2), mesh(1, (0.5, 0.5, 2)), (pose, pose))
    for face in range(len(body.mesh.faces)):
        for q in points_within(body.corners(face)):
            sides = sides_over(body, q, body.axis(face), body.plane(face))
            assert sides is not None
            assert sides.above != sides.below
            assert not sides.at
    n = len(body.mesh.arrays.vertices)
    centre = (*map(sum, zip(*(body.vertex(vertex) for vertex in range(n)))), n)
    assert sides_at(body, centre, 2).at
    assert not sides_at(other, centre, 2).at
    assert sides_at(body, centre, 2) == Sides(True, True, True)
