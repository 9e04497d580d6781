"""One pass over the faces of a mesh, and parity along a half-line in the plane."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Cancel, CancelledError, Polygon, locate
from engine.containment.methods.polygon_ray_parity import locate_in_rings
from engine.containment.methods.polyhedron_one_pass import locate_by_pass
from engine.containment.methods.polyhedron_ray_parity import locate_by_tree
from engine.containment.methods.rational_locate import rational_location
from engine.containment.prepared import rings_of, tree_of
from engine.running.budget import Budget
from engine.types import read_only
from tests.unit.containment.scenes import box_mesh, lattice_points, made, merged


@pytest.mark.parametrize("n_points", [1, 2, 7, 500])
@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (1.0, 1.0, 0.0), (0.0, 1.0, 1.0), (0.0, 0.0, 1.0), (4e-324, 1, 1)])
def test_any_number_of_points_in_any_box(n_points: int, scale: tuple[float, float, float]) -> None:
    """Points on a line or in a plane leave an axis of their grid without extent."""
    solid = made(merged(box_mesh([0, 0, 0], [3, 3, 3]), box_mesh([1, 1, 1], [4, 4, 2]), box_mesh([0, 0, 3], [1, 4, 4])))
    random = np.random.default_rng(n_points)
    points = np.concatenate([lattice_points(3), random.uniform(-1, 5, (200, 3))])
    points = read_only(points[random.permutation(len(points))[:n_points]] * scale)
    found, expected, flag = np.empty(n_points, np.int8), np.empty(n_points, np.int8), np.zeros(1, np.uint8)
    locate_by_pass(points, solid.vertices, solid.triangles, found, flag)
    locate_by_tree(points, np.zeros(n_points), tree_of(solid), expected, flag)
    assert (found == expected).all()


def test_a_pass_ends_when_the_call_must() -> None:
    solid = made(box_mesh([0, 0, 0], [1, 1, 1]))
    cancel = Cancel()
    cancel.set()
    with pytest.raises(CancelledError):
        locate(np.zeros((10, 3)), solid, cancel=cancel)
    locations = np.zeros(10, np.int8)
    with Budget(None, cancel) as budget:
        locate_by_pass(read_only(np.zeros((10, 3))), solid.vertices, solid.triangles, locations, budget.flag)
    assert locate(np.zeros((10, 3)), solid).tolist() == [0] * 10


# --- Rings by ray and parity: each kernel answer equals rational arithmetic ---


@pytest.mark.parametrize("seed", range(5))
def test_rings_that_cross_themselves(seed: int) -> None:
    random = np.random.default_rng(seed)
    solid = Polygon([random.integers(0, 6, (n, 2)) for n in (9, 4)])
    points = read_only(random.integers(-1, 13, (300, 2)) / 2.0)
    found = np.empty(len(points), np.int8)
    locate_in_rings(points, np.zeros(len(points)), rings_of(solid), found, np.zeros(1, np.uint8))
    assert found.tolist() == [rational_location(point, solid) for point in points.tolist()]
