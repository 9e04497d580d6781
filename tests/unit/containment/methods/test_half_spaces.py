"""Rows of half-spaces, and balls."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from engine import Convex, Sphere, Triangle, locate


def exact(points: Any, rows: Any) -> list[int]:
    """Return the least sign of all rows at each point."""
    found = []
    for point in points.tolist():
        values = [sum(Fraction(c) * Fraction(x) for c, x in zip(row, [*point, 1.0], strict=True)) for row in rows]
        found.append(min((v > 0) - (v < 0) for v in values))
    return found


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("scales", [(1.0, 1.0), (1.0, 1e12), (2.0**-1000, 1.0), (1.0, 1e304), (5e-324, 1e-300)])
def test_lattice_points_on_many_rows(dimension: int, scales: tuple[float, float]) -> None:
    random = np.random.default_rng(dimension)
    rows = random.integers(-3, 4, (6, dimension + 1)).astype(np.float64)
    rows[:, 0] += (rows[:, :-1] == 0).all(axis=1)
    rows[:, -1] += 4.0
    rows[::2] *= scales[0]
    rows[1::2] *= scales[1]
    points = random.integers(-2, 3, (600, dimension)).astype(np.float64)
    points[300] = 1e200  # spoils the bound of its block only
    points[301] = 1e-320
    points[599] = -1e308
    found = locate(points, Convex(rows))
    assert found.tolist() == exact(points, rows.tolist())
    assert {-1, 1} <= set(found.tolist())
    alone = np.concatenate([locate(points[item : item + 1], Convex(rows)) for item in range(290, 310)])
    assert np.array_equal(alone, found[290:310])


@pytest.mark.some(1)
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("n_rows", [1, 5, 31, 41, 90])
def test_points_that_leave_their_block_early(dimension: int, n_rows: int) -> None:
    random = np.random.default_rng(n_rows)
    rows = np.column_stack([random.integers(-9, 10, (n_rows, dimension)), np.full(n_rows, 20)]).astype(np.float64)
    rows[:, 0] += (rows[:, :-1] == 0).all(axis=1)
    rows[n_rows // 2] *= 1e9
    for n_points in (3, 256, 300):
        points = random.integers(-3, 4, (n_points, dimension)).astype(np.float64)
        assert locate(points, Convex(rows)).tolist() == exact(points, rows.tolist())
        points[-1] = 1e307
        assert locate(points, Convex(rows)).tolist() == exact(points, rows.tolist())


@pytest.mark.parametrize("turn", [0, 1, 2])
def test_a_wall_that_no_double_holds_leaves_the_point_open_wherever_it_stands_among_the_walls(turn: int) -> None:
    corners = np.array([[0.0, 0.0, 0.0], [5e-323, 0.0, 0.0], [0.0, 5e-323, 0.0]])  # its slanted wall is a row of NaN
    points = np.array([[1e-152, 1e-152, 1.0], [1e-323, 1e-323, -1.0], [2.5e-323, 2.5e-323, 0.0], [-5e-324, 0.0, 0.0]])
    found = locate(points, Triangle(np.roll(corners, turn, axis=0)))
    assert found.tolist() == [-1, 1, 0, -1]


# --- Spheres: exact one ulp beside the surface ---


def test_sphere_one_ulp_off() -> None:
    near = [[3.0, 4.0, 0.0], [3.0, np.nextafter(4.0, 9.0), 0.0], [3.0, np.nextafter(4.0, 0.0), 0.0], [0.0, 0.0, -5.0]]
    found, accuracy = locate(near, Sphere([0, 0, 0], 5), report=True)
    assert found.tolist() == [0, -1, 1, 0]
    assert accuracy.n_rational == 0
    assert accuracy.method == "squared_distance"


def test_sphere_of_radius_zero_is_its_centre() -> None:
    assert locate([[1, 1], [np.nextafter(1.0, 2.0), 1]], Sphere([1, 1], 0)).tolist() == [0, -1]
