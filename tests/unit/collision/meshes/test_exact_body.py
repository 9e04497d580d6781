"""Bodies in rational arithmetic: contacts and regions."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from engine import Pose, Surface
from engine.collision.exact_images import image_point
from engine.collision.meshes.exact_body import (
    Corners,
    ExactBody,
    as_simplex,
    classify_exact,
    exact_pair,
    kind_of_contact,
    on_lattice,
    plane_through,
    rounded_outward,
)
from engine.collision.meshes.exact_regions import Sides, points_within, regions_of, sides_at, sides_over
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.triangle_triangle import APART
from engine.running.budget import Budget
from tests.reference.contact import triangles_meet
from tests.reference.exact import vector
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


# --- Two faces on integers: whether they meet, as the reference says, whatever their shape ---


FACE: Corners = ((0, 0, 0), (6, 0, 0), (0, 6, 0))


def test_degenerate_ones_agree_with_proper_ones_moved_to_them() -> None:
    rng = np.random.default_rng(4)
    for rows in rng.integers(0, 3, (300, 6, 3)).tolist():
        t, u = tuple(map(tuple, rows[:3])), tuple(map(tuple, rows[3:]))
        how = classify_exact(t, u)
        assert (how == APART) == (classify_exact(u, t) == APART)
        if len(as_simplex(t)) == len(as_simplex(u)) == 3:
            reference = [tuple(vector(p) for p in triangle) for triangle in (t, u)]
            assert (how != APART) == triangles_meet(*reference)


@pytest.mark.parametrize(
    ("other", "kind"),
    [
        (((1, 1, 0), (2, 1, 0), (1, 2, 0)), "face_face"),
        (((1, 1, 1), (1, 1, -1), (9, 9, 9)), "edge_face"),
        (((1, 1, 0), (1, 1, 9), (2, 1, 9)), "vertex_face"),
        (((3, -1, 1), (3, 1, -1), (3, -9, -9)), "edge_edge"),
        (((3, 0, 0), (3, -1, 9), (3, -2, 9)), "vertex_edge"),
        (((0, 0, 0), (-1, 0, 9), (0, -1, 9)), "vertex_vertex"),
    ],
)
def test_kinds(other: Corners, kind: str) -> None:
    assert kind_of_contact(FACE, other) == kind
    assert kind_of_contact(other, FACE) == kind


# --- Regions of a face: one point in each, and what lies on either side ---


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
