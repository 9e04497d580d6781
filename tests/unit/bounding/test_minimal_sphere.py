"""The minimal sphere: optimality verified in rationals, on easy and on hostile sets.

A ball is the smallest one of its points exactly when it holds them all and its centre lies in the convex hull of points
on its surface; both are checked without any rounding, and independently of the code under test.
"""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine.bounding.minimal_sphere import (
    MinimalSphere,
    excess_double_double,
    minimal_sphere,
    minimal_sphere_of_rationals,
    root_up,
    smallest_ball,
)
from engine.errors import CancelledError, DeadlineExceededError, NotRepresentableError
from engine.predicates.rational import nearest_float
from engine.running.budget import Budget, Cancel

Rational = tuple[Fraction, ...]


def exact(points: object) -> list[Rational]:
    return [tuple(map(Fraction, row)) for row in np.asarray(points, np.float64).tolist()]


def square_distance(p: Rational, q: Rational) -> Fraction:
    return sum(((x - y) ** 2 for x, y in zip(p, q)), Fraction(0))


def solve(rows: list[list[Fraction]], right: list[Fraction]) -> list[Fraction] | None:
    """Solve a square system by elimination; None if it is singular."""
    n = len(rows)
    table = [[*row, value] for row, value in zip(rows, right)]
    for column in range(n):
        pivot = next((i for i in range(column, n) if table[i][column] != 0), None)
        if pivot is None:
            return None
        table[column], table[pivot] = table[pivot], table[column]
        for i in range(n):
            if i != column:
                factor = table[i][column] / table[column][column]
                table[i] = [a - factor * b for a, b in zip(table[i], table[column])]
    return [table[i][n] / table[i][i] for i in range(n)]


def is_in_hull(center: Rational, support: list[Rational]) -> bool:
    """Tell whether `center` is a convex combination of `support`, affinely independent points."""
    first, *others = support
    steps = [[a - b for a, b in zip(point, first)] for point in others]
    gram = [[sum((a * b for a, b in zip(u, v)), Fraction(0)) for v in steps] for u in steps]
    goal = [a - b for a, b in zip(center, first)]
    weights = solve(gram, [sum((a * b for a, b in zip(goal, u)), Fraction(0)) for u in steps])
    if weights is None:
        return False
    reached = [sum((w * u[axis] for w, u in zip(weights, steps)), Fraction(0)) for axis in range(len(first))]
    return reached == goal and all(w >= 0 for w in weights) and sum(weights) <= 1


def check(points: list[Rational], ball: MinimalSphere) -> None:
    support = [points[i] for i in ball.support]
    assert 1 <= len(support) <= len(points[0]) + 1
    assert all(square_distance(p, ball.exact_center) == ball.exact_square for p in support)
    assert is_in_hull(ball.exact_center, support)
    assert all(square_distance(p, ball.exact_center) <= ball.exact_square for p in points)
    assert ball.center.tolist() == [nearest_float(x) for x in ball.exact_center]
    rounded = tuple(map(Fraction, ball.center.tolist()))
    farthest = max(square_distance(p, rounded) for p in points)
    assert Fraction(ball.radius) ** 2 >= farthest
    assert ball.radius == 0.0 or Fraction(math.nextafter(ball.radius, 0.0)) ** 2 < farthest


def cospherical(n: int, dimension: int, seed: int) -> np.ndarray:
    points = np.random.default_rng(seed).normal(size=(n, dimension))
    return points / np.linalg.norm(points, axis=1)[:, None]


