"""Many polyhedra by their addresses get the locations of each tree by itself."""

from __future__ import annotations

import numpy as np

from engine.arrays import read_only
from engine.bounding.bvh import STACK
from engine.budget import Budget
from engine.containment.prepared import tree_of
from engine.containment.rational_locate import rational_location
from engine.containment.scene.tables import scene_of
from engine.containment.scene.trees import TreeTables, locate_groups, tree_line
from engine.types import UNDECIDED
from tests.unit.containment.scenes import box_mesh, made


def test_groups_of_bodies() -> None:
    solids = [made(box_mesh([k, 0, 0], [k + 3, 2, 1])) for k in range(4)]
    lines = [np.array(each) for each in zip(*(tree_line(tree_of(solid)) for solid in solids))]
    tables = TreeTables(np.array([0, 1, -1, 3], np.int32), *lines, np.zeros((4, 4), np.int64), np.zeros((4, 6)))
    points = read_only(np.random.default_rng(0).integers(-1, 8, (40, 3)).astype(float))
    owners, located = np.tile(np.arange(40), 4), np.full(160, UNDECIDED, np.int8)
    begins, order = np.arange(0, 160, 40), np.arange(160)
    with Budget() as budget:
        scene = scene_of(solids, None, 3, budget)
        stack, flag = np.empty(STACK, np.int32), budget.flag
        locate_groups(
            points, owners, order, begins, begins + 40, np.arange(4), scene.tables, tables, located, stack, flag
        )
    for body, found in enumerate(located.reshape(4, 40).tolist()):
        asked = [rational_location(point, solids[body]) for point in points.tolist()]
        assert found == ([UNDECIDED] * 40 if body == 2 else asked)
