"""Where meshes stand: arrays, frames, placement with its errors."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine import Aabb, Polyhedron, Pose, Surface
from engine.collision.exact_images import image_point
from engine.collision.meshes.dual_traversal import place_bodies
from engine.collision.meshes.mesh_arrays import NO_AREA, lattice_shift, mesh_body_of
from engine.collision.meshes.mesh_pair import new_descent
from engine.collision.meshes.placement import NEVER_APART, place_pair, placed
from engine.compiling.jit import kernel
from engine.predicates.rational import dot
from engine.predicates.vectors import as_point3
from tests.unit.collision.meshes.bodies import TURN, brick, mesh

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


# --- The map from one tree to another, within its margin of the exact one ---


@kernel
def place_in_frame(first: Any, first_pose: Any, second: Any, second_pose: Any, descent: Any) -> bool:
    return bool(place_bodies(first, first_pose, 0, second, second_pose, 0, descent)[1])


@pytest.mark.parametrize("units", [(1.0, 1.0, 1.0), (1e5, 1.0, 1e-2)])
@pytest.mark.parametrize("pose", [None, TURN])
def test_points_are_mapped_within_the_margins(pose: Pose | None, units: tuple[float, ...]) -> None:
    """By axis; those of axes on which the bodies are short are small where no pose turns them."""
    descent = new_descent()
    a, b = (
        mesh_body_of(Polyhedron(body.arrays.vertices * units, body.arrays.triangles))
        for body in (mesh(2), mesh(1, (1.5, 0.25, 0.5)))
    )
    assert not place_in_frame(a.arrays, a.posed(None), b.arrays, b.posed(None), descent)
    assert (descent.frames[0, 22:25, 0] <= 2.0**-15 * np.array(units) / max(units)).all()
    assert not place_in_frame(a.arrays, a.posed(pose), b.arrays, b.posed(TURN), descent)
    frame = descent.frames[0, :, 0].astype(np.float64)
    for local in np.random.default_rng(3).uniform(-1, 1, (20, 3)) * b.arrays.sizes:
        placed = image_point(b.arrays.origin + b.arrays.scale * local, TURN)
        if pose is not None:  # its transpose, off by far less than the margin
            away = [x - Fraction(t) for x, t in zip(placed, pose.translation.tolist())]
            placed = tuple(dot(tuple(map(Fraction, column)), away) for column in pose.rotation.T.tolist())
        exact = [(float(x) - o) / a.arrays.scale for x, o in zip(placed, a.arrays.origin)]
        mapped = frame[:9].reshape(3, 3) @ local + frame[18:21]
        assert (np.abs(mapped - exact) <= frame[22:25]).all()
        assert frame[22:25].max() <= frame[21]


def test_far_bodies_are_apart_and_unlike_scales_leave_the_frame_out() -> None:
    a, descent = mesh(1), new_descent()
    assert place_in_frame(a.arrays, a.posed(None), mesh(1, (9, 0, 0)).arrays, a.posed(None), descent)
    far = Pose(np.eye(3), [1e300, 0, 0])
    place_in_frame(a.arrays, a.posed(None), a.arrays, a.posed(far), descent)
    assert (descent.frames[0, 21] == np.float32(NEVER_APART)).all()


# --- Triangles of bodies for kernels: the caller's faces, components, lattices, flat boxes ---


def test_triangles_keep_their_places_and_numbers() -> None:
    body = brick(3, (0.5, 0, 0))
    mesh = mesh_body_of(body)
    corners = mesh.arrays.vertices[mesh.arrays.triangles]
    assert (corners == body.vertices[body.triangles[mesh.faces]]).all()
    assert mesh.has_inside
    assert mesh.arrays.extent.reach == 3.5
    assert mesh.arrays.extent.grain == 0.5
    assert mesh_body_of(body) is mesh


@pytest.mark.parametrize(
    ("high", "faces"), [([1, 1, 1], [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]), ([1, 0, 1], [2, 2]), ([0, 0, 0], [0, 0])]
)
def test_boxes(high: list[float], faces: list[int]) -> None:
    mesh = mesh_body_of(Aabb([0, 0, 0], high))
    assert sorted(mesh.faces.tolist()) == faces
    assert mesh.has_inside == all(high)
    assert (mesh.arrays.axis == NO_AREA).all() == (not any(high))


def test_components_and_unused_vertices() -> None:
    one, other = brick(1), brick(1, (5, 0, 0))
    both = Polyhedron(
        np.concatenate([one.vertices, other.vertices]), np.concatenate([one.triangles, other.triangles + 8])
    )
    arrays = mesh_body_of(both).arrays
    assert sorted(arrays.vertices[arrays.triangles[arrays.components, 0], 0] > 3) == [False, True]
    sheet = mesh_body_of(Surface([[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 2, 3]]))
    assert len(sheet.arrays.vertices) == 3
    assert not sheet.has_inside


def test_lattices() -> None:
    assert lattice_shift(np.array([0.0, 0.75, 3.0])) >= 2
    for value in (0.1, 5e-324, 1e300):
        shift = lattice_shift(np.array([value]))
        numerator, denominator = value.as_integer_ratio()
        assert (numerator << shift) % denominator == 0
