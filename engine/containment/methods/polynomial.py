"""Implicit solids: the exact sign of a polynomial at each point."""

from __future__ import annotations

from typing import Any

from engine.containment.posed.filters import NOT_FINITE, has_not_finite
from engine.jit import kernel
from engine.predicates.polynomial import sign_of_polynomial_exact, sign_of_polynomial_filter
from engine.types import UNDECIDED


@kernel
def locate_by_polynomial(points: Any, powers: Any, coefficients: Any, degree: int, locations: Any, flag: Any) -> int:
    """Fill `locations` (n,) int8 for points (n, dim) with the sign of the polynomial, or UNDECIDED.

    powers: (t, dim) int64; coefficients: (t,); degree: the largest total power. Returns the count beyond the
    filter, or NOT_FINITE.
    """
    if has_not_finite(points):
        return NOT_FINITE
    n_beyond = 0
    for item in range(len(points)):
        if flag[0]:
            break
        sign = sign_of_polynomial_filter(powers, coefficients, degree, points, item)
        if sign == UNDECIDED:
            n_beyond += 1
            sign = sign_of_polynomial_exact(powers, coefficients, points, item)
        locations[item] = sign
    return n_beyond
