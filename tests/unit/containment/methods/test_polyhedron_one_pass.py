"""Few points in one pass over the triangles: the tree's answers."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Cancel, CancelledError, locate
from engine.arrays import read_only
from engine.budget import Budget
from engine.containment.methods.polyhedron_one_pass import locate_by_pass
from engine.containment.methods.polyhedron_ray_parity import locate_by_tree
from engine.containment.prepared import tree_of
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
