"""Tables of bodies: each body finds its own solid again, in the slot of its kind."""

from __future__ import annotations

import numpy as np

from engine import Aabb, Convex, HalfSpace, Implicit, Polygon, Pose, Sphere, Triangle
from engine.budget import Budget
from engine.containment.scene.first_pass import BALL, BOX, RINGS, ROWS, SECOND_PASS
from engine.containment.scene.tables import scene_of
from tests.unit.containment.scenes import box_mesh, made


def test_kinds_and_slots_of_the_plane() -> None:
    ring = Polygon([[[0, 0], [4, 0], [0, 4]], [[1, 1], [2, 1], [1, 2]]])
    triangle, ball, box = Triangle([[5, 5], [6, 5], [5, 7]]), Sphere([1, 2], 3), Aabb([0, 0], [1, 2])
    half, wedge = HalfSpace([1, 0], 2), Convex([[1, 0, 0], [0, 1, 0]])
    many = Polygon([np.column_stack([np.cos(np.arange(200)), np.sin(np.arange(200))])])
    other = Implicit([{"powers": [1, 0], "coefficient": 1.0}])
    solids = [ball, ring, box, half, triangle, wedge, many, other, ring, ball]
    with Budget() as budget:
        scene = scene_of(solids, [None] * 9 + [Pose.identity(2)], 2, budget)
    tables = scene.tables
    assert tables.kinds.tolist() == [BALL, RINGS, BOX, ROWS, RINGS, ROWS, SECOND_PASS, SECOND_PASS, RINGS, BALL]
    assert len(scene.solids) == 8
    assert scene.unbounded.tolist() == [3, 5, 7]
    assert (tables.lows[4].tolist(), tables.highs[4].tolist()) == ([5, 5, 0], [6, 7, 0])
    assert (tables.lows[1].tolist(), tables.highs[8].tolist()) == ([0, 0, 0], [4, 4, 0])
    first = tables.rings[tables.polygon_offsets[tables.slots[8]] + 1, 0]
    assert (tables.xs[first : first + 4].tolist(), tables.ys[first : first + 4].tolist()) == (
        [1, 2, 1, 1],
        [1, 1, 2, 1],
    )
    assert tables.rows[tables.row_offsets[tables.slots[5]] :][:2].tolist() == [[1, 0, 0, 0], [0, 1, 0, 0]]
    assert tables.balls[tables.slots[0]].tolist() == [3.0, 0.0]
    assert scene.locator(7) is scene.locator(7)


def test_polyhedra_wait_for_their_cells() -> None:
    with Budget() as budget:
        scene = scene_of([made(box_mesh([0, 0, 0], [1, 2, 3]))], None, 3, budget)
    assert scene.tables.kinds.tolist() == [SECOND_PASS]
    assert scene.tables.highs.tolist() == [[1, 2, 3]]
