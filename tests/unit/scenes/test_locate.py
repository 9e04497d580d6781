"""What tables leave is settled body by body, by trees or as `locate` does; some bodies moved."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Pose, Sphere
from engine.arrays import read_only
from engine.budget import Budget
from engine.containment.rational_locate import rational_location
from engine.scenes import locate
from engine.scenes.bodies import Bodies
from engine.scenes.locate import locate_all
from engine.scenes.standing import Standing
from tests.unit.containment.scenes import box_mesh, made, merged

TURN = Pose([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]], [0.5, 0.25, 1])


@pytest.mark.parametrize("fewest", [1, 1 << 30])
def test_points_get_their_locations(fewest: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(locate, "_FEWEST_FOR_TREES", fewest)
    solid = made(merged(box_mesh([0, 0, 0], [3, 3, 3]), box_mesh([1, 1, 1], [4, 4, 2])))
    solids, poses = [solid, Sphere([1, 1, 1], 2), solid], [None, TURN, TURN]
    random = np.random.default_rng(2)
    points = read_only(random.integers(-1, 10, (200, 3)) / 2.0)
    with Budget() as budget:
        standing = Standing(Bodies((*solids, solid), (*poses, None)), {3: TURN})
        found, accuracy = locate_all(points, standing, budget, None, None)
        few, _ = locate_all(points[:9], standing, budget, None, None)
    expected = [
        (item, body, location == 0)
        for item, point in enumerate(points.tolist())
        for body, (each, pose) in enumerate(zip([*solids, solid], [*poses, TURN]))
        if (location := rational_location(point, each, pose)) >= 0
    ]
    owners = np.repeat(np.arange(200), np.diff(found.offsets)).tolist()
    assert list(zip(owners, found.indices.tolist(), found.on_boundary.tolist())) == expected
    assert few.indices.tolist() == [body for item, body, _ in expected if item < 9]
    assert solid.kept("tree") is not None
    assert accuracy.n_rational > 0
