"""The sign of a polynomial against rational arithmetic: quadrics on lattices, high degree, every exponent."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from engine.predicates.rational import polynomial_sign_rational
from engine.types import UNDECIDED
from tests.unit.predicates.batches import sign_of_polynomial_batch

Array = npt.NDArray[np.float64]


def run(powers: npt.NDArray[np.int64], coefficients: Array, points: Array) -> npt.NDArray[np.int8]:
    sides = np.empty(len(points), np.int8)
    with np.errstate(all="ignore"):
        sign_of_polynomial_batch(powers, coefficients, int(powers.sum(axis=1).max()), points, sides)
    return sides


def exact(powers: npt.NDArray[np.int64], coefficients: Array, points: Array) -> npt.NDArray[np.int8]:
    terms, weights = powers.tolist(), coefficients.tolist()
    return np.array([polynomial_sign_rational(terms, weights, point) for point in points.tolist()], np.int8)


SPHERE = np.array([[2, 0, 0], [0, 2, 0], [0, 0, 2], [0, 0, 0]])


@pytest.mark.parametrize("exponent", [-530, -300, -1, 0, 3, 400, 509])
def test_lattice_points_on_a_sphere(exponent: int) -> None:
    points = np.ldexp(np.stack(np.meshgrid(*[np.arange(-3.0, 4.0)] * 3), axis=-1).reshape(-1, 3), exponent)
    coefficients = np.array([-1.0, -1.0, -1.0, np.ldexp(9.0, 2 * exponent)])
    sides = run(SPHERE, coefficients, points)
    assert np.count_nonzero(sides == 0) == 30
    assert (sides == exact(SPHERE, coefficients, points)).all()


@pytest.mark.parametrize(("dimension", "degree", "n_terms"), [(2, 3, 6), (3, 5, 12), (3, 16, 25), (2, 16, 40)])
def test_points_near_the_zero_set(dimension: int, degree: int, n_terms: int) -> None:
    draw = np.random.default_rng(degree + n_terms)
    for _ in range(12):
        powers = draw.multinomial(degree, [1 / (dimension + 1)] * (dimension + 1), n_terms)[:, :dimension].astype(
            np.int64
        )
        coefficients = draw.standard_normal(n_terms)
        powers[-1] = 0
        points = draw.standard_normal((12, dimension)) * 1.3
        for point in points:  # the constant puts the zero set through the point, to rounding
            values = coefficients[:-1] * np.prod(point ** powers[:-1], axis=1)
            coefficients[-1] = -values.sum()
            nearby = np.stack([point, np.nextafter(point, 9.0), np.nextafter(point, -9.0)])
            sides = run(powers, coefficients, nearby)
            assert (sides == exact(powers, coefficients, nearby)).all()


def test_identically_zero_on_a_line() -> None:
    draw = np.random.default_rng(8)  # (x - y)^3 (x + 2 y) vanishes on x = y; expanded coefficients
    powers = np.array([[4, 0], [3, 1], [2, 2], [1, 3], [0, 4]])
    coefficients = np.array([1.0, -1.0, -3.0, 5.0, -2.0])
    x = draw.standard_normal(200)
    for scale in (0, -200, 200):
        points = np.ldexp(np.column_stack([x, x]), scale)
        assert (run(powers, coefficients, points) == 0).all()
        points[:, 1] = np.nextafter(points[:, 1], np.inf)
        assert (run(powers, coefficients, points) == exact(powers, coefficients, points)).all()


def test_underflow_and_overflow_never_decide_wrongly() -> None:
    draw = np.random.default_rng(9)
    powers = np.array([[16, 0], [0, 16], [8, 8], [1, 0], [0, 0]])
    n_decided = 0
    for _ in range(150):
        coefficients = np.ldexp(draw.standard_normal(5), draw.integers(-1060, 1000, 5))
        points = np.ldexp(draw.standard_normal((8, 2)), draw.integers(-1070, 1000, (8, 2)))
        sides = run(powers, coefficients, points)
        assert (sides == exact(powers, coefficients, points))[sides != UNDECIDED].all()
        n_decided += np.count_nonzero(sides != UNDECIDED)
    assert n_decided > 600


def test_thousand_terms() -> None:
    powers = np.array([(i, j, k) for i in range(17) for j in range(17 - i) for k in range(17 - i - j)][:968])
    powers = np.concatenate([powers, powers[:32]])
    coefficients = np.random.default_rng(10).standard_normal(1000)
    coefficients[968:] = -coefficients[:32]
    points = np.array([[0.5, 0.25, -0.75], [1.1, -0.7, 0.3], [0.0, 0.0, 0.0]])
    assert (run(powers, coefficients, points) == exact(powers, coefficients, points)).all()
