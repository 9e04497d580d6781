"""The exact sign of a polynomial with float64 coefficients at a float64 point, in the plane or in space.

**The filter.** u = 2^-53. A term takes at most `degree` rounded products and t terms take t - 1 sums, so
``error <= (degree + t + small) u * (sum of magnitudes)``. Underflow: powers of |x| < 1 are each off by at most
16 * 2^-1075, later products by 2^-1075 times the factors that follow. Both are covered by adding the floor 2^-1010 to
every magnitude, because even ``u 2^-1010 = 2^-1063 > 16 * 2^-1075``. A blur (filters.py) changes a term c by less than
``degree |c| m^degree blur``, m the largest of 1 and the coordinates enlarged by the blur.

**The exact stage** multiplies significands (in [1/2, 1)) as expansions, so that every term of degree D is a multiple of
2^(-53 (D + 1)), and shifts it by its exponent relative to the largest term. A term that would lose bits (more than
2^1173 below the largest for degree 16, 2^1915 for degree 2) is left out; if the rest then is not clearly larger than
such terms can be, the answer is UNDECIDED (exact fallback: `rational.py`).
"""

from __future__ import annotations

from math import frexp, ldexp

from engine.compiling.jit import called, inline
from engine.predicates.error_free import workspace
from engine.predicates.expansion import Components, compress, grow, scale, sign
from engine.predicates.side import NO_TERM
from engine.types import UNDECIDED, FloatArray, IntArray

MAX_DEGREE = 16  # total degree of a term; `Implicit` takes no more
MAX_TERMS = 1000
N_POWERS = MAX_DEGREE + 1
N_TABLE = 3 * N_POWERS

UNIT_ROUNDOFF = 2.0**-53
SPARE_ROUNDINGS = 16.0  # for the sums of magnitudes and the threshold itself
FLOOR = 2.0**-1010

SIGNIFICAND_BITS = 53
LOWEST_BIT = -1074
COMMON_TOP = 1000  # 1000 terms below 2^1000 add up below the overflow
CLEAR = 2.0**-160  # more than 1000 left-out terms, each below 2^(53 (16 + 1) - 1074) = 2^-173, add up to
N_TOTAL = 1100  # non-adjacent components between 2^-1074 and 2^1010: at most 1043
N_TERM = 1024  # components of one term: fewer than its bits, 53 (16 + 1) = 901, doubled only before compression


@inline
def _fill_powers(points: FloatArray, row: int, powers: Components) -> None:
    """Set powers[axis * N_POWERS + k] to the k-th power, k = 0 .. MAX_DEGREE, of each coordinate of points[row],
    rounded."""
    for axis in range(points.shape[1]):
        value = float(points[row, axis])
        power = 1.0
        for k in range(N_POWERS):
            powers[axis * N_POWERS + k] = power
            power *= value


@inline
def sign_of_polynomial_filter(
    powers: IntArray, coefficients: FloatArray, degree: int, points: FloatArray, row: int, blur: float
) -> int:
    """Return the sign of sum(coefficient * prod(p[k] ** powers[k])) if it is proven for all p each of whose coordinates
    is within `blur` of that of points[row]; else UNDECIDED.

    powers (t, dim) int64, coefficients (t,) float64, points (n, dim) float64, dim 2 or 3. Caller guarantees finite
    numbers, but for points with a blur, powers >= 0 with row sums <= degree <= MAX_DEGREE, and t <= MAX_TERMS."""
    table = workspace(N_TABLE)
    _fill_powers(points, row, table)
    value, magnitude, weight = 0.0, 0.0, 0.0
    for i_term in range(coefficients.shape[0]):
        term = float(coefficients[i_term])
        size = abs(term)
        weight += size
        for axis in range(powers.shape[1]):
            factor = table[axis * N_POWERS + powers[i_term, axis]]
            term *= factor
            size = size * (abs(factor) + FLOOR) + FLOOR
        value += term
        magnitude += size
    threshold = (degree + coefficients.shape[0] + SPARE_ROUNDINGS) * UNIT_ROUNDOFF * magnitude
    if blur > 0.0:
        largest, change = 1.0, 2.0 * degree * blur  # order: what underflows in the end is far below the floors
        for axis in range(points.shape[1]):
            largest = max(largest, abs(points[row, axis]) + blur)
        for _ in range(degree):
            change *= largest
        threshold += change * weight
    return 1 if value > threshold else (-1 if -value > threshold else UNDECIDED)


@inline
def _term_exponent(powers: IntArray, coefficients: FloatArray, points: FloatArray, row: int, i_term: int) -> int:
    """Return k such that term i_term of a polynomial at a point is below 2^k in magnitude; NO_TERM for a zero term."""
    if coefficients[i_term] == 0.0:
        return NO_TERM
    exponent = frexp(float(coefficients[i_term]))[1]
    for axis in range(powers.shape[1]):
        if powers[i_term, axis] > 0 and points[row, axis] == 0.0:
            return NO_TERM
        exponent += int(powers[i_term, axis]) * frexp(float(points[row, axis]))[1]
    return exponent


@called
def sign_of_polynomial_exact(powers: IntArray, coefficients: FloatArray, points: FloatArray, row: int) -> int:
    """Return the sign of a polynomial at points[row] by an expansion; UNDECIDED if exponents are too far apart. powers
    (t, dim) int64, coefficients (t,) float64."""
    top = NO_TERM
    for i_term in range(coefficients.shape[0]):
        top = max(top, _term_exponent(powers, coefficients, points, row, i_term))
    total, f, g = workspace(N_TOTAL), workspace(N_TERM), workspace(N_TERM)
    n, is_incomplete = 0, False
    for i_term in range(coefficients.shape[0]):
        exponent = _term_exponent(powers, coefficients, points, row, i_term)
        if exponent == NO_TERM:
            continue
        shift = exponent - top + COMMON_TOP
        n_factors = 1
        for axis in range(powers.shape[1]):
            n_factors += int(powers[i_term, axis])
        if shift - SIGNIFICAND_BITS * n_factors < LOWEST_BIT:
            is_incomplete = True
            continue
        f[0] = frexp(float(coefficients[i_term]))[0]
        m = 1
        for axis in range(powers.shape[1]):
            significand = frexp(float(points[row, axis]))[0]
            for _ in range(int(powers[i_term, axis])):
                m = compress(g, scale(f, m, significand, g))
                f, g = g, f
        for i in range(m):
            n = grow(total, n, ldexp(f[i], shift))
    if is_incomplete and (n == 0 or abs(total[n - 1]) < CLEAR):
        return UNDECIDED
    return sign(total, n)
