"""Cells of a polygon: their sure answers equal rational arithmetic, for every kind of outline; when they are built."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from engine import Polygon
from engine.budget import Budget
from engine.containment.methods.polygon_ray_parity import locate_in_rings
from engine.containment.prepared import rings_of
from engine.containment.rational_locate import no_check, rational_location
from engine.containment.ring_cells.build import build_ring_cells
from engine.containment.ring_cells.locate import RingCells, locate_by_ring_cells
from engine.solids.checks import as_points
from engine.types import UNDECIDED


def cells_of(solid: Polygon) -> RingCells:
    with Budget() as budget:
        return build_ring_cells(solid, budget)


def assert_certified(points: Any, solid: Polygon, most_open: float = 1.0, is_small: bool = False) -> None:
    """Compare with rational arithmetic where it is small, else with the exact ray."""
    points = as_points(points, 2)
    found, expected = np.empty(len(points), np.int8), np.empty(len(points), np.int8)
    flag = np.zeros(1, np.uint8)
    with np.errstate(all="ignore"):
        n_open = locate_by_ring_cells(points, cells_of(solid), found, flag)
        if is_small:
            expected[:] = [rational_location(point, solid, None, no_check) for point in points.tolist()]
        else:
            locate_in_rings(points, np.zeros(len(points)), *rings_of(solid), expected, flag)
    sure = found != UNDECIDED
    assert n_open == (~sure).sum()
    assert (found[sure] == expected[sure]).all()
    assert (expected[sure] != 0).all()
    assert (~sure).mean() <= most_open


def smooth(n: int, random: Any) -> Any:
    angles = np.sort(random.uniform(0, 2 * np.pi, n))
    radii = 1 + 0.3 * np.sin(7 * angles)
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


def rough(n: int, random: Any) -> Any:
    return smooth(n, random) * (1 + 0.02 * random.normal(size=(n, 1)))


def spiky(n: int, random: Any) -> Any:
    return smooth(n, random) * np.where(np.arange(n) % 2, 0.01, 1.0)[:, None]


def comb(n: int, random: Any) -> Any:
    x = np.repeat(np.arange(n // 2), 2)
    y = np.tile([0.0, 1.0, 1.0, 0.0], n // 4 + 1)[: len(x)]
    return np.concatenate([np.stack([x, y], axis=1), [[x[-1], -1.0], [0.0, -1.0]]])


def fractal(n: int, random: Any) -> Any:
    ring = smooth(4, random)
    while len(ring) < n:
        middle = 0.5 * (ring + np.roll(ring, -1, axis=0)) + 0.2 * (np.roll(ring, -1, axis=0) - ring)[:, ::-1]
        ring = np.stack([ring, middle], axis=1).reshape(-1, 2)
    return ring


def tangled(n: int, random: Any) -> Any:
    return random.uniform(-1, 1, (n, 2))


def clustered(n: int, random: Any) -> Any:
    return np.concatenate([smooth(n, random) * 1e-7, [[1.0, 1.0]]])


OUTLINES = [smooth, rough, spiky, comb, fractal, tangled, clustered]


@pytest.mark.parametrize("outline", OUTLINES)
@pytest.mark.parametrize("n", [5, 60, 2000])
def test_outlines(outline: Callable[[int, Any], Any], n: int) -> None:
    random = np.random.default_rng(n)
    vertices = outline(n, random)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    solid = Polygon([vertices, vertices[::3]] if outline is rough and n > 9 else [vertices])
    n_points = 300 if n > 100 else 60
    assert_certified(random.uniform(low, high, (n_points, 2)), solid, 0.05, is_small=n <= 60)
    index = random.integers(0, len(vertices), n_points)
    weights = random.uniform(size=(n_points, 1))
    on_edges = vertices[index] * weights + vertices[(index + 1) % len(vertices)] * (1 - weights)
    for spread in (0.0, 1e-16, 1e-12, 1e-3):
        assert_certified(on_edges + random.normal(size=(n_points, 2)) * spread, solid, is_small=n <= 60)
    near = vertices[index]
    for _ in range(4):
        assert_certified(near, solid, is_small=n <= 60)
        near = np.nextafter(near, random.choice([-np.inf, np.inf], near.shape))


@pytest.mark.parametrize("scale", [1.0, 2.0**400, 2.0**-900, 1e-310])
@pytest.mark.parametrize("offset", [0.0, 1e6, 1e9])
def test_lattice_rings_that_cross_themselves(scale: float, offset: float) -> None:
    random = np.random.default_rng(2)
    rings = [(random.integers(0, 6, (7, 2)) + offset) * scale for _ in range(3)]
    rings.append(np.concatenate([rings[0][:3], rings[0][2:], rings[1][:1]]))  # repeated points and whole edges
    grid = np.stack(np.meshgrid(np.arange(-0.5, 6.5, 0.25), np.arange(-0.5, 6.5, 0.25)), axis=-1).reshape(-1, 2)
    assert_certified((grid + offset) * scale, Polygon(rings), is_small=True)


def test_unequal_axes() -> None:
    random = np.random.default_rng(7)
    points = random.integers(-1, 9, (300, 2)) / 2
    for scales in ((1e-320, 1.0), (1e140, 5e-324), (1e-300, 1e140), (1.0, 1e-308)):
        rings = [random.integers(0, 4, (12, 2)) * scales]
        assert_certified(points * scales, Polygon(rings), is_small=True)
        assert_certified(random.uniform(0, 4, (300, 2)) * scales, Polygon(rings), is_small=True)


def test_flat_and_thin_rings() -> None:
    line = Polygon([[[0, 1], [4, 1], [2, 1]]])
    assert_certified([[1, 1], [3, 1], [5, 1], [1, 1.5]], line, is_small=True)
    post = Polygon([[[1, 0], [1, 4], [1, 2]]])
    assert_certified([[1, 1], [1, 3], [1, 5], [1.5, 1]], post, is_small=True)
    spot = Polygon([[[1, 1]] * 4])
    assert_certified([[1, 1], [1, 3], [2, 1]], spot, is_small=True)
    thin = Polygon([[[0, 0], [1, 1e-12], [2, 0], [1, -1e-12]]])
    assert_certified(np.random.default_rng(3).uniform([0, -1e-12], [2, 1e-12], (200, 2)), thin, is_small=True)


@pytest.mark.full
@pytest.mark.parametrize("seed", range(300))
def test_random_small_rings(seed: int) -> None:
    random = np.random.default_rng([seed, 1])
    n, kind = int(random.integers(3, 40)), seed % 3
    if kind == 0:
        rings = [random.integers(0, 7, (n, 2)).astype(np.float64) for _ in range(int(random.integers(1, 4)))]
        points = random.integers(-1, 15, (400, 2)) / 2
    else:
        rings = [OUTLINES[seed % len(OUTLINES)](n, random) for _ in range(kind)]
        index = random.integers(0, len(rings[0]), 400)
        weights = np.round(random.uniform(size=(400, 1)), int(random.integers(0, 17)))
        points = rings[0][index] * weights + np.roll(rings[0], -1, axis=0)[index] * (1 - weights)
        points += random.normal(size=points.shape) * random.choice([0.0, 1e-16, 1e-14, 1e-4, 0.3], (400, 1))
    move = random.choice([0.0, 1.0, 1e9], 2)
    scale = random.choice([1.0, 3.0**-40, 2.0**-1000, 2.0**450], 2)
    assert_certified((points + move) * scale, Polygon([(ring + move) * scale for ring in rings]), is_small=True)
