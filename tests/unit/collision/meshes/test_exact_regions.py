"""Regions of a face: one point in each, what lies on either side, and sides that a whole body keeps one status on."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Pose, Surface
from engine.collision.meshes.exact_body import ExactBody, exact_pair
from engine.collision.meshes.exact_regions import Sides, even_sides, regions_of, sides_at, sides_within
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.parallel import Budget
from tests.unit.collision.meshes.bodies import TURN, mesh


def sheet(*triangles: tuple[tuple[int, ...], ...]) -> ExactBody:
    corners = [corner for triangle in triangles for corner in triangle]
    faces = np.arange(len(corners)).reshape(-1, 3)
    return ExactBody(mesh_body_of(Surface(corners, faces)), None, 0)


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (((1, 1, 0), (2, 1, 5), (1, 2, 5)), (False, True)),  # stands on the open face
        (((1, 1, 0), (2, 1, -5), (1, 2, -5)), (True, False)),
        (((0, 0, 0), (0, -9, 5), (0, -9, -5)), (True, True)),  # passes a corner
        (((0, 0, 0), (9, 0, 0), (0, 0, 9)), (True, True)),  # stands on an edge
        (((1, -1, -5), (1, 9, 0), (1, -1, 5)), (False, False)),  # goes through
        (((1, 1, 0), (2, 1, 0), (1, 2, 0)), (True, True)),  # lies in the plane
    ],
)
def test_even_sides(other: tuple[tuple[int, int, int], ...], expected: tuple[bool, bool]) -> None:
    face = ((0, 0, 0), (9, 0, 0), (0, 9, 0))
    for corners in (face, (face[0], face[2], face[1])):
        assert even_sides(sheet(corners), 0, sheet(other), np.array([0])) == expected


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
        sides = sides_within(body, face, other, np.empty(0, np.int64))
        assert sides is not None
        assert sides[0].above != sides[0].below
        assert not sides[0].at
    n = len(body.mesh.arrays.vertices)
    centre = (*map(sum, zip(*(body.vertex(vertex) for vertex in range(n)))), n)
    assert sides_at(body, centre, 2).at
    assert not sides_at(other, centre, 2).at
    assert sides_at(body, centre, 2) == Sides(True, True, True)
