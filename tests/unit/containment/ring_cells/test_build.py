"""When cells of a polygon are built, and how much memory they may take."""

from __future__ import annotations

import numpy as np

from engine import Polygon, locate
from engine.arrays import read_only
from tests.unit.containment.ring_cells.test_locate import assert_certified, cells_of, rough


def test_many_edges_through_one_point_fill_no_memory() -> None:
    random = np.random.default_rng(4)
    ends = rough(3000, random)
    bundle = Polygon([np.insert(ends, np.arange(0, 3000, 2), [0.0, 0.0], axis=0)])
    cells = cells_of(bundle)
    assert len(cells.items) < 64 * len(bundle.vertices) + 10_000
    assert_certified(random.normal(size=(300, 2)) * 1e-9, bundle)
    same = Polygon([np.tile(rough(5, random), (400, 1))])
    assert len(cells_of(same).items) < 64 * len(same.vertices) + 10_000
    assert_certified(random.uniform(-1, 1, (300, 2)), same)


def test_cells_are_built_when_they_pay() -> None:
    solid = Polygon([rough(50, np.random.default_rng(4))])
    points = np.random.default_rng(5).uniform(-1.5, 1.5, (3000, 2))
    first, accuracy = locate(points, solid, report=True)
    assert accuracy.method == "ring_crossing"
    again, accuracy = locate(points, solid, report=True)
    assert accuracy.method == "ring_cells"
    assert (first == again).all()
    far = Polygon([read_only(solid.vertices * 1e300)])
    for _ in range(2):
        found, accuracy = locate(points * 1e300, far, report=True)
        assert accuracy.method == "ring_crossing"
    assert (first == found).all()
