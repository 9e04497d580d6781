"""Regions of faces in contact: where both insides come up to one side, and where a face passes through the other."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Pose
from engine.collision.meshes.mesh_mesh import look_at_regions
from engine.collision.meshes.mesh_pair import MeshPair
from engine.collision.result import Work
from tests.unit.collision.meshes.bodies import TURN, mesh


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize(("at", "overlaps"), [((1, 0, 0), True), ((2, 0, 0), False), ((0, 0, 0), True)])
def test_flush_boxes(at: tuple[float, float, float], overlaps: bool, pose: Pose | None) -> None:
    pair = MeshPair(mesh(2), mesh(2, at), (pose, pose), Work())
    with np.errstate(all="ignore"):
        pair.find_contacts()
        found = False
        for face in np.unique(pair.contacts[:, 0]).tolist():
            is_overlap, pierces = look_at_regions(pair, 0, face)
            found |= is_overlap
            assert not pierces or overlaps
        assert found == overlaps
