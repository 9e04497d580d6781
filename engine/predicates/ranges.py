"""The range of numbers in which kernels that use double-double or expansions are exact."""

from __future__ import annotations

from typing import Final

from engine.jit import inline

LARGEST: Final = 2.0**120
SMALLEST: Final = 2.0**-120
"""Coordinates of kernels that use double-double or expansions are zero or within these: products of degree four
keep all their bits (multiples of 2^-172 after a difference, of 2^-688 after a product of four)."""


@inline
def is_safe(x: float) -> bool:
    """Tell whether x is zero or of a size for which products of degree four are exact as expansions."""
    return x == 0.0 or SMALLEST <= abs(x) <= LARGEST
