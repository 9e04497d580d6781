"""The kind of a contact by compiled signs: what exact integers say, for triangles on a small lattice, posed or not."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Pose, Surface
from engine.collision.codes import UNSETTLED
from engine.collision.meshes.contact_kinds import STRENGTH
from engine.collision.meshes.dual_traversal import SEEK_CONTACT, Found
from engine.collision.meshes.exact_body import exact_pair
from engine.collision.meshes.exact_triangles import classify_exact, kind_of_contact
from engine.collision.meshes.mesh_arrays import mesh_body_of
from engine.collision.meshes.mesh_pair import relate
from engine.collision.meshes.pose_batch import KIND
from engine.collision.meshes.triangle_triangle import APART, CONTACT
from engine.collision.result import Work
from tests.unit.collision.meshes.bodies import TURN


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("size", [3, 4])
def test_agrees_with_exact_integers(size: int, pose: Pose | None) -> None:
    rng = np.random.default_rng(size)
    seen = set()
    for _ in range(600 if pose is None else 300):
        t, u = rng.integers(0, size, (2, 3, 3)).astype(float)
        if rng.random() < 0.5:
            t[:, 2] = u[:, 2] = 0.0
        first, second = (mesh_body_of(Surface(corners, [[0, 1, 2]])) for corners in (t, u))
        a, b = exact_pair(first, second, (pose, pose))
        faces = a.corners(0), b.corners(0)
        if classify_exact(*faces) == APART:
            continue
        found = Found(np.zeros((1, 2), np.int64), np.full(1, CONTACT, np.int8), np.empty(0, np.bool_))
        with np.errstate(all="ignore"):
            row, _ = relate(first, second, (first.posed(pose), second.posed(pose)), SEEK_CONTACT, Work(), found)
        if min(first.arrays.axis[0], second.arrays.axis[0]) < 0:
            assert row[KIND] == UNSETTLED
        else:
            assert STRENGTH[row[KIND]] == kind_of_contact(*faces)
            seen.add(row[KIND])
    assert seen == set(range(6))
