"""The search finds every pair of faces with a common point, however little room it has; and ends where it may."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from engine import Pose
from engine.collision.meshes.dual_traversal import (
    DONE,
    FULL,
    SEEK_CONTACT,
    SEEK_OVERLAP,
    SETTLED,
    new_descent,
    new_found,
)
from engine.collision.meshes.exact_body import exact_pair
from engine.collision.meshes.exact_triangles import classify_exact
from engine.collision.meshes.pose_batch import find_contacts
from engine.collision.meshes.triangle_triangle import APART, CROSSING
from engine.types import UNDECIDED
from tests.unit.collision.meshes.bodies import TURN, mesh

FLAG = np.zeros(1, np.uint8)


@pytest.mark.parametrize("room", [1, 7, 512])
@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("at", [(2, 0, 0), (2, 1, 0.5), (2, 2, 2), (0.5, 0.5, 2), (3, 0, 0)])
def test_finds_what_looking_at_all_pairs_finds(room: int, pose: Pose | None, at: tuple[float, float, float]) -> None:
    a, b = mesh(2), mesh(1, at)
    found, descent = new_found(room), new_descent()
    pairs: set[tuple[int, int]] = set()
    how, kinds = FULL, set()
    for turn in itertools.count():  # bound: each finds new pairs
        with np.errstate(all="ignore"):
            how, n = find_contacts(
                a.arrays, a.posed(pose), b.arrays, b.posed(pose), SEEK_OVERLAP, turn == 0, descent, found, FLAG
            )
        new = set(map(tuple, found.pairs[:n].tolist()))
        assert not new & pairs
        pairs |= new
        kinds |= set(found.kinds[:n].tolist())
        if how != FULL:
            break
    assert how == DONE
    x, y = exact_pair(a, pose, b, pose)
    every = itertools.product(range(len(a.faces)), range(len(b.faces)))
    touching = {(i, j) for i, j in every if classify_exact(x.corners(i), y.corners(j)) != APART}
    assert touching <= pairs
    assert pairs == touching or UNDECIDED in kinds
    assert CROSSING not in kinds


@pytest.mark.parametrize("pose", [None, TURN])
def test_a_crossing_or_any_contact_may_settle_the_question(pose: Pose | None) -> None:
    a, b = mesh(2), mesh(2, (1, 0.5, 0.25))
    for seek in (SEEK_OVERLAP, SEEK_CONTACT):
        found = new_found(512)
        with np.errstate(all="ignore"):
            how, n = find_contacts(
                a.arrays, a.posed(pose), b.arrays, b.posed(pose), seek, True, new_descent(), found, FLAG
            )
        assert (how, n) == (SETTLED, 1)
        i, j = found.pairs[0].tolist()
        x, y = exact_pair(a, pose, b, pose)
        kind = classify_exact(x.corners(i), y.corners(j))
        assert kind == CROSSING or (seek == SEEK_CONTACT and kind != APART)
