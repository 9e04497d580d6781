"""The workloads are seeded, and meshes stay closed. Nothing here is timed."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import workloads


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
