"""Predicates over arrays, for tests alone: one answer a row, compiled as the engine's kernels are."""

from __future__ import annotations

from typing import Any

import numba

from engine.compiling.jit import _OPTIONS
from engine.predicates.orientation import orient2d, orient2d_filter, orient3d_filter
from engine.predicates.polynomial import sign_of_polynomial_exact, sign_of_polynomial_filter
from engine.predicates.side import side_of_plane
from engine.predicates.vectors import as_point2, as_point3
from engine.types import UNDECIDED, HalfSpace3

kernel = numba.njit(**_OPTIONS)


@kernel
def orient2d_batch(a: Any, b: Any, c: Any, sides: Any) -> None:
    """Fill sides (n,) int8 with orient2d of the rows of a, b, c (n, 2) float64."""
    for item in range(sides.shape[0]):
        sides[item] = orient2d(as_point2(a, item), as_point2(b, item), as_point2(c, item))


@kernel
def orient2d_filter_batch(a: Any, b: Any, c: Any, sides: Any) -> None:
    """Fill sides (n,) int8 with orient2d_filter of the rows of a, b, c (n, 2) float64."""
    for item in range(sides.shape[0]):
        sides[item] = orient2d_filter(as_point2(a, item), as_point2(b, item), as_point2(c, item))


@kernel
def orient3d_filter_batch(a: Any, b: Any, c: Any, d: Any, sides: Any) -> None:
    """Fill sides (n,) int8 with orient3d_filter of the rows of a, b, c, d (n, 3) float64."""
    for item in range(sides.shape[0]):
        sides[item] = orient3d_filter(as_point3(a, item), as_point3(b, item), as_point3(c, item), as_point3(d, item))


@kernel
def sign_of_polynomial_batch(powers: Any, coefficients: Any, degree: int, points: Any, sides: Any) -> None:
    """Fill sides (n,) int8 with the sign of the polynomial at the rows of points (n, dim) float64."""
    for item in range(sides.shape[0]):
        sides[item] = sign_of_polynomial_filter(powers, coefficients, degree, points, item, 0.0)
        if sides[item] == UNDECIDED:
            sides[item] = sign_of_polynomial_exact(powers, coefficients, points, item)


@kernel
def side_of_plane_batch(rows: Any, points: Any, sides: Any) -> None:
    """Fill sides (n,) int8 with side_of_plane of the rows (n, 4) and the points (n, 3) float64."""
    for item in range(sides.shape[0]):
        sides[item] = side_of_plane(
            HalfSpace3(rows[item, 0], rows[item, 1], rows[item, 2], rows[item, 3]), as_point3(points, item)
        )
