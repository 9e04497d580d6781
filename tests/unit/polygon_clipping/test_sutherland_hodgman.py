"""The kernel, whichever of its arithmetics settles a polygon, against exact integers."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from engine.polygon_clipping.clip_polygons import ClippedPolygons, clip_polygons
from tests.unit.polygon_clipping.test_clip_polygons import regions_of, rings_of


def test_kernel_and_exact_integers_agree(monkeypatch: pytest.MonkeyPatch, pytestconfig: pytest.Config) -> None:
    """What the kernel settles is what exact integers settle, bit by bit, bridges included."""
    n = 3000 if pytestconfig.getoption("--full") else 60
    for dimension in (2, 3):
        rng = np.random.default_rng(dimension)
        polygons = [
            [ring[j : j + 4] for j in range(0, len(ring), 4)]
            for ring in itertools.chain(*rings_of(rng, n, dimension).values())
        ]
        for region in regions_of(rng, dimension):
            both = [clip_polygons(polygons, region)]
            with monkeypatch.context() as patch:
                patch.setattr("engine.polygon_clipping.clip_polygons.kernel_scene", lambda *_: None)
                both.append(clip_polygons(polygons, region))
            for name in ClippedPolygons.__slots__:
                np.testing.assert_array_equal(getattr(both[0], name), getattr(both[1], name), err_msg=str(region))
