"""The search finds every pair of faces with a common point, however little room it has, but for common corners of which
others say as much; and ends where it may."""

from __future__ import annotations

import itertools

import pytest

from engine import Pose
from engine.collision.meshes.dual_traversal import SEEK_CONTACT, SEEK_OVERLAP, new_found
from engine.collision.meshes.exact_body import classify_exact, exact_pair, kind_of_contact
from engine.collision.meshes.mesh_pair import SPACE, relate
from engine.collision.meshes.pose_batch import N_CONTACTS, ONE_SETTLES
from engine.collision.meshes.triangle_triangle import APART, CROSSING
from engine.collision.result import Work
from engine.types import UNDECIDED
from tests.unit.collision.meshes.bodies import TURN, mesh


@pytest.mark.parametrize("room", [1, 7, 512])
@pytest.mark.parametrize("pose", [None, TURN])
@pytest.mark.parametrize("at", [(2, 0, 0), (2, 1, 0.5), (2, 2, 2), (0.5, 0.5, 2), (3, 0, 0)])
def test_finds_what_looking_at_all_pairs_finds(
    room: int, pose: Pose | None, at: tuple[float, float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SPACE, "found", new_found(room))
    a, b = mesh(2), mesh(1, at)
    row, found = relate(a, b, (a.posed(pose), b.posed(pose)), SEEK_OVERLAP, Work())
    pairs = set(map(tuple, found.pairs[: row[N_CONTACTS]].tolist()))
    assert len(pairs) == row[N_CONTACTS]
    x, y = exact_pair(a, b, (pose, pose))
    every = itertools.product(range(len(a.faces)), range(len(b.faces)))
    touching = {(i, j) for i, j in every if classify_exact(x.corners(i), y.corners(j)) != APART}
    for i, j in touching - pairs:
        assert len(found.met) > 0
        assert kind_of_contact(x.corners(i), y.corners(j)) == "vertex_vertex"
        assert i in {p for p, _ in pairs}
        assert j in {q for _, q in pairs}
    assert pairs <= touching or UNDECIDED in found.kinds[: len(pairs)]
    assert CROSSING not in found.kinds[: len(pairs)]


@pytest.mark.parametrize("pose", [None, TURN])
def test_a_crossing_or_any_contact_may_settle_the_question(pose: Pose | None) -> None:
    a, b = mesh(2), mesh(2, (1, 0.5, 0.25))
    for seek in (SEEK_OVERLAP, SEEK_CONTACT):
        row, found = relate(a, b, (a.posed(pose), b.posed(pose)), seek, Work())
        assert row[N_CONTACTS] == ONE_SETTLES
        i, j = found.pairs[0].tolist()
        x, y = exact_pair(a, b, (pose, pose))
        kind = classify_exact(x.corners(i), y.corners(j))
        assert kind == CROSSING or (seek == SEEK_CONTACT and kind != APART)
