"""Polygons as flat arrays."""

from __future__ import annotations

import numpy as np

from engine import Polygon
from engine.polygon_overlay.pair_arrays import polygon_arrays_of
from engine.types import read_only


def _polygons() -> list[Polygon]:
    rng = np.random.default_rng(3)
    apart = [Polygon([rng.random((rng.integers(3, 9), 2)) for _ in range(k % 4)]) for k in range(40)]
    flat = read_only(rng.random((30, 2)))
    return [*apart, *(Polygon.of_arrays(flat[k : k + 6], read_only(np.array([0, 3, 6]))) for k in range(20))]


def test_arrays_of_polygons_are_their_fields() -> None:
    polygons = _polygons()
    for first, last in ((0, None), (0, 1), (7, 9), (38, 60), (39, 100)):
        made, some = polygon_arrays_of(polygons, first, last), polygons[first:last]
        assert len(made.polygon_offsets) == len(some) + 1
        assert not any(array.flags.writeable for array in made)
        for k, each in enumerate(some):
            assert made.polygon(k) == each
        assert made.ring_offsets[-1] == len(made.vertices) == sum(len(each.vertices) for each in some)
