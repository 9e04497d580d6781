"""Numbers held as an unevaluated sum of two doubles (106 bits), each operation with its proven relative error.

A number is a pair (h, l) with h = fl(h + l), passed as two arguments and returned as a tuple. With u = 2^-53, and
provided nothing overflows or underflows (callers bring their input into a safe range):

    dd_add    3 u^2 of |a + b|  (4 u^2 kept below, for the terms of third order)
    dd_mul    5 u^2 of |a b|
    dd_div   16 u^2 of |a / b|

These bounds are the input to the running bounds of the callers, who end with `surely_rounded`: it says whether the
double nearest to the true value is certain. A double-double never decides anything by itself.

Source: M. Joldes, J.-M. Muller, V. Popescu, Tight and rigorous error bounds for basic building blocks of double-word
arithmetic, 2017 (algorithms AccurateDWPlusDW, DWTimesDW2, DWDivDW2).
"""

from __future__ import annotations

import math
from typing import Final

from engine.compiling.jit import inline
from engine.predicates.error_free import fast_two_sum, fma, two_prod, two_sum

U2: Final = 2.0**-106
"""u^2: the unit in which the errors of double-double operations are counted."""


@inline
def dd_add(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return a + b."""
    sh, sl = two_sum(ah, bh)
    th, tl = two_sum(al, bl)
    vh, vl = fast_two_sum(sh, sl + th)
    return fast_two_sum(vh, tl + vl)


@inline
def dd_sub(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return a - b."""
    return dd_add(ah, al, -bh, -bl)


@inline
def dd_mul(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return a b."""
    ch, cl = two_prod(ah, bh)
    return fast_two_sum(ch, cl + fma(ah, bl, al * bh))


@inline
def dd_scale(ah: float, al: float, b: float) -> tuple[float, float]:
    """Return a b for a double b (error 2 u^2)."""
    ch, cl = two_prod(ah, b)
    return fast_two_sum(ch, fma(al, b, cl))


@inline
def dd_div(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return a / b; b is not zero."""
    th = ah / bh
    rh, rl = dd_scale(bh, bl, th)
    return fast_two_sum(th, ((ah - rh) + (al - rl)) / bh)


@inline
def surely_rounded(h: float, low: float, bound: float) -> bool:
    """Tell whether every number within `bound` of h + low rounds to fl(h + low).

    The caller's bound has room for 2 u^2 |h|, the rounding of ``low - bound`` and ``low + bound``; rounding to
    nearest is monotonic, so ends that round alike enclose nothing else. Ties and zeros are never accepted unless the
    bound is zero. False where a NaN came in.
    """
    return h + (low - bound) == h + (low + bound)


@inline
def even_of(x: float, other: float) -> float:
    """Return which of two neighbouring doubles has the even significand."""
    half = 0.5 * (x / abs(other - x))
    return x if math.floor(half) == half else other
