"""Corners of intersections of half-spaces against trying every set of planes."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest

import engine.bounding.double_description as double_description
from engine.bounding.double_description import corners_of_half_spaces
from engine.errors import DeadlineExceededError, TooComplexError
from engine.running.budget import Budget

CUBE = [[1, 0, 0, 1], [-1, 0, 0, 1], [0, 1, 0, 1], [0, -1, 0, 1], [0, 0, 1, 1], [0, 0, -1, 1]]


def cross_with_sign(rows: list[list[Fraction]]) -> list[Fraction]:
    """Return the vector orthogonal to n - 1 rows of n numbers (zero if they are dependent)."""
    n = len(rows) + 1

    def determinant(matrix: list[list[Fraction]]) -> Fraction:
        total = Fraction(0 if matrix else 1)
        for j in range(len(matrix)):
            total += (-1) ** j * matrix[0][j] * determinant([row[:j] + row[j + 1 :] for row in matrix[1:]])
        return total

    return [(-1) ** j * determinant([row[:j] + row[j + 1 :] for row in rows]) for j in range(n)]


def by_trying_all(planes: list[list[float]]) -> tuple[set[tuple[Fraction, ...]], bool]:
    """Return the corners and whether a direction leads out for ever, for planes whose normals span all of space."""
    rows = [[Fraction(x) for x in row] for row in planes]
    size = len(rows[0])
    rows.append([Fraction(0)] * (size - 1) + [Fraction(1)])
    corners, has_ray = set(), False
    for chosen in itertools.combinations(rows, size - 1):
        vector = cross_with_sign(list(chosen))
        for sign in (1, -1):
            candidate = [sign * x for x in vector]
            if any(candidate) and all(sum(a * b for a, b in zip(row, candidate)) >= 0 for row in rows):
                if candidate[-1] > 0:
                    corners.add(tuple(x / candidate[-1] for x in candidate[:-1]))
                else:
                    has_ray = True
    return corners, has_ray


def test_cube() -> None:
    corners = corners_of_half_spaces(CUBE)
    assert set(corners.points) == set(itertools.product([-1, 1], repeat=3))
    assert corners.is_bounded
    assert not corners.is_empty


@pytest.mark.parametrize("seed", range(40))
def test_agrees_with_trying_all_sets(seed: int) -> None:
    rng = np.random.default_rng(seed)
    dimension, n = 2 + seed % 2, int(rng.integers(4, 10))
    planes = rng.integers(-3, 4, (n, dimension + 1)).astype(float)
    planes = planes[planes[:, :-1].any(axis=1)]
    if np.linalg.matrix_rank(planes[:, :-1]) < dimension:
        pytest.skip("a whole line may be inside: the simple way has no answer")
    if seed % 5 == 0:
        planes = np.ldexp(planes, 1000)
    corners = corners_of_half_spaces(planes.tolist())
    expected, has_ray = by_trying_all(planes.tolist())
    assert set(corners.points) == expected
    assert len(corners.points) == len(expected)
    assert corners.is_empty == (not expected)
    assert corners.is_empty or corners.is_bounded == (not has_ray)


def test_redundant_rows_and_many_planes_through_one_corner() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    cone = [[-np.cos(a), -np.sin(a), -1.0, 1.0] for a in angles] + [[0.0, 0.0, 1.0, 0.0]]
    corners = corners_of_half_spaces([*cone, *cone, [0.0, 0.0, -1.0, 1.0], [0.0, 0.0, -1.0, 9.0]])
    assert (0, 0, 1) in corners.points
    assert len(corners.points) == 25
    assert len(set(corners.points)) == 25


def test_lines_rays_and_emptiness() -> None:
    half = corners_of_half_spaces([[1.0, 0.0, 0.0, -2.0]])
    assert (half.points, half.is_empty, half.is_bounded) == ([], False, False)
    wedge = corners_of_half_spaces([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    assert (wedge.points, wedge.is_bounded) == ([(0, 0)], False)
    empty = corners_of_half_spaces([[1.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    assert (empty.points, empty.is_empty, empty.is_bounded) == ([], True, True)
    slab_point = corners_of_half_spaces([[1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    assert slab_point.points == [(1, 0)]


def test_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(double_description, "MAX_RAYS", 5)
    with pytest.raises(TooComplexError):
        corners_of_half_spaces(CUBE)
    with Budget(deadline=0.0) as budget, pytest.raises(DeadlineExceededError):
        corners_of_half_spaces(CUBE, budget)
