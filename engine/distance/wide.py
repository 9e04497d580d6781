"""Double-doubles as one value, and points of three of them: `double_double.py` with its bounds, for kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from engine.compiling.jit import called, inline
from engine.predicates.double_double import dd_add, dd_div, dd_mul, dd_sub
from engine.predicates.error_free import fast_two_sum, two_prod


class Wide(NamedTuple):
    """A double-double."""

    h: float
    low: float


class Wide3(NamedTuple):
    """A point."""

    x: Wide
    y: Wide
    z: Wide


@inline
def plus(a: Wide, b: Wide) -> Wide:
    """Return a + b."""
    return Wide(*dd_add(a.h, a.low, b.h, b.low))


@inline
def less(a: Wide, b: Wide) -> Wide:
    """Return a - b."""
    return Wide(*dd_sub(a.h, a.low, b.h, b.low))


@inline
def times(a: Wide, b: Wide) -> Wide:
    """Return a b."""
    return Wide(*dd_mul(a.h, a.low, b.h, b.low))


@inline
def over(a: Wide, b: Wide) -> Wide:
    """Return a / b; b is not zero."""
    return Wide(*dd_div(a.h, a.low, b.h, b.low))


@inline
def product(a: float, b: float) -> Wide:
    """Return a b of two doubles, exactly."""
    return Wide(*two_prod(a, b))


@inline
def root(a: Wide) -> Wide:
    """Return the root of a positive number, within 4 u^2 of itself but for half of the relative error of a.

    With h the rounded root, sqrt(a) = h + (a - h^2) / 2h but for (u h)^2 / 2h; the difference is below 2.1 u h^2 and
    loses two roundings.
    """
    h = np.sqrt(a.h)
    p, e = two_prod(h, h)
    return Wide(*fast_two_sum(h, ((a.h - p) - e + a.low) / (2.0 * h)))


@inline
def less3(a: Wide3, b: Wide3) -> Wide3:
    """Return a - b."""
    return Wide3(less(a.x, b.x), less(a.y, b.y), less(a.z, b.z))


@called
def dot3(a: Wide3, b: Wide3) -> Wide:
    """Return a . b."""
    return plus(plus(times(a.x, b.x), times(a.y, b.y)), times(a.z, b.z))


@inline
def along3(a: Wide3, t: Wide, u: Wide3) -> Wide3:
    """Return a + t u."""
    return Wide3(plus(a.x, times(t, u.x)), plus(a.y, times(t, u.y)), plus(a.z, times(t, u.z)))
