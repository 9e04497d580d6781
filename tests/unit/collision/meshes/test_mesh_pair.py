"""Two placed meshes in one question: scaled into range where that is exact, and their patches."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Pose
from engine.collision.meshes.mesh_pair import MeshPair, simplest
from engine.collision.meshes.parity import INSIDE, OUTSIDE
from engine.collision.result import Work
from tests.unit.collision.meshes.bodies import TURN, mesh


def test_the_identity_is_no_pose() -> None:
    a, b = mesh(1), mesh(2)
    assert simplest(a, Pose.identity(), b, TURN) == (a, None, b, TURN)


def test_posed_bodies_far_out_of_range_are_scaled_exactly() -> None:
    far = Pose(TURN.rotation, [2.0**400, 0, 0])
    a, _, _, pose = simplest(mesh(1, (2.0**399, 0, 0)), None, mesh(1, (2.0**399, 0, 0)), far)
    assert pose is not None
    assert max(a.arrays.extent.reach, np.abs(pose.translation).max()) <= 1.0
    tiny = Pose(TURN.rotation, [2.0**400, 2.0**-1074, 0])
    assert simplest(mesh(1), None, mesh(1), tiny)[3] is tiny


@pytest.mark.parametrize("pose", [None, TURN])
def test_patches_inside_and_outside(pose: Pose | None) -> None:
    pair = MeshPair(mesh(1, (1, 1, 1)), pose, mesh(3), pose, Work())
    none = np.empty(0, np.int64)
    assert [len(patch) for patch in pair.patches(0, none, INSIDE)] == [12]
    assert [len(patch) for patch in pair.patches(1, none, OUTSIDE)] == [108]
    assert pair.patches(0, none, OUTSIDE) == []
    beside = list(pair.sides_beside(0, np.arange(12)))
    assert beside
    assert all(sides.above != sides.below for sides in beside)
