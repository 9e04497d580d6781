"""The overlay benchmark's pairs are seeded and of the size they say. Nothing here is timed."""

from __future__ import annotations

import numpy as np
import pytest

import engine
from benchmarks import polygon_pairs


@pytest.mark.parametrize("family", ["smooth", "spiky", "comb", "dense comb", "soup"])
def test_large_pairs_are_seeded(family: str) -> None:
    first, again, other = (polygon_pairs.large(family, 100, seed) for seed in (0, 0, 1))
    for ours, same, rest in zip(first, again, other, strict=True):
        assert abs(sum(map(len, ours)) - 100) <= 2
        assert np.array_equal(np.concatenate(ours), np.concatenate(same))
        assert not np.array_equal(np.concatenate(ours), np.concatenate(rest))
    assert engine.overlay(*map(engine.Polygon, first)).n_pieces > 0


@pytest.mark.parametrize("family", ["star", "convex", "lattice"])
def test_small_pairs_mostly_meet(family: str) -> None:
    sides = zip(*polygon_pairs.small(family, 10, 50, 0))
    batch = engine.overlay_batch(*([engine.Polygon(rings) for rings in side] for side in sides))
    assert np.count_nonzero(np.diff(batch.pair_offsets)) > 30
