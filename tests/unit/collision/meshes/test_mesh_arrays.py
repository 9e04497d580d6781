"""Triangles of bodies for kernels: the caller's faces, components, lattices, flat boxes."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Polyhedron, Surface
from engine.collision.meshes.mesh_arrays import NO_AREA, lattice_shift, mesh_body_of
from tests.unit.collision.meshes.bodies import brick


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
