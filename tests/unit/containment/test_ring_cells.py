"""Cells of a polygon: their sure answers equal the exact ray's; when they are built."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Polygon, locate
from engine.containment.build_ring_cells import build_ring_cells
from engine.containment.ring_cells import locate_by_ring_cells
from engine.parallel import Budget
from engine.types import UNDECIDED


def assert_certified(points: Any, solid: Polygon, most_open: float = 1.0) -> None:
    points = np.ascontiguousarray(points)
    found = np.empty(len(points), np.int8)
    with Budget() as budget:
        cells = build_ring_cells(solid, budget)
    with np.errstate(all="ignore"):
        n_open = locate_by_ring_cells(points, cells, found, np.zeros(1, np.uint8))
    expected = locate(
        points, Polygon([solid.vertices[i:j] for i, j in zip(solid.ring_offsets, solid.ring_offsets[1:])])
    )
    sure = found != UNDECIDED
    assert n_open == (~sure).sum()
    assert (found[sure] == expected[sure]).all()
    assert (~sure).mean() <= most_open


def star(n: int, seed: int) -> Any:
    random = np.random.default_rng(seed)
    angles = np.sort(random.uniform(0, 2 * np.pi, n))
    radii = 1 + 0.3 * np.sin(7 * angles) + 0.02 * random.normal(size=n)
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


@pytest.mark.parametrize("n", [3, 10, 300])
def test_stars(n: int) -> None:
    vertices = star(n, n)
    random = np.random.default_rng(1)
    assert_certified(random.uniform(-1.5, 1.5, (3000, 2)), Polygon([vertices]), 1e-3)
    index = random.integers(0, n, 3000)
    weights = random.uniform(size=(3000, 1))
    on_edges = vertices[index] * weights + vertices[(index + 1) % n] * (1 - weights)
    for spread in (0.0, 1e-16, 1e-9, 1e-3):
        assert_certified(on_edges + random.normal(size=(3000, 2)) * spread, Polygon([vertices]))
    assert_certified(vertices, Polygon([vertices, vertices[::2]] if n > 6 else [vertices]))


@pytest.mark.parametrize("scale", [1.0, 2.0**400, 2.0**-900, 1e-310])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_lattice_rings_that_cross_themselves(scale: float, offset: float) -> None:
    random = np.random.default_rng(2)
    rings = [(random.integers(0, 6, (7, 2)) + offset) * scale for _ in range(3)]
    grid = np.stack(np.meshgrid(np.arange(-0.5, 6.5, 0.25), np.arange(-0.5, 6.5, 0.25)), axis=-1).reshape(-1, 2)
    assert_certified((grid + offset) * scale, Polygon(rings))


def test_flat_and_thin_rings() -> None:
    line = Polygon([[[0, 1], [4, 1], [2, 1]]])
    assert_certified([[1, 1], [3, 1], [5, 1], [1, 1.5]], line)
    thin = Polygon([[[0, 0], [1, 1e-12], [2, 0], [1, -1e-12]]])
    assert_certified(np.random.default_rng(3).uniform([0, -1e-12], [2, 1e-12], (2000, 2)), thin)


def test_cells_are_built_when_they_pay() -> None:
    solid = Polygon([star(50, 4)])
    points = np.random.default_rng(5).uniform(-1.5, 1.5, (3000, 2))
    first, accuracy = locate(points, solid, report=True)
    assert accuracy.method == "ring_crossing"
    again, accuracy = locate(points, solid, report=True)
    assert accuracy.method == "ring_cells"
    assert (first == again).all()
