"""Inputs of the benchmarks."""

from __future__ import annotations

import numpy as np
import pytest

import engine
from benchmarks import polygon_pairs, workloads


@pytest.mark.parametrize("kind", ["random", "corner", "edge", "ulp"])
def test_segments_are_seeded(kind: str) -> None:
    first, second, other = (workloads.segments_of(kind, 3, 40, seed) for seed in (0, 0, 1))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)


def test_rings_are_seeded() -> None:
    first, second, other = (workloads.star_rings(5, 3, 40, seed) for seed in (0, 0, 1))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)


def test_meshes_are_seeded() -> None:
    first, second = (workloads.bumpy_sphere("bumpy", 5, 2) for _ in range(2))
    assert np.array_equal(first.vertices, second.vertices)
    points = [workloads.points_near(first, 50, seed) for seed in (0, 0, 1)]
    assert np.array_equal(points[0], points[1])
    assert not np.array_equal(points[0], points[2])


def test_subdivided_meshes_stay_closed() -> None:
    mesh = workloads.bumpy_sphere("bumpy", 0, 2)
    assert len(mesh.faces) == 320
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    keys = {tuple(edge) for edge in edges.tolist()}
    assert len(keys) == len(edges)
    assert all((b, a) in keys for a, b in keys)


# --- The overlay benchmark's pairs are seeded and of the size they say. Nothing here is timed ---


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
