"""The kind of a contact by compiled signs: what exact integers say, for triangles on a small lattice, posed or not."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Pose, Surface
from engine.collision.codes import KIND, UNSETTLED
from engine.collision.meshes.contact_kinds import STRENGTH
from engine.collision.meshes.dual_traversal import SEEK_CONTACT, SEEK_OVERLAP, Contacts
from engine.collision.meshes.exact_body import classify_exact, exact_pair, kind_of_contact
from engine.collision.meshes.mesh_arrays import STILL, mesh_body_of
from engine.collision.meshes.mesh_pair import relate
from engine.collision.meshes.pose_batch import DETAIL, NO_SHARED_AREA
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
        found = Contacts(np.zeros((1, 2), np.int64), np.full(1, CONTACT, np.int8), np.empty(0, np.bool_))
        with np.errstate(all="ignore"):
            row, _ = relate(first, second, (first.posed(pose), second.posed(pose)), SEEK_CONTACT, Work(), found)
        if min(first.arrays.axis[0], second.arrays.axis[0]) < 0:
            assert row[KIND] == UNSETTLED
        else:
            assert STRENGTH[row[KIND]] == kind_of_contact(*faces)
            seen.add(row[KIND])
    assert seen == set(range(6))


@pytest.mark.parametrize(
    ("other", "cut"),
    [
        (((1, 1, 0), (2, 1, 5), (1, 2, 5)), 0),  # stands on the open face
        (((0, 0, 0), (0, -9, 5), (0, -9, -5)), 0),  # passes a corner
        (((0, 0, 0), (9, 0, 0), (0, 0, 9)), 0),  # stands on an edge
        (((1, 1, 0), (2, 1, 0), (1, 1, 5)), 1),  # stands on the open face with an edge
        (((1, 0, 0), (2, -1, 5), (2, -2, 5)), 0),  # touches an edge with a corner
        (((-1, 0, -9), (10, 0, -9), (4, 0, 18)), 2),  # holds an edge within
        (((1, -1, -5), (1, 9, 0), (1, -1, 5)), 3),  # goes through
    ],
)
def test_which_open_face_is_cut(other: tuple[tuple[int, int, int], ...], cut: int) -> None:
    for face in (((0, 0, 0), (9, 0, 0), (0, 9, 0)), ((0, 9, 0), (9, 0, 0), (0, 0, 0))):
        bodies = [mesh_body_of(Surface(corners, [[0, 1, 2]])) for corners in (face, other)]
        for first, second, bits in ((*bodies, cut), (*bodies[::-1], (0, 2, 1, 3)[cut])):
            found = Contacts(np.zeros((1, 2), np.int64), np.full(1, CONTACT, np.int8), np.empty(0, np.bool_))
            with np.errstate(all="ignore"):
                relate(first, second, (STILL, STILL), SEEK_OVERLAP, Work(), found, DETAIL)
            assert found.kinds.tolist() == [NO_SHARED_AREA | bits]
