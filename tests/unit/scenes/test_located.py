"""Tables of bodies: each body finds its own solid again, in the slot of its kind."""

from __future__ import annotations

import numpy as np

from engine import Aabb, Convex, HalfSpace, Implicit, Polygon, Pose, Sphere, Triangle
from engine.budget import Budget
from engine.containment.prepared import tree_of
from engine.scenes.bodies import Bodies
from engine.scenes.located import BALL, BOX, BY_ITSELF, MESH, RINGS, ROWS
from tests.unit.containment.scenes import box_mesh, made


def test_kinds_and_slots_of_the_plane() -> None:
    ring = Polygon([[[0, 0], [4, 0], [0, 4]], [[1, 1], [2, 1], [1, 2]]])
    triangle, ball, box = Triangle([[5, 5], [6, 5], [5, 7]]), Sphere([1, 2], 3), Aabb([0, 0], [1, 2])
    half, wedge = HalfSpace([1, 0], 2), Convex([[1, 0, 0], [0, 1, 0]])
    many = Polygon([np.column_stack([np.cos(np.arange(200)), np.sin(np.arange(200))])])
    other = Implicit([{"powers": [1, 0], "coefficient": 1.0}])
    solids = [ball, ring, box, half, triangle, wedge, many, other, ring, ball]
    with Budget() as budget:
        tables = Bodies(tuple(solids), (*[None] * 9, Pose.identity(2))).tables(budget)
    assert tables.kinds.tolist() == [BALL, RINGS, BOX, ROWS, RINGS, ROWS, BY_ITSELF, BY_ITSELF, RINGS, BALL]
    first = tables.rings[tables.polygon_offsets[tables.slots[8]] + 1, 0]
    assert (tables.xs[first : first + 4].tolist(), tables.ys[first : first + 4].tolist()) == (
        [1, 2, 1, 1],
        [1, 1, 2, 1],
    )
    assert tables.rows[tables.row_offsets[tables.slots[5]] :][:2].tolist() == [[1, 0, 0, 0], [0, 1, 0, 0]]
    assert tables.balls[tables.slots[0]].tolist() == [3.0, 0.0]


def test_polyhedra_have_the_trees_that_are_there() -> None:
    solid = made(box_mesh([0, 0, 0], [1, 2, 3]))
    with Budget() as budget:
        for has_tree in (False, True):
            tables = Bodies((solid,), (None,)).tables(budget)
            assert tables.kinds.tolist() == [MESH]
            assert bool(tables.addresses.any()) == has_tree
            tree_of(solid)