LATTICE = np.array(list(itertools.product([-2.0, -1.0, 0.0, 1.0, 2.0], repeat=3)))
SETS = {
    "one point": [[3.0, -4.0, 0.1]],
    "coincident": [[0.1, 0.2]] * 7,
    "collinear 2D": [[0.1 * i, 0.3 * i] for i in range(9)],
    "collinear 3D": [[0.1 * i, 0.3 * i, -0.7 * i] for i in range(9)],
    "cube": list(itertools.product([0.0, 1.0], repeat=3)),
    "cube off by an ulp": [*itertools.product([0.0, 1.0], repeat=3), (1.0, 1.0, math.nextafter(1.0, 2.0))],
    "lattice": LATTICE.tolist(),
    "lattice on one sphere": LATTICE[(LATTICE**2).sum(axis=1) == 5.0].tolist(),
    "pythagorean circle": [[3, 4], [-3, 4], [4, 3], [5, 0], [0, -5], [-4, -3]],
    "right triangle": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
    "obtuse triangle": [[0.0, 0.0, 0.0], [8.0, 1.0, 0.0], [16.0, 0.0, 0.0]],
    "flat in space": [[x, y, 7.0] for x in (0.0, 0.1, 0.2) for y in (0.3, 0.9)],
    "needle": [[0.0, 0.0, 0.0], [1e300, 5e-324, 0.0], [5e299, 0.0, 5e-324]],
    "huge": [[1e300, -1e300, 1e300], [-1e300, 1e300, 9e299], [1e300, 1e300, -1e300]],
    "largest that fits": [[1.7e308, 0.0], [-1.7e308, 0.0], [0.0, 1.7e308]],
    "denormal": [[5e-324, 0.0, 0.0], [0.0, 5e-324, 1e-323], [2e-323, 5e-324, 0.0]],
    "one denormal step": [[0.0, 0.0], [5e-324, 0.0]],
    "huge with denormals": [[1e308, 5e-324, 0.0], [1e308, 0.0, 1e-323], [1e308, 2e-323, 0.0]],
    "huge and tiny": [[1e308, 5e-324], [-1e308, 1e-300], [0.0, 1e308], [1e-308, -1e308]],
    "noise around a huge point": [[1e17 + 16 * i, 1e17 - 16 * (i * i % 7)] for i in range(12)],
}


@pytest.mark.parametrize("points", SETS.values(), ids=SETS.keys())
def test_is_optimal_on_hostile_sets(points: list[list[float]]) -> None:
    array = np.array(points, np.float64)
    check(exact(array), minimal_sphere(array))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("n", [2, 5, 30, 300])
@pytest.mark.parametrize("exponent", [0, 1000, -1040])
def test_is_optimal_on_random_sets(n: int, dimension: int, exponent: int) -> None:
    rng = np.random.default_rng(n * 10 + dimension)
    array = np.ldexp(rng.normal(size=(n, dimension)), exponent)
    check(exact(array), minimal_sphere(array))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("offset", [0.0, 1e6, 1e15])
@pytest.mark.parametrize("exponent", [0, 950, -900])
def test_is_optimal_on_tessellated_spheres(dimension: int, offset: float, exponent: int) -> None:
    array = np.ldexp(cospherical(400, dimension, 7) + offset, exponent)
    ball = minimal_sphere(array)
    check(exact(array), ball)
    if offset < 1e15:
        assert ball.n_candidates > 64  # the double-double stage was needed


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-(2.0**1022), 2.0**1022)] * 3), min_size=1, max_size=8))
def test_is_optimal_at_any_exponent(points: list[tuple[float, ...]]) -> None:
    array = np.array(points, np.float64)
    check(exact(array), minimal_sphere(array))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(*[st.integers(-3, 3)] * 2), min_size=1, max_size=12))
def test_is_optimal_on_small_lattices(points: list[tuple[int, ...]]) -> None:
    array = np.array(points, np.float64)
    check(exact(array), minimal_sphere(array))


def test_order_copies_and_scale_do_not_matter() -> None:
    array = cospherical(200, 3, 11)
    ball = minimal_sphere(array)
    shuffled = np.random.default_rng(5).permutation(np.concatenate([array, array]))
    again = minimal_sphere(shuffled)
    assert (again.center.tolist(), again.radius) == (ball.center.tolist(), ball.radius)
    scaled = minimal_sphere(np.ldexp(array, 900))
    assert scaled.radius == math.ldexp(ball.radius, 900)
    assert scaled.center.tolist() == np.ldexp(ball.center, 900).tolist()


