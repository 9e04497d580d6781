"""orient2d and orient3d against rational arithmetic: near-degenerate grids, every exponent, rotations and swaps."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from engine.predicates.orientation import orient3d_batch
from engine.predicates.rational import orient2d_rational, orient3d_rational
from engine.types import UNDECIDED
from tests.unit.predicates.batches import orient2d_batch, orient2d_filter_batch, orient3d_filter_batch

Array = npt.NDArray[np.float64]
Signs = npt.NDArray[np.int8]


def run(batch: Any, *points: Array) -> Signs:
    """Return the batch kernel's answer for arrays of points, single points repeated as needed."""
    n = max(p.shape[0] if p.ndim == 2 else 1 for p in points)
    full = [np.ascontiguousarray(np.broadcast_to(p, (n, p.shape[-1]))) for p in points]
    sides = np.empty(n, np.int8)
    with np.errstate(all="ignore"):
        batch(*full, sides)
    return sides


def exact(rational: Callable[..., int], *points: Array) -> Signs:
    """Return the rational answer, row by row."""
    return np.array([rational(*(p.tolist() for p in row)) for row in zip(*points)], np.int8)


def grid(corner: float, size: int) -> Array:
    """Return size^2 neighbouring doubles above (corner, corner): the picture of Kettner et al. 2008."""
    step = math.ulp(corner)
    i, j = np.divmod(np.arange(size * size), size)
    return np.stack([corner + i * step, corner + j * step], axis=1)


@pytest.mark.parametrize(
    ("q", "r"),
    [((12.0, 12.0), (24.0, 24.0)), ((8.8, 8.8), (12.1, 12.1)), ((17.300000000000001,) * 2, (24.00000000000005,) * 2)],
)
def test_orient2d_on_a_grid_of_neighbouring_doubles(q: tuple[float, float], r: tuple[float, float]) -> None:
    p = grid(0.5, 64)
    sides = run(orient2d_batch, p, np.array(q), np.array(r))
    assert (sides == [orient2d_rational(row, q, r) for row in p.tolist()]).all()
    assert {-1, 0, 1} <= set(sides.tolist())
    assert (run(orient2d_filter_batch, p, np.array(q), np.array(r)) == UNDECIDED).all()


@pytest.mark.parametrize("scale", [0, 700, -990, 1018, -1020])
def test_orient3d_on_a_grid_of_neighbouring_doubles(scale: int) -> None:
    xy = grid(0.5, 24)
    d = np.ldexp(np.column_stack([xy, np.full(len(xy), xy[12 * 25, 0])]), scale)
    a, b, c = (np.ldexp(np.array(v), scale) for v in ((12.0, 12.0, 12.0), (24.0, 24.0, 24.0), (8.0, 9.0, 8.5)))
    sides = run(orient3d_batch, a, b, c, d)
    assert UNDECIDED not in sides
    assert (sides == [orient3d_rational(a, b, c, row) for row in d]).all()
    assert {-1, 0, 1} <= set(sides.tolist())


def near_degenerate(dimension: int, n: int, seed: int) -> tuple[list[Array], npt.NDArray[np.bool_]]:
    """Return dimension + 1 points per item, nearly or exactly dependent, at random exponents, and where they mix."""
    draw = np.random.default_rng(seed)
    base = [
        draw.integers(-8, 9, (n, dimension)) / draw.choice([1.0, 3.0, 10.0, 1024.0], (n, 1)) for _ in range(dimension)
    ]
    weights = draw.integers(-3, 4, (dimension, n, 1)) / 2.0
    weights[0] = 1.0 - weights[1:].sum(axis=0)
    last = sum(w * p for w, p in zip(weights, base))
    points = [*base, last]
    for p in points:
        moved = (draw.random((n, dimension)) < 0.15) & (p != 0.0)
        p[moved] = np.nextafter(p[moved], draw.choice([-np.inf, np.inf]))
    kind = draw.integers(0, 4, n)
    common = draw.integers(-1060, 1015, (n, 1))
    by_axis = draw.integers(-1060, 1015, (n, dimension))
    shift = np.where(kind[:, None] == 0, 0, np.where(kind[:, None] == 1, common, by_axis))
    points = [np.ldexp(p, shift) for p in points]
    for p in points:  # mixed exponents within one axis
        mixed = (kind == 3) & (draw.random(n) < 0.3)
        p[mixed, draw.integers(dimension)] = np.ldexp(draw.random(mixed.sum()), draw.integers(-1073, 1024, mixed.sum()))
    return points, kind == 3


