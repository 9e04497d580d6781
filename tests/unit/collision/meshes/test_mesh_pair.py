"""Two placed meshes in one question: what it leaves out, and their patches."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Pose
from engine.collision.meshes.mesh_pair import MeshPair, unless_identity
from engine.collision.meshes.parity import INSIDE, OUTSIDE
from engine.collision.result import Work
from tests.unit.collision.meshes.bodies import TURN, mesh


def test_the_identity_is_no_pose() -> None:
    assert unless_identity((None, Pose.identity())) == (None, None)
    assert unless_identity((TURN, None)) == (TURN, None)


@pytest.mark.parametrize("pose", [None, TURN])
def test_patches_inside_and_outside(pose: Pose | None) -> None:
    pair = MeshPair(mesh(1, (1, 1, 1)), mesh(3), (pose, pose), Work())
    none = np.empty(0, np.int64)
    assert [len(patch) for patch in pair.patches(0, none, INSIDE)] == [12]
    assert [len(patch) for patch in pair.patches(1, none, OUTSIDE)] == [108]
    assert pair.patches(0, none, OUTSIDE) == []
    beside = list(pair.sides_beside(0, np.arange(12)))
    assert beside
    assert all(sides.above != sides.below for sides in beside)
