"""Boxes of single bodies hold all of their points."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Aabb, Csg, HalfSpace, Polygon, Pose, Solid, Sphere, Triangle
from engine.containment.rational_locate import no_check, to_world_frame
from engine.scenes.body_box import body_box
from tests.unit.containment.scenes import box_mesh, made

POSE = Pose([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]], [0.1, 1e9, -3])
FLAT = Pose([[0.6, -0.8], [0.8, 0.6]], [0.1, 1e-300])


@pytest.mark.parametrize("solid", [made(box_mesh([0, 0, 0], [1, 2, 3])), Polygon([[[0, 0], [3, 0], [1, 0.1]]])])
def test_images_of_vertices_are_in_the_box(solid: Polygon) -> None:
    pose = POSE if solid.dimension == 3 else FLAT
    low, high = body_box(solid, pose, no_check)
    for vertex in solid.vertices.tolist():
        image = to_world_frame(vertex, pose)
        assert all(a <= x <= b for a, x, b in zip(low.tolist(), image, high.tolist()))
    assert (high - low).max() < 10


@pytest.mark.parametrize("radius", [0.0, 0.1, 5e-324, 1e300])
def test_balls_grow_by_their_radius(radius: float) -> None:
    low, high = body_box(Sphere([0.1, 0.2, 0.3], radius), POSE, no_check)
    center = to_world_frame([0.1, 0.2, 0.3], POSE)
    assert all(a <= x - int(radius) <= x + int(radius) <= b for a, x, b in zip(low.tolist(), center, high.tolist()))
    assert body_box(Sphere([0, 0], 2.0), None, no_check)[1].min() >= 2.0


def test_what_has_no_bounds_has_an_infinite_box() -> None:
    for solid in (HalfSpace([1, 0, 0], 0), Triangle(np.eye(3))):
        assert np.isinf(body_box(solid, POSE, no_check)).all()
    assert np.isinf(body_box(Aabb([-1.7e308] * 3, [1.7e308] * 3), POSE, no_check)).any()


def test_trees_take_the_boxes_of_their_operands() -> None:
    first, second = Aabb([0, 0], [2, 2]), Aabb([1, 1], [3, 3])

    def box(operation: str, *operands: Solid) -> list[list[float]]:
        return [side.tolist() for side in body_box(Csg(operation, operands), None, no_check)]

    assert box("union", first, second) == [[0, 0], [3, 3]]
    assert box("intersection", first, second) == [[1, 1], [2, 2]]
    assert box("difference", first, second) == [[0, 0], [2, 2]]
    assert box("union", Csg("difference", [first, second]), HalfSpace([1, 0], 0)) == [[-np.inf] * 2, [np.inf] * 2]
