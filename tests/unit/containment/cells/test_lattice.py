"""The lattice: a triangle is only kept out of cells that it does not reach into."""

from __future__ import annotations

import numpy as np

from engine.containment.cells.lattice import misses_cell


def test_cells_are_only_missed_where_no_point_is() -> None:
    random = np.random.default_rng(7)
    n_missed = 0
    for _ in range(2000):
        a, b, c = random.uniform(-2, 2, (3, 3)) * random.choice([1.0, 5.0])
        missed = misses_cell(tuple(b - a), tuple(c - a), tuple(-a))
        n_missed += missed
        weights = random.dirichlet([0.5, 0.5, 0.5], 200)
        points = weights @ np.array([a, b, c])
        assert not (missed and (np.abs(points) <= 0.5).all(axis=1).any())
    assert n_missed > 500
