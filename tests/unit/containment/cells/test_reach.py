"""Cells that a triangle may reach into: none is left out that meets it, by exact separating axes; few are listed."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import numpy as np
import pytest

from engine.containment.cells.lattice import cells_reached, rows_reached, walls_of

N = 6


def _reached(corners: np.ndarray) -> set[tuple[int, int, int]]:
    """Return the cells of N x N x N from (0, 0, 0) on that may be reached."""
    a, b, c = corners
    walls, (x, y, z) = walls_of(tuple(b - a), tuple(c - a)), 0.5 - a
    found = set()
    for k in range(N):
        first, last = rows_reached(walls, z + k, y, 0, N - 1)
        for j in range(first, last + 1):
            left, right = cells_reached(walls, z + k, y + j, x, 0, N - 1)
            found |= {(i, j, k) for i in range(left, right + 1)}
    return found


def _cross(u: list[Fraction], v: list[Fraction]) -> list[Fraction]:
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def _meets(corners: np.ndarray, cell: tuple[int, int, int]) -> bool:
    """Tell whether a triangle meets a closed cell, by all separating axes."""
    triangle = [[Fraction(x) for x in corner] for corner in corners.tolist()]
    edges = [[q - p for p, q in zip(triangle[k], triangle[(k + 1) % 3])] for k in range(3)]
    units = [[Fraction(int(i == k)) for i in range(3)] for k in range(3)]
    axes = [*units, _cross(edges[0], edges[1]), *(_cross(unit, edge) for unit in units for edge in edges)]
    box = [[Fraction(c + d) for c, d in zip(cell, corner)] for corner in product((0, 1), repeat=3)]
    for axis in axes:
        ours = [sum(x * y for x, y in zip(axis, p)) for p in triangle]
        its = [sum(x * y for x, y in zip(axis, p)) for p in box]
        if max(ours) < min(its) or min(ours) > max(its):
            return False
    return True


def _triangles() -> list[np.ndarray]:
    random = np.random.default_rng(7)
    made = [random.uniform(-2, N + 2, (3, 3)) for _ in range(12)]
    made += [random.integers(0, N + 1, (3, 3)).astype(float) for _ in range(12)]  # on the walls of cells
    for thin in (1e-3, 1e-9, 2.0**-50):
        ends = random.uniform(0, N, (2, 3))
        made.append(np.array([ends[0], ends[1], ends[1] + thin * random.normal(size=3)]))
    made.append(np.array([[1, 1, 1], [5, 1, 1], [1, 1, 5.0]]))  # in a plane of the lattice
    made.append(np.array([[1, 1, 1], [3, 3, 3], [5, 5, 5.0]]))  # a segment
    made.append(np.array([[2.0, 3.0, 4.0]] * 3))  # a point in a corner
    made += [corners * 2.0**28 - 2.0**27 for corners in made[:3]]  # as deep levels see large faces
    return made


@pytest.mark.some(12)
@pytest.mark.parametrize("corners", _triangles())
def test_no_cell_that_meets_the_triangle_is_left_out(corners: np.ndarray) -> None:
    low, high = np.floor(corners.min(axis=0)) - 1, np.floor(corners.max(axis=0))
    within = {cell for cell in product(range(N), repeat=3) if (cell >= low).all() and (cell <= high).all()}
    assert {cell for cell in within if _meets(corners, cell)} <= _reached(corners)


def test_what_is_listed_is_what_meets() -> None:
    random = np.random.default_rng(8)
    n_met = n_listed = 0
    for _ in range(20):
        corners = random.uniform(0, N, (3, 3))
        low, high = np.floor(corners.min(axis=0)), np.floor(corners.max(axis=0))
        listed = {cell for cell in _reached(corners) if (cell >= low).all() and (cell <= high).all()}
        n_met += sum(_meets(corners, cell) for cell in listed)
        n_listed += len(listed)
    assert n_met >= 0.99 * n_listed > 0
