"""Vertices of one placed body in another: what exact containment says, or UNDECIDED."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Polyhedron, Pose, locate
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.parity import locate_vertices
from engine.types import UNDECIDED
from tests.unit.collision.meshes.bodies import TURN, brick


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("at", [(0, 0, 0), (0.5, 0.25, 1), (0.1, 0.2, 0.3)])
def test_agrees_with_locate(pose: Pose | None, at: tuple[float, float, float]) -> None:
    solid = Polyhedron([[0, 0, 0], [3, 0, 0], [0, 3, 0], [0.5, 0.5, 3]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    source = mesh_body_of(brick(3, at))
    target = mesh_body_of(solid)
    vertices = np.arange(len(source.arrays.vertices))
    found = np.empty(len(vertices), np.int8)
    with np.errstate(all="ignore"):
        locate_vertices(
            source.arrays, source.posed(pose), vertices, target.arrays, target.posed(pose), found, np.zeros(1, np.uint8)
        )
    expected = locate(source.arrays.vertices, solid)  # one pose of both changes nothing
    is_off = expected != 0  # on a face nothing is promised
    decided = is_off & (found != UNDECIDED)
    assert (found[decided] == expected[decided]).all()
    assert decided.sum() > (0.4 if pose is not None else 0.99) * is_off.sum()
