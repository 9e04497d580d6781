"""Polygons gathered into flat arrays, and taken from these again."""

from __future__ import annotations

import numpy as np
import pytest

from engine.polygon_overlay.polygon_arrays import gathered
from engine.solids.polygon import Polygon


@pytest.mark.parametrize("most_rings", [0, 1, 4])
def test_gathered(most_rings: int) -> None:
    random = np.random.default_rng(most_rings)
    rings = [
        [random.random((random.integers(3, 9), 2)) for _ in range(random.integers(most_rings + 1))] for _ in "1234567"
    ]
    polygons = [Polygon(each) for each in rings]
    found = gathered(polygons)
    assert np.diff(found.polygon_offsets).tolist() == list(map(len, rings))
    assert np.diff(found.ring_offsets).tolist() == [len(ring) for each in rings for ring in each]
    assert found.sizes().tolist() == [sum(map(len, each)) for each in rings]
    assert found.most() == (max(found.sizes()), max(map(len, rings)))
    numbers = random.permutation(7)[:4]
    some = found.taken(numbers)
    for k, number in enumerate(numbers.tolist()):
        one, other = some.polygon(k), polygons[number]
        assert (one.vertices.tolist(), one.ring_offsets.tolist()) == (
            other.vertices.tolist(),
            other.ring_offsets.tolist(),
        )
