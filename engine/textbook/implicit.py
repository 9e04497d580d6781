"""Point in an implicit solid: evaluate f and look at its sign.

Source: section 22.4.1 of the chapter on computer graphics in Algorithms of Informatics: a solid defined by f holds the
points with f(x, y, z) >= 0. Here f is a polynomial, the sum of coefficient x^i y^j z^k.
What goes wrong: near the surface f is a small difference of large terms, and rounding decides the sign.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import BoolArray, FloatArray, IntArray
from engine.jit import kernel


@kernel
def contains(points: FloatArray, powers: IntArray, coefficients: FloatArray) -> BoolArray:
    """Tell of each point whether f >= 0; points (n, dim), powers (t, dim), coefficients (t,)."""
    contained = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        total = 0.0
        for j in range(len(coefficients)):
            term = coefficients[j]
            for k in range(points.shape[1]):
                term *= points[i, k] ** powers[j, k]
            total += term
        contained[i] = total >= 0.0
    return contained