@pytest.mark.parametrize(
    ("n", "seed"),
    [(8_000, 1), pytest.param(100_000, 2, marks=pytest.mark.full), pytest.param(100_000, 3, marks=pytest.mark.full)],
)
@pytest.mark.parametrize("dimension", [2, 3])
def test_near_degenerate_points_of_every_exponent(dimension: int, n: int, seed: int) -> None:
    points, mixed = near_degenerate(dimension, n, seed)
    batch, filters = (
        (orient2d_batch, orient2d_filter_batch) if dimension == 2 else (orient3d_batch, orient3d_filter_batch)
    )
    sides = run(batch, *points)
    expected = exact(orient2d_rational if dimension == 2 else orient3d_rational, *points)
    decided = sides != UNDECIDED
    assert (sides[decided] == expected[decided]).all()
    assert decided[~mixed].all()
    assert decided.mean() > 0.9
    filtered = run(filters, *points)
    assert (filtered[filtered != UNDECIDED] == expected[filtered != UNDECIDED]).all()
    for order in itertools.permutations(range(dimension + 1)):
        parity = np.linalg.det(np.eye(dimension + 1)[list(order)])
        turned = run(batch, *(points[i] for i in order))
        assert (turned == expected * round(parity))[turned != UNDECIDED].all()
        assert (turned != UNDECIDED)[~mixed].all()


def test_random_bit_patterns() -> None:
    draw = np.random.default_rng(4)
    bits = draw.integers(0, 2**64, (4, 6000, 3), dtype=np.uint64).view(np.float64)
    points = list(np.where(np.isfinite(bits), bits, 0.0))
    flat = [np.ascontiguousarray(p[:, :2]) for p in points[:3]]
    sides, expected = run(orient3d_batch, *points), exact(orient3d_rational, *points)
    assert (sides[sides != UNDECIDED] == expected[sides != UNDECIDED]).all()
    sides, expected = run(orient2d_batch, *flat), exact(orient2d_rational, *flat)
    assert (sides[sides != UNDECIDED] == expected[sides != UNDECIDED]).all()


@pytest.mark.parametrize("exponent", range(-1074, 1024, 31))
def test_a_lattice_is_decided_at_every_scale(exponent: int) -> None:
    draw = np.random.default_rng(5)
    points = [draw.integers(0, 2, (200, 3)).astype(float) for _ in range(4)]
    plain = run(orient3d_batch, *points)
    scaled = run(orient3d_batch, *(np.ldexp(p, exponent) for p in points))
    assert (plain == scaled).all()
    flat = [np.ascontiguousarray(p[:, :2]) for p in points[:3]]
    assert (run(orient2d_batch, *flat) == run(orient2d_batch, *(np.ldexp(p, exponent) for p in flat))).all()


def test_products_that_underflow_or_overflow_never_decide_wrongly() -> None:
    tiny, huge = 5e-324, 1.7976931348623157e308
    cases = [
        [(tiny, 0.0), (0.0, tiny), (0.0, 0.0)],
        [(-huge, -huge), (huge, huge), (0.0, tiny)],
        [(1e-200, 1e-200), (2e-200, 2e-200), (0.0, tiny)],
        [(huge, 1.0), (-huge, -1.0), (0.0, 0.0)],
    ]
    for a, b, c in cases:
        side = int(run(orient2d_batch, np.array(a), np.array(b), np.array(c))[0])
        assert side in (UNDECIDED, orient2d_rational(a, b, c))
    a, b, c, d = (tiny, 0.0, 0.0), (0.0, tiny, 0.0), (0.0, 0.0, huge), (0.0, 0.0, 0.0)
    assert run(orient3d_batch, *map(np.array, (d, a, b, c)))[0] == 1


def test_equal_points_are_coplanar_at_any_exponent() -> None:
    draw = np.random.default_rng(6)
    points = list(draw.random((4, 300, 3)) * 2.0 ** draw.integers(-1060, 1020, (4, 300, 3)))
    for first, second in itertools.combinations(range(4), 2):
        equal = [point.copy() for point in points]
        equal[second] = equal[first]
        assert (run(orient3d_batch, *equal) == 0).all()


FAR_APART = [(-1022, 0, 0), (0, -1022, 3), (900, -600, 10), (-1022, -300, -300), (971, 0, 300), (600, 600, 600)]
FAR_APART += [(-550, -550, -550), (600, -600, 600), (600, 600, -600), (0, 971, 700), (700, 971, 0), (971, 700, 0)]
FAR_APART += [(3, 0, 971), (0, 700, 971), (700, 0, 971), (0, 0, -1022)]


@pytest.mark.parametrize("exponents", FAR_APART)
def test_coordinates_far_apart_on_an_axis_are_decided(exponents: tuple[int, int, int]) -> None:
    """4.0 beside 5e-324: lattice points, some moved by a few steps of a lattice that is finer by far."""
    draw = np.random.default_rng(8)
    coarse, fine = draw.integers(-2, 3, (4, 1500, 3)), draw.integers(-2, 3, (4, 1500, 3))
    steps = np.ldexp(1.0, np.array(exponents) - 52)
    is_fine = draw.integers(0, 4, (4, 1500, 3)) == 0
    points = list(np.where(is_fine, fine * steps, coarse.astype(float)))
    flat = [np.ascontiguousarray(p[:, :2]) for p in points[:3]]
    assert (run(orient3d_batch, *points) == exact(orient3d_rational, *points)).all()
    assert (run(orient2d_batch, *flat) == exact(orient2d_rational, *flat)).all()
