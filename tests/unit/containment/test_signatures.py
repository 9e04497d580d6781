"""Each kernel is compiled once per dimension, whatever kind of array the caller passes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import config as numba_config

import engine
from engine.containment.methods.ball import locate_in_ball
from engine.containment.methods.half_spaces import locate_in_half_planes, locate_in_half_spaces
from engine.containment.methods.polygon_ray_parity import locate_in_rings
from engine.containment.methods.polyhedron_one_pass import locate_by_pass
from engine.containment.methods.polyhedron_ray_parity import locate_by_tree
from engine.containment.posed.filters import locate_by_polynomial, locate_in_box

VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
TURN = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]

SOLIDS = [
    (
        engine.Polyhedron(VERTICES, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
        [locate_by_tree, locate_by_pass],
    ),
    (engine.Triangle(VERTICES[:3]), [locate_in_half_spaces]),
    (engine.Convex([[1, 0, 0, 0]]), [locate_in_half_spaces]),
    (engine.Sphere([0, 0, 0], 1), [locate_in_ball]),
    (engine.Aabb([0, 0], [1, 1]), [locate_in_box]),
    (engine.HalfSpace([1, 0], 0), [locate_in_half_planes]),
    (engine.Polygon([np.column_stack([np.arange(600.0), np.arange(600.0) ** 2])]), [locate_in_rings]),
    (engine.Triangle([[0, 0], [1, 0], [0, 1]]), [locate_in_rings]),
    (engine.Implicit([{"powers": [1, 0], "coefficient": 1}]), [locate_by_polynomial]),
]


@pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="about compiled code")
@pytest.mark.parametrize(("solid", "kernels"), SOLIDS)
def test_a_kernel_sees_one_kind_of_array(solid: engine.Solid, kernels: list[Any]) -> None:
    n_points = 600 if isinstance(solid, engine.Polygon) else 6  # beyond one pass over the edges
    points = np.random.default_rng(0).random((n_points, solid.dimension))
    frozen = points.copy()
    frozen.setflags(write=False)
    turn = engine.Pose([row[: solid.dimension] for row in TURN[: solid.dimension]], [0.25] * solid.dimension)
    for given in (points, frozen, points[::2], np.asfortranarray(points), points.astype(np.float32), points.tolist()):
        engine.locate(given, solid)
        engine.locate_scene(given, [solid, solid], [turn, None])
    if isinstance(solid, engine.Polyhedron):
        engine.locate(np.random.default_rng(1).random((1 << 15, 3)), solid)  # more than a few passes
    for kernel in kernels:
        layouts = {
            tuple((each.ndim, each.layout, each.mutable) for each in signature if hasattr(each, "layout"))
            for signature in kernel.signatures
        }
        assert len(layouts) == 1, kernel.py_func.__name__
