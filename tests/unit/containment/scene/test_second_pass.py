"""What the first pass leaves is settled body by body, by a tree where a body has one, else as `locate` does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Pose, Sphere
from engine.arrays import read_only
from engine.budget import Budget
from engine.containment.rational_locate import rational_location
from engine.containment.scene import second_pass
from engine.containment.scene.second_pass import settle_rest
from engine.containment.scene.tables import scene_of
from tests.unit.containment.scenes import box_mesh, made, merged

TURN = Pose([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]], [0.5, 0.25, 1])


@pytest.mark.parametrize("fewest", [1, 1 << 30])
def test_pairs_get_their_locations_piece_by_piece(fewest: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(second_pass, "_FEWEST_FOR_TREES", fewest)
    solid = made(merged(box_mesh([0, 0, 0], [3, 3, 3]), box_mesh([1, 1, 1], [4, 4, 2])))
    solids, poses = [solid, Sphere([1, 1, 1], 2), solid], [None, TURN, TURN]
    random = np.random.default_rng(2)
    points = read_only(random.integers(-1, 10, (200, 3)) / 2.0)
    owners, bodies = random.integers(0, 200, 600), random.integers(0, 3, 600)
    found: list[Any] = []
    with Budget() as budget:
        scene = scene_of(solids, poses, 3, budget)
        pieces = np.split(owners, [100, 100]), np.split(bodies, [100, 100])
        counts = settle_rest(points, scene, *pieces, [found.append] * 3, budget, None)
        assert settle_rest(points, scene, [], [], [], budget, 1).beyond == 0
    assert [len(each) for each in found] == [100, 0, 500]
    expected = [rational_location(points[i].tolist(), solids[b], poses[b]) for i, b in zip(owners, bodies)]
    assert np.concatenate(found).tolist() == expected
    assert solid.kept("tree") is not None
    assert counts.rational > 0