def test_rational_points() -> None:
    third = Fraction(1, 3)
    points = [(third, Fraction(0)), (-third, Fraction(0)), (Fraction(0), third), (Fraction(0), -third * 2)]
    check(points, minimal_sphere_of_rationals(points))
    rng = np.random.default_rng(3)
    points = [tuple(Fraction(int(x), 7) for x in row) for row in rng.integers(-50, 50, (40, 3))]
    check(points, minimal_sphere_of_rationals(points))


def test_double_double_stage_is_within_its_bound() -> None:
    rng = np.random.default_rng(9)
    points = cospherical(300, 3, 9) * 3.0 + 1e3
    center = rng.normal(size=3) * 1e-3 + 1e3
    shift = [Fraction(int(rng.integers(-100, 100)), 7 * 2**60) for _ in range(3)]
    unit = Fraction(4)
    exact_center = tuple(Fraction(c) + unit * s for c, s in zip(center.tolist(), shift))
    square = Fraction(9, 16)
    excess, bound = excess_double_double(points, center, shift, square, unit)
    for point, value in zip(exact(points), excess.tolist()):
        truth = square_distance(point, exact_center) / unit**2 - square
        assert abs(Fraction(value) - truth) <= Fraction(bound) + abs(truth) / 2**50


@pytest.mark.parametrize(
    "value", [0, 2, Fraction(1, 3), Fraction(10) ** 600, Fraction(1, 10**640), Fraction(1, 2**2200), 9]
)
def test_root_up_is_the_smallest_double(value: Fraction) -> None:
    root = root_up(Fraction(value))
    assert Fraction(root) ** 2 >= value
    assert root == 0.0 or Fraction(math.nextafter(root, 0.0)) ** 2 < value


def test_radius_beyond_float64_is_refused() -> None:
    top = 1.7976931348623157e308
    with pytest.raises(NotRepresentableError):
        minimal_sphere(np.array([[top, top], [-top, -top]]))
    with pytest.raises(NotRepresentableError):
        root_up(Fraction(top) ** 2 + 1)


def test_deadline_and_cancel_end_the_walk() -> None:
    array = cospherical(1000, 3, 1)
    with Budget(deadline=0.0) as budget, pytest.raises(DeadlineExceededError):
        minimal_sphere(array, budget)
    cancel = Cancel()
    cancel.set()
    with Budget(cancel=cancel) as budget, pytest.raises(CancelledError):
        minimal_sphere(array, budget)


@pytest.mark.data
@pytest.mark.parametrize("name", ["c3d_fandisk", "igl_decimated-knight", "syn_sliver_uv", "fcl_env"])
def test_real_meshes(name: str, data: Path) -> None:
    vertices = np.load(data / "meshes" / f"{name}.npz")["vertices"].astype(np.float64)
    check(exact(vertices), minimal_sphere(vertices))


@pytest.mark.full
def test_many_random_sets() -> None:
    for seed in range(3000):
        rng = np.random.default_rng(seed)
        dimension, n = 2 + seed % 2, int(rng.integers(1, 40))
        array = rng.normal(size=(n, dimension)) * 10.0 ** rng.integers(-300, 300) + rng.choice([0.0, 1.0, 1e9])
        array = np.round(array) if seed % 3 == 0 else array
        check(exact(array), minimal_sphere(array))


def test_ball_of_two_and_of_three_points() -> None:
    ball = smallest_ball([(4, 0), (0, 0), (2, 1)], 0)
    assert ball.support == (0, 1)
    assert [Fraction(x, ball.scale) for x in ball.center] == [2, 0]
    ball = smallest_ball([(4, 0), (0, 0), (2, 3)], 2)
    assert sorted(ball.support) == [0, 1, 2]
    assert Fraction(ball.square, ball.scale**2) == Fraction(13, 6) ** 2


def test_dependent_points_need_a_smaller_support() -> None:
    ball = smallest_ball([(0, 0, 0), (1, 1, 1), (2, 2, 2), (3, 3, 3)], 3)
    assert sorted(ball.support) == [0, 3]


def test_a_point_that_is_not_on_the_surface_is_noticed() -> None:
    with pytest.raises(AssertionError):
        smallest_ball([(0, 0), (4, 0), (2, 0)], 2)
