"""All contacts of a pair, the first of them by the caller's faces, coplanar ones first; or one that settles all."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from engine import Pose
from engine.collision.meshes.contact_kinds import N_NAMED
from engine.collision.meshes.exact_body import classify_exact
from engine.collision.meshes.mesh_pair import MeshPair
from engine.collision.meshes.triangle_triangle import APART, COPLANAR
from engine.collision.result import Work
from tests.unit.collision.meshes.bodies import TURN, mesh


@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("at", [(2, 0.5, 0), (2, 2, 1), (9, 0, 0)])
def test_contacts_are_those_of_all_pairs_in_order(pose: Pose | None, at: tuple[float, float, float]) -> None:
    pair = MeshPair(mesh(2), mesh(1, at), (pose, pose), Work())
    with np.errstate(all="ignore"):
        pair.find_contacts()
    assert not pair.is_settled
    a, b = pair.exact
    every = list(itertools.product(range(len(a.mesh.faces)), range(len(b.mesh.faces))))
    kinds = {(i, j): classify_exact(a.corners(i), b.corners(j)) for i, j in every}
    found = [(i, j) for i, j in pair.contacts.tolist()]
    assert sorted(found) == [key for key in every if kinds[key] != APART]
    keys = [(kinds[i, j] != COPLANAR, a.mesh.faces[i], b.mesh.faces[j], i, j) for i, j in found]
    assert keys[:N_NAMED] == sorted(keys)[:N_NAMED]


def test_a_crossing_settles() -> None:
    pair = MeshPair(mesh(2), mesh(2, (1, 0.5, 0.25)), (None, None), Work())
    pair.find_contacts()
    assert pair.is_settled
    assert len(pair.contacts) == 1
