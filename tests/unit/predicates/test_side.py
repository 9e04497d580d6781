"""side_of_plane against rational arithmetic, at every exponent."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from engine.predicates.rational import side_rational
from engine.types import UNDECIDED
from tests.unit.predicates.batches import side_of_plane_batch

Array = npt.NDArray[np.float64]


def run(rows: Array, points: Array) -> npt.NDArray[np.int8]:
    """Ask for planes, or for lines as planes along z."""
    if points.shape[1] == 2:
        rows, points = np.insert(rows, 2, 0.0, axis=1), np.insert(points, 2, 0.0, axis=1)
    sides = np.empty(len(points), np.int8)
    with np.errstate(all="ignore"):
        side_of_plane_batch(np.ascontiguousarray(rows), np.ascontiguousarray(points), sides)
    return sides


def exact(rows: Array, points: Array) -> npt.NDArray[np.int8]:
    return np.array([side_rational(row, point) for row, point in zip(rows.tolist(), points.tolist())], np.int8)


def near_planes(dimension: int, n: int, seed: int) -> tuple[Array, Array]:
    """Return rows and points on or within a few ulp of them."""
    draw = np.random.default_rng(seed)
    normals = draw.integers(-9, 10, (n, dimension)) / draw.choice([1.0, 3.0, 7.0, 64.0], (n, 1))
    points = draw.integers(-9, 10, (n, dimension)) / draw.choice([1.0, 3.0, 10.0, 64.0], (n, 1))
    offsets = -(normals * points).sum(axis=1)
    for _ in range(2):
        moved = draw.random(n) < 0.3
        offsets[moved] = np.nextafter(offsets[moved], draw.choice([-np.inf, np.inf]))
    return np.column_stack([normals, offsets]), points


@pytest.mark.parametrize("dimension", [2, 3])
def test_points_near_planes(dimension: int) -> None:
    rows, points = near_planes(dimension, 10_000, 1)
    sides = run(rows, points)
    assert (sides == exact(rows, points)).all()
    assert {-1, 0, 1} == set(sides.tolist())


@pytest.mark.parametrize("dimension", [2, 3])
def test_every_exponent(dimension: int) -> None:
    rows, points = near_planes(dimension, 6_000, 2)
    draw = np.random.default_rng(3)
    by_axis = draw.integers(-1000, 1000, rows.shape)
    rows = np.ldexp(rows, np.where(draw.random(len(rows)) < 0.3, by_axis.T, by_axis[:, :1].T).T)
    points = np.ldexp(points, np.clip(by_axis[:, -1:] - by_axis[:, :-1], -1000, 1000))
    sides = run(rows, points)
    assert (sides == exact(rows, points))[sides != UNDECIDED].all()
    assert (sides != UNDECIDED).mean() > 0.99


def test_random_bit_patterns() -> None:
    draw = np.random.default_rng(4)
    bits = draw.integers(0, 2**64, (6000, 7), dtype=np.uint64).view(np.float64)
    bits = np.where(np.isfinite(bits), bits, 0.0)
    sides = run(bits[:, :4], bits[:, 4:])
    assert (sides == exact(bits[:, :4], bits[:, 4:]))[sides != UNDECIDED].all()


def test_terms_that_underflow_or_overflow() -> None:
    tiny, huge = 5e-324, 1.7976931348623157e308
    cases = [
        ((tiny, -tiny, 0.0), (0.5, 0.5), 0),
        ((tiny, -tiny, 0.0), (0.5, 0.25), 1),
        ((huge, huge, -huge), (huge, -huge), -1),
        ((huge, -huge, tiny), (huge, huge), UNDECIDED),  # the offset is 2^3000 below the terms that cancel
        ((0.0, 1.0, -tiny), (huge, tiny), 0),
    ]
    for row, point, expected in cases:
        assert run(np.array([row]), np.array([point])).tolist() == [expected]
