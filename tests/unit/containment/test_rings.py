"""Rings, slabs and cells of a polygon equal rational arithmetic, for every kind of outline; when they are built."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from engine import Polygon, Triangle, locate
from engine.containment.methods.filters import NOT_FINITE
from engine.containment.methods.polygon_ray_parity import MIXED, locate_in_rings
from engine.containment.methods.rational_locate import no_check, rational_location
from engine.containment.prepared import closed_rings, edges_of, ring_cells_of, rings_of
from engine.solids.checks import as_points
from engine.types import UNDECIDED, read_only

FLAG = np.zeros(1, np.uint8)


def assert_certified(points: Any, solid: Polygon, most_beyond: float = 1.0, is_small: bool = False) -> None:
    """Compare with rational arithmetic where it is small, else cells and slabs with all edges."""
    points = as_points(points, 2)
    found, expected = np.empty((4, len(points)), np.int8), np.empty(len(points), np.int8)
    cells, slabs, edges = ring_cells_of(solid, FLAG), rings_of(solid), edges_of(solid)
    with np.errstate(all="ignore"):
        n_beyond = [
            locate_in_rings(points, np.zeros(0), rings, found[k], FLAG) for k, rings in enumerate((cells, slabs, edges))
        ]
        locate_in_rings(points, np.full(len(points), 2.0**-30), slabs, found[3], FLAG)
    if is_small:
        expected[:] = [rational_location(point, solid, None, no_check) for point in points.tolist()]
    else:
        expected = found[2]
    for each in found[:3]:
        sure = each != UNDECIDED
        assert (each[sure] == expected[sure]).all()
    blurred = found[3] != UNDECIDED
    assert (found[3][blurred] == expected[blurred]).all()
    assert n_beyond[0] <= n_beyond[1] <= most_beyond * len(points)


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


def test_rays_meet_few_edges_of_a_comb_whichever_way_it_lies() -> None:
    upright = comb(400, None)
    for vertices, columns in ((upright, (1, 0)), (upright[:, ::-1], (0, 1)), (upright * [1.0, 1e-300], (1, 0))):
        rings = rings_of(Polygon([vertices]))
        assert rings.columns == columns
        lengths = np.diff(rings.runs, axis=1).ravel()
        assert np.add.reduceat(lengths, rings.offsets[:-1]).max() <= 20


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


@pytest.mark.parametrize("seed", range(4))
def test_cells_are_marked_wherever_an_edge_passes(seed: int) -> None:
    random = np.random.default_rng(seed)
    solid = Polygon([[[0, 0], [8, 0], [8, 8], [0, 8]], random.uniform(0, 8, (5, 2))])
    rings = ring_cells_of(solid, FLAG)
    (n_u, n_v), scales = (rings.u.n_cells, rings.v.n_cells), (rings.u.cells_per_unit / 2, rings.v.cells_per_unit / 2)
    statuses = rings.statuses.reshape(n_v, n_u)
    assert 0.4 < (statuses != MIXED).mean() < 0.95
    starts = solid.vertices
    for ring in (starts[:4], starts[4:]):
        for start, end in zip(ring, np.roll(ring, -1, axis=0)):
            for share in np.linspace(0.0, 1.0, 333):
                column, row = ((start + (end - start) * share) * scales).astype(int)
                assert statuses[min(row, n_v - 1), min(column, n_u - 1)] == MIXED
    points = random.uniform(0.01, 7.99, (400, 2))
    for point, (column, row) in zip(points, (points * scales).astype(int)):
        if statuses[row, column] != MIXED:
            assert statuses[row, column] == rational_location(point.tolist(), solid)


def test_many_edges_through_one_point_fill_no_memory() -> None:
    random = np.random.default_rng(4)
    ends = rough(3000, random)
    bundle = Polygon([np.insert(ends, np.arange(0, 3000, 2), [0.0, 0.0], axis=0)])
    assert ring_cells_of(bundle, FLAG).runs.nbytes < 64 * len(bundle.vertices) + 10_000
    assert_certified(random.normal(size=(300, 2)) * 1e-9, bundle)
    same = Polygon([np.tile(rough(5, random), (400, 1))])
    assert ring_cells_of(same, FLAG).runs.nbytes < 64 * len(same.vertices) + 10_000
    assert_certified(random.uniform(-1, 1, (300, 2)), same)


def test_cells_are_built_when_they_pay() -> None:
    solid = Polygon([rough(50, np.random.default_rng(4))])
    points = np.random.default_rng(5).uniform(-1.5, 1.5, (2000, 2))
    first, accuracy = locate(points, solid, report=True)
    assert accuracy.method == "ring_crossing"
    again, accuracy = locate(points, solid, report=True)
    assert accuracy.method == "ring_cells"
    assert (first == again).all()
    far = Polygon([read_only(solid.vertices * 1e300)])
    for _ in range(2):
        found, accuracy = locate(points * 1e300, far, report=True)
    assert accuracy.method == "ring_cells"
    assert (first == found).all()


@pytest.mark.parametrize("seed", range(5))
def test_rings_that_cross_themselves(seed: int) -> None:
    random = np.random.default_rng(seed)
    solid = Polygon([random.integers(0, 6, (n, 2)) for n in (9, 4)])
    xs, ys, runs, _ = closed_rings(solid.vertices, solid.ring_offsets)
    for (first, last), begin in zip(runs.tolist(), solid.ring_offsets):
        ring = np.stack([xs[first : last + 1], ys[first : last + 1]], axis=1)
        assert ring[0].tolist() == ring[-1].tolist() == solid.vertices[begin].tolist()
    assert_certified(random.integers(-1, 13, (300, 2)) / 2.0, solid, is_small=True)
    large = Polygon([random.integers(0, 6, (n, 2)) for n in (300, 4)])
    assert_certified(random.integers(-1, 13, (200, 2)) / 2.0, large, is_small=True)


def test_no_more_is_told_of_a_point_that_is_no_number() -> None:
    rings, found = edges_of(Polygon([[[0, 0], [4, 0], [1, 1], [0, 4]]])), np.empty(1, np.int8)
    assert locate_in_rings(read_only(np.array([[0.0, np.inf]])), np.zeros(0), rings, found, FLAG) == NOT_FINITE
    with np.errstate(invalid="ignore"):
        locate_in_rings(read_only(np.full((1, 2), np.nan)), np.full(1, np.inf), rings, found, FLAG)
    assert found[0] == UNDECIDED


def test_plane_triangle_without_area_is_its_segment() -> None:
    flat = Triangle([[0, 0], [2, 2], [1, 1]])
    assert locate([[0.5, 0.5], [2, 2], [3, 3], [1, 1.5]], flat).tolist() == [0, 0, -1, -1]


def test_lattice_points_equal_integers() -> None:
    random = np.random.default_rng(0)
    for _ in range(50):
        corners = random.integers(-3, 4, (3, 2))
        points = random.integers(-4, 5, (100, 2))
        expected = []
        for q in points:
            sides = [
                int(np.linalg.det(np.stack([b - a, q - a])).round()) for a, b in zip(corners, np.roll(corners, -1, 0))
            ]
            is_boxed = (q >= corners.min(axis=0)).all() and (q <= corners.max(axis=0)).all()
            has_both_signs = min(sides) < 0 < max(sides)
            expected.append(-1 if has_both_signs or not is_boxed else 0 if 0 in sides else 1)
        assert locate(points, Triangle(corners)).tolist() == expected
