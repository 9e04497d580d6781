"""The first pass over a scene: what it decides is right, and its lists are in order."""

from __future__ import annotations

import numpy as np

from engine import Aabb, Convex, HalfSpace, Polygon, Pose, Sphere
from engine.arrays import read_only
from engine.budget import Budget
from engine.containment.rational_locate import rational_location
from engine.containment.scene.first_pass import drop_outside, put_in_order, scan_points, sort_by_cell
from engine.containment.scene.tables import scene_of
from engine.types import UNDECIDED

SOLIDS = [
    Aabb([0, 0], [2, 1]),
    Sphere([1, 1], 1.5),
    HalfSpace([1, -1], 0),
    Polygon([[[0, 0], [3, 0], [3, 3], [1, 1], [0, 3]]]),
    Convex([[1, 0, 0], [0, 1, 0], [-1, -1, 3]]),
]


def test_what_is_decided_is_right_and_the_rest_is_listed() -> None:
    solids = SOLIDS * 2
    poses = [None] * 5 + [Pose([[0.6, -0.8], [0.8, 0.6]], [1, 0])] * 5
    points = read_only(np.random.default_rng(0).integers(-4, 16, (300, 2)) / 4.0)
    counts, bodies, located = np.zeros(300, np.int64), np.empty(3000, np.int32), np.empty(3000, np.int8)
    with Budget() as budget, np.errstate(all="ignore"):
        scene = scene_of(solids, poses, 2, budget)
        done, n_listed, _ = scan_points(
            points, scene.tables, scene.grid, scene.unbounded, counts, bodies, located, budget.flag
        )
    assert done == 300
    assert n_listed == counts.sum()
    place = 0
    for point, count in zip(points.tolist(), counts.tolist()):
        listed = dict(zip(bodies[place : place + count].tolist(), located[place : place + count].tolist()))
        place += count
        assert list(listed) == sorted(listed)
        for body, (solid, pose) in enumerate(zip(solids, poses)):
            assert listed.get(body, -1) in (rational_location(point, solid, pose), UNDECIDED)


def test_a_pass_without_room_says_how_far_it_came() -> None:
    with Budget() as budget:
        scene = scene_of(SOLIDS, None, 2, budget)
        counts, bodies, located = np.zeros(5, np.int64), np.empty(7, np.int32), np.empty(7, np.int8)
        points = read_only(np.full((5, 2), 0.5))
        done, n_listed, _ = scan_points(
            points, scene.tables, scene.grid, scene.unbounded, counts, bodies, located, budget.flag
        )
    assert (done, n_listed) == (1, 5)


def test_points_are_put_back_in_order() -> None:
    points = read_only(np.random.default_rng(1).uniform(-1, 4, (50, 2)))
    with Budget() as budget:
        grid = scene_of(SOLIDS, None, 2, budget).grid
    order, gathered, ends = np.empty(50, np.int32), np.empty((50, 2)), np.zeros(len(grid.offsets) + 2, np.int64)
    sort_by_cell(points, grid, 0, np.empty(50, np.int32), ends, order, gathered)
    assert (points[order] == gathered).all()
    sorted_counts = order % 3  # so many bodies for each point, named after the point
    sorted_bodies = np.repeat(order, sorted_counts).astype(np.int32)
    sorted_located = np.where(sorted_bodies % 2, 1, UNDECIDED).astype(np.int8)
    n = len(sorted_bodies)
    lists = np.empty(n, np.int64), np.empty(n, np.int8), np.empty(n, np.int64), np.empty(n, np.int64)
    counts, starts = np.zeros(50, np.int64), np.empty(50, np.int64)
    n_open = put_in_order(order, sorted_counts.astype(np.int64), sorted_bodies, sorted_located, counts, starts, lists)
    assert lists[0].tolist() == np.repeat(np.arange(50), np.arange(50) % 3).tolist()
    assert (lists[3][:n_open] % 2 == 0).all()
    assert (lists[1][lists[2][:n_open]] == UNDECIDED).all()


def test_bodies_outside_are_dropped() -> None:
    counts, bodies = np.array([2, 0, 3]), np.array([4, 5, 6, 7, 8])
    located = np.array([-1, 0, 1, -1, 0], np.int8)
    assert drop_outside(counts, bodies, located) == 3
    assert (counts.tolist(), bodies[:3].tolist(), located[:3].tolist()) == ([1, 0, 2], [5, 6, 8], [0, 1, 0])
