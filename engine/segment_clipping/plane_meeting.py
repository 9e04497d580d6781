"""Where a segment meets a plane of a box, as a double-double: its parameter t, and which of two is the larger.

t = n / d with n = at - p and d = q - p on the plane's axis, each known as what rounding left and what it lost.

Bound, with u = 2^-53. The quotient t of the rounded n and d is within u, so n - t d is a double (fma finds it) of at
most u n; what n lost is as small, and so is t times what d lost. Adding the three up costs 6 u^2 n, their quotient by d
3 u^2 t, leaving out what d lost there 3 u^2 t: t + t_low is within 13 u^2 of itself, and t_low at most 3.1 u t.

Everything here is written without branches and takes and gives numbers only: loops that call it become vector code.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from engine.jit import merged
from engine.predicates.double_double import U2
from engine.predicates.error_free import fma, two_diff, two_prod

T_BOUND: Final = 24.0 * U2
"""Of t in double-double, relative: 18 u^2 where it is a quotient of double-doubles, and the test of its rounding."""
SHORTEST: Final = 2.0**-400
LONGEST: Final = 2.0**400
"""Sizes of d for which that holds: the quotients of products that underflow are below `_UNDERFLOW`."""
_UNDERFLOW: Final = 2.0**-600
_CLOSE: Final = 48.0 * U2
"""Two parameters are within 26 u^2 of the larger one, the difference of their low parts loses 6 u^2; that of their high
parts loses nothing where they are within a factor of two, and elsewhere does not matter."""


class Meeting(NamedTuple):
    """A place where a segment enters or leaves a slab.

    t, t_low: parameter, a double-double. n, d: as above, rounded. is_exact: they lost nothing. plane: 0.0 .. 5.0, or
    -1.0 for none, with a t outside of [0, 1] that is like no other.
    """

    t: float
    t_low: float
    n: float
    d: float
    is_exact: bool
    plane: float


@merged
def meeting(p: float, q: float, at: float, plane: float) -> Meeting:
    """Return where p q, its coordinates on one axis, meets the plane at `at`."""
    n, n_low = two_diff(at, p)
    d, d_low = two_diff(q, p)
    d = d if p != q else 1.0  # not met: any number
    t = n / d
    return Meeting(t, ((fma(-t, d, n) + n_low) - t * d_low) / d, n, d, (n_low == 0.0) & (d_low == 0.0), plane)


@merged
def meetings(p: float, q: float, low: float, high: float, axis: float) -> tuple[Meeting, Meeting, bool]:
    """Return where p q enters the slab low .. high of an axis and where it leaves; False where q - p has no range."""
    is_entered, is_left = (p < low) | (p > high), (q < low) | (q > high)
    entered = meeting(p, q, low if p < low else high, 2.0 * axis if p < low else 2.0 * axis + 1.0)
    left = meeting(p, q, low if q < low else high, 2.0 * axis if q < low else 2.0 * axis + 1.0)
    length = abs(entered.d)
    has_range = ((length >= SHORTEST) & (length <= LONGEST)) | (not (is_entered | is_left))
    entered = entered if is_entered else Meeting(-1.0 - axis, 0.0, 0.0, 1.0, False, -1.0)
    left = left if is_left else Meeting(2.0 + axis, 0.0, 0.0, 1.0, False, -1.0)
    return entered, left, has_range


@merged
def gap_between(a: Meeting, b: Meeting) -> tuple[float, bool]:
    """Return the parameter of a less that of b, and whether its sign is sure: exactly zero where both are equal.

    Of exact differences equality shows as n_a d_b = n_b d_a (lattices: diagonals through corners).
    """
    gap = (a.t - b.t) + (a.t_low - b.t_low)
    left, left_tail = two_prod(a.n, b.d)
    right, right_tail = two_prod(b.n, a.d)
    is_tie = a.is_exact & b.is_exact & (left == right) & (left_tail == right_tail) & (abs(left) > _UNDERFLOW)
    return (0.0 if is_tie else gap), (abs(gap) > _CLOSE * max(abs(a.t), abs(b.t)) + _UNDERFLOW) | is_tie
